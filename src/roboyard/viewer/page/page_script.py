"""JavaScript in every page of a server, with messages in both directions."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

MOST_CHARACTERS = 20_000
"""Longest message of a page (characters); longer ones are ignored."""

_WRAPPED = """
(() => {
  const name = %(name)s, uuid = %(uuid)s, live = (window.__roboyard ??= {});
  const listeners = (window.__roboyardListeners ??= {});
  live[name]?.();
  delete listeners[name];
  const listen = listener => { listeners[name] = listener; };
  let count = Date.now();
  const say = value => (window.__roboyardSend ?? window.__viserMutable?.sendMessage)?.(
    {type: "GuiUpdateMessage", uuid: uuid, updates: {value: JSON.stringify([count++, value])}});
  live[name] = ((say, listen) => {%(body)s})(say, listen) ?? (() => {});
})();
"""


class PageScript:
    """Runs JavaScript in each page, including pages opened later, and receives its messages.

    The messages use a hidden element of the panel: they need no port of their own and arrive in the order in
    which they were sent.
    """

    def __init__(self, server: Any, name: str, body: str, receive: Callable[[int, Any], None]) -> None:
        """Start the script in every page of `server`.

        Args:
            server: a `viser.ViserServer`.
            name: name of the script; a newer script of the same name replaces the older one.
            body: JavaScript. `say(value)` sends any value that JSON can represent; `listen(f)` calls f with
                each value of `send`. The function that the body returns is called before the script is
                replaced, to remove its listeners and elements.
            receive: called with the number of the page's client and the value, in the thread of the server's
                event loop; it must return quickly. Invalid JSON is ignored, but the value is not
                validated.
        """
        self._receive, self._server, self._name = receive, server, name
        self._element = server.gui.add_text(f"script {name}", "", visible=False)
        self._element.on_update(self._on_update)
        source = _WRAPPED % {"name": json.dumps(name), "uuid": json.dumps(self._uuid), "body": body}
        _run_in_pages(server, source)

    @property
    def _uuid(self) -> str:
        return self._element._impl.uuid

    def send(self, value: Any) -> None:
        """Send a JSON value to the script in all pages; pages opened later receive the last one."""
        name = json.dumps(self._name)
        text = json.dumps(value, separators=(",", ":"))
        _run_in_pages(
            self._server, f"window.__roboyardListeners?.[{name}]?.({text})", instead=f"send {self._name}"
        )

    def remove(self) -> None:
        """Stop receiving; the script keeps running in pages until one of the same name replaces it."""
        self._element.remove()

    async def _on_update(self, event: Any) -> None:
        # a coroutine runs in the event loop, in order; plain functions run in a thread pool, in any order
        text = event.target.value
        if event.client_id is None or not isinstance(text, str) or len(text) > MOST_CHARACTERS:
            return
        try:
            _, value = json.loads(text)
        except (ValueError, TypeError, RecursionError):
            return
        self._receive(int(event.client_id), value)


def _run_in_pages(server: Any, source: str, *, instead: str | None = None) -> None:
    """Run a script in all pages, including pages opened later; the only use of viser's private names.

    `instead` replaces the last source of the same name, which pages opened later no longer need.
    """
    from viser import _messages

    message = _messages.RunJavascriptMessage(source)
    if instead is not None:
        message.redundancy_key = lambda: f"roboyard {instead}"  # otherwise viser stores every script for ever
    server._websock_server.queue_message(message)

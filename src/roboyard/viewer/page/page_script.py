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
  const say = value => window.__viserMutable?.sendMessage?.(
    {type: "GuiUpdateMessage", uuid: uuid, updates: {value: JSON.stringify([count++, value])}});
  live[name] = ((say, listen) => {%(body)s})(say, listen) ?? (() => {});
})();
"""


class PageScript:
    """Runs JavaScript in each page, those that open later too, and receives its messages.

    The messages come through an element of the panel that is never shown: they need no port of their own and
    arrive in the order in which they were sent.
    """

    def __init__(self, server: Any, name: str, body: str, receive: Callable[[int, Any], None]) -> None:
        """Start the script in every page of `server`.

        Args:
            server: a `viser.ViserServer`.
            name: of the script; a page runs one of a name, and a newer one takes the older one's place.
            body: JavaScript. `say(value)` sends any value that JSON can hold; `listen(f)` has f called with
                each value of `send`. What the body returns is called before the script is replaced, to take
                its listeners and elements away.
            receive: called with the number of the page's client and the value, in the thread of the server's
                event loop: return quickly. Invalid JSON is ignored; the value may be anything else.
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
        """Hand a value that JSON can hold to the script in all pages; pages that open later get the last."""
        name = json.dumps(self._name)
        text = json.dumps(value, separators=(",", ":"))
        _run_in_pages(
            self._server, f"window.__roboyardListeners?.[{name}]?.({text})", instead=f"send {self._name}"
        )

    def remove(self) -> None:
        """Stop receiving; the script runs on in pages until one of its name replaces it."""
        self._element.remove()

    async def _on_update(self, event: Any) -> None:
        # a coroutine runs in the event loop, in order; plain functions would run in a pool, in any order
        text = event.target.value
        if event.client_id is None or not isinstance(text, str) or len(text) > MOST_CHARACTERS:
            return
        try:
            _, value = json.loads(text)
        except (ValueError, TypeError, RecursionError):
            return
        self._receive(int(event.client_id), value)


def _run_in_pages(server: Any, source: str, *, instead: str | None = None) -> None:
    """Have all pages run this, those that open later too; the one use of what viser does not publish.

    `instead` names what the last source of the same name said, which pages that open later need no more.
    """
    from viser import _messages

    message = _messages.RunJavascriptMessage(source)
    if instead is not None:
        message.redundancy_key = lambda: f"roboyard {instead}"  # viser keeps every script for ever otherwise
    server._websock_server.queue_message(message)

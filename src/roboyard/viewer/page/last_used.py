"""The page that a user used last, of all pages of a server: by a key, the mouse or a finger."""

from __future__ import annotations

from typing import Any

from roboyard.viewer.page.page_script import PageScript

_SCRIPT = """
  let last = 0;
  const use = () => {
    const now = Date.now();
    if (now - last < 300) return;
    last = now;
    say(1);
  };
  const kinds = ["pointerdown", "keydown", "wheel"];
  for (const kind of kinds) window.addEventListener(kind, use, {capture: true, passive: true});
  return () => { for (const kind of kinds) window.removeEventListener(kind, use, true); };
"""


class LastUsed:
    """Which page was used last."""

    def __init__(self, server: Any) -> None:
        """Listen to all pages of a `viser.ViserServer`."""
        self._server = server
        self._last: int | None = None
        self._script = PageScript(server, "last used", _SCRIPT, self._on_message)

    def _on_message(self, client: int, _: Any) -> None:
        self._last = client

    @property
    def client(self) -> Any:
        """The `viser.ClientHandle` of that page; the page opened last if none was used; None: no page."""
        clients = self._server.get_clients()
        if self._last in clients:
            return clients[self._last]
        return clients[max(clients)] if clients else None

"""Reject requests of foreign pages to a viewer's server (cross-site WebSocket hijacking, DNS rebinding).

A browser allows any page to open a WebSocket to this machine, with the page's own address in the header
`Origin`. The header `Host` has the name under which the server was called: a page whose own name resolves to
this machine (DNS rebinding) is detected by it. Other programs send no `Origin`; they run on this machine, or
the user chose to listen on another address.
"""

from __future__ import annotations

import ipaddress
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

from roboyard.viewer.page.document import with_early_script

VARIABLE = "ROBOYARD_VIEWER_ORIGINS"
"""Environment variable with further accepted origins, separated by commas: "https://hub.example.org"."""

_patching = threading.Lock()


def refusal(origin: str | None, host: str | None, *, loopback: bool) -> str | None:
    """Return the reason to reject a request; None: it is accepted.

    Args:
        origin: the header `Origin`; None: the request has none.
        host: the header `Host`.
        loopback: whether the server listens on this machine only.
    """
    allowed = {word.strip().rstrip("/").lower() for word in os.environ.get(VARIABLE, "").split(",")} - {""}
    called = (host or "").lower()
    remedy = f"set {VARIABLE} to let it in"
    known = not loopback or not called or _is_loopback(called)
    if not known and called not in {urlsplit(one).netloc for one in allowed}:
        return f"this viewer is not called {called}; {remedy}=http://{called}"
    if origin is None or origin.lower().rstrip("/") in allowed:
        return None
    if origin.lower() == "null" or urlsplit(origin.lower()).netloc != called:
        return f"a page of {origin} may not talk to this viewer; {remedy}={origin}"
    return None


def _is_loopback(netloc: str) -> bool:
    try:
        name = urlsplit(f"//{netloc}").hostname or ""
    except ValueError:
        return False
    if name == "localhost" or name.endswith(".localhost"):
        return True
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return False


@contextmanager
def guarded(host: str) -> Iterator[None]:
    """Reject foreign pages at every viser server that starts within this context; its pages run `early.js`.

    viser has no option for the handshake, so the callback that it passes to `websockets` is wrapped.
    """
    import websockets.asyncio.server as module

    try:
        loopback = host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        loopback = False
    with _patching:
        serve: Any = module.serve

        def serve_guarded(*args: Any, **options: Any) -> Any:
            page: Any = options.get("process_request")
            if getattr(page, "__module__", "").startswith("viser."):
                page = with_early_script(page, compressed=not loopback)
                options["process_request"] = _checked(page, loopback)
            return serve(*args, **options)

        setattr(module, "serve", serve_guarded)  # noqa: B010 - replaces a function of the module
        try:
            yield
        finally:
            setattr(module, "serve", serve)  # noqa: B010


def _checked(page: Callable[[Any, Any], Any], loopback: bool) -> Callable[[Any, Any], Any]:
    def answer(connection: Any, request: Any) -> Any:
        headers = request.headers
        problem = refusal(headers.get("Origin"), headers.get("Host"), loopback=loopback)
        return page(connection, request) if problem is None else connection.respond(403, f"{problem}\n")

    return answer

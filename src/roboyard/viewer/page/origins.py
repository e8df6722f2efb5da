"""Which requests a viewer's server answers: those of its own page, never those of a foreign page.

A browser lets any page open a WebSocket to this machine, but says in the header `Origin` which page it is.
The header `Host` says under what name the server was called; a page that had its own name point here (DNS
rebinding) is known by it. Programs that are no browsers send no `Origin`; they run on this machine, or were
let in by whoever chose to listen at another address.
"""

from __future__ import annotations

import ipaddress
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

VARIABLE = "ROBOYARD_VIEWER_ORIGINS"
"""Environment variable: more origins that may talk to a viewer, by commas: "https://hub.example.org"."""

_patching = threading.Lock()


def refusal(origin: str | None, host: str | None, *, loopback: bool) -> str | None:
    """Why a request is not answered; None where it is.

    Args:
        origin: the header `Origin`; None without one.
        host: the header `Host`.
        loopback: whether the server listens on this machine alone.
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
    """A viser server that starts within this context answers no foreign page.

    viser gives no access to the handshake, so what it hands to websockets is wrapped on the way.
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
                options["process_request"] = _checked(page, loopback)
            return serve(*args, **options)

        setattr(module, "serve", serve_guarded)  # noqa: B010 - a module's name, on purpose
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

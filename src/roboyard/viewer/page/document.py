"""The document of a viewer's pages: viser's own, with a script that runs before it."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path
from typing import Any

Answer = Callable[[Any, Any], Any]
"""Connection and request to viser's response; None for a WebSocket."""
HEAD = b"<head>"


def with_early_script(answer: Answer, *, compressed: bool) -> Answer:
    """Return viser's function for requests of files, whose document runs `early.js` first.

    The document is packed already, so that compressing it again saves a fifth of its bytes; on one machine it
    would only delay the first picture.

    Args:
        answer: the function of one server.
        compressed: send the document compressed to browsers that accept it.
    """
    made: dict[bool, bytes] = {}

    def answered(connection: Any, request: Any) -> Any:
        headers = request.headers
        is_document = request.path.partition("?")[0] in ("/", "/index.html")
        if headers.get("Upgrade") == "websocket" or not is_document:
            return answer(connection, request)
        zipped = compressed and "gzip" in headers.get("Accept-Encoding", "")
        del headers["Accept-Encoding"]
        response = answer(connection, request)
        if zipped not in made:
            page = _with_script(response.body)
            made[zipped] = gzip.compress(page, 6) if zipped else page
        response.body = made[zipped]
        for name, value in (
            ("Content-Length", str(len(response.body))),
            ("Content-Encoding", "gzip" if zipped else "identity"),
        ):
            del response.headers[name]
            response.headers[name] = value
        return response

    return answered


def _with_script(page: bytes) -> bytes:
    script = Path(__file__).with_name("early.js").read_bytes()
    return page.replace(HEAD, HEAD + b"<script>" + script + b"</script>", 1)

"""Executing requests on one world, in the order of arrival."""

from __future__ import annotations

import sys
import traceback
from typing import Any

from roboyard.pybullet.client import Client
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.errors import error
from roboyard.pybullet.face.wire import WireError, encode

_LOCAL = {"setTimeOut"}  # handled by the remote client itself


class Dispatcher:
    """The world of a server."""

    def __init__(self) -> None:
        """Create a client in this process."""
        self.client = Client()

    def answer(self, request: Any) -> bytes:
        """Execute a decoded request and return the body of the response.

        Raises:
            WireError: it is not a request.
        """
        number, name, arguments = _checked(request)
        try:
            result = COMMANDS[name].function(self.client, *arguments)
            return encode([number, "ok", result])
        except error as problem:
            return encode([number, "error", str(problem), list(getattr(problem, "__notes__", []))])
        except TypeError as problem:
            return encode([number, "type", str(problem), []])
        except Exception as problem:
            traceback.print_exc(file=sys.stderr)
            text = f"{name} failed on the server: {type(problem).__name__}: {problem}"
            return encode([number, "error", text, ["see the traceback in the server's output"]])


def _checked(request: Any) -> tuple[int, str, list[Any]]:
    match request:
        case [int(number), str(name), list(arguments)] if name in COMMANDS and name not in _LOCAL:
            return number, name, arguments
        case [int(), str(name), _]:
            raise WireError(f"there is no command {name[:60]!r}")
        case _:
            raise WireError(f"expected [number, command name, arguments], got {str(request)[:60]}")

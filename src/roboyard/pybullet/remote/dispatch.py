"""Answering requests: one world, every command of the table, in the order of arrival."""

from __future__ import annotations

import sys
import traceback
from typing import Any

from roboyard.pybullet.client import Client
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.errors import error
from roboyard.pybullet.face.wire import WireError, encode

_LOCAL = {"setTimeOut"}  # answered by the client's own side


class Dispatcher:
    """The world of a server."""

    def __init__(self) -> None:
        self.client = Client()

    def answer(self, request: Any) -> bytes:
        """Body of the answer to a decoded request.

        Raises:
            WireError: it is no request.
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
            return encode([number, "error", text, ["the server's own output has the traceback"]])


def _checked(request: Any) -> tuple[int, str, list[Any]]:
    match request:
        case [int(number), str(name), list(arguments)] if name in COMMANDS and name not in _LOCAL:
            return number, name, arguments
        case [int(), str(name), _]:
            raise WireError(f"there is no command {name[:60]!r}")
        case _:
            raise WireError("a request is [number, command name, arguments]")

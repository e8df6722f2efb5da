"""Executing requests on one world, in the order of arrival."""

from __future__ import annotations

import math
import sys
import traceback
from collections.abc import Mapping
from typing import Any

import numpy as np

from roboyard.pybullet.client import Client
from roboyard.pybullet.face.calling import REFUSED
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.errors import error, world_failure
from roboyard.pybullet.face.wire import WireError, encode, shortened
from roboyard.pybullet.state.file_search import SearchPath
from roboyard.pybullet.state.output_files import OutputFiles

_LOCAL = {"setTimeOut"}  # handled by the remote client itself


class Dispatcher:
    """The world of a server."""

    def __init__(self, output_files: OutputFiles | None = None) -> None:
        """Create a client in this process.

        Args:
            output_files: where commands may write; nowhere by default.
        """
        self.client = Client()
        self.client.search = SearchPath()  # what strangers search is no matter of this process
        self.client.output_files = output_files or OutputFiles(is_free=False)

    def answer(self, request: Any) -> bytes:
        """Execute a decoded request and return the body of the response.

        Raises:
            WireError: it is not a request.
        """
        number, name, arguments = _checked(request)
        if has_nan(arguments):
            text = f"{name} failed: an argument is not a number (NaN)"
            return encode([number, "error", text, ["give finite numbers"]])
        try:
            result = COMMANDS[name].function(self.client, *arguments)
            return encode([number, "ok", result])
        except error as problem:
            return encode([number, "error", str(problem), list(getattr(problem, "__notes__", []))])
        except TypeError as problem:
            return encode([number, "type", str(problem), []])
        except REFUSED as problem:
            refusal = world_failure(name, problem)
            return encode([number, "error", str(refusal), list(getattr(refusal, "__notes__", []))])
        except Exception as problem:
            traceback.print_exc(file=sys.stderr)
            text = f"{name} failed on the server: {type(problem).__name__}: {problem}"
            return encode([number, "error", text, ["see the traceback in the server's output"]])


def has_nan(value: Any) -> bool:
    """Return whether plain data or arrays have a NaN anywhere."""
    todo = [value]
    while todo:
        item = todo.pop()
        if isinstance(item, float):
            if math.isnan(item):
                return True
        elif isinstance(item, list | tuple):
            todo.extend(item)
        elif isinstance(item, Mapping):
            todo.extend(item.values())
        elif isinstance(item, np.ndarray) and item.dtype.kind == "f" and bool(np.isnan(item).any()):
            return True
    return False


def _checked(request: Any) -> tuple[int, str, list[Any]]:
    match request:
        case [int(number), str(name), list(arguments)] if name in COMMANDS and name not in _LOCAL:
            return number, name, arguments
        case [int(), str(name), _]:
            raise WireError(f"there is no command {name[:60]!r}")
        case _:
            raise WireError(f"expected [number, command name, arguments], got {shortened(request)}")

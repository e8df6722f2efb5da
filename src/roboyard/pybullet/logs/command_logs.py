"""Files of commands: what was called on a client, to be called again.

The file is a sequence of frames as they go over the wire to a server: [command name, [arguments...]].
"""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.face import wire
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.errors import failure

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client

_LEFT_OUT = {"startStateLogging", "stopStateLogging", "setTimeOut", "submitProfileTiming"}
_ASKING = ("get", "calculate", "rayTest", "is", "compute")
_FAILED = "startStateLogging failed."


class CommandLog:
    """Writes every command that may change something, until it is closed."""

    def __init__(self, client: Client, name: str) -> None:
        try:
            self._file = Path(name).open("wb")  # noqa: SIM115 - open from start to stop of the log
        except OSError as problem:
            raise failure(_FAILED, str(problem)) from None
        self._client = client
        self._commands = [name for name in COMMANDS if name not in _LEFT_OUT and not name.startswith(_ASKING)]
        for name in self._commands:
            setattr(client, name, self._logged(name))

    def record(self) -> None:
        """Nothing: stepSimulation is a command like others."""

    def close(self) -> None:
        for name in self._commands:
            self._client.__dict__.pop(name, None)
        self._file.close()

    def _logged(self, name: str) -> Any:
        function = COMMANDS[name].function
        signature, client = inspect.signature(function), self._client

        def call(*args: Any, **kwargs: Any) -> Any:
            result = function(client, *args, **kwargs)
            bound = signature.bind(client, *args, **kwargs)
            bound.apply_defaults()
            self._file.write(wire.frame([name, list(bound.args)[1:]]))
            return result

        return call


class Replay:
    """Calls what a file says, once, when it is opened."""

    def __init__(self, client: Client, name: str) -> None:
        for number, (command, arguments) in enumerate(_commands_in(name)):
            try:
                COMMANDS[command].function(client, *arguments)
            except TypeError as problem:
                raise failure(_FAILED, f"{name}: command {number}, {command}: {problem}") from None

    def record(self) -> None:
        """Nothing: all was called at the start."""

    def close(self) -> None:
        """Nothing to finish."""


def _commands_in(name: str) -> list[tuple[str, list[Any]]]:
    try:
        content = Path(name).read_bytes()
    except OSError as problem:
        raise failure(_FAILED, str(problem)) from None
    found, at = [], 0
    try:
        while at < len(content):
            start = at + wire.PREFIX.size
            end = start + wire.body_length(content[at:start].ljust(wire.PREFIX.size, b"\xff"))
            match wire.decode(content[start:end]):
                case [str(command), list(arguments)] if command in COMMANDS and command not in _LEFT_OUT:
                    found.append((command, arguments))
                case other:
                    raise wire.WireError(f"no command: {str(other)[:60]}")
            at = end
    except wire.WireError as problem:
        raise failure(
            _FAILED, f"{name} is no file of commands, or was cut off at byte {at}: {problem}"
        ) from None
    return found

"""Logs of the commands called on a client, which can be replayed.

The file is a sequence of wire frames (see `face.wire`): [command name, [arguments...]].
"""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.face import wire
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.direct_calls import DIRECT
from roboyard.pybullet.face.errors import failure
from roboyard.untrusted.files import read_file

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client

_NOT_LOGGED = {"startStateLogging", "stopStateLogging", "setTimeOut", "submitProfileTiming"}
_MAX_BYTES = 256 << 20
_QUERIES = ("get", "calculate", "rayTest", "is", "compute")
_FAILED = "startStateLogging failed."


class CommandLog:
    """Writes every command that may change the world, until it is closed."""

    def __init__(self, client: Client, name: str) -> None:
        """Open the file and start to log the commands of a client.

        Raises:
            error: the file cannot be written.
        """
        try:
            self._file = client.output_files.open(name)
        except OSError as problem:
            raise failure(_FAILED, str(problem)) from None
        self._client = client
        self._commands = [
            name for name in COMMANDS if name not in _NOT_LOGGED and not name.startswith(_QUERIES)
        ]
        for name in self._commands:
            setattr(client, name, self._logged(name))
        self._numbers = [number for number, one in DIRECT.items() if one is client]
        for number in self._numbers:  # a log sees only methods
            del DIRECT[number]

    def record(self) -> None:
        """Do nothing: stepSimulation is logged as a command."""

    def close(self) -> None:
        """Stop logging and close the file."""
        for name in self._commands:
            self._client.__dict__.pop(name, None)
        DIRECT.update(dict.fromkeys(self._numbers, self._client))
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
    """Calls all commands of a file once, when it is opened."""

    def __init__(self, client: Client, name: str) -> None:
        """Call the commands of a file on a client.

        Raises:
            error: the file is not a log of commands, or a command fails.
        """
        for number, (command, arguments) in enumerate(_commands_in(name)):
            try:
                COMMANDS[command].function(client, *arguments)
            except TypeError as problem:
                raise failure(
                    _FAILED, f"{name}: command {number}, {command}{tuple(arguments)!r}: {problem}"[:200]
                ) from None

    def record(self) -> None:
        """Do nothing: all commands were called when the file was opened."""

    def close(self) -> None:
        """Do nothing: there is no file to finish."""


def _commands_in(name: str) -> list[tuple[str, list[Any]]]:
    try:
        content = read_file(name, _MAX_BYTES)
    except OSError as problem:
        raise failure(_FAILED, str(problem)) from None
    found, at = [], 0
    try:
        while at < len(content):
            start = at + wire.PREFIX.size
            end = start + wire.body_length(content[at:start].ljust(wire.PREFIX.size, b"\xff"))
            match wire.decode(content[start:end]):
                case [str(command), list(arguments)] if command in COMMANDS and command not in _NOT_LOGGED:
                    found.append((command, arguments))
                case other:
                    raise wire.WireError(f"not a command that can be replayed: {str(other)[:60]}")
            at = end
    except wire.WireError as problem:
        raise failure(
            _FAILED, f"{name} is not a log of commands, or it is truncated at byte {at}: {problem}"
        ) from None
    return found

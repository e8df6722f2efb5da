"""PyBullet's exception: its texts, with the remedy as a note (PEP 678)."""

from __future__ import annotations

from roboyard.errors import RoboyardError


class error(Exception):
    """Error of a failed call; `str()` is PyBullet's text, the notes explain cause and remedy."""


error.__module__ = __name__.removesuffix(".face.errors")


def failure(message: str, *remedies: str) -> error:
    """Return an `error` with PyBullet's `message`; each remedy is added as a note."""
    exception = error(message)
    for remedy in remedies:
        exception.add_note(remedy)
    return exception


def unavailable(function: str, why: str) -> error:
    """Return the error of a function that is not available, with the reason."""
    return error(f"{function} is not available: {why}")


class WorldError(error, RoboyardError):
    """An error of the world below that crosses the API: PyBullet's class for scripts, ours for programs."""


WorldError.__module__ = error.__module__


def world_failure(function: str, problem: Exception) -> error:
    """Return PyBullet's error for what the world refuses; it is one of our errors, too.

    Args:
        function: name of the function that the script called.
        problem: what the world raised; its notes are kept.
    """
    first, *rest = str(problem).splitlines() or [type(problem).__name__]
    exception = WorldError(f"{function} failed: {first}")
    for note in (*rest, *getattr(problem, "__notes__", ())):
        exception.add_note(note)
    return exception

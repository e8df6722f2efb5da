"""The exception of the face: PyBullet's texts, with the remedy as a note (PEP 678)."""

from __future__ import annotations


class error(Exception):
    """What every failed call raises; `str()` is PyBullet's text, the notes say how to mend it."""


error.__module__ = __name__.removesuffix(".face.errors")


def failure(message: str, *remedies: str) -> error:
    """An `error` with PyBullet's `message`; each of `remedies` follows as a note in the traceback."""
    exception = error(message)
    for remedy in remedies:
        exception.add_note(remedy)
    return exception


def unavailable(function: str, why: str) -> error:
    """The error of a function that cannot be had here, saying why."""
    return error(f"{function} is not available: {why}")

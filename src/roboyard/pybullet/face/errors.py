"""PyBullet's exception: its texts, with the remedy as a note (PEP 678)."""

from __future__ import annotations


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

"""Percent codes in the names of files, as addresses have them."""

from __future__ import annotations


def unquoted(text: str) -> str:
    """Return text with its percent codes read; texts without one, nearly all, do not load `urllib.parse`."""
    if "%" not in text:
        return text
    from urllib.parse import unquote

    return unquote(text)

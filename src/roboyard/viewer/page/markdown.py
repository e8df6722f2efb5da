"""Markdown for texts of robot files, which are untrusted."""

from __future__ import annotations


def plain(text: str) -> str:
    """Escape a text so that Markdown and HTML show it unchanged."""
    return "".join(f"&#{ord(c)};" if c in "<>&*_`[]()!#|\\~{}" else c for c in text)

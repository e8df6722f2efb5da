"""Paths in the written files of an import, without the folders of the machine that made it."""

from __future__ import annotations

import html
import re
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

_END = r"(?=$|[/\\\s'\"`<>|:;,&()\[\]{}])"
"""End of a folder in a text; with any other character behind it, it is the start of a longer name."""


def portable_texts(urdf: Path, build: Path, packages: Mapping[str, Path]) -> Callable[[Any], Any]:
    """Return a function that names files from the robot file instead of from the machine's root.

    Args:
        urdf: the vendor's file. Paths beside and below it become relative to its folder, those elsewhere
            in the tree get `../` for each folder upwards.
        build: folder in which the package is built; its paths become relative to the package.
        packages: folder of each named package; its paths become `package://` URIs.

    Returns:
        A function of plain data for JSON, or of one text; only texts and the keys of mappings change.
    """
    shorter: dict[str, str] = {}
    for folder in _spellings(Path(tempfile.gettempdir())):
        shorter[folder] = "<temporary folder>"
    for folder in _spellings(_home()):
        shorter[folder] = "~"
    for folder in _spellings(build.parent.parent):
        shorter[folder] = "<dataset>"
    for start in _distinct(urdf.absolute().parent, urdf.resolve().parent):
        up = [start, *start.parents][: len(start.parts) - 1]
        for count, folder in enumerate(up):
            shorter[str(folder)] = "/".join([".."] * count) or "."
    for name, folder in packages.items():
        for text in _spellings(folder):
            shorter[text] = f"package://{name}"
    for folder in (build.parent, build):
        for text in _spellings(folder):
            shorter[text] = "."
    return _replacing(shorter)


def _home() -> Path:
    try:
        return Path.home()
    except RuntimeError:  # the user has none
        return Path("/")


def _distinct(*folders: Path) -> Sequence[Path]:
    return list(dict.fromkeys(folders))


def _spellings(folder: Path) -> list[str]:
    """Return a folder as given and with its links resolved; nothing for the root of the machine."""
    return [str(each) for each in _distinct(folder.absolute(), folder.resolve()) if len(each.parts) > 1]


def _replacing(shorter: Mapping[str, str]) -> Callable[[Any], Any]:
    """Return the function that replaces folders in texts, the longest first."""
    shorter = {html.escape(folder): text for folder, text in shorter.items()} | dict(shorter)
    folders = sorted(shorter, key=len, reverse=True)
    pattern = re.compile(r"(?<![\w.~-])(" + "|".join(map(re.escape, folders)) + ")" + _END)

    def text_of(text: str) -> str:
        if "/" not in text and "\\" not in text:
            return text
        return (
            pattern.sub(lambda found: shorter[found[1]], text)
            .replace("file://./", "./")
            .replace("././", "./")
        )

    def replaced(value: Any) -> Any:
        if isinstance(value, str):
            return text_of(value)
        if isinstance(value, Mapping):
            return {replaced(key): replaced(each) for key, each in value.items()}
        if isinstance(value, list | tuple):
            return [replaced(each) for each in value]
        return value

    return replaced

"""Find the robot files in a folder, and below it."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from roboyard.untrusted.files import read_file

MAX_FILES = 200_000
"""Files of a folder that are looked at."""
MAX_DEPTH = 12
USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
_MAX_BYTES = 64 << 20
_HEAD = 1 << 20
"""Bytes of an XML file that are looked at."""
_PARTS = {
    *("configuration", "configurations", "payload", "payloads", "props", "parts", "materials", "textures"),
    *("geometry", "looks", "topology", "components"),
}
"""Folders of layers that other USD stages are made of."""
_SKIPPED = {"node_modules", "__pycache__", "build", "install", "log", "site-packages"}
_ROOT = re.compile(rb"<\s*(robot|sdf|mujoco)\b([^>]*)>")
_COMMENT = re.compile(rb"<!--.*?-->", re.S)
_MADE = re.compile(rb"<\s*(?:link|joint|xacro:(?!macro\b|property\b|include\b|arg\b|if\b|unless\b)\w+)\b")
_MACRO_START = re.compile(rb"<\s*(?:xacro:)?macro\b")
_INCLUDE = re.compile(rb"<\s*(?:xacro:)?include\b")
_MACRO = re.compile(rb"<\s*xacro:macro\b.*?</\s*xacro:macro\s*>", re.S)


def robot_files(folder: Path) -> tuple[Path, ...]:
    """Return the robot files below a folder, sorted by path; links to folders are not followed.

    URDF, SDF and MJCF are known by their root element; a xacro file is one where it makes links outside
    macros, or has a name and only includes others, an MJCF one where it has bodies of its own. USD stages
    count by their ending, except in folders that hold the parts of other stages.
    """
    found = [file for file in _files(folder) if _is_robot(file)]
    return tuple(sorted(found))


def _files(folder: Path) -> Iterator[Path]:
    """Yield files with an ending that a robot may have."""
    count, depth = 0, len(folder.parts)
    for name, folders, files in os.walk(folder):
        place = Path(name)
        folders[:] = sorted(each for each in folders if not each.startswith(".") and each not in _SKIPPED)
        if len(place.parts) - depth >= MAX_DEPTH:
            folders.clear()
        for each in sorted(files):
            count += 1
            if count > MAX_FILES:
                return
            ending = Path(each).suffix.lower()
            if ending in (".urdf", ".xacro", ".sdf", ".mjcf", ".xml", *USD_SUFFIXES) and each[0] != ".":
                yield place / each


def _is_robot(file: Path) -> bool:
    ending = file.suffix.lower()
    if ending in USD_SUFFIXES:
        return not {part.lower() for part in file.parts[:-1]} & _PARTS
    try:
        text = _COMMENT.sub(b"", read_file(file, _MAX_BYTES)[:_HEAD])
    except (OSError, ValueError):  # unreadable, too large, no regular file
        return False
    root = _ROOT.search(text)
    if root is None:
        return False
    if ".srdf" in file.suffixes:
        return False
    if root[1] == b"mujoco":
        return b"<body" in text and not file.stem.lower().startswith("scene")
    if root[1] == b"sdf":
        return b"<link" in text
    plain = _MACRO.sub(b"", text) if b"xacro" in text else text
    return _MADE.search(plain) is not None or _is_assembly(text, root[2])


def _is_assembly(text: bytes, attributes: bytes) -> bool:
    """Return whether a file has a robot's name and is made of included files alone."""
    named = re.search(rb"\bname\s*=", attributes) is not None
    return named and _INCLUDE.search(text) is not None and _MACRO_START.search(text) is None

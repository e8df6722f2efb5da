"""Change values in a YAML file and leave the rest as its author wrote it: comments, order, lines, style.

>>> edited_yaml("radius: 0.1  # m", {"radius": 0.2})
'radius: 0.2  # m'
"""

from __future__ import annotations

import json
import os
import re
import tempfile
from pathlib import Path
from typing import Any

import yaml

from roboyard.errors import ConfigError

_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_./-]*")
WIDTH = 100
"""Longest collection that is written in one line"""
STEP = 2
"""Blanks of an indentation"""


def edited_yaml(text: str, data: Any) -> str:
    """The text, changed where needed so that it reads as `data`.

    Entries that stay keep their place, comments and style; new ones come after the last of their collection.

    Args:
        text: a YAML file of plain data.
        data: dicts, lists, words, numbers, booleans and None.

    Raises:
        ConfigError: the file is no YAML, or is written in a way (anchors, merges) that cannot be kept.
    """
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
        if node is None:
            return text + ("" if text.endswith("\n") or not text else "\n") + _block(data, 0) + "\n"
        for coarse in (False, True):
            changes = _Changes(text, coarse=coarse)
            changes.turn(node, data, 0)
            result = changes.done()
            if _same(_read(result), data):
                return result
    except (yaml.YAMLError, RecursionError) as error:
        raise ConfigError(f"cannot be edited: {' '.join(str(error).split())}") from error
    raise ConfigError("cannot be edited in place (anchors or merges?); write its values out, then try again")


def write_with_backup(file: Path, text: str) -> Path | None:
    """Write a text file in one step; what was there before is kept as `<name>.bak`, whose path is given."""
    backup = None
    if file.exists():
        backup = file.with_name(f"{file.name}.bak")
        _write(backup, file.read_bytes())
    _write(file, text.encode("utf-8"))
    return backup


def _write(file: Path, data: bytes) -> None:
    mode = file.stat().st_mode & 0o777 if file.exists() else 0o644
    handle, name = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name}.")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        Path(name).chmod(mode)
        Path(name).replace(file)
    except BaseException:
        Path(name).unlink()
        raise


class _Changes:
    """Pieces of a text to replace, found by comparing its nodes with the data it shall hold."""

    def __init__(self, text: str, *, coarse: bool) -> None:
        """Begin without changes; `coarse` ones replace whole values of the outermost mapping."""
        self.text = text
        self._coarse = coarse
        self._pieces: list[tuple[int, int, str]] = []

    def done(self) -> str:
        """The text with all pieces replaced."""
        out = self.text
        for begin, end, new in sorted(self._pieces, key=lambda piece: piece[:2], reverse=True):
            out = out[:begin] + new + out[end:]
        return out

    def turn(self, node: yaml.Node, data: Any, indent: int, *, in_line: bool = False, depth: int = 0) -> None:
        """Make a node say `data`.

        Args:
            node: what to change.
            data: what it shall say.
            indent: column of what holds it.
            in_line: it stands between brackets, where no lines may begin.
            depth: of the node in the file.
        """
        if _same(_plain(node), data):
            return
        whole = self._coarse and depth > 0
        if (
            not whole
            and isinstance(node, yaml.MappingNode)
            and isinstance(data, dict)
            and data
            and node.value
        ):
            self._mapping(node, data, depth)
        elif (
            not whole
            and isinstance(node, yaml.SequenceNode)
            and isinstance(data, list)
            and data
            and node.value
        ):
            self._sequence(node, data, depth)
        else:
            self._replace(node, data, indent, in_line=in_line, depth=depth)

    def _replace(self, node: yaml.Node, data: Any, indent: int, *, in_line: bool, depth: int) -> None:
        begin, end = node.start_mark.index, self._end(node)
        starts_line = not self.text[self._line(begin) : begin].strip()
        if in_line:
            self._pieces.append((begin, end, _flow(data)))
        elif starts_line and depth:
            # what stands on lines of its own must be further in than the key that it belongs to
            column = max(node.start_mark.column, indent + (0 if isinstance(data, list) else STEP))
            blanks = " " * (column - node.start_mark.column)
            text = _flow(data) if _fits(data) else _block(data, column).lstrip(" ")
            if _fits(data) and column == indent:
                blanks += " " * STEP
            self._pieces.append((begin, end, blanks + text))
        elif isinstance(node, yaml.ScalarNode) and not _fits(data):
            self._pieces.append((begin, end, "\n" + _block(data, indent + STEP)))
        else:
            blank = " " if begin == end and self.text[begin - 1 : begin] not in (" ", "\n", "") else ""
            self._pieces.append((begin, end, blank + _flow(data)))

    def _mapping(self, node: yaml.MappingNode, data: dict[Any, Any], depth: int) -> None:
        entries = {_plain(key): (key, value) for key, value in node.value}
        gone = [key for key in entries if key not in data]
        new = {key: value for key, value in data.items() if key not in entries}
        column = node.start_mark.column
        if (gone or new) and (node.flow_style or not self._starts_lines(k for k, _ in node.value)):
            begin, end = node.start_mark.index, self._end(node)
            text = _flow(data) if node.flow_style or _fits(data) else _block(data, column).lstrip(" ")
            self._pieces.append((begin, end, text))
            return
        for key, (_, value) in entries.items():
            if key in data:
                self.turn(value, data[key], column, in_line=bool(node.flow_style), depth=depth + 1)
        for key in gone:
            self._drop(entries[key][0], entries[key][1])
        if new:
            self._insert_after(node, _block(new, column))

    def _sequence(self, node: yaml.SequenceNode, data: list[Any], depth: int) -> None:
        old = node.value
        if node.flow_style:
            if len(old) == len(data):
                for item, value in zip(old, data, strict=True):
                    self.turn(item, value, node.start_mark.column, in_line=True, depth=depth + 1)
            else:
                self._pieces.append((node.start_mark.index, self._end(node), _flow(data)))
            return
        head = 0
        while head < min(len(old), len(data)) and _same(_plain(old[head]), data[head]):
            head += 1
        tail = 0
        while tail < min(len(old), len(data)) - head and _same(_plain(old[-1 - tail]), data[-1 - tail]):
            tail += 1
        column = node.start_mark.column
        was, now = old[head : len(old) - tail], data[head : len(data) - tail]
        for item, value in zip(was, now, strict=False):
            self.turn(item, value, column, depth=depth + 1)
        for item in was[len(now) :]:
            self._drop(item, item)
        if len(now) > len(was):
            last = old[head + len(was) - 1] if head + len(was) else None
            text = _block(now[len(was) :], column)
            if last is None:
                self._pieces.append(
                    (self._line(node.start_mark.index), self._line(node.start_mark.index), text + "\n")
                )
            else:
                self._insert_after(last, text)

    def _insert_after(self, node: yaml.Node, text: str) -> None:
        """Whole lines after the last line of a node."""
        place = self.text.find("\n", self._end(node))
        if place < 0:
            self._pieces.append((len(self.text), len(self.text), "\n" + text))
        else:
            self._pieces.append((place + 1, place + 1, text + "\n"))

    def _drop(self, first: yaml.Node, last: yaml.Node) -> None:
        """Take out the lines from one node to another."""
        end = self.text.find("\n", self._end(last))
        self._pieces.append((self._line(first.start_mark.index), end + 1 if end >= 0 else len(self.text), ""))

    def _starts_lines(self, nodes: Any) -> bool:
        """Whether each node is the first thing on its line."""
        return all(not self.text[self._line(n.start_mark.index) : n.start_mark.index].strip() for n in nodes)

    def _line(self, index: int) -> int:
        """Where the line of a character begins."""
        return self.text.rfind("\n", 0, index) + 1

    def _end(self, node: yaml.Node) -> int:
        """Behind the last character of a node, comments and blank lines after it not counted."""
        if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
            last = node.value[-1]
            return self._end(last[1] if isinstance(last, tuple) else last)
        return node.end_mark.index


def _read(text: str) -> Any:
    try:
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError):
        return _Nothing


class _Nothing:
    """Equal to no data."""


def _plain(node: yaml.Node) -> Any:
    """A node as data."""
    if isinstance(node, yaml.MappingNode):
        return {_plain(key): _plain(value) for key, value in node.value}
    if isinstance(node, yaml.SequenceNode):
        return [_plain(item) for item in node.value]
    return yaml.SafeLoader("").construct_object(node)


def _same(a: Any, b: Any) -> bool:
    """Equal data; 1 and 1.0 are, 1 and true are not, and the order of keys counts for nothing."""
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_same(a[key], b[key]) for key in a)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(_same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, bool) or isinstance(b, bool):
        return a is b
    return type(a) is type(b) and a == b if isinstance(a, str) or isinstance(b, str) else a == b


def _depth(data: Any) -> int:
    if isinstance(data, dict | list):
        return 1 + max((_depth(v) for v in (data.values() if isinstance(data, dict) else data)), default=0)
    return 0


def _fits(data: Any) -> bool:
    """Whether it is written in one line: vectors, poses, spheres."""
    return _depth(data) <= 2 and len(_flow(data)) <= WIDTH and not _is_list_of_things(data)


def _is_list_of_things(data: Any) -> bool:
    return isinstance(data, list) and any(isinstance(item, dict | list) for item in data)


def _block(data: Any, column: int) -> str:
    """Lines of a collection at a column, without the last line's end."""
    blanks = " " * column
    if isinstance(data, dict) and data:
        lines = []
        for key, value in data.items():
            if not isinstance(value, dict | list) or not value or _fits(value):
                lines.append(f"{blanks}{_scalar(key)}: {_flow(value)}")
            else:
                lines.append(f"{blanks}{_scalar(key)}:\n{_block(value, column + STEP)}")
        return "\n".join(lines)
    if isinstance(data, list) and data:
        lines = []
        for item in data:
            if not isinstance(item, dict | list) or not item or _fits(item):
                lines.append(f"{blanks}- {_flow(item)}")
            else:
                lines.append(f"{blanks}- {_block(item, column + STEP).lstrip(' ')}")
        return "\n".join(lines)
    return f"{blanks}{_flow(data)}"


def _flow(data: Any) -> str:
    if isinstance(data, dict):
        return "{" + ", ".join(f"{_scalar(key)}: {_flow(value)}" for key, value in data.items()) + "}"
    if isinstance(data, list):
        return "[" + ", ".join(_flow(item) for item in data) + "]"
    return _scalar(data)


def _scalar(value: Any) -> str:
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        text = repr(value)
        mantissa, mark, exponent = text.partition("e")  # YAML reads 1e-06 as a word, 1.0e-06 as a number
        return text if not mark or "." in mantissa else f"{mantissa}.0e{exponent}"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, str):
        is_word = _PLAIN.fullmatch(value) and yaml.safe_load(value) == value
        return value if is_word else json.dumps(value)
    raise TypeError(f"{type(value).__name__} is no plain data")

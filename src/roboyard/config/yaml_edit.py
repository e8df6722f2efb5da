"""Change values in a YAML file and preserve the rest: comments, order, line breaks, style.

ruamel.yaml's round trip is no replacement: it drops the comment after a flow mapping that gains a key,
re-wraps long flow sequences, and writes new entries in block style
(`test_result_of_any_edit_parses_as_the_data`, `test_the_bundled_configuration_keeps_its_comments`
and five more tests fail with it).

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
from roboyard.untrusted.yaml_reading import check_size, parse_yaml

_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_./-]*")
WIDTH = 100
"""Longest collection that is written in one line (characters)."""
STEP = 2
"""Indentation (spaces)."""


def edited_yaml(text: str, data: Any) -> str:
    """Return the text with the changes that make it parse as `data`.

    Unchanged entries keep their position, comments and style; new ones follow the last entry of their
    collection.

    Args:
        text: a YAML file of plain data.
        data: dicts, lists, strings, numbers, booleans and None.

    Raises:
        ConfigError: the text is not YAML, or has anchors or merges that cannot be preserved.
    """
    try:
        check_size(text)
        node = yaml.compose(text, Loader=yaml.SafeLoader)  # libyaml's marks have no place in the text
        if node is None:
            return text + ("" if text.endswith("\n") or not text else "\n") + _block(data, 0) + "\n"
        for coarse in (False, True):
            changes = _Changes(text, coarse=coarse)
            changes.update(node, data, 0)
            result = changes.done()
            if _same(_read(result), data):
                return result
    except (yaml.YAMLError, ValueError) as error:
        raise ConfigError(f"cannot be edited: {' '.join(str(error).split())}") from error
    raise ConfigError("cannot be edited in place (anchors or merges?); write the values out, then try again")


def write_with_backup(file: Path, text: str) -> Path | None:
    """Write a text file atomically and return the path of the backup of its old content, `<name>.bak`.

    Returns:
        None where there was no file before.
    """
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
    """Replacements in a text, found by comparing its nodes with the new data."""

    def __init__(self, text: str, *, coarse: bool) -> None:
        """Start without changes; `coarse` changes replace whole values of the outermost mapping."""
        self.text = text
        self._coarse = coarse
        self._pieces: list[tuple[int, int, str]] = []

    def done(self) -> str:
        """Return the text with all replacements made."""
        out = self.text
        for begin, end, new in sorted(self._pieces, key=lambda piece: piece[:2], reverse=True):
            out = out[:begin] + new + out[end:]
        return out

    def update(
        self, node: yaml.Node, data: Any, indent: int, *, in_line: bool = False, depth: int = 0
    ) -> None:
        """Record the replacements that make a node parse as `data`.

        Args:
            node: the node to change.
            data: its new value.
            indent: column of its parent.
            in_line: whether the node is between brackets, where line breaks are not allowed.
            depth: depth of the node in the file.
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
            # a value on lines of its own must be indented further than its key
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
                self.update(value, data[key], column, in_line=bool(node.flow_style), depth=depth + 1)
        for key in gone:
            self._drop(entries[key][0], entries[key][1])
        if new:
            self._insert_after(node, _block(new, column))

    def _sequence(self, node: yaml.SequenceNode, data: list[Any], depth: int) -> None:
        old = node.value
        if node.flow_style:
            if len(old) == len(data):
                for item, value in zip(old, data, strict=True):
                    self.update(item, value, node.start_mark.column, in_line=True, depth=depth + 1)
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
            self.update(item, value, column, depth=depth + 1)
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
        """Insert whole lines after the last line of a node."""
        place = self.text.find("\n", self._end(node))
        if place < 0:
            self._pieces.append((len(self.text), len(self.text), "\n" + text))
        else:
            self._pieces.append((place + 1, place + 1, text + "\n"))

    def _drop(self, first: yaml.Node, last: yaml.Node) -> None:
        """Remove the lines from one node to another."""
        end = self.text.find("\n", self._end(last))
        self._pieces.append((self._line(first.start_mark.index), end + 1 if end >= 0 else len(self.text), ""))

    def _starts_lines(self, nodes: Any) -> bool:
        """Whether each node is the first on its line."""
        return all(not self.text[self._line(n.start_mark.index) : n.start_mark.index].strip() for n in nodes)

    def _line(self, index: int) -> int:
        """Return the index at which the line of a character starts."""
        return self.text.rfind("\n", 0, index) + 1

    def _end(self, node: yaml.Node) -> int:
        """Return the index after the last character of a node, without trailing comments and blank lines."""
        if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
            last = node.value[-1]
            return self._end(last[1] if isinstance(last, tuple) else last)
        return node.end_mark.index


def _read(text: str) -> Any:
    try:
        return parse_yaml(text)
    except ValueError:
        return _Nothing


class _Nothing:
    """A value that equals no data."""


def _plain(node: yaml.Node) -> Any:
    """Return a node as data."""
    if isinstance(node, yaml.MappingNode):
        return {_plain(key): _plain(value) for key, value in node.value}
    if isinstance(node, yaml.SequenceNode):
        return [_plain(item) for item in node.value]
    return yaml.SafeLoader("").construct_object(node)


def _same(a: Any, b: Any) -> bool:
    """Whether data are equal: 1 equals 1.0 but not true, and the order of keys does not matter."""
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
    """Whether data are written in one line: vectors, poses, spheres."""
    return _depth(data) <= 2 and len(_flow(data)) <= WIDTH and not _is_list_of_collections(data)


def _is_list_of_collections(data: Any) -> bool:
    return isinstance(data, list) and any(isinstance(item, dict | list) for item in data)


def _block(data: Any, column: int) -> str:
    """Return the lines of a collection at a column, without the last line break."""
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
        mantissa, mark, exponent = text.partition("e")  # YAML 1.1 reads 1e-06 as text, 1.0e-06 as a number
        return text if not mark or "." in mantissa else f"{mantissa}.0e{exponent}"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, str):
        is_plain = _PLAIN.fullmatch(value) and parse_yaml(value) == value
        return value if is_plain else json.dumps(value)
    raise TypeError(f"{type(value).__name__} is not plain data")

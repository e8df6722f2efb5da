"""Parse YAML as plain data, with the line number of every key and item.

Files are untrusted: only plain scalars, lists and mappings are built, a duplicate key is an error (YAML would
keep the last one), and values are counted before any is built (`roboyard.untrusted.yaml_reading`).
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from roboyard.errors import ConfigError
from roboyard.untrusted.files import read_file
from roboyard.untrusted.yaml_reading import LOADER, check_size

MAX_BYTES = 8 * 2**20
"""Largest file (bytes)."""

Where = tuple[str | int, ...]
"""Keys and list indices from the top of the file."""


@dataclass(frozen=True, kw_only=True, slots=True)
class YamlFile:
    """One parsed YAML file."""

    data: Any
    """Dicts, lists and scalars; None for an empty file."""
    lines: Mapping[Where, int]
    """1-based line of each key and list item."""
    problems: tuple[tuple[int, str], ...]
    """Line and message of errors that do not stop the parser: duplicate keys, keys that are not scalars."""

    def line(self, where: Where) -> int | None:
        """Return the line of `where`, or of its nearest parent that exists; None if there is none."""
        for length in range(len(where), 0, -1):
            if where[:length] in self.lines:
                return self.lines[where[:length]]
        return None


def read_yaml(file: Path) -> YamlFile:
    """Parse a YAML file as plain data.

    Raises:
        ConfigError: the file is missing, too large, not YAML, or has tags beyond plain data.
    """
    try:
        text = read_file(file, MAX_BYTES).decode("utf-8")
    except UnicodeDecodeError as error:
        raise ConfigError(f"{file.name}: not UTF-8 text (byte {error.start}); save it as UTF-8") from None
    except OSError as error:
        raise ConfigError(f"{file.name}: {error.strerror or error}; check the path") from None
    return parse_yaml(text, file.name)


def parse_yaml(text: str, name: str) -> YamlFile:
    """Parse YAML text as plain data; messages call the file `name`.

    Raises:
        ConfigError: the text is not YAML, or has tags beyond plain data.
    """
    try:
        check_size(text)
        node = yaml.compose(text, Loader=LOADER)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{name}:{mark.line + 1}" if mark else name
        reason = " ".join(part for part in (error.context, error.problem) if part)
        raise ConfigError(f"{where}: not valid YAML: {reason}; fix the syntax at this line") from None
    except yaml.YAMLError as error:
        raise ConfigError(f"{name}: not valid YAML: {' '.join(str(error).split())}") from None
    except ValueError as error:
        raise ConfigError(f"{name}: {error}") from None
    walk = _Walk(name)
    data = None if node is None else walk.plain(node, ())
    return YamlFile(data=data, lines=walk.lines, problems=tuple(walk.problems))


class _Walk:
    def __init__(self, name: str) -> None:
        self.name = name
        self.lines: dict[Where, int] = {}
        self.problems: list[tuple[int, str]] = []
        self._scalars = yaml.SafeLoader("")

    def plain(self, node: yaml.Node, where: Where) -> Any:
        line = node.start_mark.line + 1
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, where)
        if isinstance(node, yaml.SequenceNode):
            self._plain_tag(node, "seq")
            items = []
            for index, item in enumerate(node.value):
                self.lines[(*where, index)] = item.start_mark.line + 1
                items.append(self.plain(item, (*where, index)))
            return items
        try:
            return self._scalars.construct_object(node)
        except yaml.YAMLError:
            raise ConfigError(
                f"{self.name}:{line}: the tag {node.tag!r} is not allowed; use plain data"
            ) from None
        except (ValueError, OverflowError) as error:
            raise ConfigError(f"{self.name}:{line}: {node.value!r} cannot be read ({error})") from None

    def _plain_tag(self, node: yaml.Node, kind: str) -> None:
        if node.tag != f"tag:yaml.org,2002:{kind}":
            line = node.start_mark.line + 1
            raise ConfigError(f"{self.name}:{line}: the tag {node.tag!r} is not allowed; use plain data")

    def _mapping(self, node: yaml.MappingNode, where: Where) -> dict[str | int, Any]:
        self._plain_tag(node, "map")
        found: dict[str | int, Any] = {}
        for key_node, value_node in node.value:
            at = key_node.start_mark.line + 1
            if key_node.tag == "tag:yaml.org,2002:merge":
                self.problems.append((at, "'<<' merges are not supported; write the keys out"))
                continue
            key = self.plain(key_node, where) if isinstance(key_node, yaml.ScalarNode) else None
            if not isinstance(key, Hashable) or key is None or isinstance(key, list | dict):
                self.problems.append((at, "a key must be a scalar; quote it or fix the indentation"))
                continue
            key = key if isinstance(key, str) else str(key_node.value)
            if key in found:
                self.problems.append((at, f"{key!r} is a duplicate key; keep one"))
                continue
            self.lines[(*where, key)] = at
            found[key] = self.plain(value_node, (*where, key))
        return found

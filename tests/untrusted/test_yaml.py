"""YAML of strangers: as PyYAML reads it, or refused before anything is built."""

from __future__ import annotations

import time
from datetime import date
from pathlib import Path

import pytest
import yaml

from roboyard.config.yaml_lines import read_yaml as read_with_lines
from roboyard.errors import ConfigError
from roboyard.untrusted.yaml_reading import MAX_DEPTH, MAX_VALUES, check_size, parse_yaml, read_yaml


def bomb(levels: int, width: int = 9) -> str:
    """A list of lists of aliases: width ** levels values in a few hundred bytes."""
    lines = [f"a0: &a0 [{', '.join('x' * width)}]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * width)}]" for k in range(1, levels)]
    return "\n".join(lines)


@pytest.mark.parametrize(
    "text",
    [
        "", "a: 1", "- 1.5\n- [x, {y: null}]", "a: &one [1, 2]\nb: *one",
        "base: &b {x: 1}\nmore:\n  <<: *b\n  y: 2",
        "s: 'quoted'\nt: |\n  text\n  more", "1: a\ntrue: b", "day: 2026-01-02", bomb(3),
    ],
)  # fmt: skip
def test_it_is_read_as_by_pyyaml(text: str) -> None:
    assert parse_yaml(text) == yaml.safe_load(text)


def test_a_date_is_plain_data() -> None:
    assert parse_yaml("day: 2026-01-02") == {"day": date(2026, 1, 2)}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (bomb(20), "more than 300000 values, aliases expanded"),
        ("- a\n" * 2_000_000, "line 300000: more than 300000 values"),
        ("[" * 3_000_000, "over 200 levels deep"),
        ("- " * 2_000_000, "over 200 levels deep"),
        ("a: " + "{b: " * 300 + "1" + "}" * 300, "over 200 levels deep"),
        ("a: [1", "expected"),
        ("a: *nothing", "undefined alias"),
        ("!!python/object/apply:os.system ['true']", "could not determine a constructor"),
        ("[a]: 1\n? {b: c}\n: 2", "unhashable"),
        ("a: " + "9" * 5000, "digit"),
    ],
)
def test_others_are_refused_soon(text: str, message: str, tmp_path: Path) -> None:
    begin = time.process_time()
    with pytest.raises(ValueError, match=message):
        parse_yaml(text)
    file = tmp_path / "given.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=r"given\.yaml"):
        if read_with_lines(file).problems:
            raise ConfigError("given.yaml: keys")
    assert time.process_time() - begin < 10.0


def test_the_most_values_are_accepted() -> None:
    flat = "- a\n" * (MAX_VALUES - 1)
    check_size(flat)
    with pytest.raises(ValueError, match="more than"):
        check_size(flat + "- a\n- a\n")
    check_size("[" * MAX_DEPTH + "]" * MAX_DEPTH)


def test_a_file_is_bounded_and_utf8(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_bytes(b"a: \xff")
    with pytest.raises(ValueError, match="byte 3 is no UTF-8"):
        read_yaml(file, 100)
    file.write_bytes(b"a: " + b"x" * 200)
    with pytest.raises(OSError, match="large"):
        read_yaml(file, 100)

"""Every command that an error, a finding or a help text suggests can be run as written."""

from __future__ import annotations

import ast
import re
import shlex
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest
import typer.main

from roboyard import cli

SOURCE = Path(cli.__file__).parents[1]
HINT = re.compile(rf"`?roboyard ((?:{'|'.join(cli.COMMANDS)})\b[^`\n;:,]*)")


def texts(file: Path) -> Iterator[str]:
    """Yield the text constants of a file that may have hints; what an f-string inserts becomes VALUE."""
    source = file.read_text(encoding="utf-8")
    if "roboyard " not in source:  # parsing the whole package takes seconds
        return
    nodes = list(ast.walk(ast.parse(source)))
    within = {id(part) for node in nodes if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in nodes:
        if isinstance(node, ast.JoinedStr):
            parts = (str(v.value) if isinstance(v, ast.Constant) else "VALUE" for v in node.values)
            yield "".join(parts)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in within:
            yield node.value


@cache
def hints() -> list[tuple[str, str]]:
    """Return file and command line of every hint."""
    found = []
    for file in sorted(SOURCE.rglob("*.py")):
        for text in texts(file):
            for match in HINT.finditer(text):
                line = match[1].partition("   ")[0].partition("...")[0].partition(" >")[0].partition(" &&")[0]
                found.append((str(file.relative_to(SOURCE)), line.strip().rstrip(".)\"'")))
    return found


@cache
def parameters(command: str) -> dict[str, bool]:
    """Return the options of a command, and whether each takes a value."""
    home = cli._RENAMED.get(command, command)
    app = typer.Typer()
    app.command()(getattr(import_module(f"roboyard.cli.{home}"), home))
    made = typer.main.get_command(app)
    return {"--help": False} | {
        name: not getattr(parameter, "is_flag", False)
        for parameter in made.params
        for name in (*parameter.opts, *parameter.secondary_opts)
        if name.startswith("--")
    }


def test_there_are_hints() -> None:
    assert len(hints()) > 60


@pytest.mark.parametrize(("file", "line"), sorted(set(hints())))
def test_a_hint_names_existing_options(file: str, line: str) -> None:
    try:
        command, *words = shlex.split(line.replace("'", ""))
    except ValueError:
        command, *words = line.split()
    assert command in cli.COMMANDS
    if command == "run":
        return  # what follows is the script's
    known = parameters(command)
    waiting = None
    for word in words:
        if word.startswith("--"):
            assert waiting is None, f"{file}: {waiting} needs a value: roboyard {line}"
            name, equals, _ = word.partition("=")
            assert name in known, f"{file}: there is no {name}: roboyard {line}"
            waiting = name if known[name] and not equals else None
        else:
            waiting = None

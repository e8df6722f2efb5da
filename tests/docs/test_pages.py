"""The README and the documentation name only existing files, pictures, commands, options and names."""

from __future__ import annotations

import importlib
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from roboyard import cli
from roboyard.errors import MissingExtraError

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted(DOCS.glob("*.md"))]
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
CODE = re.compile(r"`([^`\n]+)`")

pytestmark = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)


def code_words(page: Path) -> Iterator[str]:
    """Yield the texts in backquotes."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for found in CODE.finditer(text):
        yield found[1]


def commands(page: Path) -> Iterator[str]:
    """Yield the shell commands, in blocks and in backquotes, that call roboyard."""
    for line in page.read_text(encoding="utf-8").splitlines():
        words = line.strip().removeprefix(".venv/bin/")
        if line.startswith(("    ", "roboyard ")) and words.startswith("roboyard "):
            yield words.split("  ")[0].partition(" #")[0]
    for word in code_words(page):
        if word.startswith("roboyard "):
            yield word


def test_link_targets_exist(page: Path) -> None:
    for target in LINK.findall(page.read_text(encoding="utf-8")):
        if target.startswith(("https://", "http://")):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        assert file.exists(), target
        if anchor:
            titles = re.findall(r"^#+ (.+)$", file.read_text(encoding="utf-8"), flags=re.MULTILINE)
            assert anchor in {re.sub(r"[^\w\- ]", "", title).lower().replace(" ", "-") for title in titles}


def test_commands_and_their_options_exist(page: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for line in commands(page):
        words = [word for word in shlex.split(line.replace("[", " ").replace("]", " ")) if word != "..."]
        if words[1].startswith("-") or words[1].isupper():
            continue
        assert words[1] in cli.COMMANDS, line
        if words[1] == "run":
            continue  # what follows is the script's
        assert cli.main([words[1], "--help"]) == 0
        known = capsys.readouterr().out
        for word in words[2:]:
            if word.startswith("--"):
                assert re.search(rf"{re.escape(word)}[ \n]", known), line


def test_python_names_exist(page: Path) -> None:
    for word in code_words(page):
        found = re.fullmatch(r"(roboyard(?:\.\w+)*)(?:\(.*\))?", word)
        if found is None or word.endswith((".yaml", ".py")):
            continue
        module, rest = found[1], []
        while True:
            try:
                value = importlib.import_module(module)
                break
            except ModuleNotFoundError as error:
                if error.name is None or not error.name.startswith("roboyard"):
                    pytest.skip(f"{error.name} is not installed")
                module, _, name = module.rpartition(".")
                rest.insert(0, name)
            except MissingExtraError as error:
                pytest.skip(str(error))
        for name in rest:
            value = getattr(value, name)


def test_every_page_and_picture_is_reached(page: Path) -> None:
    if page.parent != DOCS:
        return
    if page.name != "index.md":
        assert f"({page.name})" in (DOCS / "index.md").read_text(encoding="utf-8")
    everything = "".join(other.read_text(encoding="utf-8") for other in PAGES)
    for picture in (DOCS / "images").iterdir():
        assert f"images/{picture.name}" in everything, picture.name

"""Words that no roboticist would search for, in identifiers, file names, docstrings, messages and docs.

    python tests/architecture/words.py [FOLDER or FILE ...]

lists every one that is left with its file and line. `docs/architecture.md` has the glossary.
"""

from __future__ import annotations

import ast
import fnmatch
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PLACES = ("src", "tests", "docs", "examples", "benchmarks", "tools", "README.md", "CONTRIBUTING.md")

IDENTIFIERS = {
    "mend": "fix",
    "mends": "fixes",
    "mended": "fixed",
    "mendable": "fixable",
    "told": "name the message",
    "mould": "template",
    "moulds": "templates",
    "casting": "analytic template",
    "castings": "analytic templates",
    "spares": "pool",
    "footing": "support polygon",
    "glide": "set_frictionless",
    "habits": "history",
    "weigh": "update_inertia, mass",
    "companion": "external file",
    "companions": "external files",
    "lookalike": "moved file",
    "lookalikes": "moved files",
    "lathe": "revolve",
    "thing": "object",
    "things": "objects",
    "sight": "view",
    "wishes": "requests",
    "sticks": "joysticks",
    "poser": "pose sender",
    "offence": "violation",
    "verdict": "status, result",
    "senses": "sensors",
    "story": "motion sequence",
    "teller": "motion recorder",
    "intake": "load",
    "untidy": "info",
    "misbehaves": "warning",
    "recycler": "id pool",
}
"""Part of an identifier or file name, as `told` in `told_once`, to what it is called instead."""

PROSE = {
    r"mend(s|ed|ing|able)?": "fix, repair",
    r"told|tells?|telling": "report, name, state",
    r"weigh(s|ed|ing)?( anew)?": "have a mass of; compute",
    r"stands? for|stood for": "represents, approximates",
    r"bears?|bearing": "supports, allows",
    r"wants?|wanted to be": "needs, expects, requests",
    r"lies|lie in|lie at|lay in": "is, is stored",
    r"by chance": "random",
    r"leav(e|es|ing) (it |them )?(away|out)|left (away|out)": "skip, omit",
    r"moulds?|castings?|spares?": "template, analytic template, pooled body",
    r"rooms? (that|of the package|it lives)": "folder",
    r"things?": "object",
    r"anew": "again",
    r"(?:^|[.:;] )What [a-z]+(?! (do|now|next|else)\b)": "start with the noun",
    r"whoever|whatever|wherever|nobody|somebody": "name who or which",
    r"footing": "support polygon",
    r"hears?|feels?|obeys?|obeyed|felt": "receives, senses, follows",
    r"waits? (for|until) (someone|somebody|somewhere)": "is deferred until",
    r"leading role|story|stories": "motion sequence",
    r"twins?": "duplicate, reference implementation",
}
"""Pattern (whole words, case ignored) to what is written instead."""


@dataclass(frozen=True, slots=True)
class Allowed:
    """Where a word is allowed, and why."""

    place: str
    """Glob over the path from the project's root."""
    word: str
    """Regular expression of the found words."""
    reason: str


ALLOWED = (
    Allowed("tests/architecture/*", ".*", "the list itself"),
    Allowed("docs/architecture.md", ".*", "the glossary names the words to avoid"),
    Allowed("CHANGELOG.md", ".*", "a record of released texts"),
)


@dataclass(frozen=True, slots=True)
class Word:
    """A word that is to go."""

    path: str
    line: int
    word: str
    instead: str
    text: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.word!r} ({self.instead}): {self.text[:110]}"


_PROSE = re.compile(
    "|".join(f"(?P<p{i}>(?<![\\w.`])(?:{p})(?!\\w))" for i, p in enumerate(PROSE)), re.IGNORECASE
)
_INSTEAD = list(PROSE.values())


def files(places: tuple[str, ...] = PLACES) -> list[Path]:
    """Python and Markdown files of the project."""
    found: list[Path] = []
    for place in places:
        path = ROOT / place
        found += [path] if path.is_file() else [p for kind in ("*.py", "*.md") for p in path.rglob(kind)]
    return sorted(p for p in found if "__pycache__" not in p.parts and ".venv" not in p.parts)


def words_of(path: Path) -> list[Word]:
    """All words to be replaced in one file, without the allowed ones."""
    name = path.relative_to(ROOT).as_posix()
    text = path.read_text(encoding="utf-8")
    found = list(_in_python(name, text) if path.suffix == ".py" else _in_prose(name, text, 1))
    found += _in_identifier(name, 0, path.stem, name)
    return [
        word
        for word in found
        if not any(fnmatch.fnmatch(name, a.place) and re.fullmatch(a.word, word.word, re.I) for a in ALLOWED)
    ]


# From Python 3.12 on an f-string is several tokens: its text, and the names between braces as any other name.
_F_STRING_TEXT = getattr(tokenize, "FSTRING_MIDDLE", -1)


def _in_python(name: str, text: str) -> Iterator[Word]:
    lines = text.splitlines()
    seen: set[tuple[int, str]] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        line = token.start[0]
        if token.type == tokenize.NAME and (line, token.string) not in seen:
            seen.add((line, token.string))
            yield from _in_identifier(name, line, token.string, lines[line - 1].strip())
        elif token.type == tokenize.COMMENT:
            yield from _in_prose(name, token.string, line)
        elif token.type == tokenize.STRING and (" " in token.string or token.string.startswith('"""')):
            yield from _in_prose(name, _plain(token.string), line)
        elif token.type == _F_STRING_TEXT and " " in token.string:
            yield from _in_prose(name, token.string, line)


def _plain(literal: str) -> str:
    try:
        value = ast.literal_eval(literal)
    except (ValueError, SyntaxError):
        return literal  # an f-string
    return value if isinstance(value, str) else ""


def _in_identifier(name: str, line: int, identifier: str, text: str) -> Iterator[Word]:
    for part in _words_in(identifier):
        yield Word(name, line, part, IDENTIFIERS[part.lower()], text)


@cache
def _words_in(identifier: str) -> list[str]:
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", identifier)
    return [part for part in parts if part.lower() in IDENTIFIERS]


def _in_prose(name: str, text: str, first: int) -> Iterator[Word]:
    text = re.sub(r"```.*?```", lambda m: "\n" * m[0].count("\n"), text, flags=re.DOTALL)
    text = re.sub(r"`[^`\n]*`", "``", text)
    for found in _PROSE.finditer(text):
        number = int(str(found.lastgroup)[1:])
        start = text.rfind("\n", 0, found.start()) + 1
        end = text.find("\n", found.end())
        whole = text[start : len(text) if end < 0 else end].strip()
        yield Word(name, first + text.count("\n", 0, found.start()), found[0], _INSTEAD[number], whole)


if __name__ == "__main__":
    places = tuple(str(Path(given).resolve().relative_to(ROOT)) for given in sys.argv[1:]) or PLACES
    left = [word for path in files(places) for word in words_of(path)]
    print(*left, sep="\n")
    print(f"{len(left)} words in {len({word.path for word in left})} files")
    sys.exit(bool(left))

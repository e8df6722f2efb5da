"""Count what docstrings and errors say, and fail below the project's marks.

    python tools/docstrings.py [--list] [FOLDER or FILE ...]

Public modules, classes, functions, methods and properties of the package are counted; `--list`, a folder or a
missed mark lists each one that falls short. The marks hold for the package as a whole.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "roboyard"

DOCUMENTED, SHAPED, QUOTED = 1.0, 1.0, 0.9
"""Least shares: names with a docstring, array functions that state a shape, raises that quote a value."""

ARRAY = re.compile(r"\b(Array|ArrayLike|NDArray|ndarray|Floats|Ints|Indices)\b")
SHAPE = re.compile(r"\((?:\.\.\.|[\w*+\-/ ]+),[\w*+\-/., ]*\)")
UNIT_FIRST = re.compile(
    r"^(S|M|Kg|Rad|Hz|M/s|Rad/s|N|Pixels?)(?:$|[.,;]| (?:or|of|from|since|between|between|for|,))"
)
PYBULLET = SOURCE / "pybullet"
"""Its texts are PyBullet's own, which scripts compare."""

Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


@dataclass
class Count:
    """How many of all do, and which do not."""

    title: str
    mark: float
    good: int = 0
    short: list[str] = field(default_factory=list)

    def add(self, is_good: bool, where: str) -> None:
        self.good += is_good
        if not is_good:
            self.short.append(where)

    @property
    def share(self) -> float:
        return self.good / max(1, self.good + len(self.short))

    def __str__(self) -> str:
        every = self.good + len(self.short)
        return f"{self.title}: {self.good} of {every}, {self.share:.1%} (mark {self.mark:.0%})"


def main(given: list[str]) -> int:
    """Print the counts; 1 where a mark is missed."""
    listed = "--list" in given
    places = [Path(word).resolve() for word in given if not word.startswith("--")] or [SOURCE]
    files = sorted(f for p in places for f in ([p] if p.is_file() else p.rglob("*.py")))
    documented = Count("public names documented", DOCUMENTED)
    shaped = Count("array functions that state a shape", SHAPED)
    quoted = Count("raised errors that quote a value", QUOTED)
    units = Count("docstrings that spell units as units", 1.0)
    for file in files:
        tree = ast.parse(file.read_text(encoding="utf-8"))
        name = file.relative_to(ROOT).as_posix()
        documented.add(ast.get_docstring(tree) is not None, f"{name}: module")
        for owner, node in _public(tree):
            where, text = f"{name}:{node.lineno} {owner}{node.name}", ast.get_docstring(node) or ""
            documented.add(bool(text), where)
            units.add(not UNIT_FIRST.match(text), f"{where}: {text[:40]!r}")
            if not isinstance(node, ast.ClassDef) and _takes_arrays(node):
                shaped.add(bool(SHAPE.search(text)), where)
        for node in ast.walk(tree):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and node.exc.args:
                if file.is_relative_to(PYBULLET) and "error" in ast.unparse(node.exc.func).lower():
                    continue
                is_quoted = any(not _is_constant(argument) for argument in node.exc.args)
                quoted.add(is_quoted, f"{name}:{node.lineno} {ast.unparse(node)[:90]}")
    counts = (documented, shaped, quoted, units)
    for count in counts:
        if listed or given or count.share < count.mark:
            print(*(f"    {where}" for where in count.short), sep="\n")
        print(count)
    return int(any(count.share < count.mark for count in counts))


def _public(tree: ast.Module | ast.ClassDef, owner: str = "") -> Iterator[tuple[str, Definition]]:
    for node in tree.body:
        if not isinstance(node, Definition) or node.name.startswith("_"):
            continue
        decorators = {ast.unparse(d) for d in node.decorator_list}
        if any(d.endswith((".setter", "overload")) for d in decorators):
            continue
        yield owner, node
        if isinstance(node, ast.ClassDef):
            yield from _public(node, f"{owner}{node.name}.")


def _takes_arrays(node: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    arguments = node.args
    every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    annotations = [a.annotation for a in every if a.annotation is not None]
    annotations += [node.returns] if node.returns is not None else []
    return any(ARRAY.search(ast.unparse(annotation)) for annotation in annotations)


def _is_constant(message: ast.expr) -> bool:
    match message:
        case ast.Constant():
            return True
        case ast.JoinedStr(values=values):
            return not any(isinstance(value, ast.FormattedValue) for value in values)
        case ast.BinOp(left=left, right=right):
            return _is_constant(left) and _is_constant(right)
    return False


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

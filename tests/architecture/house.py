"""Files of the package, each parsed once, and the graph of its imports: type-only and lazy ones included."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src"
PACKAGE = "roboyard"

LAYERS = (
    ("_bootstrap",),
    ("errors", "_arrays", "_bytecode", "_digests", "_lazy", "_numba", "_threads", "_version", "untrusted"),
    ("_libraries", "_mujoco_parts", "_records"),
    ("_mujoco", "_numpy", "_qhull"),
    ("transforms", "paths", "config", "assets", "native", "pybullet_data"),
    ("shapes", "whole_moves", "_second_process"),
    ("description", "rendering"),
    ("kinematics", "audit"),
    ("repair", "morphology"),
    ("export",),
    ("sim",),
    ("sensors",),
    ("robots",),
    ("scenes", "planning", "reports"),
    ("recording", "skills", "validation"),
    ("teleop", "demo", "diagnosis", "importer"),
    ("viewer", "omnigibson"),
    ("envs", "pybullet"),
    ("cli",),
    ("__init__",),
    ("__main__",),
)
"""Lowest first; folders on one line do not import each other. docs/architecture.md draws them."""


@dataclass(frozen=True, slots=True)
class Import:
    """One import of one of our modules by another."""

    importer: str
    imported: str
    line: int


@dataclass(frozen=True, slots=True)
class Call:
    """A call of an attribute."""

    owner: str
    """Name of what has the attribute; an empty text where it is no name."""
    attribute: str
    line: int


@dataclass(frozen=True, slots=True)
class Outline:
    """The parts of a file that its rules are about."""

    docstring: str
    exports: frozenset[str]
    """Names in `__all__`."""
    imports_from: tuple[tuple[str, str], ...]
    """Module and name of each `from ... import` at the top level."""
    imports: tuple[tuple[str, int], ...]
    """Module of the package, and line."""
    calls: tuple[Call, ...]


@cache
def modules() -> dict[str, Path]:
    """Module name to file."""
    found = {}
    for path in sorted((SOURCE / PACKAGE).rglob("*.py")):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def imports() -> list[Import]:
    """All imports inside the package; an import of a package's name counts as one of its `__init__`."""
    found = [
        Import(name, imported, line)
        for name, path in modules().items()
        for imported, line in outline(path).imports
        if imported != name
    ]
    assert len(found) > 1000, "the import graph was not read"
    return found


@cache
def outline(path: Path) -> Outline:
    """Parse a file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree))
    return Outline(
        docstring=(ast.get_docstring(tree) or "").strip(),
        exports=_exports_of(tree),
        imports_from=tuple(
            (node.module, alias.name)
            for node in tree.body
            if isinstance(node, ast.ImportFrom) and node.module
            for alias in node.names
        ),
        imports=tuple(_imports_of(path, nodes)),
        calls=tuple(_calls_of(nodes)),
    )


def _exports_of(tree: ast.Module) -> frozenset[str]:
    for node in tree.body:
        match node:
            case ast.Assign(targets=[ast.Name(id="__all__")], value=ast.List(elts=elements)):
                return frozenset(str(e.value) for e in elements if isinstance(e, ast.Constant))
    return frozenset()


def _calls_of(nodes: list[ast.AST]) -> Iterator[Call]:
    for node in nodes:
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            owner = node.func.value
            yield Call(owner.id if isinstance(owner, ast.Name) else "", node.func.attr, node.lineno)


def _imports_of(path: Path, nodes: list[ast.AST]) -> Iterator[tuple[str, int]]:
    known = modules()
    for node in nodes:
        match node:
            case ast.ImportFrom(module=str(module), names=names, level=0) if module.split(".")[0] == PACKAGE:
                for alias in names:
                    whole = f"{module}.{alias.name}"
                    yield (whole if whole in known else module), node.lineno
            case ast.ImportFrom(level=level) if level:
                raise AssertionError(f"{path}: relative import in line {node.lineno}; import by full name")
            case ast.Import(names=names):
                for alias in names:
                    if alias.name.split(".")[0] == PACKAGE:
                        yield alias.name, node.lineno
            case ast.Constant(value=str(text)) if text != PACKAGE and text in known:
                yield text, node.lineno  # lazily loaded: `lazy_module("roboyard.sim.stepping.kernels")`


def folder(module: str) -> str:
    """First folder below the package, or the file's own name where it lies in none."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else "__init__"


def circles(edges: list[Import]) -> list[list[str]]:
    """Sets of two or more files that import one another (strongly connected components, Tarjan 1972)."""
    neighbours: dict[str, set[str]] = {}
    for edge in edges:
        neighbours.setdefault(edge.importer, set()).add(edge.imported)
        neighbours.setdefault(edge.imported, set())
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []
    for start in sorted(neighbours):
        work: list[tuple[str, Iterator[str]]] = []
        if start not in index:
            index[start] = low[start] = len(index)
            stack.append(start)
            work.append((start, iter(sorted(neighbours[start]))))
        while work:
            node, rest = work[-1]
            following = next(rest, None)
            if following is None:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    group = stack[stack.index(node) :]
                    del stack[stack.index(node) :]
                    if len(group) > 1:
                        found.append(sorted(group))
            elif following not in index:
                index[following] = low[following] = len(index)
                stack.append(following)
                work.append((following, iter(sorted(neighbours[following]))))
            elif following in stack:
                low[node] = min(low[node], index[following])
    return found

"""Evaluate the Python expressions of xacro files without the means to run other code.

Xacro evaluates `${...}` and `$(eval ...)` with Python's `eval`, from which attributes of plain objects lead
to every loaded module. Here an expression is parsed first: attributes that begin with an underscore, and
names with two, are refused, and each attribute access goes through `attribute`, which allows keys of mappings
and the methods of plain data that do not format.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from functools import lru_cache
from types import CodeType
from typing import Any

MAX_CHARACTERS = 20_000
"""Longest expression."""
_GUARD = "__attribute"
"""No expression may use a name that begins so."""
_FORBIDDEN = (ast.Await, ast.Yield, ast.YieldFrom, ast.NamedExpr)
_STRING_METHODS = """
capitalize casefold count endswith find index isalnum isalpha isdigit islower isnumeric isspace isupper
join lower lstrip partition removeprefix removesuffix replace rfind rindex rpartition rsplit rstrip split
splitlines startswith strip swapcase title upper zfill
"""
_METHODS = tuple(
    (kind, frozenset(names.split()))
    for kind, names in (
        (str, _STRING_METHODS),
        (dict, "copy get items keys pop setdefault update values"),
        (list, "append copy count extend index insert pop remove reverse sort"),
        (tuple, "count index"),
        (set, "add copy difference intersection union"),
        (int, "real imag bit_length"),
        (float, "real imag is_integer"),
    )
)


class ExpressionError(Exception):
    """An expression uses what no robot description needs."""


def evaluate(expression: str, names: Any, more: Any = None, mappings: tuple[type, ...] = ()) -> Any:
    """Return the value of an expression.

    Args:
        expression: one Python expression.
        names: the names it may use, a dictionary; its `__builtins__` are replaced.
        more: more names, which are looked up first.
        mappings: types whose keys are read as attributes.

    Raises:
        ExpressionError: the expression is refused.
        Exception: the error that the expression raises.
    """
    code = _compiled(expression.strip())

    def guarded(value: Any, name: str) -> Any:
        return attribute(value, name, mappings)

    names["__builtins__"] = {_GUARD: guarded}
    return eval(code, names, more)  # noqa: S307 - parsed and guarded above


def attribute(value: Any, name: str, mappings: tuple[type, ...] = ()) -> Any:
    """Return `value.name` where that is data or a harmless method.

    Raises:
        ExpressionError: it is neither.
    """
    if isinstance(value, mappings):
        if isinstance(value, Mapping) and name in value:
            return value[name]
        if not isinstance(value, dict):
            return getattr(value, name)
    for kind, methods in _METHODS:
        if isinstance(value, kind) and name in methods:
            return getattr(value, name)
    raise ExpressionError(f"the attribute {name!r} of {_kind(value)} is not allowed")


def _kind(value: Any) -> str:
    return f"a {type(value).__name__}"


@lru_cache(maxsize=4096)
def _compiled(expression: str) -> CodeType:
    if len(expression) > MAX_CHARACTERS:
        raise ExpressionError(f"{len(expression)} characters are more than the {MAX_CHARACTERS} allowed")
    tree = ast.parse(expression, "<expression>", "eval")
    for node in ast.walk(tree):
        if isinstance(node, _FORBIDDEN):
            raise ExpressionError(f"{type(node).__name__} is not allowed in an expression")
        name = _name_of(node)
        hidden = "__" if isinstance(node, ast.Name) else "_"  # `_size` may be a property of the file
        if name is not None and name.startswith(hidden):
            begins = "two underscores" if hidden == "__" else "an underscore"
            raise ExpressionError(f"the name {name!r} is not allowed: it begins with {begins}")
    guarded = ast.fix_missing_locations(_Guarded().visit(tree))
    return compile(guarded, "<expression>", "eval")


def _name_of(node: ast.AST) -> str | None:
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        return node.attr
    if isinstance(node, ast.arg):
        return node.arg
    return None


class _Guarded(ast.NodeTransformer):
    """Turns each `a.b` into `__attribute(a, "b")`."""

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        call = ast.Call(
            func=ast.Name(id=_GUARD, ctx=ast.Load()),
            args=[self.visit(node.value), ast.Constant(value=node.attr)],
            keywords=[],
        )
        return ast.copy_location(call, node)

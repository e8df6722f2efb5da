"""The entry of a front: reads numbers and vectors, calls the core, makes tuples. Compiled with numba."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from roboyard.native.entry_parts import HAS_LENGTH, ITEM
from roboyard.native.python_functions import PYTHON
from roboyard.native.signatures import FrontSignature

_HELPERS = """
def number(given):
    value = PyFloat_AsDouble(given)
    if value == -1.0 and PyErr_Occurred() != 0:
        PyErr_Clear()
        return np.nan
    return value

def is_ignored(keywords, name):
    if PyTuple_Size(keywords) != 1:
        return False
    given = PyTuple_GetItem(keywords, 0)
    if PyUnicode_GetLength(given) != len(name):
        return False
    for place in range(len(name)):
        if PyUnicode_ReadChar(given, place) != name[place]:
            return False
    return True
"""


def helpers(part: Callable[[Any], Any]) -> dict[str, Any]:
    """Return name to compiled function of what an entry calls; `part` compiles one."""
    values: dict[str, Any] = {"np": np, **PYTHON}
    exec(compile(_HELPERS + ITEM + HAS_LENGTH, "<front>", "exec"), values)  # noqa: S102 - our own source
    names = ("number", "item", "has_length", "is_ignored")
    return {name: part(values[name]) for name in names}


def front_source(signature: FrontSignature) -> str:
    """Return the source of the function that a call comes to: the callee, its arguments, count and keywords.

    What it does not take goes to the Python function in the end; a number that is not finite, too.
    """
    count = len(signature.arguments)
    passed, lines, sizes = [], [], []
    for k, argument in enumerate(signature.arguments):
        if argument.length:
            sizes.append(f"has_length(given[{k}], {argument.length})")
        for place in range(max(1, argument.length)):
            name = f"a{len(passed)}"
            read = f"item(given[{k}], {place})" if argument.length else f"number(given[{k}])"
            lines.append(f"{name} = {_rounded(argument.dtype, read)}")
            passed.append(name)
    lines.append(f"total = {' + '.join(passed)}")
    lines.append("if total - total == 0.0:")
    inner = [f"result = _loop({', '.join(passed)})"]
    made, place = [], 0
    for result in signature.results:
        for _ in range(max(1, result.length)):
            made.append(f"r{place}")
            inner.append(f"r{place} = {_rounded(result.dtype, f'result[{place}]')}")
            place += 1
    inner += [f"total = {' + '.join(made)}", "if total - total == 0.0:"]
    inner += [f"    {line}" for line in _tuples(signature)]
    takes = f"keywords == 0 or is_ignored(keywords, {tuple(signature.ignored.encode())})"
    body = [f"    {line}" for line in (*lines, *(f"    {line}" for line in inner))]
    head = f"if ({takes if signature.ignored else 'keywords == 0'}) and count == {count}:"
    if sizes:
        body = [f"    if {' and '.join(sizes)}:", *(f"    {line}" for line in body)]
    lines = [head, *body, "return PyObject_Vectorcall(callee, given, count, keywords)"]
    return "\n    ".join(["def entry(callee, given, count, keywords):", *lines])


def _rounded(dtype: str, value: str) -> str:
    return f"np.float64(np.float32({value}))" if dtype == "float32" else value


def _tuples(signature: FrontSignature) -> list[str]:
    """Return the lines that make the results r0, r1, ... tuples and return them."""
    lines, names, place = [], [], 0
    for k, result in enumerate(signature.results):
        if not result.length:
            names.append(f"PyFloat_FromDouble(r{place})")
            place += 1
            continue
        names.append(f"t{k}")
        lines.append(f"t{k} = PyTuple_New({result.length})")
        for n in range(result.length):
            lines.append(f"PyTuple_SetItem(t{k}, {n}, PyFloat_FromDouble(r{place}))")
            place += 1
    if len(names) == 1:
        return [*lines, f"return {names[0]}"]
    lines.append(f"whole = PyTuple_New({len(names)})")
    lines += [f"PyTuple_SetItem(whole, {k}, {name})" for k, name in enumerate(names)]
    return [*lines, "return whole"]

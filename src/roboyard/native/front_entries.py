"""The entry of a front: reads numbers and vectors, calls the core, makes tuples. Compiled with numba."""

from __future__ import annotations

import sys
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

def is_named(text, size, name):
    for place in range(len(name) - 1):
        if word(text, place) != name[place]:
            return False
    return word(text + size - 8, 0) == name[len(name) - 1]

def is_short(given, name):
    for place in range(len(name)):
        if PyUnicode_ReadChar(given, place) != name[place]:
            return False
    return True
"""


def helpers(part: Callable[[Any], Any], word: Any) -> dict[str, Any]:
    """Return name to compiled function of what an entry calls; `part` compiles one, `word` reads memory."""
    values: dict[str, Any] = {"np": np, "word": word, **PYTHON}
    exec(compile(_HELPERS + ITEM + HAS_LENGTH, "<front>", "exec"), values)  # noqa: S102 - our own source
    names = ("number", "item", "has_length", "is_named", "is_short")
    return {name: part(values[name]) for name in names}


def front_source(signature: FrontSignature) -> str:
    """Return the source of the function that a call comes to: the callee, its arguments, count and keywords.

    What it does not take goes to the Python function in the end; a number that is not finite, too.
    """
    passed, lines, sizes = [], [], []
    for k, argument in enumerate(signature.arguments):
        if argument.length:
            sizes.append(f"has_length(read[{k}], {argument.length})")
        for place in range(max(1, argument.length)):
            name = f"a{len(passed)}"
            read = f"item(read[{k}], {place})" if argument.length else f"number(read[{k}])"
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
    body = [f"    {line}" for line in (*lines, *(f"    {line}" for line in inner))]
    if sizes:
        body = [f"    if {' and '.join(sizes)}:", *(f"    {line}" for line in body)]
    last = "return PyObject_Vectorcall(callee, given, count, keywords)"
    lines = [*_places(signature), "if fits:", *body, last]
    return "\n    ".join(["def entry(callee, given, count, keywords):", *lines])


def _places(signature: FrontSignature) -> list[str]:
    """Return the lines that make `read` the arguments in their order, and `fits` whether these are all."""
    count = len(signature.arguments)
    lines = [
        f"read, fits = given, count == {count}",
        "if keywords != 0:",
        f"    read, fits, total = words(), count <= {count}, count",
        f"    for k in range({count}):",
        "        if k < count:",
        "            read[k] = given[k]",
        "    for k in range(PyTuple_Size(keywords)):",
        "        name, place = PyTuple_GetItem(keywords, k), -1",
        "        size, text = PyUnicode_GetLength(name), PyUnicode_AsUTF8AndSize(name, 0)",
        "        if text == 0:",
        "            PyErr_Clear()",
        "            size = -1",
    ]
    ways = "if"
    for place, name in enumerate((*signature.names, signature.ignored)):
        if name:
            lines += [
                f"        {ways} size == {len(name)} and {_is_it(name)}:",
                f"            place = {place}",
            ]
            ways = "elif"
    return [
        *lines,
        f"        if place == {count}:",
        "            continue",
        "        fits = fits and place >= count",
        "        if fits:",
        "            read[place] = given[count + k]",
        "            total += 1",
        f"    fits = fits and total == {count}",
    ]


def _is_it(name: str) -> str:
    """Return what compares a keyword with a name: eight bytes at once, the last ones up to its end."""
    text = name.encode()
    if len(text) < 8:
        return f"is_short(name, {tuple(text)})"
    starts = [*range(0, len(text) - 7, 8), len(text) - 8]
    words = tuple(int.from_bytes(text[k : k + 8], sys.byteorder, signed=True) for k in starts)
    return f"is_named(text, size, {words})"


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

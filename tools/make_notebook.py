"""Run a script of `# %%` cells and write it as a notebook with its outputs.

    python tools/make_notebook.py [tools/tutorial_cells.py [examples/pybullet_tutorial.ipynb]]

Cells run in order in this process; what a cell prints and the
picture in its last line become its outputs, pictures as small PNGs.
"""

from __future__ import annotations

import argparse
import ast
import base64
import contextlib
import io
import json
import os
import re
import tempfile
from pathlib import Path
from typing import Any

SCRIPT = Path(__file__).parent / "tutorial_cells.py"
NOTEBOOK = Path(__file__).parent.parent / "examples" / "pybullet_tutorial.ipynb"
_CELL = re.compile(r"^# %% ?(.*)$", re.MULTILINE)


def cells_of(script: str) -> list[tuple[str, str]]:
    """Title and source of each cell; the first one is the docstring's text, without source."""
    parts = _CELL.split(script)
    head = ast.get_docstring(ast.parse(parts[0])) or ""
    pairs = zip(parts[1::2], parts[2::2], strict=True)
    return [(head, ""), *((title, source.strip("\n")) for title, source in pairs)]


def notebook(script: str, outputs: list[list[dict[str, Any]]] | None = None) -> dict[str, Any]:
    """The notebook of a script, as nbformat 4.5 has it."""
    cells: list[dict[str, Any]] = []
    for number, (title, source) in enumerate(cells_of(script)):
        text = title if not number else f"## {title}"
        cells.append(
            {"cell_type": "markdown", "id": f"title-{number}", "metadata": {}, "source": _lines(text)}
        )
        if source:
            cells.append(
                {
                    "cell_type": "code",
                    "id": f"cell-{number}",
                    "metadata": {},
                    "execution_count": number,
                    "source": _lines(source),
                    "outputs": outputs[number] if outputs else [],
                }
            )
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    metadata = {"kernelspec": kernel, "language_info": {"name": "python"}}
    return {"cells": cells, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}


def run(script: str) -> list[list[dict[str, Any]]]:
    """Outputs of each cell."""
    values: dict[str, Any] = {"__name__": "__main__"}
    return [_run_cell(source, values, number) for number, (_, source) in enumerate(cells_of(script))]


def _run_cell(source: str, values: dict[str, Any], number: int) -> list[dict[str, Any]]:
    tree = ast.parse(source)
    last = tree.body[-1] if tree.body else None
    if isinstance(last, ast.Expr):
        tree.body.pop()
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, f"cell {number}", "exec"), values)
        expression = ast.Expression(last.value) if isinstance(last, ast.Expr) else None
        result = None if expression is None else eval(compile(expression, f"cell {number}", "eval"), values)
    outputs: list[dict[str, Any]] = []
    if printed.getvalue():
        outputs.append({"output_type": "stream", "name": "stdout", "text": _lines(printed.getvalue())})
    if result is not None:
        shown = {"metadata": {}, "execution_count": number, "output_type": "execute_result"}
        outputs.append({**shown, "data": _data(result)})
    return outputs


def _data(result: Any) -> dict[str, Any]:
    """Return what a notebook front end shows for a value."""
    if hasattr(result, "save") and hasattr(result, "size"):
        raw = io.BytesIO()
        result.convert("RGB").quantize(64).save(raw, "PNG", optimize=True)
        picture = base64.b64encode(raw.getvalue()).decode()
        return {"image/png": picture, "text/plain": [f"<picture of {result.size[0]} by {result.size[1]}>"]}
    return {"text/plain": _lines(repr(result))}


def _lines(text: str) -> list[str]:
    return text.splitlines(keepends=True)


def main() -> None:
    """Write the notebook."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("script", type=Path, nargs="?", default=SCRIPT)
    options.add_argument("notebook", type=Path, nargs="?", default=NOTEBOOK)
    given = options.parse_args()
    path, target = given.script.resolve(), given.notebook.resolve()
    script = path.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        outputs = run(script)
        os.chdir(path.parent)
    made = json.dumps(notebook(script, outputs), indent=1, ensure_ascii=False)
    target.write_text(made + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

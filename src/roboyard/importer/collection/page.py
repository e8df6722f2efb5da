"""The table of a collection, as CSV, as JSON, and as a page with a picture of each robot."""

from __future__ import annotations

import csv
import io
import json
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from html import escape
from pathlib import Path
from urllib.parse import quote

from roboyard.importer.collection.tasks import TaskResult
from roboyard.reports.html import badge, page, plural

_STYLE = """
.all{display:grid;grid-template-columns:repeat(auto-fill,minmax(11rem,1fr));gap:.8rem;margin:1rem 0}
.one{border:1px solid var(--line);border-radius:.4rem;padding:.5rem;overflow-wrap:anywhere}
.one img{width:100%;height:auto;border-radius:.3rem}
"""
_KINDS = {"imported": "good", "refused": "bad"}
_HEADS = (
    "name",
    "file",
    "outcome",
    "kind",
    "links",
    "joints",
    "mass",
    "gates",
    "warnings",
    "seconds",
    "message",
)


def write_tables(folder: Path, source: Path, results: Sequence[TaskResult]) -> None:
    """Write `table.csv`, `table.json` and `index.html`, each whole.

    Args:
        folder: where they are written.
        source: folder of the collection.
        results: of all robots.
    """
    folder.mkdir(parents=True, exist_ok=True)
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(_HEADS)
    writer.writerows(_row(result) for result in results)
    _write(folder / "table.csv", text.getvalue())
    _write(folder / "table.json", json.dumps([asdict(result) for result in results], indent=1) + "\n")
    _write(folder / "index.html", _page(folder, source, results))


def _write(file: Path, text: str) -> None:
    draft = file.with_name(f".{file.name}.{os.getpid()}")
    draft.write_text(text, encoding="utf-8", errors="backslashreplace", newline="")
    draft.replace(file)


def _row(result: TaskResult) -> list[str]:
    facts = result.facts
    passed, count = facts.get("gates") or (0, 0)
    return [
        result.name,
        result.shown,
        result.outcome,
        *(str(facts.get(key, "")) for key in ("kind", "links", "joints", "mass")),
        f"{passed}/{count}" if count else "",
        str(facts.get("warnings", "")),
        f"{result.seconds:.1f}",
        result.message,
    ]


def _page(folder: Path, source: Path, results: Sequence[TaskResult]) -> str:
    counts = Counter(result.outcome for result in results)
    labels = " ".join(badge(f"{count} {kind}", _KINDS.get(kind, "look")) for kind, count in counts.items())
    seconds = sum(result.seconds for result in results)
    body = [
        f"<h1>{escape(source.name)}</h1>",
        f'<p>{labels}</p><p class="facts">{plural(len(results), "robot")} below '
        f"<code>{escape(str(source))}</code>; {seconds:.0f} s of imports</p>",
        '<div class="all">',
        *(_card(folder, result) for result in results),
        "</div>",
        "<table><tr>" + "".join(f"<th>{escape(head)}</th>" for head in _HEADS) + "</tr>",
        *(
            "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in _row(result)) + "</tr>"
            for result in results
        ),
        "</table>",
    ]
    return page(f"{source.name}: {plural(len(results), 'robot')}", body, _STYLE)


def _card(folder: Path, result: TaskResult) -> str:
    picture, report = result.facts.get("picture"), result.facts.get("report")
    name = escape(result.name)
    image = ""
    if picture is not None and Path(picture).is_file():
        image = f'<img alt="{name}" loading="lazy" src="{_link(folder, picture)}">'
    title = f'<a href="{_link(folder, report)}">{name}</a>' if report else name
    note = f'<br><span class="dim">{escape(result.message[:160])}</span>' if result.message else ""
    label = badge(result.outcome, _KINDS.get(result.outcome, "look"))
    return f'<div class="one">{image}<div>{label}{title}{note}</div></div>'


def _link(folder: Path, file: str) -> str:
    """Return the address of a file from the page's folder."""
    return quote(Path(os.path.relpath(file, folder)).as_posix())

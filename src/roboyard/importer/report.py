"""`import_report.html`: one self-contained page of what an import made, to be looked at rather than read."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

from roboyard.importer.context import ImportContext
from roboyard.importer.model import ImportedRobot
from roboyard.importer.report_pictures import KINDS, sights_of

MAX_LINKS_PICTURED = 40
_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:76rem;padding:0 1rem;color:#1c2430}
h1{margin:0}h2{margin:2rem 0 .5rem;border-bottom:1px solid #dde2e8}
table{border-collapse:collapse}th,td{text-align:left;vertical-align:top;padding:.25rem .7rem;
border-bottom:1px solid #e6eaef}th{color:#5b6675}td.n{text-align:right}
.good{color:#23803a}.look{color:#b26200}figure{margin:.4rem .8rem .4rem 0;display:inline-block}
figure img{max-width:100%;border:1px solid #dde2e8;border-radius:.3rem}
figcaption{color:#5b6675;font-size:.9em}
code{background:#f1f4f7;padding:.05rem .3rem;overflow-wrap:anywhere}
"""


def write_report(robot: ImportedRobot, context: ImportContext) -> None:
    """Write the page beside the other files of the package."""
    page = report_page(robot, context.log.facts, context.log.warnings)
    (context.build / "import_report.html").write_text(page, encoding="utf-8")


def report_page(robot: ImportedRobot, facts: Mapping[str, Any], warnings: Sequence[Any]) -> str:
    """The page's text; every name in it is escaped."""
    title = escape(robot.name)
    parts = [
        "<!doctype html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>Import of {title}</title>',
        f"<style>{_STYLE}</style></head><body><h1>{title}</h1>",
        f"<p>{escape(_summary(robot, facts))}</p>",
    ]
    sights = {kind: sights_of(robot, kind) for kind in KINDS}
    shown = {kind: sight for kind, sight in sights.items() if not sight.is_empty}
    parts += ["<h2>The robot</h2>", *(_figure(s.picture(), kind) for kind, s in shown.items())]
    parts += _look_at(warnings)
    parts += _validation(facts.get("validation", {}))
    parts += _mends(facts)
    parts += _links(robot, facts)
    names = [
        link.name for link in robot.description.links if any(link.name in s.bounds for s in shown.values())
    ]
    if names:
        parts.append("<h2>Link by link</h2>")
    for name in names[:MAX_LINKS_PICTURED]:
        parts.append(f"<h3><code>{escape(name)}</code></h3>")
        parts += [
            _figure(sight.picture((name,), width=240, height=180), kind)
            for kind, sight in shown.items()
            if name in sight.bounds
        ]
    if len(names) > MAX_LINKS_PICTURED:
        parts.append(f"<p>{len(names) - MAX_LINKS_PICTURED} more links are not pictured.</p>")
    parts.append("</body></html>")
    return "\n".join(parts) + "\n"


def _summary(robot: ImportedRobot, facts: Mapping[str, Any]) -> str:
    description = robot.description
    moving = sum(joint.is_moving for joint in description.joints)
    mass = sum(link.inertial.mass for link in description.links if link.inertial is not None)
    base = ", on a gliding base" if robot.holonomic else ""
    came = str(facts.get("source", {}).get("verdict", "")).strip()
    return f"{len(description.links)} links, {moving} moving joints, {mass:.2f} kg{base}. {came}"


def _figure(png: bytes, caption: str) -> str:
    data = base64.b64encode(png).decode()
    text = escape(caption)
    image = f'<img alt="{text}" src="data:image/png;base64,{data}">'
    return f"<figure>{image}<figcaption>{text}</figcaption></figure>"


def _look_at(warnings: Sequence[Any]) -> list[str]:
    if not warnings:
        return ["<h2>Look at next</h2>", '<p class="good">Nothing stands out.</p>']
    rows = [f"<li>{escape(f'{w.element}: ' if w.element else '')}{escape(w.message)}</li>" for w in warnings]
    return ["<h2>Look at next</h2>", '<ul class="look">', *rows, "</ul>"]


def _validation(results: Mapping[str, Sequence[str]]) -> list[str]:
    rows = []
    for kind, problems in results.items():
        text = "; ".join(problems) if problems else "read back and found equal"
        rows.append((kind, text))
    return ["<h2>Read back</h2>", *_table(("file", "result"), rows)] if rows else []


def _mends(facts: Mapping[str, Any]) -> list[str]:
    mends = facts.get("mends", [])
    if not mends:
        return []
    rows = [(m.get("element", ""), f"{m.get('before', '')} → {m.get('after', '')}") for m in mends[:60]]
    parts = ["<h2>Put right on the way in</h2>", *_table(("element", "what"), rows)]
    if len(mends) > len(rows):
        parts.append(f"<p>{len(mends) - len(rows)} more stand in import_log.json.</p>")
    return parts


def _links(robot: ImportedRobot, facts: Mapping[str, Any]) -> list[str]:
    collision, spheres = facts.get("collision", {}), facts.get("spheres", {})
    planned = robot.planning.spheres if robot.planning is not None else {}
    rows = []
    for link in robot.description.links:
        made = collision.get(link.name, {})
        excess = [m["excess_volume"] for m in made.get("meshes", ()) if m.get("excess_volume") is not None]
        fit = spheres.get(link.name, {})
        rows.append(
            (
                link.name,
                "" if link.inertial is None else f"{link.inertial.mass:.3f}",
                str(made.get("way", "")),
                str(len(link.collisions)),
                "" if not excess else f"{max(excess):.2f}",
                str(len(planned.get(link.name, ()))),
                "" if "coverage" not in fit else f"{fit['coverage']:.3f}",
            )
        )
    heads = ("link", "mass, kg", "collision", "shapes", "excess volume", "spheres", "coverage")
    return ["<h2>Links</h2>", *_table(heads, rows)]


def _table(heads: Iterable[str], rows: Iterable[Sequence[str]]) -> list[str]:
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    body = ["<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows]
    return [f"<table><tr>{head}</tr>", *body, "</table>"]

"""Rows of the import report, one a link: pictures and figures."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING, Any

from roboyard.importer.report.pictures import link_pictures, resting_frames
from roboyard.reports.html import figure, plural

if TYPE_CHECKING:
    from roboyard.description.model import Link
    from roboyard.description.robot_model import RobotModel

MAX_LINKS_PICTURED = 40
WIDTH, HEIGHT = 300, 200


def link_rows(robot: RobotModel, facts: Mapping[str, Any]) -> list[str]:
    """Return an HTML row for each link that has a shape or a mass; the others are listed in one line."""
    planned = robot.planning.spheres if robot.planning is not None else {}
    frames = resting_frames(robot.description)
    parts, bare, pictured = [], [], 0
    for link in robot.description.links:
        if not (link.visuals or link.collisions or link.inertial or planned.get(link.name)):
            bare.append(link.name)
            continue
        pictures = (
            link_pictures(robot, link.name, frames, width=WIDTH, height=HEIGHT)
            if pictured < MAX_LINKS_PICTURED
            else {}
        )
        pictured += bool(pictures)
        shown = "".join(figure(png, kind, WIDTH) for kind, png in pictures.items())
        figures = "".join(
            f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>"
            for name, value in _figures(robot, link, facts)
        )
        parts.append(
            f'<div class="link"><div><h3><code>{escape(link.name)}</code></h3><table>{figures}</table></div>'
            f'<div class="pictures">{shown}</div></div>'
        )
    if not parts:
        return []
    out = ["<h2>Links</h2>", f'<div class="links">{"".join(parts)}</div>']
    if pictured == MAX_LINKS_PICTURED and len(parts) > pictured:
        out.append(f'<p class="dim">{len(parts) - pictured} more links are not pictured.</p>')
    if bare:
        names = ", ".join(f"<code>{escape(name)}</code>" for name in bare)
        out.append(f'<p class="dim">{plural(len(bare), "link")} without shape or mass: {names}</p>')
    return out


def _figures(robot: RobotModel, link: Link, facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the known figures of a link, each with its name."""
    known = facts.get("links", {}).get(link.name, {})
    made = facts.get("collision", {}).get(link.name, {})
    spheres = robot.planning.spheres.get(link.name, ()) if robot.planning is not None else ()
    out: list[tuple[str, str]] = []
    if known.get("size"):
        out.append(("size", " × ".join(f"{1e3 * extent:.0f}" for extent in known["size"]) + " mm"))
    if link.inertial is not None:
        out.append(("mass", f"{link.inertial.mass:.3f} kg"))
    method = str(made.get("method", ""))
    words = {"keep": "unchanged", "none": "none, as configured", "convex": "one hull per mesh"}
    methods = {m.get("method") for m in made.get("meshes", ())}
    if method == "coacd":
        words["coacd"] = "convex parts" if methods - {"hull"} else "one hull each, already tight"
    if method:
        out.append(("collision", words.get(method, method)))
    out.append(("shapes", str(len(link.collisions))))
    if known.get("excess") is not None:
        out.append(("excess volume", f"{known['excess']:.0%} of the link"))
        out.append(("not enclosed", f"{known['missing']:.1%}"))
    if spheres:
        out.append(("spheres", str(len(spheres))))
    if known.get("coverage") is not None:
        out.append(("covered by spheres", f"{known['coverage']:.0%}"))
        out.append(("spheres' excess", f"{known['sphere_excess']:.0%}"))
    for other, depth in list(known.get("overlaps_mm", {}).items())[:4]:
        out.append((f"overlaps {other}", f"{depth:.1f} mm"))
    return out

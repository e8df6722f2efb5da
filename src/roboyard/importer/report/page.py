"""`import_report.html`: one self-contained page with pictures and results of an import."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

from roboyard.importer.import_log import unique_warnings
from roboyard.importer.report.conclusions import conclusion_table
from roboyard.importer.report.links import link_rows
from roboyard.importer.report.parts import parts_section
from roboyard.importer.report.pictures import KINDS, view_of_robot
from roboyard.reports.html import badge, figure, page, plural, table
from roboyard.reports.pictures import Kind, SceneView, view_of
from roboyard.reports.robot_page import robot_page

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel
    from roboyard.description.urdf.parse import UrdfElements
    from roboyard.importer.context import ImportContext
    from roboyard.validation import Gate, ValidationReport

MAX_ROWS = 40
BASES = {
    "none": "fixed",
    "fixed": "fixed",
    "wheeled": "on wheels",
    "differential": "driven wheels on two sides",
    "holonomic": "moves in x, y, yaw",
    "ackermann": "steers like a car",
    "legged": "on legs",
    "floating": "free in the air",
}
"""Kind of base to its words."""
_RESOLVED = {
    "collision-overlap": "collision of these pairs is disabled",
    "link-name-odd": "kept; USD uses an identifier and stores this name beside it",
    "joint-name-odd": "kept; USD uses an identifier and stores this name beside it",
}
_STYLE = """
.cards{display:flex;flex-wrap:wrap;gap:.6rem;margin:1rem 0}.cards div{background:var(--card);
border-radius:.5rem;padding:.4rem .9rem}.cards b{display:block;font-size:1.25rem}.cards span{color:var(--dim)}
.sides{display:flex;gap:1.4rem}.sides h3{margin:.2rem 0;color:var(--dim);font-weight:600}
.sides .pictures{display:flex;gap:.5rem;flex-wrap:nowrap}.sides figure{flex:0 1 380px}
.pictures{display:flex;flex-wrap:wrap;gap:.6rem;align-content:flex-start}.pictures figure{margin:0}
@media(max-width:60rem){.sides{flex-wrap:wrap}}
body{max-width:88rem}
.parts{display:flex;gap:1.4rem;flex-wrap:wrap}.parts ul{list-style:none;padding:0;margin:.3rem 0;
flex:1 1 20rem}
.parts li{margin:.2rem 0}.parts li span{display:inline-block;width:.9rem;height:.9rem;border-radius:.2rem;
margin-right:.5rem;vertical-align:-.1rem}.parts code{color:var(--dim);font-size:.9em}
ul.warnings{padding-left:1.2rem}ul.warnings li{margin:.15rem 0}ul.warnings b{color:var(--look)}
.gates{columns:27rem;column-gap:.8rem}
.gate{break-inside:avoid;margin-bottom:.8rem;border:1px solid var(--line);border-radius:.5rem;
border-left:.35rem solid var(--good);padding:.5rem .8rem}.gate.bad{border-left-color:var(--bad)}
.gate.none{border-left-color:var(--line)}
.gate p{margin:.2rem 0}.gate svg{max-width:100%;height:auto}.gate svg text{font:11px system-ui,sans-serif;
fill:var(--dim)}
.links{display:grid;gap:.8rem}.link{display:grid;grid-template-columns:minmax(13rem,19rem) 1fr;gap:1rem;
border:1px solid var(--line);border-radius:.5rem;padding:.7rem .9rem}
.link h3{margin:0 0 .3rem;overflow-wrap:anywhere}.link table{font-size:.92em;width:100%}
.link td{padding:.1rem .5rem .1rem 0;border:0}.link td:first-child{color:var(--dim)}
iframe.moving{width:100%;height:34rem;border:1px solid var(--line);border-radius:.5rem}
@media(max-width:44rem){.link{grid-template-columns:1fr}}
"""


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotSections:
    """The page's sections with pictures, which do not depend on how the robot fares in simulation."""

    parts: list[str]
    result: list[str]
    """Pictures of the imported robot."""
    moving: list[str]
    links: list[str]


def robot_sections(robot: RobotModel, facts: Mapping[str, Any]) -> RobotSections:
    """Return the sections with pictures; the arguments are those of `import_page`."""
    return RobotSections(
        parts=parts_section(robot),
        result=[
            figure(_portrait(view), kind, 380)
            for kind in KINDS
            if not (view := view_of_robot(robot, kind)).is_empty
        ],
        moving=_moving(robot),
        links=link_rows(robot, facts),
    )


def source_pictures(source: UrdfElements) -> list[str]:
    """Return pictures of the vendor's robot, which need nothing of the imported one."""
    kinds: tuple[Kind, ...] = ("visual", "collision")
    return [
        figure(_portrait(view), f"{kind} shapes", 380)
        for kind in kinds
        if not (view := view_of(source, kind=kind, strict=True)).is_empty
    ]


def write_import_page(
    robot: RobotModel,
    context: ImportContext,
    validation: ValidationReport | None = None,
    source: Sequence[str] | None = None,
    sections: RobotSections | None = None,
) -> None:
    """Write the report beside the other files of the package; pictures are drawn if they are not given."""
    text = import_page(
        robot,
        context.log.facts,
        context.log.warnings,
        validation,
        source=source_pictures(context.source) if source is None else source,
        sections=sections,
    )
    (context.build / "import_report.html").write_text(
        context.portable(text), encoding="utf-8", errors="backslashreplace"
    )


def import_page(
    robot: RobotModel,
    facts: Mapping[str, Any],
    warnings: Sequence[Any],
    validation: ValidationReport | None = None,
    *,
    source: Sequence[str] = (),
    sections: RobotSections | None = None,
) -> str:
    """Return the page as HTML; every name in it is escaped.

    Args:
        robot: the robot as it was written.
        facts: facts of the import's log.
        warnings: the log's decisions that the user should check.
        validation: results of the gates, where they ran.
        source: pictures of the vendor's robot, as `source_pictures` returns them.
        sections: the sections with pictures where they were made before.
    """
    shown = sections or robot_sections(robot, facts)
    body = [
        f"<h1>{escape(robot.name)}</h1>",
        _badges(facts, warnings, validation),
        _cards(robot, facts),
        *shown.parts,
        *_sides(source, shown.result),
        *shown.moving,
        *_warnings(warnings),
        *conclusion_table(facts),
        *_gates(validation),
        *_findings(facts),
        *shown.links,
        *_files(facts),
    ]
    return page(f"Import of {robot.name}", body, _STYLE)


def _badges(facts: Mapping[str, Any], warnings: Sequence[Any], validation: ValidationReport | None) -> str:
    parts = []
    if validation is None:
        parts.append(badge("not validated", "none"))
    elif validation.passed:
        parts.append(badge("every gate passed", "good"))
    else:
        count = plural(len(validation.failed), "gate")
        parts.append(badge(f"{count} of {len(validation.gates)} failed", "bad"))
    read_back = facts.get("read_back", {})
    if read_back:
        wrong = sum(1 for problems in read_back.values() if problems)
        parts.append(
            badge(f"{plural(wrong, 'file')} differ when read back", "bad")
            if wrong
            else badge("files read back without difference", "good")
        )
    count = len(unique_warnings(warnings))
    parts.append(badge(f"{plural(count, 'warning')}", "look") if warnings else badge("no warnings", "good"))
    return f"<p>{''.join(parts)}</p>"


def _cards(robot: RobotModel, facts: Mapping[str, Any]) -> str:
    description = robot.description
    moving = sum(joint.is_moving for joint in description.joints)
    mass = sum(link.inertial.mass for link in description.links if link.inertial is not None)
    size = " × ".join(f"{extent:.2f}" for extent in robot.metadata.bbox_size)
    planning = robot.planning
    cards = [
        ("links", str(len(description.links))),
        ("moving joints", str(moving)),
        ("mass", f"{mass:.2f} kg"),
        ("size", f"{size} m"),
        ("base", BASES[robot.semantic.base]),
    ]
    if planning is not None:
        count = sum(map(len, planning.spheres.values()))
        cards.append(("end effectors", ", ".join(e.link for e in robot.semantic.end_effectors) or "none"))
        cards.append(("planning spheres", str(count)))
    if robot.sensors:
        cards.append(("sensors and markers", str(len(robot.sensors))))
    shown = "".join(f"<div><span>{escape(k)}</span><b>{escape(v)}</b></div>" for k, v in cards)
    came = str(facts.get("source", {}).get("status", "")).strip()
    said = f'<p class="facts">The vendor\'s file: {escape(came)}.</p>' if came else ""
    return f'<div class="cards">{shown}</div>{said}'


def _sides(source: Sequence[str], result: Sequence[str]) -> list[str]:
    """Return pictures of the vendor's robot beside those of the imported one."""
    shown = [
        f'<div style="flex:{len(figures)}"><h3>{name}</h3><div class="pictures">{"".join(figures)}</div>'
        "</div>"
        for name, figures in (("Source", source), ("Result", result))
        if figures
    ]
    return ["<h2>The robot</h2>", f'<div class="sides">{"".join(shown)}</div>'] if shown else []


def _moving(robot: RobotModel) -> list[str]:
    """Return the robot with joints to move and layers to toggle, in a frame that can reach nothing else."""
    if all(view_of_robot(robot, kind).is_empty for kind in KINDS[:2]):
        return []
    inner = escape(robot_page(robot.description, small=True), quote=True)
    return [
        "<h2>Move it</h2>",
        f'<iframe title="The robot with its joints" class="moving" sandbox="allow-scripts" loading="lazy" '
        f'srcdoc="{inner}"></iframe>',
    ]


def _portrait(view: SceneView) -> bytes:
    return view.picture(around=view.points(), width=380, height=400)


def _warnings(warnings: Sequence[Any]) -> list[str]:
    if not warnings:
        return []
    rows = []
    for message, elements in unique_warnings(warnings):
        named = [element for element in elements if element]
        who = ", ".join(named[:4]) + (f" and {len(named) - 4} more" if len(named) > 4 else "")
        rows.append(f"<li>{f'<b>{escape(who)}</b>: ' if who else ''}{escape(message)}</li>")
    return ["<h2>Warnings</h2>", '<ul class="warnings">', *rows, "</ul>"]


def _gates(validation: ValidationReport | None) -> list[str]:
    if validation is None:
        return []
    ordered = sorted(validation.gates, key=lambda gate: (gate.passed, bool(gate.skipped)))
    cards = "".join(_gate(gate) for gate in ordered)
    return [
        "<h2>Validation</h2>",
        f'<p class="facts">In simulation on a floor, {validation.seconds:.1f} s; '
        f"repeat with: roboyard validate {escape(validation.robot)}</p>",
        f'<div class="gates">{cards}</div>',
    ]


def _gate(gate: Gate) -> str:
    from roboyard.validation.page import plot

    title = f"<b>{escape(gate.title)}</b>"
    if gate.skipped:
        return f'<div class="gate none">{title}<p class="dim">skipped: {escape(gate.skipped)}</p></div>'
    figures = f"{gate.figure:.4g} {gate.unit} ({gate.sense} {gate.threshold:g})"
    parts = [title, f"<p>{escape(figures)}</p>"]
    if not gate.passed:
        parts += [f"<p>{escape(line)}</p>" for line in gate.findings[:8]]
        parts.append(f"<p><b>Remedy:</b> {escape(gate.advice)}</p>")
    parts += [f"<p><b>Warning:</b> {escape(line)}</p>" for line in gate.warnings]
    if gate.detail:
        parts.append(f'<p class="dim">{escape(gate.detail)}</p>')
    if gate.curve is not None and len(gate.curve.x) > 1 and gate.curve.lines:
        parts.append(plot(gate.curve))
    return f'<div class="gate{"" if gate.passed else " bad"}">{"".join(parts)}</div>'


def _findings(facts: Mapping[str, Any]) -> list[str]:
    """Return a table of the audit's findings on the vendor's file and how each was resolved, a row for each
    kind.
    """
    findings = facts.get("source", {}).get("findings", [])
    fixes = facts.get("fixes", [])
    unresolved = {finding.get("code") for finding in facts.get("unresolved", facts.get("remaining", []))}
    codes = dict.fromkeys(str(item.get("code", "")) for item in (*findings, *fixes))
    rows = []
    for code in codes:
        same = [f for f in findings if str(f.get("code", "")) == code]
        done = [m for m in fixes if str(m.get("code", "")) == code]
        first = (same or done)[0]
        where = str(first.get("element", ""))
        if same and first.get("line"):
            where = f"{where} (line {first['line']})"
        count = max(len(same), len(done))
        what = str(first.get("message", code)) + (f" — and {count - 1} more like this" if count > 1 else "")
        now = f"fixed: {_short(done[0].get('before'))} → {_short(done[0].get('after'))}" if done else ""
        if not done:
            now = "unchanged" if code in unresolved else _RESOLVED.get(code, "resolved by the import")
        rows.append((what, where, str(first.get("severity", "")), now))
    if not rows:
        return []
    heads = ("finding", "first place", "severity", "result")
    parts = ["<h2>Findings in the source</h2>", table(heads, rows[:MAX_ROWS])]
    if len(rows) > MAX_ROWS:
        parts.append(f'<p class="dim">{len(rows) - MAX_ROWS} more kinds are in import_log.json.</p>')
    return parts


def _short(value: object, limit: int = 110) -> str:
    text = " ".join(str(value or "").split())
    return text if len(text) <= limit else text[: limit - 1] + "…"


def _files(facts: Mapping[str, Any]) -> list[str]:
    files, results = facts.get("files", {}), facts.get("read_back", {})
    rows = []
    for kind in dict.fromkeys((*files, *results)):
        problems = results.get(kind)
        result = "not read back" if problems is None else "; ".join(problems) or "read back and equal"
        rows.append((kind, ", ".join(files.get(kind, ())), result))
    return ["<h2>Files</h2>", table(("format", "file", "result"), rows)] if rows else []

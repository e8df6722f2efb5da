"""`import_report.html`: one self-contained page of what an import made, to be looked at rather than read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from roboyard.importer.import_log import unique_warnings
from roboyard.importer.report.links import link_rows
from roboyard.importer.report.pictures import KINDS, view_of_robot
from roboyard.reports.html import figure, page, plural, table, verdict
from roboyard.reports.pictures import Kind, SceneView, view_of

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel
    from roboyard.description.urdf.parse import UrdfElements
    from roboyard.importer.context import ImportContext
    from roboyard.validation import Gate, ValidationReport

MAX_ROWS = 40
BASES = {
    "none": "fixed or legged",
    "wheeled": "on wheels",
    "differential": "two driven wheels",
    "holonomic": "moves in x, y, yaw",
}
"""Kind of base to its words."""
_SETTLED = {
    "collision-overlap": "the pairs are kept from pushing each other",
    "link-name-odd": "kept; USD has its own name and keeps this one beside it",
    "joint-name-odd": "kept; USD has its own name and keeps this one beside it",
}
_STYLE = """
.cards{display:flex;flex-wrap:wrap;gap:.6rem;margin:1rem 0}.cards div{background:var(--card);
border-radius:.5rem;padding:.4rem .9rem}.cards b{display:block;font-size:1.25rem}.cards span{color:var(--dim)}
.sides{display:flex;gap:1.4rem}.sides h3{margin:.2rem 0;color:var(--dim);font-weight:600}
.sides .pictures{display:flex;gap:.5rem;flex-wrap:nowrap}.sides figure{flex:0 1 380px}
.pictures{display:flex;flex-wrap:wrap;gap:.6rem;align-content:flex-start}.pictures figure{margin:0}
@media(max-width:60rem){.sides{flex-wrap:wrap}}
body{max-width:88rem}
ul.look{padding-left:1.2rem}ul.look li{margin:.15rem 0}ul.look b{color:var(--look)}
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
@media(max-width:44rem){.link{grid-template-columns:1fr}}
"""


def write_import_page(
    robot: RobotModel, context: ImportContext, validation: ValidationReport | None = None
) -> None:
    """Write the page beside the other files of the package."""
    text = import_page(
        robot,
        context.log.facts,
        context.log.warnings,
        validation,
        draft=context.source,
    )
    (context.build / "import_report.html").write_text(text, encoding="utf-8")


def import_page(
    robot: RobotModel,
    facts: Mapping[str, Any],
    warnings: Sequence[Any],
    validation: ValidationReport | None = None,
    *,
    draft: UrdfElements | None = None,
) -> str:
    """The page's text; every name in it is escaped.

    Args:
        robot: as it was written.
        facts: of the import's log.
        warnings: the log's decisions that the user should look at.
        validation: how the robot did when it was tried.
        draft: the vendor's file, for the pictures of what came in.
    """
    body = [
        f"<h1>{escape(robot.name)}</h1>",
        _verdicts(facts, warnings, validation),
        _cards(robot, facts),
        *_before_and_after(robot, draft),
        *_look_at(warnings),
        *_gates(validation),
        *_came_in(facts),
        *link_rows(robot, facts),
        *_files(facts),
    ]
    return page(f"Import of {robot.name}", body, _STYLE)


def _verdicts(facts: Mapping[str, Any], warnings: Sequence[Any], validation: ValidationReport | None) -> str:
    parts = []
    if validation is None:
        parts.append(verdict("not tried out", "none"))
    elif validation.passed:
        parts.append(verdict("works: every gate passed", "good"))
    else:
        count = plural(len(validation.failed), "gate")
        parts.append(verdict(f"{count} of {len(validation.gates)} failed", "bad"))
    read_back = facts.get("read_back", {})
    if read_back:
        wrong = sum(1 for problems in read_back.values() if problems)
        parts.append(
            verdict(f"{plural(wrong, 'file')} read back differently", "bad")
            if wrong
            else verdict("files read back as meant", "good")
        )
    count = len(unique_warnings(warnings))
    parts.append(
        verdict(f"{plural(count, 'thing')} to look at", "look")
        if warnings
        else verdict("nothing stands out", "good")
    )
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
        balls = sum(map(len, planning.spheres.values()))
        cards.append(("end effectors", ", ".join(e.link for e in robot.semantic.end_effectors) or "none"))
        cards.append(("planner's spheres", str(balls)))
    if robot.sensors:
        cards.append(("sensors and markers", str(len(robot.sensors))))
    shown = "".join(f"<div><span>{escape(k)}</span><b>{escape(v)}</b></div>" for k, v in cards)
    came = str(facts.get("source", {}).get("status", "")).strip()
    said = f'<p class="facts">The vendor\'s file: {escape(came)}.</p>' if came else ""
    return f'<div class="cards">{shown}</div>{said}'


def _before_and_after(robot: RobotModel, draft: UrdfElements | None) -> list[str]:
    """The whole robot as it came in beside what it became."""
    before: list[str] = []
    kinds: tuple[Kind, ...] = ("visual", "collision")
    if draft is not None:
        for kind in kinds:
            sight = view_of(draft, kind=kind, strict=True)
            if not sight.is_empty:
                before.append(figure(_portrait(sight), f"{kind} shapes", 380))
    after = [
        figure(_portrait(sight), kind, 380)
        for kind in KINDS
        if not (sight := view_of_robot(robot, kind)).is_empty
    ]
    sides = [("As it came in", before), ("As it is now", after)]
    shown = [
        f'<div style="flex:{len(figures)}"><h3>{name}</h3><div class="pictures">{"".join(figures)}</div>'
        "</div>"
        for name, figures in sides
        if figures
    ]
    return ["<h2>The robot</h2>", f'<div class="sides">{"".join(shown)}</div>'] if shown else []


def _portrait(sight: SceneView) -> bytes:
    return sight.picture(around=sight.points(), width=380, height=400)


def _look_at(warnings: Sequence[Any]) -> list[str]:
    if not warnings:
        return []
    rows = []
    for message, elements in unique_warnings(warnings):
        named = [element for element in elements if element]
        who = ", ".join(named[:4]) + (f" and {len(named) - 4} more" if len(named) > 4 else "")
        rows.append(f"<li>{f'<b>{escape(who)}</b>: ' if who else ''}{escape(message)}</li>")
    return ["<h2>Look at next</h2>", '<ul class="look">', *rows, "</ul>"]


def _gates(validation: ValidationReport | None) -> list[str]:
    if validation is None:
        return []
    ordered = sorted(validation.gates, key=lambda gate: (gate.passed, bool(gate.skipped)))
    cards = "".join(_gate(gate) for gate in ordered)
    return [
        "<h2>Does it work?</h2>",
        f'<p class="facts">Tried on a floor, {validation.seconds:.1f} s; '
        f"roboyard validate {escape(validation.robot)} does it again.</p>",
        f'<div class="gates">{cards}</div>',
    ]


def _gate(gate: Gate) -> str:
    from roboyard.validation.page import plot

    title = f"<b>{escape(gate.title)}</b>"
    if gate.skipped:
        return f'<div class="gate none">{title}<p class="dim">not asked: {escape(gate.skipped)}</p></div>'
    figures = f"{gate.figure:.4g} {gate.unit} ({gate.sense} {gate.threshold:g})"
    parts = [title, f"<p>{escape(figures)}</p>"]
    if not gate.passed:
        parts += [f"<p>{escape(line)}</p>" for line in gate.findings[:8]]
        parts.append(f"<p><b>What to look at:</b> {escape(gate.advice)}</p>")
    if gate.detail:
        parts.append(f'<p class="dim">{escape(gate.detail)}</p>')
    if gate.curve is not None and len(gate.curve.x) > 1 and gate.curve.lines:
        parts.append(plot(gate.curve))
    return f'<div class="gate{"" if gate.passed else " bad"}">{"".join(parts)}</div>'


def _came_in(facts: Mapping[str, Any]) -> list[str]:
    """What the audit found in the vendor's file, a row for each kind, and what became of it."""
    findings = facts.get("source", {}).get("findings", [])
    fixes = facts.get("fixes", [])
    still = {finding.get("code") for finding in facts.get("unresolved", facts.get("remaining", []))}
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
        now = f"put right: {_short(done[0].get('before'))} → {_short(done[0].get('after'))}" if done else ""
        if not done:
            now = "as it was" if code in still else _SETTLED.get(code, "settled by the import")
        rows.append((what, where, str(first.get("severity", "")), now))
    if not rows:
        return []
    heads = ("what was found", "where first", "how bad", "what became of it")
    parts = ["<h2>What came in, and what became of it</h2>", table(heads, rows[:MAX_ROWS])]
    if len(rows) > MAX_ROWS:
        parts.append(f'<p class="dim">{len(rows) - MAX_ROWS} more kinds stand in import_log.json.</p>')
    return parts


def _short(value: object, limit: int = 110) -> str:
    text = " ".join(str(value or "").split())
    return text if len(text) <= limit else text[: limit - 1] + "…"


def _files(facts: Mapping[str, Any]) -> list[str]:
    files, results = facts.get("files", {}), facts.get("read_back", {})
    rows = []
    for kind in dict.fromkeys((*files, *results)):
        problems = results.get(kind)
        said = "not read back" if problems is None else "; ".join(problems) or "read back and found equal"
        rows.append((kind, ", ".join(files.get(kind, ())), said))
    return ["<h2>Files</h2>", table(("format", "file", "result"), rows)] if rows else []

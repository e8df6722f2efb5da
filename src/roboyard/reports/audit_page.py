"""One self-contained HTML page for an audit, with the offending links picked out in pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

import numpy as np

from roboyard.audit.findings import Audit, Finding, Severity
from roboyard.audit.report import facts_line
from roboyard.audit.run import audit_urdf
from roboyard.description.urdf.parse import UrdfElements, parse_urdf
from roboyard.reports.html import badge, figure, page
from roboyard.reports.pictures import RGBA, Kind, view_of

MAX_PICTURES = 24
MAX_ROWS = 200
_COLORS: dict[Severity, RGBA] = {
    Severity.ERROR: (0.85, 0.12, 0.12, 1.0),
    Severity.WARNING: (0.95, 0.55, 0.05, 1.0),
    Severity.INFO: (0.15, 0.45, 0.85, 1.0),
}
_STYLE = """
.error{color:var(--bad)}.warning{color:var(--look)}.info{color:var(--note)}
table{width:100%}td.line{text-align:right;color:var(--dim)}
.fix{color:var(--good);white-space:nowrap}
"""


def write_audit_page(
    file: Path | str,
    page: Path | str,
    *,
    packages: Mapping[str, Path] | None = None,
    search_paths: Sequence[Path] = (),
    xacro_args: Mapping[str, str] | None = None,
) -> Audit:
    """Audit a URDF and write one HTML page without any link to elsewhere; returns the audit.

    The page has the status, pictures of the robot (visual and collision shapes), and for each code the
    findings with a picture in which the links concerned stand out: red for errors, orange for warnings,
    blue for information.
    """
    draft = parse_urdf(file, packages=packages, search_paths=search_paths, xacro_args=xacro_args)
    audit = audit_urdf(draft)
    Path(page).write_text(audit_page(audit, draft), encoding="utf-8", errors="backslashreplace")
    return audit


def audit_page(audit: Audit, draft: UrdfElements) -> str:
    """The page's text."""
    title = audit.robot or audit.file.stem
    parts = [
        f"<h1>{escape(title)}</h1>",
        f"<p>{badge(audit.status, 'good' if audit.is_usable else 'bad')}"
        f"<code>{escape(audit.file.name)}</code></p>",
    ]
    if audit.facts.links:
        parts.append(f'<p class="facts">{escape(facts_line(audit))}</p>')
        parts += _overview(draft)
    parts += _findings(audit, draft)
    return page(f"Audit of {title}", parts, _STYLE)


def _overview(draft: UrdfElements) -> list[str]:
    kinds: tuple[tuple[Kind, str], ...] = (
        ("visual", "as it looks"),
        ("collision", "as it collides"),
    )
    out = []
    for kind, caption in kinds:
        if any(shape.kind == kind for shape in draft.shapes):
            view = view_of(draft, kind=kind)
            if not view.is_empty:
                out.append(figure(view.picture(), caption, 480))
    return out


def _findings(audit: Audit, draft: UrdfElements) -> list[str]:
    if not audit.findings:
        return ["<p>No findings.</p>"]
    out: list[str] = []
    pictures = 0
    for severity in Severity:
        of_severity = [finding for finding in audit.findings if finding.severity == severity]
        if not of_severity:
            continue
        out.append(f'<h2 class="{severity.name.lower()}">{severity.label} ({len(of_severity)})</h2>')
        for code in dict.fromkeys(finding.code for finding in of_severity):
            alike = [finding for finding in of_severity if finding.code == code]
            drawn = _pictures(alike, draft) if pictures < MAX_PICTURES else []
            pictures += len(drawn)
            out += [f"<h3><code>{code}</code></h3>", *drawn, _table(alike)]
    return out


def _pictures(alike: Sequence[Finding], draft: UrdfElements) -> list[str]:
    """The links concerned in the whole robot, and close up where they are small."""
    marked = {name for finding in alike for name in finding.links}
    if not marked:
        return []
    kind: Kind = "collision" if "collision" in alike[0].code else "visual"
    view = view_of(draft, kind=kind, marked=marked, color=_COLORS[alike[0].severity])
    seen = [name for name in marked if name in view.bounds]
    if not seen:
        return []
    named = ", ".join(sorted(seen)[:4]) + (", ..." if len(seen) > 4 else "")
    out = [figure(view.picture(width=480, height=360), named, 360)]
    if _share(view.bounds, seen) < 0.35:
        out.append(figure(view.picture(seen, width=480, height=360), "close up", 360))
    return out


def _share(bounds: Mapping[str, object], names: Sequence[str]) -> float:
    """Size of the box round the named links / size of the robot's."""

    def size(boxes: Sequence[object]) -> float:
        corners = np.array(boxes, dtype=float).reshape(-1, 3)
        return float(np.linalg.norm(corners.max(axis=0) - corners.min(axis=0)))

    return size([bounds[name] for name in names]) / max(size(list(bounds.values())), 1e-9)


def _table(alike: Sequence[Finding]) -> str:
    rows = [
        "<tr><th>line</th><th>element</th><th>what is wrong</th><th>remedy</th></tr>",
    ]
    for finding in alike[:MAX_ROWS]:
        fix = ' <span class="fix">repair fixes it</span>' if finding.fixable else ""
        rows.append(
            f'<tr><td class="line">{finding.line or ""}</td><td>{escape(finding.element)}</td>'
            f"<td>{escape(finding.message)}</td><td>{escape(finding.remedy)}{fix}</td></tr>"
        )
    if len(alike) > MAX_ROWS:
        rows.append(f'<tr><td></td><td colspan="3">and {len(alike) - MAX_ROWS} more</td></tr>')
    return f"<table>{''.join(rows)}</table>"

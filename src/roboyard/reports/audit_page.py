"""One self-contained HTML page for an audit, with the offending links picked out in pictures."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

import numpy as np

from roboyard.reports.pictures import RGBA, Kind, sight_of
from roboyard.urdf.auditing.draft import Draft
from roboyard.urdf.auditing.findings import Audit, Finding, Severity
from roboyard.urdf.auditing.report import facts_line
from roboyard.urdf.auditing.run import judge, open_draft

MAX_PICTURES = 24
MAX_ROWS = 200
_COLORS: dict[Severity, RGBA] = {
    Severity.BLOCKS: (0.85, 0.12, 0.12, 1.0),
    Severity.MISBEHAVES: (0.95, 0.55, 0.05, 1.0),
    Severity.UNTIDY: (0.15, 0.45, 0.85, 1.0),
}
_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:72rem;padding:0 1rem}
body{color:#1c2430;background:#fff}
h1{margin:0 0 .2rem}h2{margin:2rem 0 .5rem;border-bottom:1px solid #dde2e8}.facts{color:#5b6675}
.verdict{display:inline-block;padding:.15rem .7rem;border-radius:1rem;color:#fff;font-weight:600}
.good{background:#23803a}.bad{background:#b51d1d}
.blocks{color:#b51d1d}.misbehaves{color:#b26200}.untidy{color:#1f5fae}
table{border-collapse:collapse;width:100%}th,td{text-align:left;vertical-align:top;padding:.35rem .6rem;
border-bottom:1px solid #e6eaef}th{color:#5b6675;font-weight:600}td.line{text-align:right;color:#5b6675}
code{font-size:.9em;background:#f1f4f7;padding:.05rem .3rem;overflow-wrap:anywhere}
.mend{color:#23803a;white-space:nowrap}figure{margin:.5rem 1rem .5rem 0;display:inline-block}
figure img{max-width:100%;border:1px solid #dde2e8;border-radius:.3rem}
figcaption{color:#5b6675;font-size:.9em}
@media(prefers-color-scheme:dark){body{background:#14181e;color:#dfe5ec}
h2{border-color:#333c47}
th,td{border-color:#2a323c}code{background:#222a33}figure img{border-color:#333c47}}
"""


def write_audit_page(
    file: Path | str,
    page: Path | str,
    *,
    packages: Mapping[str, Path] | None = None,
    search_paths: Sequence[Path] = (),
) -> Audit:
    """Audit a URDF and write one HTML page without any link to elsewhere; returns the audit.

    The page has the verdict, pictures of the robot (visual and collision shapes), and for each code the
    findings with a picture in which the links concerned stand out: red what blocks import, orange what will
    misbehave, blue what is untidy.
    """
    draft, blocked = open_draft(file, packages=packages, search_paths=search_paths)
    audit = judge(draft, blocked=blocked)
    Path(page).write_text(audit_page(audit, draft), encoding="utf-8")
    return audit


def audit_page(audit: Audit, draft: Draft) -> str:
    """The page's text."""
    title = escape(audit.robot or audit.file.stem)
    parts = [
        "<!doctype html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>Audit of {title}</title>',
        '<meta name="viewport" content="width=device-width,initial-scale=1">',
        f"<style>{_STYLE}</style></head><body>",
        f"<h1>{title}</h1>",
        f'<p><span class="verdict {"good" if audit.is_usable else "bad"}">{audit.verdict}</span> '
        f"<code>{escape(audit.file.name)}</code></p>",
    ]
    if audit.facts.links:
        parts.append(f'<p class="facts">{escape(facts_line(audit))}</p>')
    parts += _overview(draft)
    parts += _findings(audit, draft)
    parts.append("</body></html>")
    return "\n".join(parts) + "\n"


def _figure(png: bytes, caption: str, width: int) -> str:
    data = base64.b64encode(png).decode("ascii")
    return (
        f'<figure><img width="{width}" alt="{escape(caption)}" src="data:image/png;base64,{data}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


def _overview(draft: Draft) -> list[str]:
    kinds: tuple[tuple[Kind, str], ...] = (
        ("visual", "as it looks"),
        ("collision", "as it collides"),
    )
    out = []
    for kind, caption in kinds:
        if any(shape.kind == kind for shape in draft.shapes):
            sight = sight_of(draft, kind=kind)
            if not sight.is_empty:
                out.append(_figure(sight.picture(), caption, 480))
    return out


def _findings(audit: Audit, draft: Draft) -> list[str]:
    if not audit.findings:
        return ["<p>Nothing to mend.</p>"]
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


def _pictures(alike: Sequence[Finding], draft: Draft) -> list[str]:
    """The links concerned in the whole robot, and close up where they are small."""
    marked = {name for finding in alike for name in finding.links}
    if not marked:
        return []
    kind: Kind = "collision" if "collision" in alike[0].code else "visual"
    sight = sight_of(draft, kind=kind, marked=marked, color=_COLORS[alike[0].severity])
    seen = [name for name in marked if name in sight.bounds]
    if not seen:
        return []
    named = ", ".join(sorted(seen)[:4]) + (", ..." if len(seen) > 4 else "")
    out = [_figure(sight.picture(width=480, height=360), named, 360)]
    if _share(sight.bounds, seen) < 0.35:
        out.append(_figure(sight.picture(seen, width=480, height=360), "close up", 360))
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
        mend = ' <span class="mend">repair does it</span>' if finding.mendable else ""
        rows.append(
            f'<tr><td class="line">{finding.line or ""}</td><td>{escape(finding.element)}</td>'
            f"<td>{escape(finding.message)}</td><td>{escape(finding.remedy)}{mend}</td></tr>"
        )
    if len(alike) > MAX_ROWS:
        rows.append(f'<tr><td></td><td colspan="3">and {len(alike) - MAX_ROWS} more</td></tr>')
    return f"<table>{''.join(rows)}</table>"

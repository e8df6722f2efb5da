"""A validation report as one self-contained HTML page with curves."""

from __future__ import annotations

from html import escape
from pathlib import Path

import numpy as np

from roboyard.validation.report import Curve, Gate, ValidationReport

WIDTH, HEIGHT, LEFT, BOTTOM, TOP = 520, 170, 64, 34, 10
"""Size and margins of a plot (pixels)."""
COLORS = ("#1f6feb", "#d1660a", "#23803a", "#8250df")
MAX_POINTS = 400
STYLE = """
body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:60rem;padding:0
1rem;color:#1c2430;background:#fff}
h1{margin:0 0 .2rem}.facts{color:#5b6675}section{border:1px solid #dde2e8;border-radius:.5rem;padding:.2rem
1rem 1rem;
margin:1rem 0}h2{font-size:1.1rem;margin:.7rem 0 .3rem}.tag{display:inline-block;padding:.05rem .6rem;
border-radius:1rem;color:#fff;font-weight:600;font-size:.85rem}.ok{background:#23803a}.bad{background:#b51d1d}
.none{background:#7a8594}.figure{font-variant-numeric:tabular-nums}svg{max-width:100%;height:auto}
svg text{font:11px system-ui,sans-serif;fill:#5b6675}
@media(prefers-color-scheme:dark){body{background:#14181e;color:#dfe5ec}section{border-color:#333c47}}
"""


def write_page(report: ValidationReport, file: Path | str) -> Path:
    """Write the page of a report and return its path."""
    path = Path(file)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page_html(report), encoding="utf-8", errors="backslashreplace")
    return path


def page_html(report: ValidationReport) -> str:
    """Return a report as HTML."""
    status = '<span class="tag ok">passed</span>' if report.passed else '<span class="tag bad">failed</span>'
    facts = (
        f"{report.joints} joints; {', '.join(report.capabilities) or 'no capabilities'}; "
        f"{report.seconds:.1f} s"
    )
    body = "".join(_section(gate) for gate in report.gates)
    title = f"Validation of {escape(report.robot)}"
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f'<meta name="viewport" content="width=device-width"><style>{STYLE}</style></head><body>'
        f'<h1>{title} {status}</h1><p class="facts">{escape(facts)}</p>{body}</body></html>'
    )


def _section(gate: Gate) -> str:
    """Return the HTML of one gate."""
    if gate.skipped:
        tag = '<span class="tag none">skipped</span>'
        return f"<section><h2>{escape(gate.title)} {tag}</h2><p>{escape(gate.skipped)}</p></section>"
    tag = '<span class="tag ok">ok</span>' if gate.passed else '<span class="tag bad">failed</span>'
    figure = f"{gate.figure:.4g} {gate.unit} ({gate.sense} {gate.threshold:g})"
    parts = [
        f"<h2>{escape(gate.title)} {tag}</h2>",
        f'<p class="figure"><b>{escape(figure)}</b> {escape(gate.detail)}</p>',
    ]
    if gate.findings:
        parts.append("<ul>" + "".join(f"<li>{escape(line)}</li>" for line in gate.findings[:50]) + "</ul>")
    parts += [f"<p><b>Warning:</b> {escape(line)}</p>" for line in gate.warnings]
    if not gate.passed and gate.advice:
        parts.append(f"<p><b>To check:</b> {escape(gate.advice)}</p>")
    if gate.curve is not None and len(gate.curve.x) > 1 and gate.curve.lines:
        parts.append(plot(gate.curve))
    return f"<section>{''.join(parts)}</section>"


def plot(curve: Curve) -> str:
    """Return the curves as SVG; the value axis starts at 0."""
    step = max(1, len(curve.x) // MAX_POINTS)
    x = curve.x[::step]
    lines = {label: np.nan_to_num(values[::step]) for label, values in curve.lines.items()}
    top = max((float(values.max()) for values in lines.values()), default=0.0)
    top = max(top, 1e-6)  # smaller values are rounding errors
    low, high = float(x.min()), float(x.max())
    span = high - low or 1.0
    across, up = WIDTH - LEFT - 10, HEIGHT - BOTTOM - TOP
    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" role="img"',
        f' aria-label="{escape(curve.y_label)}">',
        f'<path d="M{LEFT} {TOP}V{TOP + up}H{LEFT + across}" fill="none" stroke="#9aa5b1"/>',
        f'<text x="{LEFT - 6}" y="{TOP + 9}" text-anchor="end">{top:.3g}</text>',
        f'<text x="{LEFT - 6}" y="{TOP + up}" text-anchor="end">0</text>',
        f'<text x="{LEFT}" y="{HEIGHT - 18}">{low:.3g}</text>',
        f'<text x="{LEFT + across}" y="{HEIGHT - 18}" text-anchor="end">{high:.3g}</text>',
        f'<text x="{LEFT + across / 2}" y="{HEIGHT - 18}" text-anchor="middle">',
        f"{escape(curve.x_label)}</text>",
    ]
    for index, (label, values) in enumerate(lines.items()):
        color = COLORS[index % len(COLORS)]
        points = " ".join(
            f"{LEFT + (a - low) / span * across:.1f},{TOP + up - max(0.0, b) / top * up:.1f}"
            for a, b in zip(x, values, strict=True)
        )
        parts.append(f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="1.5"/>')
        parts.append(
            f'<text x="{LEFT + index * 150}" y="{HEIGHT - 4}" style="fill:{color}">{escape(label)}</text>'
        )
    return "".join(parts) + "</svg>"

"""Draw docs/images/architecture.svg: the layers, and four ways of a URDF through their files.

    python tools/architecture_picture.py

Layers are those that `tests/architecture` holds the imports to; every file named here has to exist.
"""

from __future__ import annotations

import sys
from html import escape
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "architecture"))
from house import LAYERS, SOURCE  # noqa: E402

PICTURE = ROOT / "docs" / "images" / "architecture.svg"

WAYS: dict[str, tuple[str, tuple[str, ...]]] = {
    "to a joint": (
        "#1f77b4",
        (
            "description/loader.py",
            "description/urdf/parse.py",
            "description/urdf/build.py",
            "description/model.py",
            "sim/world.py",
            "sim/build/bodies.py",
            "sim/build/joints.py",
            "sim/compiled_world.py",
            "sim/joint.py",
            "sim/actuation/drives.py",
            "sim/actuation/gains.py",
            "sim/stepping/time_steps.py",
        ),
    ),
    "to a pixel": (
        "#2ca02c",
        (
            "description/model.py",
            "shapes/load.py",
            "sim/appearance/render_shapes.py",
            "rendering/scene.py",
            "rendering/scene_arrays.py",
            "rendering/renderer.py",
            "rendering/software.py",
            "rendering/kernels/raster.py",
            "rendering/kernels/shade.py",
            "rendering/image.py",
        ),
    ),
    "to a USD prim": (
        "#d62728",
        (
            "importer/pipeline.py",
            "importer/build.py",
            "importer/steps/repair_and_copy.py",
            "importer/steps/collision.py",
            "morphology/wheels.py",
            "description/robot_model.py",
            "importer/write_formats.py",
            "export/usd/stage.py",
            "export/usd/links.py",
            "export/usd/geometry.py",
            "export/usd/materials.py",
            "export/usd/joints.py",
        ),
    ),
    "to a report": (
        "#9467bd",
        (
            "audit/run.py",
            "audit/checks/joints.py",
            "audit/findings.py",
            "reports/audit_page.py",
            "validation/run.py",
            "validation/gates/rest.py",
            "validation/report.py",
            "importer/report/page.py",
            "reports/html.py",
        ),
    ),
}
"""Title to colour and files, in the order in which they take part."""

LEFT, LANE, STEP, PAD, TOP = 330, 265, 24, 14, 56
FONT = "font-family='DejaVu Sans, Arial, sans-serif'"


def main() -> None:
    """Write the picture."""
    rows = [names for names in LAYERS if any((SOURCE / "roboyard" / name).is_dir() for name in names)]
    row_of = {name: number for number, names in enumerate(rows) for name in names}
    placed: dict[tuple[int, int], list[tuple[int, str]]] = {}
    for lane, (_, files) in enumerate(WAYS.values()):
        for step, file in enumerate(files, 1):
            if not (SOURCE / "roboyard" / file).is_file():
                raise SystemExit(f"architecture_picture.py: there is no file {file}")
            placed.setdefault((row_of[file.split("/")[0]], lane), []).append((step, file))
    heights = [
        2 * PAD + STEP * max([len(placed.get((row, lane), [])) for lane in range(len(WAYS))] + [1])
        for row in range(len(rows))
    ]
    width, height = LEFT + LANE * len(WAYS) + 20, TOP + sum(heights) + 20
    out = [
        f"<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{height}'>",
        _box(0, 0, width, height, "white"),
        _text(20, 34, "Layers (imports lead down)", 15, "#222", bold=True),
    ]
    for lane, (title, (color, _)) in enumerate(WAYS.items()):
        out.append(_text(LEFT + lane * LANE, 34, f"A URDF {title}", 15, color, bold=True))
    spots: list[list[tuple[int, float, float]]] = [[] for _ in WAYS]
    y = float(TOP)
    for row in reversed(range(len(rows))):
        shade = "#f2f5f8" if row % 2 else "#e7ecf1"
        out.append(
            f"<rect x='10' y='{y}' width='{width - 20}' height='{heights[row] - 3}' rx='6' fill='{shade}'/>"
        )
        x, names = 20.0, [n for n in rows[row] if (SOURCE / "roboyard" / n).is_dir()]
        middle = y + heights[row] / 2
        for name in names:
            size = 7.6 * len(name) + 14
            out.append(_box(x, middle - 13, size, 24, "white", "#8fa3b5"))
            out.append(_text(x + 7, middle + 4, name, 12.5, "#222"))
            x += size + 7
        for lane in range(len(WAYS)):
            steps = placed.get((row, lane), [])
            start = middle - STEP * (len(steps) - 1) / 2
            for k, (step, file) in enumerate(reversed(steps)):
                place = start + k * STEP
                spots[lane].append((step, LEFT + lane * LANE + 10, place))
                out.append(_text(LEFT + lane * LANE + 26, place + 4, file, 12, "#222"))
        y += heights[row]
    for lane, (color, _) in enumerate(WAYS.values()):
        points = sorted(spots[lane])
        path = " ".join(f"{x},{y}" for _, x, y in points)
        out.append(
            f"<polyline points='{path}' fill='none' stroke='{color}' stroke-width='2' opacity='0.35'/>"
        )
        for step, x, y in points:
            out.append(f"<circle cx='{x}' cy='{y}' r='9.5' fill='{color}'/>")
            out.append(_text(x - 3.2 * len(str(step)), y + 3.8, str(step), 10.5, "white"))
    out.append("</svg>")
    PICTURE.write_text("\n".join(out) + "\n", encoding="utf-8")


def _box(x: float, y: float, width: float, height: float, fill: str, stroke: str = "none") -> str:
    size = f"width='{width:.1f}' height='{height:.1f}' rx='5'"
    return f"<rect x='{x:.1f}' y='{y:.1f}' {size} fill='{fill}' stroke='{stroke}'/>"


def _text(x: float, y: float, text: str, size: float, color: str, *, bold: bool = False) -> str:
    style = f"font-size='{size}' fill='{color}' {FONT}" + (" font-weight='bold'" if bold else "")
    return f"<text x='{x:.1f}' y='{y:.1f}' {style}>{escape(text)}</text>"


if __name__ == "__main__":
    main()

"""The summary of a demo: a dictionary for summary.json, and the tables printed from it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from roboyard._version import __version__
from roboyard.demo.demo_world import DemoWorld
from roboyard.demo.load import LoadedRobot
from roboyard.demo.motion_sequence import MotionSequence
from roboyard.demo.output import MARK
from roboyard.untrusted.text import one_line

if TYPE_CHECKING:
    from rich.console import Console

MOST_PLACES = 10
"""Largest number of rows in the table of positions."""
MOST_FINDINGS = 12
"""Largest number of lines in a list of findings, fixes or notes."""


def summarize(
    scene: DemoWorld,
    sequence: MotionSequence,
    *,
    source: str,
    loaded: LoadedRobot,
    notes: Sequence[str],
    places: Mapping[str, Sequence[float]],
    film: Mapping[str, float],
    wall_time: float,
    files: Sequence[str],
) -> dict[str, Any]:
    """Return the summary as plain data for JSON, in SI units.

    Args:
        scene: the world after the demo.
        sequence: the outcome of the motion.
        source: label of the robot.
        loaded: the robot with its findings and fixes.
        notes: warnings and notes from loading the robot.
        places: name to (3,) position of links and obstacle at rest (m).
        film: number of pictures and speed of the video.
        wall_time: duration of the demo (s).
        files: names of the files written.
    """
    plan, robot, description = scene.plan, scene.robot, scene.model.description
    moved = plan.sweeps
    joints = {}
    for joint in description.depth_first_joints:
        if not joint.is_moving:
            continue
        entry: dict[str, Any] = {"type": joint.type, "limits": _pair(joint.position_limits())}
        if joint.name in moved:
            sweep, (rms, largest) = moved[joint.name], sequence.errors[joint.name]
            entry |= {
                "moved": _pair((sweep.lower, sweep.upper)),
                "share_of_range": _number(sweep.share),
                "tracking_error_rms": _number(rms),
                "tracking_error_max": _number(largest),
            }
            if sweep.reasons:
                entry["why_not_all"] = list(sweep.reasons)
        elif joint.name in plan.still:
            entry["not_moved"] = plan.still[joint.name]
        joints[joint.name] = entry
    return {
        "made_by": MARK,
        "version": __version__,
        "robot": description.name,
        "source": source,
        "links": len(description.links),
        "joints": joints,
        "degrees_of_freedom": len(plan.home),
        "mass": _number(robot.mass),
        "findings": list(loaded.findings),
        "repairs": list(loaded.repairs),
        "notes": list(notes),
        "stance": {
            "kind": plan.support.kind,
            "why": plan.support.reason,
            "stand_height": _number(plan.stand if robot.is_fixed else 0.0),
            "fell_when_dropped": sequence.fell_when_dropped,
            "fell_when_moved": sequence.fell_when_moved,
        },
        "settle_time": None if sequence.settle_time is None else _number(sequence.settle_time),
        "places": {name: [_number(x) for x in place] for name, place in places.items()},
        "simulated_time": _number(sequence.simulated),
        "steps": sequence.steps,
        "time_step": scene.world.timestep,
        "stepping_time": _number(sequence.stepping),
        "real_time_factor": _number(sequence.real_time_factor),
        "wall_time": _number(wall_time),
        "film": {name: _number(value) for name, value in film.items()},
        "files": list(files),
    }


def link_positions(scene: DemoWorld) -> dict[str, list[float]]:
    """Return name to (3,) world position (m) of the robot's base, its outermost links and the obstacle."""
    description = scene.model.description
    ends = [
        link.name
        for link in description.links
        if not description.child_joints[link.name]
        and link.name != description.root.name
        and (link.visuals or link.collisions)
    ]
    found = {description.root.name: scene.robot.position.tolist()}
    for name in ends:
        found[name] = scene.robot.link(name).pose[0].tolist()
    found["obstacle"] = scene.obstacle.position.tolist()
    return found


def print_tables(summary: Mapping[str, Any], folder: str, console: Console) -> None:
    """Print a summary as lists and tables.

    Args:
        summary: as `summarize` returns it.
        folder: the output folder, for the last line.
        console: where to print.
    """
    from rich.table import Table
    from rich.text import Text

    _print_list(console, "Findings", finding_lines(summary["findings"]))
    _print_list(console, "Fixed in a copy", repair_lines(summary["repairs"]))
    _print_list(console, "Notes", summary["notes"])
    positions = Table(title="Positions at rest", title_justify="left", box=None, padding=(0, 2, 0, 0))
    for heading in ("", "x [m]", "y [m]", "z [m]"):
        positions.add_column(heading, justify="left" if not heading else "right")
    rows = list(summary["places"].items())
    shown = [*rows[: MOST_PLACES - 1], rows[-1]] if len(rows) > MOST_PLACES else rows
    for name, place in shown:
        positions.add_row(Text(one_line(name)), *(f"{x:.3f}" for x in place))
    console.print(positions)
    if len(shown) < len(rows):
        console.print(f"... and {len(rows) - len(shown)} more links, in summary.json", style="dim")
    console.print()
    results = Table(title="Results", title_justify="left", box=None, padding=(0, 2, 0, 0), show_header=False)
    for name, value in _results(summary):
        results.add_row(name, Text(one_line(value)))
    console.print(results)
    console.print()
    console.print(
        Text(one_line(f"Written to {folder}: {', '.join(summary['files'])}")), soft_wrap=True, highlight=False
    )


def finding_lines(findings: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return one line for each kind of finding, worst first: severity, first place, message and count."""
    lines = []
    for first, more in _by_code(findings):
        where = f"{first['element']}: " if first["element"] else ""
        line = f"line {first['line']}: " if first["line"] else ""
        lines.append(f"{first['severity']}: {line}{where}{first['message']}{more}")
    return lines


def repair_lines(repairs: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return one line for each kind of fix: the first before and after, and how many more there are."""
    lines = []
    for first, more in _by_code(repairs):
        where = f"{first['element']}: " if first["element"] else ""
        lines.append(f"{where}{_shortened(first['before'])} → {_shortened(first['after'])}{more}")
    return lines


def _by_code(entries: Sequence[Mapping[str, Any]]) -> list[tuple[Mapping[str, Any], str]]:
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for entry in entries:
        groups.setdefault(entry["code"], []).append(entry)
    return [
        (group[0], f" (and {len(group) - 1} more like this)" if len(group) > 1 else "")
        for group in groups.values()
    ]


def _shortened(text: str, most: int = 60) -> str:
    flat = " ".join(text.split())
    return flat if len(flat) <= most else flat[: most - 1] + "…"


def _results(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    joints = summary["joints"]
    moved = {name: entry for name, entry in joints.items() if "moved" in entry}
    partly = [name for name, entry in moved.items() if entry["share_of_range"] < 0.995]
    still = len(joints) - len(moved)
    followers = sum("follows" in entry.get("not_moved", "") for entry in joints.values())
    settle_time, stance = summary["settle_time"], summary["stance"]
    rows = [
        ("robot", f"{summary['robot']}: {summary['links']} links, {len(joints)} moving joints, "
                  f"{summary['mass']:.2f} kg"),
        ("support", _support(stance)),
        ("at rest", "never completely" if settle_time is None else f"after {settle_time:.2f} s"),
        ("moved", f"{len(moved)} of {len(joints)} joints"
                  + (f", {len(partly)} of them through part of their range" if partly else "")
                  + (f"; {followers} mimic others" if followers else "")
                  + (f"; {still - followers} not moved" if still > followers else "")),
    ]  # fmt: skip
    if moved:
        worst = max(moved, key=lambda name: _relative_error(moved[name]))
        entry = moved[worst]
        unit = "m" if entry["type"] == "prismatic" else "rad"
        error = (
            f"{entry['tracking_error_rms']:.4f} {unit} rms, {entry['tracking_error_max']:.4f} {unit} largest"
        )
        rows.append(("tracking error", f"worst joint {worst}: {error}"))
    if stance["fell_when_moved"]:
        rows.append(("fell", "while its joints moved"))
    speed = (
        f"{summary['simulated_time']:.1f} s simulated in {summary['stepping_time']:.2f} s: "
        f"{summary['real_time_factor']:.0f} times real time"
    )
    rows.append(("speed", speed))
    rows.append(("duration", f"{summary['wall_time']:.1f} s with pictures"))
    return rows


def _support(stance: Mapping[str, Any]) -> str:
    kind, why = stance["kind"], stance["why"]
    at = f"at a height of {stance['stand_height']:.2f} m" if stance["stand_height"] > 0 else "on the floor"
    if kind == "mounted":
        on = f"on a stand of {stance['stand_height']:.2f} m" if stance["stand_height"] > 0 else at
        return f"base fixed {on}: {why}"
    drop = "it fell over when dropped" if stance["fell_when_dropped"] else "it stayed upright when dropped"
    if kind == "supported":
        return f"base fixed {at}: {why}; {drop}"
    if stance["fell_when_dropped"]:
        return f"{drop}; then base fixed {at}"
    return f"free on the floor: {why}"


def _relative_error(entry: Mapping[str, Any]) -> float:
    low, high = entry["moved"]
    return entry["tracking_error_rms"] / max(high - low, 1e-9)


def _print_list(console: Console, title: str, lines: Sequence[str]) -> None:
    if not lines:
        return
    console.print(f"{title}:")
    for line in lines[:MOST_FINDINGS]:
        console.print(f"  {one_line(line)}", soft_wrap=True, markup=False, highlight=False)
    if len(lines) > MOST_FINDINGS:
        console.print(f"  ... and {len(lines) - MOST_FINDINGS} more, in summary.json", style="dim")
    console.print()


def _number(value: float) -> float | None:
    """Return a number for JSON, rounded to nine significant digits; None if it is not finite."""
    return float(f"{value:.9g}") if math.isfinite(value) else None


def _pair(values: tuple[float, float] | None) -> list[float | None] | None:
    return None if values is None else [_number(value) for value in values]

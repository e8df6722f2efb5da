"""What the demo has to say: one dictionary for summary.json, and tables for people made from it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from roboyard._version import __version__
from roboyard.demo.demo_world import DemoWorld
from roboyard.demo.load import LoadedRobot, told_findings, told_repairs
from roboyard.demo.motion_sequence import MotionSequence
from roboyard.demo.output import MARK

if TYPE_CHECKING:
    from rich.console import Console

MOST_PLACES = 10
"""Rows of the table of places."""
MOST_FINDINGS = 12


def summarize(
    stage: DemoWorld,
    story: MotionSequence,
    *,
    source: str,
    intake: LoadedRobot,
    notes: Sequence[str],
    places: Mapping[str, Sequence[float]],
    film: Mapping[str, float],
    wall_time: float,
    files: Sequence[str],
) -> dict[str, Any]:
    """Everything that is known after the demo; SI units, and plain data for JSON."""
    plan, robot, description = stage.plan, stage.robot, stage.figure.description
    moved = plan.sweeps
    joints = {}
    for joint in description.depth_first_joints:
        if not joint.is_moving:
            continue
        entry: dict[str, Any] = {"type": joint.type, "limits": _pair(joint.position_limits())}
        if joint.name in moved:
            sweep, (rms, largest) = moved[joint.name], story.errors[joint.name]
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
        "findings": list(intake.findings),
        "repairs": list(intake.repairs),
        "notes": list(notes),
        "stance": {
            "kind": plan.stance.kind,
            "why": plan.stance.reason,
            "stand_height": _number(plan.stand if robot.is_fixed else 0.0),
            "fell_when_dropped": story.fell_when_dropped,
            "fell_when_moved": story.fell_when_moved,
        },
        "settle_time": None if story.settle_time is None else _number(story.settle_time),
        "places": {name: [_number(x) for x in place] for name, place in places.items()},
        "simulated_time": _number(story.simulated),
        "steps": story.steps,
        "time_step": stage.world.timestep,
        "stepping_time": _number(story.stepping),
        "real_time_factor": _number(story.real_time_factor),
        "wall_time": _number(wall_time),
        "film": {name: _number(value) for name, value in film.items()},
        "files": list(files),
    }


def where_things_are(stage: DemoWorld) -> dict[str, list[float]]:
    """Name to position (m) of the robot's base, its outermost links and the obstacle, as they are now."""
    description = stage.figure.description
    ends = [
        link.name
        for link in description.links
        if not description.child_joints[link.name]
        and link.name != description.root.name
        and (link.visuals or link.collisions)
    ]
    found = {description.root.name: stage.robot.position.tolist()}
    for name in ends:
        found[name] = stage.robot.link(name).pose[0].tolist()
    found["obstacle"] = stage.obstacle.position.tolist()
    return found


def print_tables(summary: Mapping[str, Any], folder: str, console: Console) -> None:
    """The summary for people."""
    from rich.table import Table

    _print_list(console, "Found in the file", told_findings(summary["findings"]))
    _print_list(console, "Put right, in a copy", told_repairs(summary["repairs"]))
    _print_list(console, "Noted while it was read", summary["notes"])
    where = Table(title="Where things are", title_justify="left", box=None, padding=(0, 2, 0, 0))
    for heading in ("", "x [m]", "y [m]", "z [m]"):
        where.add_column(heading, justify="left" if not heading else "right")
    rows = list(summary["places"].items())
    shown = [*rows[: MOST_PLACES - 1], rows[-1]] if len(rows) > MOST_PLACES else rows
    for name, place in shown:
        where.add_row(name, *(f"{x:.3f}" for x in place))
    console.print(where)
    if len(shown) < len(rows):
        console.print(f"... and {len(rows) - len(shown)} more links, in summary.json", style="dim")
    console.print()
    facts = Table(
        title="How it went", title_justify="left", box=None, padding=(0, 2, 0, 0), show_header=False
    )
    for name, value in _facts(summary):
        facts.add_row(name, value)
    console.print(facts)
    console.print()
    console.print(f"Written to {folder}: {', '.join(summary['files'])}", soft_wrap=True, highlight=False)


def _facts(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    stance = summary["stance"]
    moved = {name: entry for name, entry in summary["joints"].items() if "moved" in entry}
    held_back = [name for name, entry in moved.items() if entry["share_of_range"] < 0.995]
    still = len(summary["joints"]) - len(moved)
    followers = sum("follows" in entry.get("not_moved", "") for entry in summary["joints"].values())
    rows = [
        ("robot", f"{summary['robot']}: {summary['links']} links, {len(summary['joints'])} moving joints, "
                  f"{summary['mass']:.2f} kg"),
        ("stands", _stands(stance)),
        ("settled", "never quite still" if summary["settle_time"] is None
            else f"after {summary['settle_time']:.2f} s"),
        ("moved", f"{len(moved)} of {len(summary['joints'])} joints"
                  + (f", {len(held_back)} of them through part of their range" if held_back else "")
                  + (f"; {followers} follow others" if followers else "")
                  + (f"; {still - followers} stay" if still > followers else "")),
    ]  # fmt: skip
    if moved:
        worst = max(moved, key=lambda name: _relative_error(moved[name]))
        entry = moved[worst]
        unit = "m" if entry["type"] == "prismatic" else "rad"
        rows.append(
            ("tracked", f"worst joint {worst}: {entry['tracking_error_rms']:.4f} {unit} rms, "
                        f"{entry['tracking_error_max']:.4f} {unit} at most")
        )  # fmt: skip
    if stance["fell_when_moved"]:
        rows.append(("fell", "while its joints moved"))
    rows.append(
        (
            "speed",
            f"{summary['simulated_time']:.1f} s simulated in {summary['stepping_time']:.2f} s: "
            f"{summary['real_time_factor']:.0f} times real time",
        )
    )
    rows.append(("in all", f"{summary['wall_time']:.1f} s with pictures"))
    return rows


def _stands(stance: Mapping[str, Any]) -> str:
    kind, why = stance["kind"], stance["why"]
    up = f" {stance['stand_height']:.2f} m up" if stance["stand_height"] > 0 else " to the floor"
    if kind == "mounted":
        on = f"on a stand{up}" if stance["stand_height"] > 0 else "to the floor"
        return f"mounted {on}: {why}"
    fell = "it fell over when dropped" if stance["fell_when_dropped"] else "it stood when dropped"
    if kind == "held":
        return f"held by its base{up}: {why}; {fell}"
    if stance["fell_when_dropped"]:
        return f"{fell}; then held by its base{up}"
    return f"free on the floor: {why}"


def _relative_error(entry: Mapping[str, Any]) -> float:
    low, high = entry["moved"]
    return entry["tracking_error_rms"] / max(high - low, 1e-9)


def _print_list(console: Console, title: str, lines: Sequence[str]) -> None:
    if not lines:
        return
    console.print(f"{title}:")
    for line in lines[:MOST_FINDINGS]:
        console.print(f"  {line}", soft_wrap=True, markup=False, highlight=False)
    if len(lines) > MOST_FINDINGS:
        console.print(f"  ... and {len(lines) - MOST_FINDINGS} more, in summary.json", style="dim")
    console.print()


def _number(value: float) -> float | None:
    """A number that JSON can hold, to nine significant digits; null for what is not finite."""
    return float(f"{value:.9g}") if math.isfinite(value) else None


def _pair(values: tuple[float, float] | None) -> list[float | None] | None:
    return None if values is None else [_number(value) for value in values]

"""What the demo will do with a robot, worked out before anything moves.

Joints move in a few groups: first wheels and the like, then those equally far from the base together, so that
both arms of a robot do the same and the whole takes about a minute of simulated time, however many joints
there are. A robot that stands free moves each joint only as far as it keeps its balance and stays above the
floor; one that is held or mounted goes through its whole range, on a stand high enough.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from roboyard.demo.sweep import Sweep, first_sweep
from roboyard.morphology.point_model import PointModel, extreme_points
from roboyard.morphology.support_mode import SupportMode, decide
from roboyard.transforms import Array

Flags = NDArray[np.bool_]

MOST_GROUPS = 6
SHORTEST, LONGEST = 1.5, 20.0
"""s for one group."""
SAMPLES = 33
REACH_DIRECTIONS = 48
"""In which each group's farthest points are looked for."""
CLEARANCE = 0.05
"""m between a robot on a stand and the floor."""
SINK = 0.01
"""m that a standing robot's parts may come below its feet before they count as in the floor."""
GRAVITY = 9.81
"""m/s²"""
TIPPING_SHARE = 0.15
"""Of the moment that would tip the robot: what the reaction to a sweep may use up."""
ROLLING_SPEED = 1.2
"""rad/s at most of joints that carry the robot: wheels are often hulls of meshes, whose flats rock it."""
KEEP = 0.4
"""Part of the balance margin that a sweep has to leave."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Group:
    """Joints that move together."""

    sweeps: tuple[Sweep, ...]
    duration: float
    """s"""


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    stance: SupportMode
    home: Mapping[str, float]
    """Joint name to rad or m, for every driven joint."""
    inertias: Mapping[str, float]
    """Joint name to the largest inertia it moves; kg m² or kg."""
    groups: tuple[Group, ...]
    still: Mapping[str, str]
    """Joints that are not moved, and why."""
    stand: float
    """Height of the stand below a held or mounted robot; 0: none; m."""
    reach: Array
    """(k, 3) outermost points that its outline reaches, in the root link's frame; m."""
    size: Array
    """(2, 3) box around its outline at home, in the root link's frame; m."""

    @property
    def duration(self) -> float:
        """Of all groups; s."""
        return sum(group.duration for group in self.groups)

    @property
    def sweeps(self) -> dict[str, Sweep]:
        """Joint name to its sweep, in the order they move."""
        return {sweep.joint: sweep for group in self.groups for sweep in group.sweeps}


def make_plan(figure: PointModel) -> Plan:
    """Decide how the robot stands, in which groups its joints move, and how far."""
    stance = decide(figure)
    inertias = figure.moved_inertias()
    levels: dict[tuple[bool, int], list[Sweep]] = {}
    for joint in figure.joints:
        inertia = inertias[joint.name]
        sweep = first_sweep(joint, figure.home[joint.name], inertia)
        if not sweep.stretches:
            continue
        if stance.kind == "standing":
            sweep = _trimmed(figure, stance, _gentle(figure, stance, sweep, inertia))
        place = (joint.name not in stance.levers, _level(figure, joint.name))
        levels.setdefault(place, []).append(_timed(sweep))
    merged = _merged([levels[place] for place in sorted(levels)], stance.levers)
    groups = []
    for sweeps in merged:
        together = tuple(sweeps)
        if stance.kind == "standing":
            together = _balanced(figure, stance, together)
        groups.append(Group(sweeps=together, duration=max(SHORTEST, *(s.duration for s in together))))
    rest = figure.points(figure.poses({}))
    places = [rest, *(figure.points(_group_poses(figure, group.sweeps)).reshape(-1, 3) for group in groups)]
    reach = np.concatenate([extreme_points(place, REACH_DIRECTIONS) for place in places])
    stand = 0.0
    below = stance.lowest - float(reach[:, 2].min(initial=stance.lowest))
    if stance.kind == "held" or (stance.kind == "mounted" and below > SINK):
        stand = float(below + CLEARANCE)
    return Plan(
        stance=stance,
        home=dict(figure.home),
        inertias=inertias,
        groups=tuple(groups),
        still=_still(figure, groups),
        stand=stand,
        reach=reach,
        size=_box(rest),
    )


def _gentle(figure: PointModel, stance: SupportMode, sweep: Sweep, inertia: float) -> Sweep:
    """The sweep slowed down so that its reaction uses up only a part of the balance margin.

    What tips a robot of mass m is a moment of m g · margin. Turning an inertia takes inertia · acceleration;
    driving off on wheels takes m · height of the weight · lever · acceleration.
    """
    moment = TIPPING_SHARE * figure.mass * GRAVITY * stance.margin
    lever = stance.levers.get(sweep.joint)
    if lever is not None:
        sweep = replace(sweep, speed=min(sweep.speed, ROLLING_SPEED))
        height = float(figure.centre_of_mass(figure.poses({}))[2]) - stance.lowest
        inertia = figure.mass * height * lever
    elif figure.description.joint_by_name[sweep.joint].type == "prismatic":
        inertia *= float(figure.centre_of_mass(figure.poses({}))[2]) - stance.lowest
    if inertia <= 0 or moment <= 0:
        return sweep
    return replace(sweep, acceleration=min(sweep.acceleration, moment / inertia))


def _merged(levels: list[list[Sweep]], alone: Container[str]) -> list[list[Sweep]]:
    """Neighbouring levels joined until there are few groups; never wheels or joints that endanger balance."""
    groups = [list(level) for level in levels]
    while len(groups) > MOST_GROUPS:
        pairs = [
            (len(a) + len(b), k)
            for k, (a, b) in enumerate(pairwise(groups))
            if not any(sweep.reasons or sweep.joint in alone for sweep in (*a, *b))
        ]
        if not pairs:
            break
        _, k = min(pairs)
        groups[k : k + 2] = [groups[k] + groups[k + 1]]
    return groups


def _level(figure: PointModel, name: str) -> int:
    """Driven joints between the root and this joint."""
    driven = {joint.name for joint in figure.joints}
    joint = figure.description.joint_by_name[name]
    level = 0
    while (above := figure.description.parent_joint.get(joint.parent)) is not None:
        level += above.name in driven
        joint = above
    return level


def _timed(sweep: Sweep) -> Sweep:
    """The sweep, shortened where the joint is too slow for its range."""
    if sweep.duration <= LONGEST:
        return sweep
    reason = f"it is too slow for more in {LONGEST:g} s"
    while sweep.duration > LONGEST:
        sweep = _shrunk(sweep, min(LONGEST / sweep.duration, 0.99), reason)
    return sweep


def _shrunk(sweep: Sweep, factor: float, reason: str) -> Sweep:
    """The sweep with both ends drawn towards home."""
    return replace(
        sweep,
        lower=sweep.home + factor * (sweep.lower - sweep.home),
        upper=sweep.home + factor * (sweep.upper - sweep.home),
        reasons=tuple(dict.fromkeys((*sweep.reasons, reason))),
    )


def _trimmed(figure: PointModel, stance: SupportMode, sweep: Sweep) -> Sweep:
    """The part of a sweep around home in which a free-standing robot neither tips nor hits the floor."""
    values = np.unique(np.append(np.linspace(sweep.lower, sweep.upper, SAMPLES), sweep.home))
    poses = figure.poses({sweep.joint: values})
    keeps, clear = _safety(
        figure, stance, poses, figure.moved_links(figure.description.joint_by_name[sweep.joint])
    )
    good = keeps & clear
    at_home = int(np.searchsorted(values, sweep.home))
    if good.all():
        return sweep
    first = last = at_home
    while first > 0 and good[first - 1]:
        first -= 1
    while last < len(values) - 1 and good[last + 1]:
        last += 1
    reasons = [] if keeps.all() else ["more would tip it over"]
    reasons += [] if clear.all() else ["more would hit the floor"]
    return replace(
        sweep, lower=float(values[first]), upper=float(values[last]), reasons=(*sweep.reasons, *reasons)
    )


def _safety(
    figure: PointModel, stance: SupportMode, poses: Mapping[str, Array], moved: Sequence[str]
) -> tuple[Flags, Flags]:
    """Where it keeps its balance, and where its moved parts (but its feet) stay above the floor."""
    keeps = stance.margin_at(figure.centre_of_mass(poses)) >= KEEP * stance.margin
    lifted = [name for name in moved if name not in stance.feet]
    clear = figure.lowest(poses, lifted) >= stance.lowest - SINK
    return np.broadcast_to(keeps, clear.shape), clear


def _balanced(figure: PointModel, stance: SupportMode, sweeps: tuple[Sweep, ...]) -> tuple[Sweep, ...]:
    """The sweeps of one group, made smaller together until they keep the robot on its feet."""
    every = list(figure.outlines)
    for _ in range(20):
        keeps, clear = _safety(figure, stance, _group_poses(figure, sweeps), every)
        if (keeps & clear).all():
            break
        reason = "more would tip it over" if not keeps.all() else "more would hit the floor"
        sweeps = tuple(_shrunk(sweep, 0.85, reason) for sweep in sweeps)
    return sweeps


def _group_poses(figure: PointModel, sweeps: Sequence[Sweep]) -> dict[str, Array]:
    phase = np.linspace(0.0, 1.0, 2 * SAMPLES + 1)
    return figure.poses({sweep.joint: sweep.at(phase)[0] for sweep in sweeps})


def _box(points: Array) -> Array:
    if points.size == 0:
        return np.zeros((2, 3))
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _still(figure: PointModel, groups: Sequence[Group]) -> dict[str, str]:
    moved = {sweep.joint for group in groups for sweep in group.sweeps if sweep.stretches}
    found = {}
    for joint in figure.description.depth_first_joints:
        if not joint.is_moving or joint.name in moved:
            continue
        if joint.mimic is not None:
            found[joint.name] = f'follows "{joint.mimic.joint}"'
        elif joint.name not in figure.home:
            found[joint.name] = f"is {joint.type}; it has no drive and moves freely"
        else:
            limits = joint.position_limits()
            found[joint.name] = (
                f"its limits leave no room ({limits[0]:g} to {limits[1]:g})"
                if limits is not None and limits[0] >= limits[1]
                else "no part of its range is safe for a robot that stands free"
            )
    return found

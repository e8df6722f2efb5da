"""The plan of a demo, computed before the simulation starts: groups of joints and the range of each.

Joints move in a few groups: first wheels and other joints that carry the robot, then joints equally far from
the base together, so that both arms of a robot do the same and the demo takes about a minute of simulated
time for any number of joints. On a free robot a joint moves only as far as the robot keeps its balance and
stays above the floor; on a supported or mounted robot it moves through its full range, on a stand that is
high enough.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from roboyard._arrays import NDArray
from roboyard.demo.sweep import Sweep, first_sweep
from roboyard.description.mass_properties import GRAVITY
from roboyard.morphology.point_model import PointModel, extreme_points
from roboyard.morphology.support_mode import SupportMode, decide
from roboyard.transforms import Array

Flags = NDArray[np.bool_]

MOST_GROUPS = 6
SHORTEST, LONGEST = 1.5, 20.0
"""Duration of a group (s)."""
SAMPLES = 33
"""Positions of a joint at which balance and floor are checked."""
REACH_DIRECTIONS = 48
"""Directions in which the farthest points of each group are searched."""
CLEARANCE = 0.05
"""Distance between a robot on a stand and the floor (m)."""
SINK = 0.01
"""Depth below its feet at which a part of a free robot counts as in the floor (m)."""
TIPPING_SHARE = 0.15
"""Share of the tipping moment that the reaction to a sweep may reach."""
ROLLING_SPEED = 1.2
"""Largest speed of joints that carry the robot (rad/s): wheels are often hulls, whose flats rock it."""
KEEP = 0.4
"""Share of the balance margin that must remain during a sweep."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Group:
    """Joints that move together."""

    sweeps: tuple[Sweep, ...]
    """Motion of each joint."""
    duration: float
    """Duration of the motion (s)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """Support, home posture and motion of a robot in the demo."""

    support: SupportMode
    """How the robot is supported by the floor."""
    home: Mapping[str, float]
    """Home position of every driven joint by name (rad or m)."""
    groups: tuple[Group, ...]
    """Groups in the order in which they move."""
    still: Mapping[str, str]
    """Name of each joint that is not moved to the reason."""
    stand: float
    """Height of the stand below a supported or mounted robot (m); 0 for none."""
    reach: Array
    """(k, 3) outermost points that its outline reaches, in the root link's frame (m)."""
    size: Array
    """(2, 3) bounding box of its outline at home, in the root link's frame (m)."""

    @property
    def duration(self) -> float:
        """Duration of all groups (s)."""
        return sum(group.duration for group in self.groups)

    @property
    def sweeps(self) -> dict[str, Sweep]:
        """Joint name to its sweep, in the order of motion."""
        return {sweep.joint: sweep for group in self.groups for sweep in group.sweeps}


def make_plan(model: PointModel) -> Plan:
    """Return the plan of a robot: its support, the groups of its joints and the range of each sweep."""
    support = decide(model)
    inertias = model.moved_inertias()
    levels: dict[tuple[bool, int], list[Sweep]] = {}
    for joint in model.joints:
        inertia = inertias[joint.name]
        sweep = first_sweep(joint, model.home[joint.name], inertia)
        if not sweep.stretches:
            continue
        if support.kind == "free":
            sweep = _trimmed(model, support, _slowed(model, support, sweep, inertia))
        place = (joint.name not in support.levers, _level(model, joint.name))
        levels.setdefault(place, []).append(_timed(sweep))
    merged = _merged([levels[place] for place in sorted(levels)], support.levers)
    groups = []
    for sweeps in merged:
        together = tuple(sweeps)
        if support.kind == "free":
            together = _balanced(model, support, together)
        groups.append(Group(sweeps=together, duration=max(SHORTEST, *(s.duration for s in together))))
    rest = model.points(model.poses({}))
    places = [rest, *(model.points(_group_poses(model, group.sweeps)).reshape(-1, 3) for group in groups)]
    reach = np.concatenate([extreme_points(place, REACH_DIRECTIONS) for place in places])
    stand = 0.0
    below = support.lowest - float(reach[:, 2].min(initial=support.lowest))
    if support.kind == "supported" or (support.kind == "mounted" and below > SINK):
        stand = float(below + CLEARANCE)
    return Plan(
        support=support,
        home=dict(model.home),
        groups=tuple(groups),
        still=_still(model, groups),
        stand=stand,
        reach=reach,
        size=_box(rest),
    )


def _slowed(model: PointModel, support: SupportMode, sweep: Sweep, inertia: float) -> Sweep:
    """Return the sweep slowed down so that its reaction moment stays below a share of the tipping moment.

    A robot of mass m tips at a moment of m g · margin. Accelerating an inertia takes inertia · acceleration;
    accelerating the robot on wheels takes m · height of the centre of mass · lever · acceleration.
    """
    moment = TIPPING_SHARE * model.mass * GRAVITY * support.margin
    lever = support.levers.get(sweep.joint)
    if lever is not None:
        sweep = replace(sweep, speed=min(sweep.speed, ROLLING_SPEED))
        height = float(model.centre_of_mass(model.poses({}))[2]) - support.lowest
        inertia = model.mass * height * lever
    elif model.description.joint_by_name[sweep.joint].type == "prismatic":
        inertia *= float(model.centre_of_mass(model.poses({}))[2]) - support.lowest
    if inertia <= 0 or moment <= 0:
        return sweep
    return replace(sweep, acceleration=min(sweep.acceleration, moment / inertia))


def _merged(levels: list[list[Sweep]], alone: Container[str]) -> list[list[Sweep]]:
    """Merge neighbouring levels to a few groups; wheels and joints that affect balance stay alone."""
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


def _level(model: PointModel, name: str) -> int:
    """Return the number of driven joints between the root and this joint."""
    driven = {joint.name for joint in model.joints}
    joint = model.description.joint_by_name[name]
    level = 0
    while (above := model.description.parent_joint.get(joint.parent)) is not None:
        level += above.name in driven
        joint = above
    return level


def _timed(sweep: Sweep) -> Sweep:
    """Return the sweep, shortened where the joint is too slow for its range."""
    if sweep.duration <= LONGEST:
        return sweep
    reason = f"too slow for its full range in {LONGEST:g} s"
    while sweep.duration > LONGEST:
        sweep = _shrunk(sweep, min(LONGEST / sweep.duration, 0.99), reason)
    return sweep


def _shrunk(sweep: Sweep, factor: float, reason: str) -> Sweep:
    """Return the sweep with both ends moved towards home by a factor."""
    return replace(
        sweep,
        lower=sweep.home + factor * (sweep.lower - sweep.home),
        upper=sweep.home + factor * (sweep.upper - sweep.home),
        reasons=tuple(dict.fromkeys((*sweep.reasons, reason))),
    )


def _trimmed(model: PointModel, support: SupportMode, sweep: Sweep) -> Sweep:
    """Return the part of a sweep around home in which a free robot neither tips nor hits the floor."""
    values = np.unique(np.append(np.linspace(sweep.lower, sweep.upper, SAMPLES), sweep.home))
    poses = model.poses({sweep.joint: values})
    keeps, clear = _safety(
        model, support, poses, model.moved_links(model.description.joint_by_name[sweep.joint])
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
    reasons = [] if keeps.all() else ["a wider sweep would tip the robot"]
    reasons += [] if clear.all() else ["a wider sweep would hit the floor"]
    return replace(
        sweep, lower=float(values[first]), upper=float(values[last]), reasons=(*sweep.reasons, *reasons)
    )


def _safety(
    model: PointModel, support: SupportMode, poses: Mapping[str, Array], moved: Sequence[str]
) -> tuple[Flags, Flags]:
    """Return for each pose whether the robot keeps its balance and its moved parts clear the floor."""
    keeps = support.margin_at(model.centre_of_mass(poses)) >= KEEP * support.margin
    lifted = [name for name in moved if name not in support.feet]
    clear = model.lowest(poses, lifted) >= support.lowest - SINK
    return np.broadcast_to(keeps, clear.shape), clear


def _balanced(model: PointModel, support: SupportMode, sweeps: tuple[Sweep, ...]) -> tuple[Sweep, ...]:
    """Return the sweeps of one group, shrunk together until the robot keeps its balance."""
    every = list(model.outlines)
    for _ in range(20):
        keeps, clear = _safety(model, support, _group_poses(model, sweeps), every)
        if (keeps & clear).all():
            break
        reason = (
            "a wider sweep would tip the robot" if not keeps.all() else "a wider sweep would hit the floor"
        )
        sweeps = tuple(_shrunk(sweep, 0.85, reason) for sweep in sweeps)
    return sweeps


def _group_poses(model: PointModel, sweeps: Sequence[Sweep]) -> dict[str, Array]:
    phase = np.linspace(0.0, 1.0, 2 * SAMPLES + 1)
    return model.poses({sweep.joint: sweep.at(phase)[0] for sweep in sweeps})


def _box(points: Array) -> Array:
    if points.size == 0:
        return np.zeros((2, 3))
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _still(model: PointModel, groups: Sequence[Group]) -> dict[str, str]:
    moved = {sweep.joint for group in groups for sweep in group.sweeps if sweep.stretches}
    found = {}
    for joint in model.description.depth_first_joints:
        if not joint.is_moving or joint.name in moved:
            continue
        if joint.mimic is not None:
            found[joint.name] = f'follows "{joint.mimic.joint}"'
        elif joint.name not in model.home:
            found[joint.name] = f"{joint.type} joint without a drive; it moves freely"
        else:
            limits = joint.position_limits()
            found[joint.name] = (
                f"its limits allow no motion ({limits[0]:g} to {limits[1]:g})"
                if limits is not None and limits[0] >= limits[1]
                else "no part of its range is safe for a free robot"
            )
    return found

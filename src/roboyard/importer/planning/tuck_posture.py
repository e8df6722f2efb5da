"""Tucked posture of a robot that drives or walks: its arms near the body, without contact, above the floor.

Many random postures of each arm are tried, the nearest to the body first; an arm that mirrors the one before
takes its posture where that is free.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from roboyard._arrays import NDArray
from roboyard.description.model import RobotDescription
from roboyard.description.robot_model import CollisionSphere, RobotModel
from roboyard.importer.planning.self_collision import PostureSampler, sample_range
from roboyard.importer.planning.sphere_pairs import SphereSets
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.morphology.point_model import PointModel
from roboyard.transforms import Array

TRIES = 1000
"""Random postures of each arm."""
GAP = 0.002
"""Smallest distance between links (m)."""
FLOOR_GAP = 0.05
"""Smallest height of an arm above the lowest point of the robot (m)."""
DIGITS = 3


def tuck_posture(
    robot: RobotModel,
    rest: Mapping[str, float],
    spheres: Mapping[str, Sequence[CollisionSphere]],
    ignore: Mapping[str, Sequence[str]],
    touches: Callable[[Mapping[str, float]], bool] = lambda posture: False,
) -> dict[str, float]:
    """Return the tucked position of every joint (rad or m); empty for a robot whose base does not move, one
    without arms, and where no free posture is found.

    Args:
        robot: with its semantics.
        rest: the rest posture.
        spheres: link name to its spheres.
        ignore: link name to links that it may touch.
        touches: whether collision shapes overlap in a posture where they do not at rest; never by default.
    """
    semantic = robot.semantic
    arms = [arm for arm in semantic.arms if arm.joints]
    names = [link.name for link in robot.description.links if spheres.get(link.name)]
    if semantic.base in ("none", "fixed", "floating") or not arms or not names:
        return {}
    sampler = PostureSampler(robot.description)
    sets = SphereSets.of(names, spheres)
    figure = PointModel(robot.description)
    carried = set().union(*(_moved(robot.description, arm.joints) for arm in arms))
    standing = [link.name for link in robot.description.links if link.name not in carried]

    def lowest(posture: Mapping[str, float], links: Sequence[str]) -> float:
        poses = figure.poses({name: value for name, value in posture.items() if name in figure.home})
        return float(figure.lowest(poses, links))

    floor = lowest(rest, standing)
    allowed = _allowed(names, ignore)
    tucked = dict(rest)
    changed = False
    before: list[tuple[tuple[str, ...], bool]] = []
    for arm in arms:
        moved = _moved(robot.description, arm.joints)
        own = [index for index, name in enumerate(names) if name in moved]
        if not own:
            continue

        def collides(posture: Mapping[str, float], links: tuple[str, ...] = tuple(sorted(moved))) -> bool:
            low = lowest(posture, links)  # also of shapes without spheres
            return (np.isfinite(floor) and low < floor + FLOOR_GAP) or touches(posture)

        trial = _Trials(sampler, sets, names, own, allowed, collides, is_one_of_two=len(arms) > 1)
        first = [_mirrored(robot.description, joints, arm.joints, tucked) for joints, ok in before if ok]
        found = trial.nearest(tucked, arm.joints, robot.description, [guess for guess in first if guess])
        if found is not None:
            tucked |= found
            changed = True
        before.append((arm.joints, found is not None))
    return (
        {name: _rounded(robot.description, name, value) for name, value in tucked.items()} if changed else {}
    )


def _rounded(description: RobotDescription, name: str, value: float) -> float:
    """Return a position with few digits, still within the joint's limits (rad or m)."""
    limits = description.joint_by_name[name].position_limits()
    short = round(value, DIGITS)
    return short if limits is None else min(max(short, limits[0]), limits[1])


class _Trials:
    """Postures of one arm, ranked by how far the arm reaches out."""

    def __init__(
        self,
        sampler: PostureSampler,
        sets: SphereSets,
        names: Sequence[str],
        own: Sequence[int],
        allowed: NDArray[np.bool_],
        touches: Callable[[Mapping[str, float]], bool],
        *,
        is_one_of_two: bool,
    ) -> None:
        self.sampler = sampler
        self.sets = sets
        self.names = names
        self.own = list(own)
        self.others = [index for index in range(len(names)) if index not in self.own]
        self.allowed = allowed
        self.touches = touches
        self.is_one_of_two = is_one_of_two

    def nearest(
        self,
        start: Mapping[str, float],
        joints: Sequence[str],
        description: RobotDescription,
        guesses: Sequence[dict[str, float]],
    ) -> dict[str, float] | None:
        """Return joint to position of the first free guess, else of the free posture nearest to the body,
        which may be the start; None where none is free.
        """
        rng = np.random.default_rng(0)
        ranges = np.array([sample_range(description.joint_by_name[name]) for name in joints])
        drawn = ranges[:, 0] + rng.uniform(size=(TRIES, len(joints))) * (ranges[:, 1] - ranges[:, 0])
        tries = [dict(zip(joints, (float(v) for v in row), strict=True)) for row in np.round(drawn, DIGITS)]
        options: list[dict[str, float]] = [{}, *guesses, *tries]
        postures = [self.sampler.posture({**start, **one}) for one in options]
        positions, rotations = self.sampler.frames(postures, self.names)
        spread = [self._spread(positions[k], rotations[k]) for k in range(len(postures))]

        def is_free(k: int) -> bool:
            return self._free(positions[k], rotations[k]) and not self.touches({**start, **options[k]})

        for index, guess in enumerate(guesses, start=1):
            if spread[index] < spread[0] and is_free(index):
                return guess
        ranked = sorted(range(1 + len(guesses), len(postures)), key=lambda k: spread[k])
        for index in ranked:
            if spread[index] >= spread[0]:
                break
            if is_free(index):
                return options[index]
        return {name: start.get(name, 0.0) for name in joints} if is_free(0) else None

    def _spread(self, positions: Array, rotations: Array) -> float:
        """Return how far the arm's links reach from the middle of the others, level, plus a tenth of their
        height, plus how far one of two arms reaches across the middle (m).
        """
        rough = self.sets.around
        centres = positions + np.einsum("lij,lj->li", rotations, rough[:, :3])
        middle = centres[self.others].mean(axis=0) if self.others else np.zeros(3)
        away = np.linalg.norm(centres[self.own, :2] - middle[:2], axis=1) + rough[self.own, 3]
        shoulder = float(centres[self.own[0], 1])
        across = rough[self.own, 3] - np.sign(shoulder) * centres[self.own, 1]
        crossed = float(across.max(initial=0.0)) if self.is_one_of_two else 0.0
        return float(away.max() + 0.1 * centres[self.own, 2].max() + crossed)

    def _free(self, positions: Array, rotations: Array) -> bool:
        """Return whether the arm touches nothing and stays above the floor."""
        centres = positions + np.einsum("lij,lj->li", rotations, self.sets.around[:, :3])
        lows = centres[:, 2] - self.sets.around[:, 3]
        if self.others and lows[self.own].min() < lows[self.others].min() + FLOOR_GAP:
            return False
        gaps = self.sets.gaps(positions, rotations)
        return bool((gaps[np.logical_not(self.allowed)] > GAP).all())


def _allowed(names: Sequence[str], ignore: Mapping[str, Sequence[str]]) -> NDArray[np.bool_]:
    """Return (links, links) whether two links may touch; also where the upper triangle holds no pair."""
    index = {name: k for k, name in enumerate(names)}
    allowed = np.tril(np.ones((len(names), len(names)), dtype=bool))
    for name, others in ignore.items():
        for other in others:
            if name in index and other in index:
                allowed[index[name], index[other]] = allowed[index[other], index[name]] = True
    return allowed


def _moved(description: RobotDescription, joints: Sequence[str]) -> set[str]:
    """Return the links that the joints move."""
    found: set[str] = set()
    stack = [description.joint_by_name[name].child for name in joints]
    while stack:
        link = stack.pop()
        if link not in found:
            found.add(link)
            stack += [joint.child for joint in description.child_joints[link]]
    return found


def _mirrored(
    description: RobotDescription, joints: Sequence[str], others: Sequence[str], posture: Mapping[str, float]
) -> dict[str, float] | None:
    """Return the posture of some joints for joints that mirror them across y = 0; None where they do not."""
    if len(joints) != len(others):
        return None
    frames = forward_kinematics(description)
    flip = np.array([1.0, -1.0, 1.0])
    found = {}
    for name, other in zip(joints, others, strict=True):
        one, two = description.joint_by_name[name], description.joint_by_name[other]
        axes = [frames[j.child][:3, :3] @ np.asarray(j.axis) for j in (one, two)]
        image = flip * axes[0] if one.type == "prismatic" else -flip * axes[0]
        along = float(image @ axes[1])
        limits = two.position_limits()
        value = posture.get(name, 0.0) * (1.0 if along > 0 else -1.0)
        if one.type != two.type or abs(along) < 0.95:
            return None
        if limits is not None and not limits[0] <= value <= limits[1]:
            return None
        found[other] = round(value, DIGITS)
    return found

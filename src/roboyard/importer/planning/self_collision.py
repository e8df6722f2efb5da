"""Pairs of links that a planner need not check: adjacent ones, and those that always or never collide.

Links are represented by their spheres, as in planners, in a few thousand random postures whose frames MuJoCo
computes; at rest also by their collision shapes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.model import Joint, RobotDescription
from roboyard.description.robot_model import CollisionSphere
from roboyard.importer.planning.sphere_pairs import PairCounts, SphereSets
from roboyard.kinematics.joint_order import single_dof_joints
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.sim import World
    from roboyard.sim.body import Body

SAMPLES = 3000
ALWAYS = 0.95
"""Share of postures with a collision from which a pair counts as always colliding."""
NEVER_MARGIN = 0.02
"""Smallest distance in every posture for a pair to count as never colliding (m)."""
REST_MARGIN = 0.004
"""Distance of spheres at rest below which a pair counts as colliding (m): twice cuRobo's sphere buffer."""
NEAR = 0.01
"""Distance of spheres below which hulls that overlap at rest count as colliding (m); spheres follow concave
shapes, hulls do not.
"""

BATCH = 500
"""Postures processed at once."""

Pair = tuple[str, str]


@dataclass(frozen=True, kw_only=True, slots=True)
class SelfCollision:
    """Pairs of links by how they collide in the sampled postures, in link order."""

    adjacent: tuple[Pair, ...]
    """Connected by a joint, or by links without spheres or without motion between them; or of one gripper."""
    at_rest: tuple[Pair, ...]
    """Colliding in the rest posture, or as near as their mirror images collide, and not adjacent."""
    always: tuple[Pair, ...]
    never: tuple[Pair, ...]
    samples: int

    def ignore(self) -> dict[str, tuple[str, ...]]:
        """Return each link with the links it may touch, each pair once."""
        found: dict[str, list[str]] = {}
        for a, b in (*self.adjacent, *self.at_rest, *self.always, *self.never):
            if b not in found.setdefault(a, []):
                found[a].append(b)
        return {a: tuple(others) for a, others in found.items()}


def self_collision_matrix(
    description: RobotDescription,
    spheres: Mapping[str, Sequence[CollisionSphere]],
    rest: Mapping[str, float],
    touching: Sequence[tuple[str, str, float]] = (),
    *,
    grippers: Sequence[Sequence[str]] = (),
    samples: int = SAMPLES,
    seed: int = 0,
) -> SelfCollision:
    """Return the pairs of links that a planner need not check.

    Args:
        description: the robot.
        spheres: link name to its spheres; links without any are skipped.
        rest: joint name to position at rest (rad or m).
        touching: links whose collision shapes touch at rest, with depth (m); see `contacts_at`.
        grippers: links of each gripper, which closes on itself.
        samples: random postures inside the limits.
        seed: seed of the random postures.
    """
    order = {link.name: index for index, link in enumerate(description.links)}
    names = sorted((name for name, own in spheres.items() if own), key=order.__getitem__)
    adjacent = adjacent_pairs(description, names)
    for links in grippers:
        adjacent |= {_key(a, b, order) for a, b in combinations(links, 2) if a in names and b in names}
    sets = SphereSets.of(names, spheres)
    sampler = PostureSampler(description)
    frames = sampler.frames([sampler.posture(rest)], names)
    rest_gap = sets.gaps(frames[0][0], frames[1][0])
    touching_pairs = {_key(a, b, order) for a, b, _ in touching}
    at_rest: list[Pair] = []
    open_pairs: list[tuple[int, int]] = []
    for i, a in enumerate(names):
        for j, b in enumerate(names[i + 1 :], start=i + 1):
            if (a, b) in adjacent:
                continue
            dents = NEAR if _key(a, b, order) in touching_pairs else REST_MARGIN
            if rest_gap[i, j] < dents:
                at_rest.append((a, b))
            else:
                open_pairs.append((i, j))
    mirrored = {_key(_other_side(a), _other_side(b), order) for a, b in at_rest if _is_of(order, a, b)}
    beside = [(i, j) for i, j in open_pairs if rest_gap[i, j] < NEAR and (names[i], names[j]) in mirrored]
    at_rest += [(names[i], names[j]) for i, j in beside]
    open_pairs = [pair for pair in open_pairs if pair not in beside]
    always, never = _over_postures(sampler, sets, names, open_pairs, samples, seed)
    return SelfCollision(
        adjacent=tuple(sorted(adjacent, key=lambda p: (order[p[0]], order[p[1]]))),
        at_rest=tuple(at_rest),
        always=tuple(always),
        never=tuple(never),
        samples=samples,
    )


def _over_postures(
    sampler: PostureSampler,
    sets: SphereSets,
    names: Sequence[str],
    pairs: list[tuple[int, int]],
    samples: int,
    seed: int,
) -> tuple[list[Pair], list[Pair]]:
    """Return the pairs that always collide, and those that never do, in random postures."""
    rng = np.random.default_rng(seed)
    watched = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    seen = PairCounts.empty(len(pairs))
    patience = int((1.0 - ALWAYS) * samples)
    for begin in range(0, samples, BATCH):
        postures = sampler.random(min(BATCH, samples - begin), rng)
        positions, rotations = sampler.frames(postures, names)
        seen.add(sets, watched, positions, rotations, margin=NEVER_MARGIN, patience=patience)
    named = [(names[i], names[j]) for i, j in pairs]
    always = [pair for pair, missed in zip(named, seen.missed, strict=True) if missed <= patience]
    never = [pair for pair, near in zip(named, seen.near, strict=True) if not near]
    return always, never


def adjacent_pairs(description: RobotDescription, names: Sequence[str]) -> set[Pair]:
    """Return pairs of named links that a joint connects, directly or through links that are not named, and
    pairs that cannot move relative to each other.
    """
    order = {link.name: index for index, link in enumerate(description.links)}
    named = set(names)
    pairs: set[Pair] = set()
    above: dict[str, str | None] = {}
    bodies: dict[str, list[str]] = {}
    body_of: dict[str, str] = {}
    for joint in ((None, description.root.name), *((j, j.child) for j in description.depth_first_joints)):
        of, child = joint
        nearest = None if of is None else (of.parent if of.parent in named else above[of.parent])
        above[child] = nearest
        if child in named and nearest is not None:
            pairs.add(_key(nearest, child, order))
        body_of[child] = child if of is None or of.is_moving else body_of[of.parent]
        if child in named:
            bodies.setdefault(body_of[child], []).append(child)
    for members in bodies.values():
        pairs |= {_key(a, b, order) for a, b in combinations(members, 2)}
    return pairs


def contacts_at(body: Body, world: World, rest: Mapping[str, float]) -> list[tuple[str, str, float]]:
    """Return links whose collision shapes overlap at `rest` (rad or m), with depth (m); adjacent links are
    skipped.
    """
    for joint in body.joints:
        if joint.is_scalar and joint.name in rest:
            joint.position = rest[joint.name]
    world.detect_contacts()
    data, geom_body = world.data, world.model.geom_bodyid
    index_of = {int(row): index for index, row in enumerate(body.mujoco_ids)}
    deepest: dict[tuple[int, int], float] = {}
    for geoms, distance in zip(data.contact.geom, data.contact.dist, strict=True):
        a, b = sorted(index_of.get(int(geom_body[g]), -1) for g in geoms)
        if a >= 0 and a != b and distance < 0:
            deepest[a, b] = max(deepest.get((a, b), 0.0), -float(distance))
    return [(body.links[a].name, body.links[b].name, depth) for (a, b), depth in deepest.items()]


def _other_side(name: str) -> str:
    """Return a name with left and right, or the single letters l and r, exchanged."""
    swap = {"left": "right", "right": "left", "l": "r", "r": "l"}

    def other(found: re.Match[str]) -> str:
        word = swap[found.group().lower()]
        return (
            word.upper() if found.group().isupper() else word.title() if found.group()[0].isupper() else word
        )

    return re.sub(r"left|right|(?<![a-z])[lr](?![a-z])", other, name, flags=re.IGNORECASE)


def _is_of(order: Mapping[str, int], *names: str) -> bool:
    """Return whether the robot has the links of the other side."""
    return all(_other_side(name) in order for name in names)


def _key(a: str, b: str, order: Mapping[str, int]) -> Pair:
    return (a, b) if order[a] < order[b] else (b, a)


# -------------------------------------------------------------------------------------------------- postures


class PostureSampler:
    """Random postures inside the joint limits, and their link frames."""

    def __init__(self, description: RobotDescription) -> None:
        from roboyard.sim import World

        bare = replace(
            description,
            links=tuple(replace(link, visuals=(), collisions=()) for link in description.links),
        )
        self.world = World(visual_geoms=False)
        self.body = self.world.add_description(bare, fixed_base=True, self_collision=False, drives=False)
        self.model: Any = self.world.model
        self.data: Any = self.world.data
        self.rows = {
            link.name: int(row) for link, row in zip(self.body.links, self.body.mujoco_ids, strict=True)
        }
        self.joints = list(single_dof_joints(description.joints))
        self.address = {j.name: self.body.joint(j.name).qpos_slice.start for j in self.joints}

    def posture(self, positions: Mapping[str, float]) -> Array:
        """Return the (nq,) posture with the named joints set, mimic joints following, and the others at
        zero.
        """
        q = np.array(self.model.qpos0)
        for joint in self.joints:
            q[self.address[joint.name]] = positions.get(joint.name, 0.0)
        self._follow(q[None])
        return q

    def random(self, count: int, rng: np.random.Generator) -> Array:
        """Return (count, nq) postures, uniform inside the limits; within ±π or ±0.5 m for joints without
        limits.
        """
        q = np.tile(np.array(self.model.qpos0), (count, 1))
        for joint in self.joints:
            lower, upper = sample_range(joint)
            q[:, self.address[joint.name]] = rng.uniform(lower, upper, count)
        self._follow(q)
        return q

    def _follow(self, q: Array) -> None:
        for _ in range(8):
            for joint in self.joints:
                if joint.mimic is not None and joint.mimic.joint in self.address:
                    leader = q[:, self.address[joint.mimic.joint]]
                    q[:, self.address[joint.name]] = joint.mimic.multiplier * leader + joint.mimic.offset

    def frames(self, postures: Array | Sequence[Array], names: Sequence[str]) -> tuple[Array, Array]:
        """Return (n, links, 3) positions (m) and (n, links, 3, 3) rotations of links in the root link's
        frame.
        """
        from roboyard._mujoco import mujoco

        rows = [self.rows[name] for name in names]
        positions = np.empty((len(postures), len(rows), 3))
        rotations = np.empty((len(postures), len(rows), 9))
        for index, posture in enumerate(postures):
            self.data.qpos[:] = posture
            mujoco.mj_kinematics(self.model, self.data)
            positions[index] = self.data.xpos[rows]
            rotations[index] = self.data.xmat[rows]
        return positions, rotations.reshape(len(postures), len(rows), 3, 3)


def sample_range(joint: Joint) -> tuple[float, float]:
    """Return the bounds within which a joint is sampled (rad or m)."""
    if joint.name.startswith("base_footprint_"):
        return (0.0, 0.0)
    limits = joint.position_limits()
    slides = joint.type == "prismatic"
    if limits is None:
        return (-0.5, 0.5) if slides else (-math.pi, math.pi)
    reach = 10.0 if slides else math.pi
    lower, upper = max(limits[0], -reach), min(limits[1], reach)
    return (lower, upper) if lower < upper else limits

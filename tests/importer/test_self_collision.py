"""Which pairs of links a planner need not check, against plain loops over the same postures."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from roboyard.description import Joint, Link, RobotDescription
from roboyard.description.model import Limit, Pose
from roboyard.description.robot_model import CollisionSphere
from roboyard.importer.planning.self_collision import (
    NEVER_MARGIN,
    REST_MARGIN,
    PostureSampler,
    self_collision_matrix,
)
from roboyard.kinematics.description_poses import forward_kinematics

SAMPLES = 200
SEED = 3


def spider() -> RobotDescription:
    """A body with three legs of two joints, a rotor, and a slide that can reach a leg."""
    links, joints = [Link(name="body")], []

    def add(name: str, parent: str, kind: str, position, axis, lower=-1.0, upper=1.0) -> None:
        links.append(Link(name=name))
        limit = Limit(lower=lower, upper=upper, effort=1.0, velocity=1.0)
        joints.append(
            Joint(
                name=f"{name}_joint",
                type=kind,
                parent=parent,
                child=name,
                origin=Pose(position=position),
                axis=axis,
                limit=limit if kind != "continuous" else None,
            )
        )

    for leg in range(3):
        around = 2 * np.pi * leg / 3
        add(f"hip{leg}", "body", "revolute", (0.12 * np.cos(around), 0.12 * np.sin(around), 0.0), (0, 0, 1))
        add(f"shin{leg}", f"hip{leg}", "revolute", (0.1, 0.0, 0.0), (0, 1, 0), -0.5, 2.0)
    add("rotor", "body", "continuous", (0.0, 0.0, 0.12), (0, 0, 1))
    add("lamp", "rotor", "fixed", (0.0, 0.0, 0.01), (1, 0, 0))
    add("slide", "body", "prismatic", (0.0, 0.0, -0.3), (0, 0, 1), 0.0, 0.25)
    return RobotDescription(name="spider", links=tuple(links), joints=tuple(joints))


def balls(seed: int) -> dict[str, tuple[CollisionSphere, ...]]:
    rng = np.random.default_rng(seed)
    found = {}
    for link in spider().links:
        found[link.name] = tuple(
            CollisionSphere(
                center=tuple(rng.uniform(-0.05, 0.05, 3)),  # type: ignore[arg-type]
                radius=float(rng.uniform(0.01, 0.05)),
            )
            for _ in range(rng.integers(1, 6))
        )
    return found


def gap(frames, spheres, a, b) -> float:
    """Least distance between two links' balls."""
    centers, radii = [], []
    for name in (a, b):
        local = np.array([(*ball.center, 1.0) for ball in spheres[name]])
        centers.append(local @ frames[name][:3].T)
        radii.append(np.array([ball.radius for ball in spheres[name]]))
    between = np.linalg.norm(centers[0][:, None] - centers[1][None], axis=2)
    return float((between - radii[0][:, None] - radii[1][None]).min())


@pytest.mark.parametrize("seed", [0, 1])
def test_pairs_are_sorted_as_plain_loops_over_the_postures_would(seed):
    robot, spheres = spider(), balls(seed)
    found = self_collision_matrix(robot, spheres, {}, samples=SAMPLES, seed=SEED)
    sampler = PostureSampler(robot)
    postures = sampler.random(SAMPLES, np.random.default_rng(SEED))
    moving = [joint.name for joint in sampler.joints]
    names = [link.name for link in robot.links]
    gaps = {pair: [] for pair in itertools.combinations(names, 2)}
    for q in postures:
        frames = forward_kinematics(robot, {name: q[sampler.address[name]] for name in moving})
        for pair in gaps:
            gaps[pair].append(gap(frames, spheres, *pair))
    rest = forward_kinematics(robot)
    joined = {(j.parent, j.child) for j in robot.joints}
    for pair, over in gaps.items():
        kind = [k for k in ("adjacent", "at_rest", "always", "never") if pair in getattr(found, k)]
        if pair in joined or pair[::-1] in joined:
            wanted = ["adjacent"]
        elif gap(rest, spheres, *pair) < REST_MARGIN:
            wanted = ["at_rest"]
        elif np.mean(np.array(over) < 0) >= 0.95:
            wanted = ["always"]
        else:
            wanted = ["never"] if min(over) > NEVER_MARGIN else []
        assert kind == wanted, pair
    assert found.never and found.at_rest and len(found.ignore()) > 2


def test_hulls_that_touch_count_only_where_the_balls_are_near():
    robot = spider()
    spheres = {
        "body": (CollisionSphere(center=(0, 0, 0), radius=0.05),),
        "shin0": (CollisionSphere(center=(0, 0, 0), radius=0.05),),
        "rotor": (CollisionSphere(center=(0, 0, 0), radius=0.01),),
        "lamp": (CollisionSphere(center=(0, 0, 0), radius=0.073),),
    }
    hulls = [("body", "shin0", 0.01), ("body", "lamp", 0.01)]
    found = self_collision_matrix(robot, spheres, {}, hulls, samples=10)
    assert found.at_rest == (("body", "lamp"),), "the shin's balls are 0.12 m away, the lamp's 7 mm"


def test_links_that_cannot_move_against_each_other_are_neighbours():
    """Two brackets screwed to one body: nothing can change whether they touch."""
    links = tuple(Link(name=name) for name in ("body", "left", "right", "arm"))
    joints = [Joint(name=f"fix_{s}", type="fixed", parent="body", child=s) for s in ("left", "right")]
    joints.append(Joint(name="turn", type="continuous", parent="left", child="arm", axis=(0, 0, 1)))
    robot = RobotDescription(name="brackets", links=links, joints=tuple(joints))
    spheres = {link.name: (CollisionSphere(center=(0, 0, 0), radius=0.1),) for link in links}
    found = self_collision_matrix(robot, spheres, {}, samples=10)
    assert ("left", "right") in found.adjacent
    assert {pair for pair in found.adjacent if "arm" in pair} == {("left", "arm")}

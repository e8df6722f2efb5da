"""Pairs of links whose spheres overlap where their hulls never touch are left to exact shapes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from roboyard.description.model import Box, Collision, Joint, Limit, Link, Pose, RobotDescription
from roboyard.description.robot_model import CollisionSphere
from roboyard.planning import Planner, SphereModel
from roboyard.planning.attached import Attached, with_attached
from roboyard.planning.hull_judge import judge_of
from roboyard.planning.kernels.arrays import work_for
from roboyard.planning.kernels.checker import is_free
from roboyard.planning.obstacles import Obstacles
from roboyard.planning.spheres.never_touching import never_touch, proven_apart
from roboyard.planning.spheres.self_pairs import adjacent_pairs, allowed_overlaps, rough_pairs
from roboyard.planning.spheres.sphere_model import sphere_robot


def tower(gap: float) -> SphereModel:
    """Three plates above each other that turn about an axis, each a large sphere, and a flap on the last."""
    plate = Collision(geometry=Box(size=(0.2, 0.2, 0.02)))
    links, joints = [Link(name="plate0", collisions=(plate,))], []
    limit = Limit(lower=-3.0, upper=3.0, effort=10.0, velocity=2.0)
    for k in (1, 2):
        links.append(Link(name=f"plate{k}", collisions=(plate,)))
        origin = Pose(position=(0.0, 0.0, gap / 2))
        joints.append(
            Joint(
                name=f"turn{k}",
                type="revolute",
                parent=f"plate{k - 1}",
                child=f"plate{k}",
                origin=origin,
                axis=(0, 0, 1),
                limit=limit,
            )
        )
    arm = Collision(geometry=Box(size=(0.02, 0.02, 0.3)), origin=Pose(position=(0.0, 0.0, 0.15)))
    links.append(Link(name="flap", collisions=(arm,)))
    origin = Pose(position=(0.15, 0.0, 0.0))
    fold = Joint(
        name="fold",
        type="revolute",
        parent="plate2",
        child="flap",
        origin=origin,
        axis=(0, 1, 0),
        limit=limit,
    )
    joints.append(fold)
    description = RobotDescription(name="tower", links=tuple(links), joints=tuple(joints))
    large = (CollisionSphere(center=(0.0, 0.0, 0.0), radius=0.15),)
    rod = tuple(CollisionSphere(center=(0.0, 0.0, 0.03 * k), radius=0.03) for k in range(11))
    spheres = {"plate0": large, "plate1": large, "plate2": large, "flap": rod}
    return SphereModel(
        description=description,
        spheres=spheres,
        ignore=frozenset(adjacent_pairs(description, list(spheres)) | {("flap", "plate1")}),
        gaps=dict.fromkeys(spheres, 0.0),
    )


def test_plates_that_never_touch_are_rough_and_a_flap_that_does_is_not() -> None:
    assert rough_pairs(tower(0.1)) == {("plate0", "plate2")}


@pytest.mark.parametrize("fold", [-2.6, 2.6])
def test_plans_are_found_between_rough_pairs_and_judged_by_hulls(fold: float) -> None:
    model = tower(0.1)
    start, goal = np.array([0.0, 0.0, 0.3]), np.array([0.5, 0.5, 0.3])
    assert Planner(model).plan(start, goal).solved, "where start and goal touch, hulls decide"
    model = replace(model, rough=rough_pairs(model))
    planner = Planner(model)
    assert planner.plan(start, goal).solved
    folded = planner.plan(start, np.array([0.5, 0.5, fold]))
    judged = planner.judge.clashes(np.array([0.5, 0.5, fold]))
    assert folded.solved == (not judged)
    if judged:
        assert "flap" in folded.reason


def test_the_first_overlap_of_a_rough_pair_is_where_checking_every_step_finds_it() -> None:
    model = tower(0.1)
    pair = ("flap", "plate0")
    model = replace(model, rough=frozenset({pair}))
    judge = Planner(model).judge
    assert judge.robot.rough == (pair,)
    fold = np.linspace(0.3, -2.9, 1500)
    qs = np.stack([0.2 * np.sin(fold), 0.1 * fold, fold], axis=1)
    every = next(i for i, q in enumerate(qs) if any({c.link, c.other} == set(pair) for c in judge.clashes(q)))
    found = judge.first_pair_clash(qs)
    assert found is not None
    assert found[0] == every
    assert judge.first_pair_clash(qs[:every]) is None
    assert judge.first_pair_clash(qs[:0]) is None


def test_plates_that_cannot_touch_are_proven_apart_and_a_flap_that_can_is_not() -> None:
    model = replace(tower(0.1), rough=frozenset({("plate0", "plate2"), ("flap", "plate0")}))
    assert proven_apart(model) == {("plate0", "plate2")}
    robot = sphere_robot(model, model.coordinate_names)
    judge = judge_of(robot, ())
    for pair, reach in zip(robot.rough, robot.rough_reach, strict=True):
        proven = never_touch(judge, pair, reach, robot.arrays.lower, robot.arrays.upper)
        assert proven == (pair == ("plate0", "plate2"))


def test_a_pair_is_looked_at_again_when_one_of_its_links_holds_a_body() -> None:
    pair = ("plate0", "plate2")
    model = replace(tower(0.1), apart=frozenset({pair}), overlaps={("flap", "plate0"): 0.01})
    ball = (CollisionSphere(center=(0.0, 0.0, 0.1), radius=0.03),)
    held = Attached(body=None, link="flap", pose=np.eye(4), spheres=ball, touching=frozenset())  # type: ignore[arg-type]
    loaded = with_attached(model, [held])
    assert (loaded.apart, loaded.rough, loaded.overlaps) == (frozenset({pair}), frozenset(), {})
    loaded = with_attached(model, [replace(held, link="plate2")])
    assert (loaded.apart, loaded.rough) == (frozenset(), frozenset({pair}))
    assert loaded.overlaps == model.overlaps


def test_allowed_overlaps_close_fewer_free_postures_and_motions_stay_free() -> None:
    model = tower(0.1)
    model = replace(model, rough=rough_pairs(model))
    model = replace(model, overlaps=allowed_overlaps(model))
    assert model.overlaps and all(0.0 < depth < 0.18 for depth in model.overlaps.values())
    robot = sphere_robot(model, model.coordinate_names)
    judge, world = judge_of(robot, ()), Obstacles().arrays
    work = work_for(robot.arrays, world)
    postures = np.random.default_rng(7).uniform(robot.arrays.lower, robot.arrays.upper, (1500, 3))
    free = [q for q in postures if not judge.clashes(q)]
    closed = [
        sum(not is_free(arrays, world, q, 0.0, work) for q in free)
        for arrays in (robot.arrays, robot.search_arrays)
    ]
    assert closed[1] < 0.5 * closed[0]
    planner = Planner(model)
    for k in range(0, 40, 2):
        plan = planner.plan(free[k], free[k + 1])
        if plan.solved:
            assert plan.trajectory is not None
            assert judge.first_clash(plan.trajectory.dense(0.005)) is None

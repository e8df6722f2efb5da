"""Plans of an arm with primitive shapes: replayed in MuJoCo, within limits, failures with their reasons."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Joint,
    Limit,
    Link,
    Pose,
    RobotDescription,
    Sphere,
)
from roboyard.description.robot_model import CollisionSphere
from roboyard.errors import ConfigError
from roboyard.kinematics import forward_kinematics
from roboyard.planning import (
    Obstacle,
    Planner,
    PoseGoal,
    PosesGoal,
    SphereModel,
    covering_model,
    fitted_model,
)

LENGTHS = (0.25, 0.3, 0.3, 0.25, 0.15, 0.1)


def chain_arm() -> RobotDescription:
    """Six joints about z, y, y, x, y, x with capsules between them."""
    axes = ((0, 0, 1), (0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0))
    links = [Link(name="base", collisions=(Collision(geometry=Box(size=(0.2, 0.2, 0.1))),))]
    joints = []
    for k, (axis, length) in enumerate(zip(axes, LENGTHS, strict=True)):
        along = (0.0, 0.0, 0.1) if k == 0 else (0.0, 0.0, LENGTHS[k - 1])
        shape = Capsule(radius=0.04, length=length - 0.02)
        middle = Pose(position=(0.0, 0.0, length / 2))
        links.append(Link(name=f"link{k}", collisions=(Collision(geometry=shape, origin=middle),)))
        joints.append(
            Joint(
                name=f"j{k}",
                type="revolute",
                parent="base" if k == 0 else f"link{k - 1}",
                child=f"link{k}",
                origin=Pose(position=along),
                axis=axis,
                limit=Limit(lower=-2.6, upper=2.6, velocity=2.0, effort=10.0),
            )
        )
    return RobotDescription(name="chain", links=tuple(links), joints=tuple(joints))


WALL = Obstacle(name="wall", shape=Box(size=(0.8, 0.05, 0.9)), pose=Pose(position=(0.6, 0.0, 0.45)))
FLOOR = Obstacle(name="floor", shape=Box(size=(3, 3, 0.02)), pose=Pose(position=(0, 0, -0.12)))
START, GOAL = (-0.9, 0.9, 0.6, 0.0, 0.3, 0.0), (0.9, 0.9, 0.6, 0.0, 0.3, 0.0)


@pytest.fixture(scope="module")
def model() -> SphereModel:
    return fitted_model(chain_arm())


@pytest.fixture(scope="module")
def planner(model: SphereModel) -> Planner:
    return Planner(model, obstacles=[WALL, FLOOR])


def replay(dense: np.ndarray) -> float:
    """Deepest overlap in a MuJoCo model written here, of links that are not neighbours and of obstacles."""
    spec = mujoco.MjSpec()
    for obstacle in (WALL, FLOOR):
        assert isinstance(obstacle.shape, Box)
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=np.array(obstacle.shape.size) / 2,
            pos=obstacle.pose.position,
        )
    axes = ((0, 0, 1), (0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0))
    body, bodies = spec.worldbody, []
    for k, (axis, length) in enumerate(zip(axes, LENGTHS, strict=True)):
        body = body.add_body(pos=(0, 0, 0.1 if k == 0 else LENGTHS[k - 1]), name=f"l{k}")
        body.add_joint(axis=axis)
        size = [0.04, length / 2 - 0.01, 0]
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=size, pos=(0, 0, length / 2))
        bodies.append(body)
    # joints of one centre: links two apart overlap where they fold
    for k in range(4):
        spec.add_exclude(bodyname1=f"l{k}", bodyname2=f"l{k + 2}")
    compiled = spec.compile()
    data = mujoco.MjData(compiled)
    deepest = 0.0
    for q in dense:
        data.qpos[:] = q
        mujoco.mj_kinematics(compiled, data)
        mujoco.mj_collision(compiled, data)
        for contact in data.contact[: data.ncon]:
            deepest = max(deepest, -contact.dist)
    return deepest


def test_a_plan_goes_round_the_wall_and_touches_nothing(planner: Planner) -> None:
    line = np.linspace(0, 1, 200)[:, None] * (np.array(GOAL) - START) + START
    assert replay(line) > 0.01
    for seed in range(10):
        plan = planner.plan(START, GOAL, seed=seed)
        assert plan.solved, plan.reason
        assert plan.trajectory is not None
        dense = plan.trajectory.dense()
        assert replay(dense) < 1e-6
        np.testing.assert_allclose(dense[[0, -1]], [START, GOAL], atol=1e-9)
        q, v, a, j = plan.trajectory.at(np.linspace(0, plan.trajectory.duration, 5000))
        assert np.abs(v).max() <= 2.0 * (1 + 1e-6)
        assert np.abs(a).max() <= 15.0 * (1 + 1e-6)
        assert np.abs(j).max() <= 500.0 * (1 + 1e-6)
        assert (np.abs(q) <= 2.6).all()


def test_the_same_seed_gives_the_same_path(planner: Planner) -> None:
    one, two = planner.plan(START, GOAL, seed=3), planner.plan(START, GOAL, seed=3)
    np.testing.assert_array_equal(one.path, two.path)


def test_more_time_gives_a_path_that_is_no_longer(planner: Planner) -> None:
    first = planner.plan(START, GOAL, seed=5)
    longer = planner.plan(START, GOAL, seed=5, improve=0.3)
    assert longer.length <= first.length + 1e-9


def test_poses_are_reached_with_and_without_orientation(planner: Planner) -> None:
    from roboyard.kinematics import forward_kinematics, from_description
    from roboyard.transforms import quaternion_from_matrix

    chain = from_description(chain_arm(), "link5")
    pose = forward_kinematics(chain, GOAL)
    position = pose[:3, 3]
    quaternion = quaternion_from_matrix(pose[:3, :3])
    for turn in (None, quaternion):
        plan = planner.plan(START, PoseGoal(link="link5", position=position, quaternion=turn))
        assert plan.solved, plan.reason
        reached = forward_kinematics(chain, plan.path[-1])
        np.testing.assert_allclose(reached[:3, 3], position, atol=2e-4)
        if turn is not None:
            np.testing.assert_allclose(reached[:3, :3], pose[:3, :3], atol=3e-3)


def test_ik_lists_distinct_postures_with_free_ones_first(planner: Planner) -> None:
    from roboyard.kinematics import forward_kinematics, from_description

    pose = forward_kinematics(from_description(chain_arm(), "link5"), GOAL)
    found = planner.ik(PoseGoal(link="link5", position=pose[:3, 3].tolist()), START)
    assert len(found) > 3
    flags = [solution.is_free for solution in found]
    assert flags == sorted(flags, reverse=True)
    assert flags[0]
    for i, one in enumerate(found):
        assert one.position_error < 1e-4
        for other in found[i + 1 :]:
            assert np.abs(one.q - other.q).max() >= 0.05


def test_the_nearest_of_several_goals_is_reached(planner: Planner) -> None:
    plan = planner.plan(START, [GOAL, tuple(np.array(START) + 0.05)])
    assert plan.solved
    assert plan.goal == 1


def test_failures_name_the_pair_the_depth_and_a_remedy(model: SphereModel, planner: Planner) -> None:
    inside = (0.0, 0.9, 0.6, 0.0, 0.3, 0.0)
    plan = planner.plan(inside, GOAL)
    assert plan.outcome == "start in collision"
    assert '"wall"' in plan.reason
    assert " mm" in plan.reason
    assert planner.plan(START, inside).outcome == "goal in collision"
    far = planner.plan(START, PoseGoal(link="link5", position=(3.0, 0.0, 0.5)))
    assert far.outcome == "goal unreachable"
    assert "link5" in far.reason
    assert planner.plan((3.0, *START[1:]), GOAL).outcome == "start outside limits"
    assert "j0" in planner.plan(START, (3.0, *GOAL[1:])).reason
    # two plates leave room for an upright arm only, and the lid is too low for that
    plates = [
        Obstacle(name=f"plate{x}", shape=Box(size=(3, 0.02, 4)), pose=Pose(position=(x, 0, 0.5)))
        for x in (-1.56, 1.56)
    ]
    lid = Obstacle(name="lid", shape=Box(size=(3, 3, 0.02)), pose=Pose(position=(0, 0, 1.2)))
    closed = Planner(model, obstacles=[*plates, lid, FLOOR])
    over = closed.plan(START, GOAL, time_limit=0.2)
    assert over.outcome == "time over"
    assert "time" in over.reason


def test_wrong_vectors_are_named(planner: Planner, model: SphereModel) -> None:
    with pytest.raises(ConfigError, match="start"):
        planner.plan((0.0, 1.0), GOAL)
    with pytest.raises(ConfigError, match="elbow"):
        Planner(model, ["elbow"])
    with pytest.raises(ConfigError, match="velocity"):
        Planner(model, velocity=[1.0, 2.0])


def test_held_joints_and_the_order_of_joints(model: SphereModel) -> None:
    names = ["j4", "j0", "j1", "j2"]
    planner = Planner(model, names, [WALL, FLOOR], held={"j3": 0.4})
    start, goal = (0.3, -0.9, 0.9, 0.6), (0.3, 0.9, 0.9, 0.6)
    plan = planner.plan(start, goal)
    assert plan.solved
    np.testing.assert_allclose(plan.path[[0, -1]], [start, goal], atol=1e-12)
    whole = np.zeros((len(dense := plan.trajectory.dense()), 6))  # type: ignore[union-attr]
    whole[:, [4, 0, 1, 2]], whole[:, 3] = dense, 0.4
    assert replay(whole) < 1e-6


def test_an_obstacle_that_moved_is_avoided(model: SphereModel) -> None:
    ball = Obstacle(name="ball", shape=Sphere(radius=0.1), pose=Pose(position=(0, 0, 5)))
    planner = Planner(model, obstacles=[ball])
    assert len(planner.plan(START, GOAL).path) == 2
    middle = planner.checker.robot
    from roboyard.kinematics import forward_kinematics

    tip = forward_kinematics(middle.chain, (np.array(START) + GOAL) / 2, "link5")[:3, 3]
    planner.obstacles.move("ball", Pose(position=tuple(tip)))
    plan = planner.plan(START, GOAL)
    assert plan.solved
    assert len(plan.path) > 2


def test_spheres_of_a_file_that_leave_links_out_are_completed(model: SphereModel) -> None:
    tiny = {"link3": (CollisionSphere(center=(0.0, 0.0, 0.05), radius=0.01),)}
    file = replace(model, spheres=tiny, gaps={}, self_buffer={}, ignore=frozenset({("link0", "link5")}))
    made = covering_model(file)
    assert made.spheres["link3"][0] == tiny["link3"][0], "the file's own spheres stay"
    assert set(made.spheres) == set(model.spheres)
    assert ("link0", "link5") in made.ignore
    assert ("link1", "link2") in made.ignore
    covered, bare = (Planner(one, obstacles=[WALL, FLOOR]) for one in (made, file))
    lower, upper = covered.bounds
    qs = np.random.default_rng(4).uniform(lower, upper, (800, len(lower)))
    touching = np.array([bool(covered.judge.clashes(q)) for q in qs])
    assert 100 < touching.sum() < 700
    assert bare.checker.free(qs)[touching].any()
    rough = [covered.judge.first_pair_clash(q[None]) is not None for q in qs]
    assert not (covered.checker.free(qs) & touching & ~np.array(rough)).any()


def test_fitting_is_announced_once_and_cached(
    model: SphereModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("ROBOYARD_CACHE", str(tmp_path))
    with caplog.at_level(logging.WARNING):
        cold = fitted_model(model.description)
        assert [r.getMessage().split(":")[0] for r in caplog.records] == [
            f"fitting spheres to the links of {model.description.name}"
        ]
        warm = fitted_model(model.description)
    assert len(caplog.records) == 1
    assert warm.spheres == cold.spheres


def test_poses_that_cannot_be_reached_together_are_named(planner: Planner) -> None:
    chain = planner.robot.chain
    links = ("link3", "link5")
    near, far = (forward_kinematics(chain, np.array(q), links) for q in (START, GOAL))

    def poses(tip: np.ndarray, elbow: np.ndarray) -> PosesGoal:
        return PosesGoal(
            poses=[
                PoseGoal(link=name, position=pose[:3, 3])
                for name, pose in zip(links, (elbow, tip), strict=True)
            ]
        )

    whole = planner.plan(START, poses(far[1], far[0]))
    assert whole.solved, whole.reason
    reached = forward_kinematics(chain, whole.path[-1], links)
    np.testing.assert_allclose(reached[:, :3, 3], far[:, :3, 3], atol=2e-4)
    plan = planner.plan(START, poses(far[1], near[0]))
    assert plan.outcome == "goal unreachable"
    assert "at once" in plan.reason
    with pytest.raises(ConfigError, match=r"link5.*two poses"):
        planner.plan(START, PosesGoal(poses=[PoseGoal(link="link5", position=(0.3, 0, 0.5))] * 2))
    with pytest.raises(ConfigError, match="without poses"):
        planner.ik(PosesGoal(poses=[]), START)

"""createConstraint and its queries, compared with PyBullet 3.2.7 and with statics."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.pybullet.client import Client
from roboyard.pybullet.connections import CLIENTS

WHEELS = "".join(
    f"""<link name="{name}"><inertial><mass value="1"/>
<inertia ixx="{inertia}" ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"/></inertial></link>
<joint name="j{name}" type="continuous"><parent link="base"/><child link="{name}"/>
<axis xyz="0 0 1"/><origin xyz="{place} 0 0"/></joint>"""
    for place, (name, inertia) in enumerate((("a", 0.01), ("b", 0.03), ("c", 0.02)))
)
WHEELS = f'<robot name="wheels"><link name="base"/>{WHEELS}</robot>'


def box(p: Any, at: tuple[float, float, float], mass: float = 1.0) -> int:
    return p.createMultiBody(mass, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), basePosition=at)


def message_of(call: Callable[[], Any]) -> list[str]:
    try:
        return ["no error", repr(call())]
    except Exception as problem:
        return [type(problem).__name__, str(problem)]


def record_constraint_info(p: Any, folder: Path) -> Any:
    a, b = box(p, (0, 0, 1)), box(p, (0, 0, 2))
    made = [
        p.createConstraint(a, -1, b, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0.5], [0, 0, -0.5]),
        p.createConstraint(
            a, -1, b, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0.5], [0, 0, -0.5], [0, 0, 0, 1], [0, 0, 0.6, 0.8]
        ),
        p.createConstraint(a, -1, -1, -1, p.JOINT_POINT2POINT, [0, 0, 0], [0.1, 0, 0], [0.1, 0, 1]),
        p.createConstraint(a, -1, -1, -1, p.JOINT_PRISMATIC, [1, 0, 0], [0, 0, 0], [0, 0, 1]),
    ]
    found = [p.getConstraintInfo(each) for each in made]
    p.changeConstraint(made[2], [0.3, 0, 1], maxForce=20)
    return [made, found, p.getConstraintInfo(made[2]), p.getNumConstraints()]


def record_constraint_ids(p: Any, folder: Path) -> Any:
    a, b = box(p, (0, 0, 1)), box(p, (0, 0, 2))
    for _ in range(3):
        p.createConstraint(a, -1, b, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0.5], [0, 0, -0.5])
    p.removeConstraint(2)
    p.removeConstraint(50)
    fresh = p.createConstraint(a, -1, b, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0.5], [0, 0, -0.5])
    return [fresh, p.getNumConstraints(), sorted(p.getConstraintUniqueId(i) for i in range(3))]


def record_constraint_errors(p: Any, folder: Path) -> Any:
    a = box(p, (0, 0, 1))
    return [
        message_of(lambda: p.getConstraintInfo(9)),
        message_of(lambda: p.getConstraintState(9)),
        message_of(lambda: p.removeConstraint(9)),
        message_of(lambda: p.changeConstraint(9, [0, 0, 0])),
        message_of(lambda: p.createConstraint(77, -1, a, -1, p.JOINT_FIXED, [0] * 3, [0] * 3, [0] * 3)),
    ]


def record_constraints_in_turn(p: Any, folder: Path) -> Any:
    """Poses and constraints' forces after 1, 11 and 71 steps: a case for each way rows of constraints act."""
    found = {}

    def follow(name: str, constraint: int, *bodies: int) -> None:
        for steps in (1, 10, 60):
            for _ in range(steps):
                p.stepSimulation()
            poses = [p.getBasePositionAndOrientation(body) for body in bodies]
            found.setdefault(name, []).append([poses, p.getConstraintState(constraint)])

    def start() -> int:
        p.resetSimulation()
        p.setGravity(0, 0, -10)
        return box(p, (0, 0, 1), 2.0)

    hung = start()
    follow(
        "hung off its centre",
        p.createConstraint(hung, -1, -1, -1, p.JOINT_POINT2POINT, [0] * 3, [0.1, 0, 0.1], [0.1, 0, 1.1]),
        hung,
    )
    pulled = start()
    follow(
        "pulled by more than 500 N",
        p.createConstraint(pulled, -1, -1, -1, p.JOINT_POINT2POINT, [0] * 3, [0, 0, 0.1], [0.02, 0, 1.15]),
        pulled,
    )
    for force in (15.0, 60.0):  # less than the weight, and more
        held = start()
        hand = box(p, (0, 0, 1.3), 0.0)
        weld = p.createConstraint(hand, -1, held, -1, p.JOINT_FIXED, [0] * 3, [0, 0, -0.15], [0.02, 0, 0.15])
        p.changeConstraint(weld, maxForce=force)
        follow(f"held by {force} N", weld, held)
    turned = start()
    weld = p.createConstraint(turned, -1, -1, -1, p.JOINT_FIXED, [0] * 3, [0] * 3, [0, 0, 1])
    p.changeConstraint(weld, [0.1, 0, 1.0], [0, 0, 0.6, 0.8], maxForce=50)
    follow("a frame that jumps", weld, turned)
    rail = start()
    p.setGravity(0, 0, 0)
    cart = box(p, (0.5, 0, 1))
    p.resetBaseVelocity(cart, [0.5, 0, 0])
    slide = p.createConstraint(rail, -1, cart, -1, p.JOINT_PRISMATIC, [1, 0, 0], [0.5, 0, 0.01], [0] * 3)
    follow("a slide", slide, rail, cart)
    return found


def record_gears_in_turn(p: Any, folder: Path) -> Any:
    """Joint states after 1, 11 and 71 steps of three wheels, the first two with a gear, all with motors."""
    (folder / "wheels.urdf").write_text(WHEELS)
    found = []
    held = {"erp": 0.5, "relativePositionTarget": 0.25}
    for changes in ({}, held, {"gearAuxLink": 2}, {"maxForce": 0.125}):
        p.resetSimulation()
        body = p.loadURDF(str(folder / "wheels.urdf"), useFixedBase=True, flags=p.URDF_USE_INERTIA_FROM_FILE)
        for joint, (velocity, force) in enumerate(((3, 0.5), (0, 0), (1, 0.25))):
            p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, targetVelocity=velocity, force=force)
        gear = p.createConstraint(body, 0, body, 1, p.JOINT_GEAR, [0, 0, 1], [0] * 3, [0] * 3)
        p.changeConstraint(gear, gearRatio=-2)
        if changes:
            p.changeConstraint(gear, **changes)
        for steps in (1, 10, 60):
            for _ in range(steps):
                p.stepSimulation()
            states = [state[:2] for state in p.getJointStates(body, range(3))]
            found.append([states, p.getConstraintState(gear)])
    return found


def test_constraints_move_bodies_as_pybullets(agrees: Any) -> None:
    agrees(record_constraints_in_turn, 2e-5)


def test_gears_turn_wheels_as_pybullets(agrees: Any) -> None:
    agrees(record_gears_in_turn, 2e-5)


@pytest.mark.parametrize("kind", [p.JOINT_POINT2POINT, p.JOINT_FIXED])
def test_what_hangs_pulls_by_its_weight_and_is_solved_in_turn(client: int, kind: int) -> None:
    p.setGravity(0, 0, -10)
    body = box(p, (0, 0, 1), 3.0)
    constraint = p.createConstraint(body, -1, -1, -1, kind, [0] * 3, [0, 0, 0.1], [0, 0, 1.1])
    settle(40)
    force = p.getConstraintState(constraint)
    sign = -1.0 if kind == p.JOINT_POINT2POINT else 1.0
    np.testing.assert_allclose(force[:3], (0.0, 0.0, sign * 30.0), atol=1e-6)
    here = CLIENTS[client]
    assert isinstance(here, Client)
    data = here.scene.world.live_data
    data.solver_niter[:] = -1
    settle(1)
    assert (data.solver_niter == -1).all(), "MuJoCo's solver has nothing to do"


@pytest.mark.parametrize("scenario", [record_constraint_info, record_constraint_ids])
def test_infos_and_ids_are_pybullets(agrees: Any, scenario: Any) -> None:
    agrees(scenario)


def test_errors_are_pybullets(agrees: Any) -> None:
    agrees(record_constraint_errors)


def settle(steps: int = 120) -> None:
    for _ in range(steps):
        p.stepSimulation()


def test_a_fixed_constraint_to_the_world_holds_the_pose(client: int) -> None:
    body = box(p, (0, 0, 1))
    p.setGravity(0, 0, -10)
    made = p.createConstraint(body, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 1])
    settle()
    position, orientation = p.getBasePositionAndOrientation(body)
    assert position == pytest.approx((0, 0, 1), abs=1e-3)
    assert abs(orientation[3]) == pytest.approx(1, abs=1e-6)
    assert abs(p.getConstraintState(made)[2]) == pytest.approx(10, rel=0.02), "it carries the weight"


def test_a_constraint_of_too_little_force_lets_the_body_fall(client: int) -> None:
    body = box(p, (0, 0, 1), mass=2.0)
    p.setGravity(0, 0, -10)
    made = p.createConstraint(body, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 1])
    p.changeConstraint(made, maxForce=5)
    settle(60)
    drop = 1 - p.getBasePositionAndOrientation(body)[0][2]
    assert drop == pytest.approx(0.5 * (10 - 5 / 2) * 0.25**2, rel=0.1)


def test_a_pendulum_on_a_point_keeps_its_length(client: int) -> None:
    body = box(p, (0.5, 0, 1))
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
    p.setGravity(0, 0, -10)
    p.createConstraint(body, -1, -1, -1, p.JOINT_POINT2POINT, [0, 0, 0], [-0.5, 0, 0], [0, 0, 1])
    lengths, heights = [], []
    for _ in range(200):
        p.stepSimulation()
        position = p.getBasePositionAndOrientation(body)[0]
        heights.append(position[2])
        lengths.append(np.linalg.norm(np.subtract(position, (0, 0, 1))))
    assert lengths == pytest.approx([0.5] * 200, abs=5e-3)
    assert min(heights) == pytest.approx(0.5, abs=0.01), "it swings through the lowest point"


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0.6, 0.8, 0)])
def test_a_prismatic_constraint_leaves_its_axis_free(client: int, axis: tuple[float, float, float]) -> None:
    body = box(p, (0, 0, 1))
    p.changeDynamics(body, -1, linearDamping=0)
    p.setGravity(0, 0, -10)
    p.createConstraint(body, -1, -1, -1, p.JOINT_PRISMATIC, axis, [0, 0, 0], [0, 0, 1])
    p.resetBaseVelocity(body, axis)
    settle(60)
    position = p.getBasePositionAndOrientation(body)[0]
    assert position == pytest.approx((0.25 * axis[0], 0.25 * axis[1], 1), abs=0.01)


def test_constraints_go_with_their_body(client: int) -> None:
    a, b = box(p, (0, 0, 1)), box(p, (0, 0, 2))
    p.createConstraint(a, -1, b, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0.5], [0, 0, -0.5])
    p.createConstraint(a, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 1])
    p.removeBody(b)
    assert p.getNumConstraints() == 1
    p.removeBody(a)
    assert p.getNumConstraints() == 0


def test_a_removed_constraint_lets_go(client: int) -> None:
    body = box(p, (0, 0, 1))
    p.setGravity(0, 0, -10)
    made = p.createConstraint(body, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 1])
    settle(10)
    p.removeConstraint(made)
    settle(60)
    assert p.getBasePositionAndOrientation(body)[0][2] < 0.8


@pytest.fixture
def wheels(client: int) -> int:
    """Two wheels on a fixed base, free to turn about x."""
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    body = p.createMultiBody(
        0, -1, linkMasses=[1, 1], linkCollisionShapeIndices=[shape] * 2, linkVisualShapeIndices=[-1] * 2,
        linkPositions=[[0, 0, 0], [0, 1, 0]], linkOrientations=[[0, 0, 0, 1]] * 2,
        linkInertialFramePositions=[[0, 0, 0]] * 2, linkInertialFrameOrientations=[[0, 0, 0, 1]] * 2,
        linkParentIndices=[0, 0], linkJointTypes=[p.JOINT_REVOLUTE] * 2, linkJointAxis=[[1, 0, 0]] * 2,
    )  # fmt: skip
    for joint in (0, 1):
        p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, force=0)
    return body


@pytest.mark.parametrize("ratio", [-1.0, 1.0, 2.0, -0.5])
def test_a_gear_couples_the_velocities(wheels: int, ratio: float) -> None:
    """v_parent + ratio v_child = 0."""
    made = p.createConstraint(wheels, 0, wheels, 1, p.JOINT_GEAR, [1, 0, 0], [0, 0, 0], [0, 0, 0])
    p.changeConstraint(made, gearRatio=ratio, maxForce=1e4)
    p.setJointMotorControl2(wheels, 0, p.VELOCITY_CONTROL, targetVelocity=1.2, force=50)
    settle(30)
    parent, child = (p.getJointState(wheels, joint)[1] for joint in (0, 1))
    assert parent == pytest.approx(1.2, rel=0.02)
    assert parent + ratio * child == pytest.approx(0, abs=0.02)
    assert p.getConstraintInfo(made)[11] == ratio


def test_states_are_zeros_before_the_first_step(client: int) -> None:
    body = box(p, (0, 0, 1))
    kinds = {p.JOINT_FIXED: 6, p.JOINT_POINT2POINT: 3, p.JOINT_PRISMATIC: 5}
    for kind, count in kinds.items():
        made = p.createConstraint(body, -1, -1, -1, kind, [1, 0, 0], [0, 0, 0], [0, 0, 1])
        assert p.getConstraintState(made) == (0.0,) * count


@pytest.mark.parametrize(
    ("kind", "parts", "note"),
    [
        ("JOINT_PLANAR", {}, "joint type 3 is not supported"),
        ("JOINT_FIXED", {"parentLinkIndex": 4}, "there is no body 0 with a link 4"),
        ("JOINT_GEAR", {}, "gears couple joints"),
    ],
)
def test_what_is_not_supported_is_explained(client: int, kind: str, parts: dict[str, int], note: str) -> None:
    body = box(p, (0, 0, 1))
    options = {"parentLinkIndex": -1} | parts
    with pytest.raises(p.error, match=r"createConstraint failed\.") as caught:
        p.createConstraint(
            body, childBodyUniqueId=-1, childLinkIndex=-1, jointType=getattr(p, kind), jointAxis=[1, 0, 0],
            parentFramePosition=[0, 0, 0], childFramePosition=[0, 0, 0], **options,
        )  # fmt: skip
    assert note in "".join(caught.value.__notes__)

"""getDynamicsInfo and changeDynamics, compared with PyBullet 3.2.7 and with formulas of solid bodies."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p

LINK = """<robot name="one"><link name="base">
  <inertial><origin xyz="{at}"/><mass value="2"/>
  <inertia ixx="0.3" ixy="{xy}" ixz="0" iyy="0.4" iyz="0" izz="0.5"/>
  </inertial>{shapes}</link></robot>"""
SHAPES = {
    "box": '<collision><geometry><box size="0.2 0.4 0.6"/></geometry></collision>',
    "sphere": '<collision><geometry><sphere radius="0.3"/></geometry></collision>',
    "cylinder": '<collision><geometry><cylinder radius="0.1" length="0.5"/></geometry></collision>',
    "capsule": '<collision><geometry><capsule radius="0.1" length="0.5"/></geometry></collision>',
    "two": '<collision><geometry><box size="0.2 0.4 0.6"/></geometry></collision>'
    '<collision><origin xyz="0 0 0.5"/><geometry><sphere radius="0.1"/></geometry></collision>',
    "none": "",
    "surface": '<contact><lateral_friction value="0.7"/><rolling_friction value="0.01"/>'
    '<spinning_friction value="0.02"/><restitution value="0.4"/><stiffness value="3000"/>'
    '<damping value="50"/></contact><collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision>',
}
FLAGS = ("0", "URDF_USE_INERTIA_FROM_FILE", "URDF_USE_IMPLICIT_CYLINDER")


def load(p: Any, folder: Path, shape: str, *, at: str = "0 0 0", xy: float = 0.0, flags: int = 0) -> int:
    file = folder / f"{shape}_{at.replace(' ', '_')}_{xy}.urdf"  # PyBullet reads a file of one name only once
    file.write_text(LINK.format(shapes=SHAPES[shape], at=at, xy=xy))
    return p.loadURDF(str(file), flags=flags)


def record_dynamics_of_shapes(p: Any, folder: Path) -> Any:
    return {
        f"{shape} {flag}": p.getDynamicsInfo(load(p, folder, shape, flags=getattr(p, flag, 0)), -1)
        for shape in SHAPES
        for flag in FLAGS
    }


def record_dynamics_off_the_centre(p: Any, folder: Path) -> Any:
    return {
        shape: p.getDynamicsInfo(load(p, folder, shape, at="0.1 0.05 0"), -1)
        for shape in ("box", "sphere", "two")
    }


def record_a_turned_tensor_of_the_file(p: Any, folder: Path) -> Any:
    """The product of inertia turns the inertial frame; only its moments are compared, axes may swap."""
    body = load(p, folder, "box", xy=0.05, flags=p.URDF_USE_INERTIA_FROM_FILE)
    return sorted(p.getDynamicsInfo(body, -1)[2])


def record_changes(p: Any, folder: Path) -> Any:
    body = load(p, folder, "box")
    steps = []
    for change in (
        {"mass": 5.0},
        {"mass": 1.0, "localInertiaDiagonal": [0.1, 0.2, 0.3]},
        {"lateralFriction": 0.9, "spinningFriction": 0.1, "rollingFriction": 0.2},
        {"restitution": 0.8},
        {"contactStiffness": 1000.0, "contactDamping": 10.0},
        {"collisionMargin": 0.02},
        {"linearDamping": 0.0, "angularDamping": 0.1},
        {"localInertiaDiagonal": [0.4, 0.5, 0.6]},
    ):
        p.changeDynamics(body, -1, **change)
        steps.append(p.getDynamicsInfo(body, -1))
    return steps


def record_inertia_of_a_new_mass_of_a_sphere(p: Any, folder: Path) -> Any:
    body = load(p, folder, "sphere")
    p.changeDynamics(body, -1, mass=7.0)
    return p.getDynamicsInfo(body, -1)


@pytest.mark.parametrize(
    "scenario",
    [
        record_dynamics_of_shapes,
        record_dynamics_off_the_centre,
        record_a_turned_tensor_of_the_file,
        record_changes,
        record_inertia_of_a_new_mass_of_a_sphere,
    ],
)
def test_numbers_are_pybullets(agrees: Any, scenario: Any) -> None:
    agrees(scenario, 1e-6)


@pytest.mark.parametrize(
    ("mass", "size"), [(1.0, (1.0, 1.0, 1.0)), (2.0, (0.2, 0.4, 0.6)), (0.3, (0.01, 0.5, 0.1))]
)
def test_a_box_of_code_has_the_moments_of_a_solid_box(
    client: int, mass: float, size: tuple[float, float, float]
) -> None:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[side / 2 for side in size])
    body = p.createMultiBody(mass, shape)
    x, y, z = size
    expected = [mass / 12 * s for s in (y * y + z * z, x * x + z * z, x * x + y * y)]
    assert p.getDynamicsInfo(body, -1)[2] == pytest.approx(expected)


@pytest.mark.parametrize(("mass", "radius"), [(1.0, 0.5), (3.0, 0.1)])
def test_a_sphere_of_code_has_the_moments_of_a_solid_sphere(client: int, mass: float, radius: float) -> None:
    body = p.createMultiBody(mass, p.createCollisionShape(p.GEOM_SPHERE, radius=radius))
    assert p.getDynamicsInfo(body, -1)[2] == pytest.approx([0.4 * mass * radius**2] * 3)


@pytest.fixture
def box(client: int) -> int:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    body = p.createMultiBody(1.0, shape, basePosition=[0, 0, 5])
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
    return body


def test_an_acceleration_is_force_by_mass(box: int) -> None:
    p.changeDynamics(box, -1, mass=4.0)
    p.applyExternalForce(box, -1, [8, 0, 0], [0, 0, 5], p.WORLD_FRAME)
    p.stepSimulation()
    assert p.getBaseVelocity(box)[0][0] == pytest.approx(8 / 4 / 240)


def test_an_angular_acceleration_is_torque_by_inertia(box: int) -> None:
    p.changeDynamics(box, -1, localInertiaDiagonal=[0.5, 0.4, 0.25])
    p.applyExternalTorque(box, -1, [1, 1, 1], p.WORLD_FRAME)
    p.stepSimulation()
    assert p.getBaseVelocity(box)[1] == pytest.approx((2 / 240, 2.5 / 240, 4 / 240), rel=1e-6)


def test_damping_slows_down_as_in_bullet(box: int) -> None:
    """The force is -m v (k + k |v|), with the velocity at the start of each step."""
    k, v, dt = 0.3, 2.0, 1 / 240
    p.changeDynamics(box, -1, linearDamping=k)
    p.resetBaseVelocity(box, [v, 0, 0])
    for _ in range(5):
        v -= dt * v * (k + k * v)
        p.stepSimulation()
    assert p.getBaseVelocity(box)[0][0] == pytest.approx(v, rel=1e-9)


def test_friction_decelerates_by_the_product_of_coefficients(client: int) -> None:
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    box = p.createMultiBody(
        1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.5, 0.5, 0.1]), -1, [0, 0, 0.1]
    )
    p.setGravity(0, 0, -10)
    p.changeDynamics(plane, -1, lateralFriction=0.5)
    p.changeDynamics(box, -1, lateralFriction=0.4, linearDamping=0)
    for _ in range(60):
        p.stepSimulation()
    p.resetBaseVelocity(box, [3, 0, 0])
    for _ in range(120):
        p.stepSimulation()
    assert p.getBaseVelocity(box)[0][0] == pytest.approx(3 - 0.5 * 0.5 * 0.4 * 10, abs=0.02)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.9])
def test_restitution_returns_a_share_of_the_velocity(client: int, restitution: float) -> None:
    floor = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    sphere = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), -1, [0, 0, 0.3])
    for body in (floor, sphere):
        p.changeDynamics(body, -1, restitution=restitution**0.5, linearDamping=0)
    p.resetBaseVelocity(sphere, [0, 0, -3])
    for _ in range(60):
        p.stepSimulation()
    assert p.getBaseVelocity(sphere)[0][2] == pytest.approx(3 * restitution, abs=0.35)


@pytest.mark.parametrize(
    ("body", "link", "message"),
    [
        (-1, -1, "getDynamicsInfo failed; invalid bodyUniqueId"),
        (0, -2, "getDynamicsInfo failed; invalid linkIndex"),
        (0, 3, "getDynamicsInfo failed; invalid return status"),
        (8, -1, "getDynamicsInfo failed; invalid return status"),
    ],
)
def test_wrong_ids_raise(box: int, body: int, link: int, message: str) -> None:
    with pytest.raises(p.error) as caught:
        p.getDynamicsInfo(body, link)
    assert str(caught.value) == message


def test_stiffness_and_damping_come_together(box: int) -> None:
    for change in ({"contactStiffness": 10.0}, {"contactDamping": 1.0}):
        with pytest.raises(p.error, match="needs to be set together"):
            p.changeDynamics(box, -1, **change)


def test_changes_of_unknown_bodies_are_ignored(box: int) -> None:
    p.changeDynamics(77, -1, mass=3)
    p.changeDynamics(box, 12, mass=3)
    assert p.getDynamicsInfo(box, -1)[0] == 1.0


@pytest.mark.parametrize(("force", "point"), [((0, 0, 3.5), (0, 0, 0)), ((1, -2.5, 0.5), (0.3, 0.1, -0.2))])
def test_pushes_in_the_bodys_frame_equal_those_turned_into_the_world(
    client: int, force: tuple[float, ...], point: tuple[float, ...]
) -> None:
    box = p.createMultiBody(1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3]))
    place, turn = (0.5, -1.0, 2.0), p.getQuaternionFromEuler([0.4, -0.7, 1.1])
    matrix = np.reshape(p.getMatrixFromQuaternion(turn), (3, 3))
    speeds = []
    for push in range(2):
        p.resetBasePositionAndOrientation(box, place, turn)
        if push == 0:
            p.applyExternalForce(box, -1, list(force), list(point), p.LINK_FRAME)
            p.applyExternalTorque(box, -1, list(force), p.LINK_FRAME)
        else:
            p.applyExternalForce(box, -1, matrix @ force, place + matrix @ point, p.WORLD_FRAME)
            p.applyExternalTorque(box, -1, matrix @ force, p.WORLD_FRAME)
        p.stepSimulation()
        speeds.append(np.concatenate(p.getBaseVelocity(box)))
    assert np.abs(speeds[0]).max() > 0.01
    np.testing.assert_allclose(speeds[0], speeds[1], atol=1e-9)


def test_pushes_still_reject_floats_for_integers(client: int) -> None:
    box = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1))
    for body, link, flags in ((float(box), -1, p.LINK_FRAME), (box, -1.0, p.LINK_FRAME), (box, -1, 1.0)):
        with pytest.raises(TypeError):
            p.applyExternalForce(body, link, [0.0, 0.0, 1.0], [0.0, 0.0, 0.0], flags)


@pytest.mark.parametrize(
    ("inertia", "moments", "axes"),
    [
        (
            (1.2, 0.1, -0.2, 1.5, 0.3, 0.9),
            (1.295036, 1.624950, 0.680014),
            (0.423963, -0.010164, -0.383171, 0.820568),
        ),
        ((1.0, 0.2, 0, 1.0, 0, 1.5), (0.8, 1.2, 1.5), (0.197527, -0.021277, -0.763244, 0.614808)),
        ((0.5, 0, 1e-9, 0.6, 0, 0.7), (0.5, 0.6, 0.7), (0.174349, -0.095247, -0.469869, 0.860089)),
        ((1, 0.9, 0, 0.1, 0, 0.1), (0, 0, 0), (0.174349, -0.095247, -0.469869, 0.860089)),
    ],
)
def test_principal_axes_of_a_file_are_pybullets(
    client: int, tmp_path: Path, inertia: Any, moments: Any, axes: Any
) -> None:
    """Numbers of PyBullet 3.2.7, whose axes are in no order of size; the last tensor is no body's."""
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    given = " ".join(f'{name}="{value}"' for name, value in zip(names, inertia, strict=True))
    file = tmp_path / "turned.urdf"
    file.write_text(
        '<robot name="a"><link name="b"><inertial><origin xyz="0 0 0.1" rpy="0.4 0 -1"/><mass value="1"/>'
        f"<inertia {given}/></inertial></link></robot>"
    )
    body = p.loadURDF(str(file), flags=p.URDF_USE_INERTIA_FROM_FILE)
    found = p.getDynamicsInfo(body, -1)
    assert found[2] == pytest.approx(moments, abs=1e-6)
    assert found[4] == pytest.approx(axes, abs=1e-6)


@pytest.mark.parametrize(
    ("given", "is_of_base"),  # as PyBullet 3.2.7 has it
    [
        ({}, False),
        ({"linearDamping": 0}, True),
        ({"angularDamping": 0.1}, True),
        ({"linearDamping": 0, "restitution": 0.2}, False),
        ({"linearDamping": 0, "jointDamping": 0.1}, False),
        ({"angularDamping": 0, "frictionAnchor": 1}, False),
        ({"linearDamping": 0, "contactStiffness": 100.0, "contactDamping": 1.0}, False),
        ({"activationState": 4}, True),
        ({"restitution": 0.2, "activationState": 4}, True),
        ({"activationState": 4, "contactProcessingThreshold": 0.1}, False),
        ({"linearDamping": 0, "ccdSweptSphereRadius": 0.1}, False),
        ({"maxJointVelocity": 10}, True),
        ({"collisionMargin": 0.001, "contactProcessingThreshold": 0.1}, True),
        ({"jointLimitForce": 1, "sleepThreshold": 0.1, "localInertiaDiagonal": [1, 1, 1]}, False),
    ],
)
@pytest.mark.parametrize("calls", [1, 1500])  # by Python, and by machine code
def test_some_arguments_make_all_of_them_those_of_the_base(
    client: int, given: dict[str, Any], is_of_base: bool, calls: int
) -> None:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    body = p.createMultiBody(
        2.0, shape, linkMasses=[1.0], linkCollisionShapeIndices=[shape], linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 0.3]], linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0, 0, 0]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]], linkParentIndices=[0],
        linkJointTypes=[p.JOINT_REVOLUTE], linkJointAxis=[[0, 1, 0]],
    )  # fmt: skip
    for k in range(calls):
        p.changeDynamics(body, 0, mass=1.5 + 0.5 * (k % 2), lateralFriction=0.3 + 0.1 * (k % 2), **given)
    p.changeDynamics(body, 0, mass=3.0, lateralFriction=0.9, **given)
    base, link = (p.getDynamicsInfo(body, place)[:2] for place in (-1, 0))
    assert (base if is_of_base else link) == (3.0, 0.9)
    assert (link if is_of_base else base) == ((1.0, 0.5) if is_of_base else (2.0, 0.5))


def test_the_largest_velocity_of_joints_is_that_of_a_body(client: int) -> None:
    """PyBullet 3.2.7 bounds all joints, whichever link is named."""
    count = 2
    body = p.createMultiBody(
        0.0, linkMasses=[1.0] * count, linkCollisionShapeIndices=[-1] * count,
        linkVisualShapeIndices=[-1] * count, linkPositions=[[0, 0, 0.3]] * count,
        linkOrientations=[[0, 0, 0, 1]] * count, linkInertialFramePositions=[[0, 0, 0]] * count,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * count, linkParentIndices=[0, 0],
        linkJointTypes=[p.JOINT_PRISMATIC] * count, linkJointAxis=[[1, 0, 0]] * count,
    )  # fmt: skip
    p.changeDynamics(body, 1, maxJointVelocity=0.5)
    for joint in range(count):
        p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, force=0)
    for _ in range(100):
        for joint in range(count):
            p.setJointMotorControl2(body, joint, p.TORQUE_CONTROL, force=20)
        p.stepSimulation()
    assert [p.getJointState(body, joint)[1] for joint in range(count)] == pytest.approx([0.5, 0.5])

"""Changes while a simulation runs: forces, speeds, masses, terrain."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p
import roboyard.pybullet_data as data


@pytest.fixture
def ball(client: int) -> int:
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.5)
    body = p.createMultiBody(2.0, shape, basePosition=[0, 0, 5])
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
    return body


@pytest.mark.parametrize("parts", [1, 4])
def test_a_push_lasts_a_whole_step(ball: int, parts: int) -> None:
    p.setPhysicsEngineParameter(numSubSteps=parts)
    p.applyExternalForce(ball, -1, [48, 0, 0], [0, 0, 0], p.LINK_FRAME)
    p.stepSimulation()
    p.stepSimulation()
    assert p.getBaseVelocity(ball)[0][0] == pytest.approx(48 / 2 / 240)


def test_the_greatest_joint_speed_can_be_changed(client: int) -> None:
    p.setAdditionalSearchPath(data.getDataPath())
    cart = p.loadURDF("cartpole.urdf")
    for greatest in (100, 3, 150):
        if greatest != 100:
            p.changeDynamics(cart, 1, maxJointVelocity=greatest)
        p.setJointMotorControl2(cart, 1, p.VELOCITY_CONTROL, targetVelocity=500, force=1e6)
        for _ in range(5):
            p.stepSimulation()
        assert p.getJointState(cart, 1)[1] == pytest.approx(greatest, rel=1e-3)


@pytest.mark.parametrize(
    ("torque", "expected"),
    [
        ((0, 0, 2000), (37.778364371, -100.0, 100.0)),
        ((-3000, 2500, 20), (-100.0, 100.0, -100.0)),
    ],
)
def test_the_greatest_speeds_of_a_turned_body_are_those_in_the_world_frame(
    client: int, torque: tuple[float, float, float], expected: tuple[float, float, float]
) -> None:
    """As recorded from PyBullet 3.2.7, which keeps each component within 100 rad/s."""
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3])
    body = p.createMultiBody(1.0, shape, basePosition=[0, 0, 1], baseOrientation=[0.3, 0.2, -0.4, 0.84])
    p.applyExternalTorque(body, -1, torque, p.WORLD_FRAME)
    p.stepSimulation()
    assert p.getBaseVelocity(body)[1] == pytest.approx(expected, abs=1e-6)


def test_a_client_that_left_frees_its_world(client: int) -> None:
    import weakref

    from roboyard.pybullet.connections import CLIENTS

    other = p.connect(p.DIRECT)
    p.createMultiBody(
        1.0, p.createCollisionShape(p.GEOM_SPHERE, physicsClientId=other), physicsClientId=other
    )
    p.stepSimulation(physicsClientId=other)
    freed = weakref.ref(CLIENTS[other].scene.world.data)
    p.disconnect(other)
    assert freed() is None, "without waiting for the garbage collector"
    assert np.isfinite(p.getAPIVersion())


def test_stable_pd_brings_a_stiff_joint_to_its_target(client: int) -> None:
    p.setAdditionalSearchPath(data.getDataPath())
    p.setGravity(0, 0, -10)
    cart = p.loadURDF("cartpole.urdf")
    joints = [0, 1]
    for joint in joints:
        p.setJointMotorControl2(cart, joint, p.VELOCITY_CONTROL, force=0)
    for _ in range(240):
        p.setJointMotorControlMultiDofArray(
            cart,
            joints,
            p.STABLE_PD_CONTROL,
            targetPositions=[[0.3], [0.5]],
            positionGains=[1e5, 1e5],
            velocityGains=[1e4, 1e4],
            forces=[[1e6], [1e6]],
        )
        p.stepSimulation()
    assert [p.getJointState(cart, j)[0] for j in joints] == pytest.approx([0.3, 0.5], abs=2e-3)


def test_padded_dynamics_agree_with_the_plain_ones(client: int) -> None:
    p.setAdditionalSearchPath(data.getDataPath())
    p.setGravity(0, 0, -10)
    robot = p.loadURDF("r2d2.urdf")
    count = sum(p.getJointInfo(robot, j)[3] >= 0 for j in range(p.getNumJoints(robot)))
    rng = np.random.default_rng(1)
    base, joints = [0.1, 0.2, 0.3, 0, 0, 0, 1], rng.uniform(-0.2, 0.2, count).tolist()
    plain = np.array(p.calculateMassMatrix(robot, joints))
    padded = np.array(p.calculateMassMatrix(robot, [*base, *joints], flags=1))
    order = [3, 4, 5, 0, 1, 2, *range(6, 6 + count)]
    places = [0, 1, 2, 3, 4, 5, *range(7, 7 + count)]
    assert padded.shape == (7 + count, 7 + count)
    p.resetBasePositionAndOrientation(robot, base[:3], base[3:])
    assert np.allclose(padded[np.ix_(places, places)], plain[np.ix_(order, order)], atol=1e-9)
    assert padded[6, 6] == 1.0
    v, a = rng.normal(size=(2, 6 + count))
    wide = np.zeros((2, 7 + count))
    wide[:, places] = np.stack([v, a])[:, order]
    a[:] = 0.0  # flags 1 take accelerations for zeros
    torques = np.array(p.calculateInverseDynamics(robot, [*base, *joints], v.tolist(), a.tolist()))
    spread = np.array(p.calculateInverseDynamics(robot, [*base, *joints], *wide.tolist(), flags=1))
    assert np.allclose(spread[places], torques, atol=1e-6), "the base's force before its torque in both"


def test_user_data_of_a_file(client: int, tmp_path) -> None:
    entry = '<bullet><user-data key="{0}">of {0}</user-data></bullet>'
    (tmp_path / "noted.urdf").write_text(
        f'<robot name="noted">{entry.format("robot")}<link name="base">{entry.format("link")}<visual>'
        f'{entry.format("visual")}<geometry><sphere radius="1"/></geometry></visual></link></robot>'
    )
    body = p.loadURDF(str(tmp_path / "noted.urdf"))
    infos = [p.getUserDataInfo(body, i) for i in range(p.getNumUserData(body))]
    assert [info[1:] for info in infos] == [
        (b"robot", body, -1, -1), (b"link", body, -1, -1), (b"visual", body, -1, 0)
    ]  # fmt: skip
    assert p.getUserData(infos[2][0]) == b"of visual"


def test_a_script_can_serve(tmp_path) -> None:
    server = p.connect(p.SHARED_MEMORY_SERVER, key=48151623)
    try:
        other = p.connect(p.SHARED_MEMORY, key=48151623)
        shape = p.createCollisionShape(p.GEOM_SPHERE, physicsClientId=other)
        body = p.createMultiBody(1.0, shape, basePosition=[1, 2, 3], physicsClientId=other)
        position, _ = p.getBasePositionAndOrientation(body, physicsClientId=server)
        assert position == (1.0, 2.0, 3.0)
        entry = p.addUserData(body, "key", "value", physicsClientId=other)
        assert p.getUserData(entry, physicsClientId=server) is None
        p.syncUserData(physicsClientId=server)
        assert p.getUserData(entry, physicsClientId=server) == b"value"
        p.disconnect(other)
    finally:
        p.disconnect(server)
    assert p.connect(p.SHARED_MEMORY, key=48151623) == -1


def test_mass_0_leaves_a_body_to_itself(ball: int) -> None:
    p.setGravity(0, 0, -10)
    p.changeDynamics(ball, -1, mass=0)
    hammer = p.createMultiBody(
        5.0, p.createCollisionShape(p.GEOM_SPHERE, radius=0.3), basePosition=[1.2, 0, 5]
    )
    p.resetBaseVelocity(hammer, [-8, 0, 0])
    for _ in range(60):
        p.stepSimulation()
    assert np.allclose(p.getBasePositionAndOrientation(ball)[0], [0, 0, 5], atol=1e-3)
    assert p.getBaseVelocity(hammer)[0][0] > -4, "it bounced or stopped"
    assert p.getDynamicsInfo(ball, -1)[0] == 0.0
    p.changeDynamics(ball, -1, mass=2)
    for _ in range(24):
        p.stepSimulation()
    assert p.getBaseVelocity(ball)[0][2] == pytest.approx(-1, rel=0.05)


def _picture(folder: Path, name: str) -> Path:
    from PIL import Image

    Image.new("RGB", (4, 4), (200, 30, 30)).save(folder / name)
    return folder / name


def _textured_box(folder: Path) -> Path:
    file = folder / "box.urdf"
    file.write_text(
        '<robot name="b"><link name="b"><visual><geometry><box size="1 1 1"/></geometry><material name="m">'
        f'<texture filename="{_picture(folder, "red.png")}"/></material></visual></link></robot>'
    )
    return file


def _texture_ids(body: int) -> list[int]:
    return [row[8] for row in p.getVisualShapeData(body, p.VISUAL_SHAPE_DATA_TEXTURE_UNIQUE_IDS)]


def test_pictures_of_bodies_and_files_share_one_row_of_numbers(client: int, tmp_path: Path) -> None:
    box, other = str(_textured_box(tmp_path)), str(_picture(tmp_path, "other.png"))
    first = p.loadURDF(box)
    assert p.loadTexture(other) == 1
    second = p.loadURDF(box)
    p.removeBody(second)
    assert p.loadTexture(other) == 3
    assert _texture_ids(first) == [0]
    p.changeVisualShape(first, -1, textureUniqueId=3)
    assert _texture_ids(first) == [0], "reported as it was loaded"
    p.changeVisualShape(first, -1, textureUniqueId=77)
    p.resetSimulation()
    assert p.loadTexture(other) == 4


def test_a_texture_changes_by_bytes_and_alone(client: int, tmp_path: Path) -> None:
    picture = str(_picture(tmp_path, "red.png"))
    kept, changed = p.loadTexture(picture), p.loadTexture(picture)
    boxes = [
        p.createMultiBody(0, -1, p.createVisualShape(p.GEOM_BOX, halfExtents=[0.5] * 3), [x, 0, 0])
        for x in (-1, 1)
    ]
    for box, texture in zip(boxes, (kept, changed), strict=True):
        p.changeVisualShape(box, -1, textureUniqueId=texture)
    p.changeTexture(changed, bytes([0, 0, 255] * 4), 2, 2)
    view = p.computeViewMatrix([0, 0, 4], [0, 0, 0], [0, 1, 0])
    image = p.getCameraImage(
        40, 20, view, p.computeProjectionMatrixFOV(40, 2, 0.1, 10),
        lightAmbientCoeff=1, lightDiffuseCoeff=0, lightSpecularCoeff=0,
    )[2]  # fmt: skip
    assert image[10, 10].tolist() == [200, 30, 30, 255]
    assert image[10, 30].tolist() == [0, 0, 255, 255]


def test_a_new_colour_is_reported_for_all_shapes_of_a_link(client: int) -> None:
    shapes = p.createVisualShapeArray(
        [p.GEOM_SPHERE, p.GEOM_SPHERE], radii=[0.1, 0.2], visualFramePositions=[[0, 0, 0], [0, 0, 1]]
    )
    body = p.createMultiBody(1, -1, shapes)
    p.changeVisualShape(body, -1, shapeIndex=1, rgbaColor=[0, 1, 0, 1])
    assert [row[7] for row in p.getVisualShapeData(body)] == [(0, 1, 0, 1)] * 2


def test_a_box_needs_its_size(client: int) -> None:
    with pytest.raises(p.error, match=r"createCollisionShape failed\."):
        p.createCollisionShape(p.GEOM_BOX)
    with pytest.raises(p.error, match=r"createVisualShape failed\."):
        p.createVisualShape(p.GEOM_BOX)
    assert p.createCollisionShape(p.GEOM_SPHERE) == 0


def test_links_of_rigid_bodies_move_but_are_not_seen(client: int) -> None:
    p.setGravity(0, 0, -10)
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    same = {"linkOrientations": [[0, 0, 0, 1]], "linkInertialFrameOrientations": [[0, 0, 0, 1]]}
    body = p.createMultiBody(
        1, ball, linkMasses=[1], linkCollisionShapeIndices=[ball], linkVisualShapeIndices=[-1],
        linkPositions=[[1, 0, 0]], linkInertialFramePositions=[[0, 0, 0]], linkParentIndices=[0],
        linkJointTypes=[p.JOINT_REVOLUTE], linkJointAxis=[[0, 1, 0]], useMaximalCoordinates=True, **same,
    )  # fmt: skip
    assert p.getNumJoints(body) == 0
    assert p.getBodyInfo(body) == (b"", b"link0")
    assert p.getDynamicsInfo(body, 4)[0] == 1
    for call, arguments in ((p.getJointInfo, (body, 0)), (p.setJointMotorControl2, (body, 0, 0))):
        with pytest.raises(p.error):
            call(*arguments)
    for _ in range(24):
        p.stepSimulation()
    assert p.getBaseVelocity(body)[0][2] == pytest.approx(-1.0, abs=1e-6), "without damping"
    assert p.rayTest([1, 0, 5], [1, 0, -5])[0][0] == body


@pytest.mark.parametrize("parts", [1, 4])
def test_spare_bodies_are_deleted_between_steps_in_parts(client: int, tmp_path: Path, parts: int) -> None:
    """MuJoCo's arrays of velocities become shorter then."""
    file = tmp_path / "pendulum.urdf"
    inertial = '<inertial><mass value="1"/><origin xyz="0 0 -0.5"/>'
    inertial += '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
    joint = '<joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>'
    joint += '<dynamics damping="0.3"/></joint>'
    file.write_text(f'<robot name="p"><link name="a"/><link name="b">{inertial}</link>{joint}</robot>')
    p.setGravity(0, 0, -9.8)
    p.setPhysicsEngineParameter(numSubSteps=parts)
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.01)

    def swing(others: int) -> tuple[float, ...]:
        pendulum = p.loadURDF(str(file), useFixedBase=True)
        p.setJointMotorControl2(pendulum, 0, p.VELOCITY_CONTROL, force=0)
        p.resetJointState(pendulum, 0, 1.0)
        for k in range(others):
            body = p.createMultiBody(0.001, ball, -1, [3 + 0.03 * k, 0, 0])
            p.getClosestPoints(pendulum, body, 0.01)
        for _ in range(230):
            p.stepSimulation()
        return p.getJointState(pendulum, 0)[:2]

    crowded = swing(30)
    p.resetSimulation()
    p.setGravity(0, 0, -9.8)
    p.setPhysicsEngineParameter(numSubSteps=parts)
    assert swing(0) == pytest.approx(crowded, abs=1e-9)

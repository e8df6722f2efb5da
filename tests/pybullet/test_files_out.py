"""Files that PyBullet's functions write: state logs, videos, world scripts, meshes."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p
import roboyard.pybullet_data as data


def read_log(path: Path) -> tuple[list[str], list[tuple]]:
    """A log read with nothing but what its own header says."""
    raw = path.read_bytes()
    names, types, rest = raw.split(b"\n", 2)
    size = struct.calcsize("<" + types.decode())
    records = []
    while rest:
        assert rest[:2] == b"\xaa\xbb"
        records.append(struct.unpack("<" + types.decode(), rest[2 : 2 + size]))
        rest = rest[2 + size :]
    return names.decode().split(","), records


@pytest.fixture
def cart(client: int) -> int:
    p.setAdditionalSearchPath(data.getDataPath())
    p.setGravity(0, 0, -10)
    return p.loadURDF("cartpole.urdf")


def test_a_robot_log(cart: int, tmp_path: Path) -> None:
    other = p.createMultiBody(1.0, basePosition=[0, 0, 5])
    log = p.startStateLogging(
        p.STATE_LOGGING_GENERIC_ROBOT,
        str(tmp_path / "robot.log"),
        [cart],
        maxLogDof=3,
        logFlags=p.STATE_LOG_JOINT_TORQUES,
    )
    seen = []
    for _ in range(4):
        p.setJointMotorControl2(cart, 0, p.VELOCITY_CONTROL, targetVelocity=0.5, force=100)
        p.stepSimulation()
        seen.append(p.getJointState(cart, 0))
    p.stopStateLogging(log)
    p.stepSimulation()
    names, records = read_log(tmp_path / "robot.log")
    assert names[:4] == ["stepCount", "timeStamp", "objectId", "posX"]
    assert names[-9:] == ["q0", "q1", "q2", "u0", "u1", "u2", "t0", "t1", "t2"]
    assert len(records) == 4
    rows = [dict(zip(names, record, strict=True)) for record in records]
    assert [row["stepCount"] for row in rows] == [0, 1, 2, 3]
    assert rows[2]["timeStamp"] == pytest.approx(2 / 240)
    assert {row["objectId"] for row in rows} == {cart} != {other}
    assert [row["q0"] for row in rows] == pytest.approx([state[0] for state in seen])
    assert [row["u0"] for row in rows] == pytest.approx([state[1] for state in seen])
    assert [row["t0"] for row in rows] == pytest.approx([state[3] for state in seen], rel=1e-5)
    assert rows[0]["q2"] == 0.0
    assert rows[0]["oriW"] == 1.0


def test_a_contact_log(client: int, tmp_path: Path) -> None:
    p.setGravity(0, 0, -10)
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.5)
    balls = [p.createMultiBody(2.0, shape, basePosition=[3 * i, 0, 0.5]) for i in range(2)]
    for _ in range(100):
        p.stepSimulation()
    log = p.startStateLogging(
        p.STATE_LOGGING_CONTACT_POINTS, str(tmp_path / "touch.log"), bodyUniqueIdA=balls[1]
    )
    p.stepSimulation()
    p.stopStateLogging(log)
    names, records = read_log(tmp_path / "touch.log")
    (row,) = [dict(zip(names, record, strict=True)) for record in records]
    assert (row["bodyUniqueIdA"], row["bodyUniqueIdB"]) == (balls[1], plane)
    assert row["normalForce"] == pytest.approx(20, rel=0.01)
    assert row["positionOnAX"] == pytest.approx(3, abs=1e-3)


def test_a_film(client: int, tmp_path: Path) -> None:
    encoder = pytest.importorskip("imageio_ffmpeg")
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_SPHERE, radius=1))
    log = p.startStateLogging(p.STATE_LOGGING_VIDEO_MP4, str(tmp_path / "film.mp4"))
    for _ in range(24):
        p.stepSimulation()
    p.stopStateLogging(log)
    frames, seconds = encoder.count_frames_and_secs(str(tmp_path / "film.mp4"))
    assert frames == 7, "0.1 s at 60 pictures a second, both ends included"
    assert seconds == pytest.approx(7 / 60, abs=0.01)


def test_a_world_is_written_as_a_script(cart: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    p.resetJointState(cart, 0, 0.25)
    ball = p.loadURDF("sphere_small.urdf", [1, 2, 3])
    p.saveWorld(str(tmp_path / "world.py"))
    script = (tmp_path / "world.py").read_text().replace("import pybullet as p", "")
    script = script.replace("p.disconnect()", "")
    p.resetSimulation()
    assert p.getNumBodies() == 0
    exec(compile(script, "world.py", "exec"), {"p": p})
    assert p.getNumBodies() == 2
    assert p.getJointState(cart, 0)[0] == pytest.approx(0.25, abs=0.01)
    assert np.allclose(p.getBasePositionAndOrientation(ball)[0], [1, 2, 3], atol=1e-3)


def test_mesh_data_is_the_hull_in_the_inertial_frame(client: int) -> None:
    corners = [[x, y, z] for x in (-1, 1) for y in (-2, 2) for z in (-3, 3)]
    shape = p.createCollisionShape(
        p.GEOM_MESH, vertices=[*corners, [0, 0, 0]], collisionFramePosition=[5, 0, 0]
    )
    body = p.createMultiBody(1.0, shape, baseInertialFramePosition=[1, 0, 0])
    count, vertices = p.getMeshData(body)
    assert count == len(vertices) == 8
    np.testing.assert_allclose(sorted(vertices), sorted((x + 4, y, z) for x, y, z in corners), atol=1e-15)
    box = p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[1, 1, 1]))
    assert p.getMeshData(box) == (0, ())
    with pytest.raises(p.error, match="getMeshData failed"):
        p.getMeshData(99)


def test_mesh_data_has_the_corners_that_pybullet_rounds(client: int, tmp_path: Path) -> None:
    """Corners of hulls, also of a file's cylinder, are at 10,216 steps over each extent; numbers of 3.2.7."""
    (tmp_path / "c.urdf").write_text(
        """<robot name="c"><link name="l"><inertial><mass value="1"/>
        <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry>
        <cylinder radius="0.2" length="0.6"/></geometry></collision></link></robot>"""
    )
    count, found = p.getMeshData(p.loadURDF(str(tmp_path / "c.urdf")))
    wanted = [
        (-0.196123727486296, -0.038997650743931085, 0.3),
        (-0.11108065779169929, 0.16628817541111982, -0.3),
        (0.07650743931088488, 0.18476898981989037, -0.3),
        (0.11108065779169929, 0.16628817541111982, 0.3),
    ]
    assert count == 64
    np.testing.assert_allclose([sorted(found)[k] for k in (3, 20, 40, 45)], wanted, atol=1e-12)


def test_vhacd_writes_convex_parts(client: int, tmp_path: Path) -> None:
    from roboyard.shapes import convex_hull, load_mesh

    box = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
    faces = ((1, 3, 2), (1, 4, 3), (5, 6, 7), (5, 7, 8), (1, 2, 6), (1, 6, 5), (3, 4, 8), (3, 8, 7))
    faces += ((2, 3, 7), (2, 7, 6), (1, 5, 8), (1, 8, 4))
    (tmp_path / "box.obj").write_text(box + "".join(f"f {a} {b} {c}\n" for a, b, c in faces))
    log = tmp_path / "log.txt"
    p.vhacd(str(tmp_path / "box.obj"), str(tmp_path / "out.obj"), str(log))
    assert "convex" in log.read_text()
    assert convex_hull(load_mesh(tmp_path / "out.obj")).volume == pytest.approx(1, rel=0.02)
    with pytest.raises(p.error, match="vhacd failed"):
        p.vhacd("missing.obj", str(tmp_path / "out.obj"), "")


def test_render_image_is_get_camera_image(client: int) -> None:
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[1, 1, 1]))
    view = p.computeViewMatrix([5, 0, 2], [0, 0, 0], [0, 0, 1])
    projection = p.computeProjectionMatrixFOV(60, 4 / 3, 0.1, 50)
    wanted = p.getCameraImage(80, 60, view, projection)
    for form in ((view, projection), ([5, 0, 2], [0, 0, 0], [0, 0, 1], 0.1, 50, 60)):
        assert np.array_equal(p.renderImage(80, 60, *form)[4], wanted[4])
    with pytest.raises(p.error, match="Invalid number of args"):
        p.renderImage(80)


def test_what_cannot_be_had_says_so(client: int, tmp_path: Path) -> None:
    body = p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[1, 1, 1]))
    with pytest.raises(p.error, match="unsupportedChangeScaling"):
        p.unsupportedChangeScaling(body, [2, 2, 2])
    p.saveBullet(str(tmp_path / "moment.bullet"))
    with pytest.raises(p.error, match=r"Couldn't load \.bullet file\.") as caught:
        p.loadBullet(str(tmp_path / "moment.bullet"))
    assert "restoreState" in caught.value.__notes__[0]

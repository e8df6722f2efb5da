"""Engine parameters, stepping, saved states, user data and the debug camera against PyBullet 3.2.7."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p


def message_of(call: Callable[[], Any]) -> list[str]:
    try:
        return ["no error", repr(call())]
    except Exception as problem:
        return [type(problem).__name__, str(problem)]


def ball(p: Any, at: Any = (0, 0, 1)) -> int:
    return p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), basePosition=at)


def record_parameters(p: Any, folder: Path) -> Any:
    found = [p.getPhysicsEngineParameters()]
    p.setGravity(1, 2, -3)
    p.setTimeStep(0.01)
    p.setPhysicsEngineParameter(numSolverIterations=20, numSubSteps=2)
    found.append(p.getPhysicsEngineParameters())
    p.setPhysicsEngineParameter(fixedTimeStep=0.005, numNonContactInnerIterations=3)
    found.append(p.getPhysicsEngineParameters())
    p.resetSimulation()
    return [*found, p.getPhysicsEngineParameters()]


def record_falls(p: Any, folder: Path) -> Any:
    found = {}
    for name, options in {
        "default": {},
        "large steps": {"fixedTimeStep": 1 / 60},
        "substeps": {"fixedTimeStep": 1 / 60, "numSubSteps": 4},
    }.items():
        p.resetSimulation()
        p.setTimeStep(1 / 240)
        p.setPhysicsEngineParameter(numSubSteps=0)
        p.setPhysicsEngineParameter(**options)
        p.setGravity(0, 0, -9.81)
        body = ball(p, [0, 0, 10])
        for _ in range(20):
            p.stepSimulation()
        found[name] = [p.getBasePositionAndOrientation(body)[0], p.getBaseVelocity(body)[0]]
    return found


def record_states(p: Any, folder: Path) -> Any:
    p.setGravity(0, 0, -10)
    body = ball(p)
    p.stepSimulation()
    first = p.saveState()
    for _ in range(10):
        p.stepSimulation()
    second = p.saveState()
    p.restoreState(first)
    back = p.getBasePositionAndOrientation(body)
    p.restoreState(stateId=second)
    forth = p.getBasePositionAndOrientation(body)
    p.removeState(first)
    return [first, second, back, forth, message_of(lambda: p.restoreState(first)), p.saveState()]


def record_user_data(p: Any, folder: Path) -> Any:
    body, other = ball(p), ball(p)
    ids = [
        p.addUserData(body, "name", "first"),
        p.addUserData(body, "size", "2"),
        p.addUserData(other, "name", "second"),
        p.addUserData(body, "name", "changed"),
    ]
    found = [p.getUserData(each) for each in ids]
    infos = [p.getUserDataInfo(body, i) for i in range(p.getNumUserData(body))]
    lookups = [p.getUserDataId(body, "name"), p.getUserDataId(body, "none"), p.getUserDataId(other, "name")]
    p.removeUserData(ids[0])
    return [ids, found, sorted(map(list, infos)), lookups, p.getNumUserData(body), p.getUserData(ids[0])]


def record_errors(p: Any, folder: Path) -> Any:
    ball(p)
    return [
        message_of(lambda: p.restoreState(77)),
        message_of(lambda: p.removeState(77)),
        message_of(lambda: p.addUserData(9, "key", "value")),
        message_of(lambda: p.getUserDataInfo(0, 5)),
        message_of(lambda: p.loadURDF("missing.urdf")),
        message_of(lambda: p.loadSDF("missing.sdf")),
        message_of(lambda: p.loadMJCF("missing.xml")),
        message_of(lambda: p.applyExternalForce(0, -1, [0, 0, 1], [0, 0, 0], 7)),
        message_of(lambda: p.applyExternalForce(0, -1, [0, 0], [0, 0, 0], 1)),
        message_of(lambda: p.applyExternalTorque(0, -1, [0, 0], 1)),
        message_of(lambda: p.applyExternalForce(9, -1, [0, 0, 1], [0, 0, 0], 1)),
    ]


def record_forces(p: Any, folder: Path) -> Any:
    found = []
    for frame in (p.WORLD_FRAME, p.LINK_FRAME):
        p.resetSimulation()
        shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3])
        body = p.createMultiBody(
            2,
            shape,
            basePosition=[1, 2, 3],
            baseOrientation=[0, 0, 0.6, 0.8],
            baseInertialFramePosition=[0.1, 0, 0],
        )
        p.applyExternalForce(body, -1, [1, 2, 3], [0.1, 0.2, 0.3], frame)
        p.applyExternalTorque(body, -1, [0.1, 0.2, 0.3], frame)
        p.stepSimulation()
        found.append(p.getBaseVelocity(body))
    return found


@pytest.mark.parametrize(
    ("scenario", "tolerance"),
    [
        (record_parameters, 1e-12),
        (record_falls, 1e-5),
        (record_states, 1e-9),
        (record_user_data, 0),
        (record_errors, 0),
    ],
)
def test_results_are_pybullets(agrees: Any, scenario: Any, tolerance: float) -> None:
    agrees(scenario, tolerance)


def test_forces_in_the_world_frame_are_pybullets(agrees: Any) -> None:
    agrees(record_forces, 1e-4)


def test_a_restored_state_repeats_the_same_motion(client: int) -> None:
    p.setGravity(0, 0, -10)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    body = ball(p, (0, 0, 0.3))
    p.resetBaseVelocity(body, [1, 0, 0], [0, 3, 0])
    state = p.saveState()

    def run() -> Any:
        for _ in range(100):
            p.stepSimulation()
        return p.getBasePositionAndOrientation(body), p.getBaseVelocity(body)

    first = run()
    p.restoreState(state)
    assert run() == first


def test_a_saved_file_needs_the_same_bodies(client: int, tmp_path: Path) -> None:
    body = ball(p)
    file = str(tmp_path / "state.bullet")
    p.saveBullet(file)
    p.resetBasePositionAndOrientation(body, [5, 5, 5], [0, 0, 0, 1])
    p.restoreState(fileName=file)
    assert p.getBasePositionAndOrientation(body)[0] == pytest.approx((0, 0, 1))
    ball(p)
    with pytest.raises(p.error, match="Couldn't restore state") as caught:
        p.restoreState(fileName=file)
    assert "saved with other bodies" in caught.value.__notes__[0]
    with pytest.raises(p.error, match="Couldn't save"):
        p.saveBullet(str(tmp_path / "no" / "folder"))
    with pytest.raises(p.error, match=r"Couldn't load \.bullet file"):
        p.loadBullet(file)
    (tmp_path / "text").write_text("no state")
    with pytest.raises(p.error) as caught:
        p.restoreState(fileName=str(tmp_path / "text"))
    assert "was not written by saveBullet" in caught.value.__notes__[0]


def test_pairs_of_a_file_that_name_nothing_are_left_out(client: int, tmp_path: Path) -> None:
    """Also those of links that are not there, pairs of one link, and pairs that come twice."""
    p.setGravity(0, 0, -9.81)
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    bodies = [p.createMultiBody(k and 1.0, box, basePosition=[0, 0, 0.2 * k]) for k in range(4)]
    for _ in range(20):
        p.stepSimulation()
    file = tmp_path / "state.bullet"
    p.saveBullet(str(file))
    with np.load(file) as saved:
        arrays = dict(saved)
    assert len(arrays["updated_links"]) == 4 and len(arrays["pair_links"]) >= 3
    more = np.array([[0, 10**6], [2, -3], [9, 0]])
    arrays["updated_links"] = np.concatenate([arrays["updated_links"], more])
    arrays["link_boxes"] = np.concatenate([arrays["link_boxes"], np.zeros((3, 6))])
    pairs = np.array([[[0, 7], [1, 0]], [[2, 0], [2, 0]], [[1, 0], [2, 0]], [[1, 0], [2, 0]]])
    arrays["pair_links"] = np.concatenate([arrays["pair_links"], pairs])
    arrays["pair_states"] = np.concatenate([arrays["pair_states"], np.array([0, 5, -9, -2], np.int32)])
    ranked = np.array([[[0, 0, 9], [1, 0, 0]], [[3, 0, 0], [3, 0, 0]]])
    arrays["ranked_owners"] = np.concatenate([arrays["ranked_owners"], ranked])
    arrays["pair_checked"] = np.array(10**12)
    with file.open("wb") as changed:
        np.savez(changed, **arrays)
    for _ in range(2):
        p.restoreState(fileName=str(file))
        for _ in range(30):
            p.stepSimulation()
        heights = [p.getBasePositionAndOrientation(body)[0][2] for body in bodies]
        np.testing.assert_allclose(heights, [0, 0.2, 0.4, 0.6], atol=2e-3)


def test_user_data_goes_with_its_body(client: int) -> None:
    body = ball(p)
    entry = p.addUserData(body, "key", "value", linkIndex=-1, visualShapeIndex=2)
    assert p.getUserDataInfo(body, 0) == (entry, b"key", body, -1, 2)
    p.removeBody(body)
    assert p.getUserData(entry) is None
    assert p.getNumUserData(body) == 0
    with pytest.raises(p.error, match="Error in removeUserData"):
        p.removeUserData(entry)


@pytest.mark.parametrize("pitch", [-80.0, -35.0, 0.0, 40.0])
@pytest.mark.parametrize("yaw", [0.0, 50.0, -120.0])
def test_the_debug_camera_looks_at_its_target(window: int, yaw: float, pitch: float) -> None:
    target = [1.0, 2.0, 3.0]
    p.resetDebugVisualizerCamera(4.0, yaw, pitch, target)
    camera = p.getDebugVisualizerCamera()
    view = [camera[2][4 * column : 4 * column + 4] for column in range(4)]
    seen = [sum(view[k][row] * value for k, value in enumerate([*target, 1.0])) for row in range(3)]
    assert seen == pytest.approx([0, 0, -4], abs=1e-5), "in camera axes the target is 4 m ahead"
    assert camera[8:11] == pytest.approx((yaw, pitch, 4.0))


def test_switches_of_the_visualizer_are_kept(window: int) -> None:
    from roboyard.pybullet.connections import CLIENTS

    p.configureDebugVisualizer(p.COV_ENABLE_SHADOWS, 0)
    p.configureDebugVisualizer(lightPosition=[1, 2, 3], shadowMapResolution=512, rgbBackground=[0, 0, 1])
    p.configureDebugVisualizer(p.COV_ENABLE_Y_AXIS_UP, 1)
    camera = CLIENTS[window].visualizer
    assert camera.switches == {p.COV_ENABLE_SHADOWS: 0, p.COV_ENABLE_Y_AXIS_UP: 1}
    assert camera.settings == {
        "lightPosition": (1, 2, 3), "shadowMapResolution": 512, "rgbBackground": (0, 0, 1)
    }  # fmt: skip
    assert p.getDebugVisualizerCamera()[4] == (0.0, 1.0, 0.0)


def test_settings_without_effect_are_accepted(client: int) -> None:
    from roboyard.pybullet.connections import CLIENTS

    p.setDefaultContactERP(0.3)
    p.setInternalSimFlags(3)
    p.setPhysicsEngineParameter(erp=0.1, warmStartingFactor=0.5, enableSAT=1)
    p.setTimeOut(3)
    p.setRealTimeSimulation(1)
    others = CLIENTS[client].parameters.others
    assert others == {
        "contactERP": 0.3, "internalSimFlags": 3, "erp": 0.1, "warmStartingFactor": 0.5, "enableSAT": 1
    }  # fmt: skip
    assert p.getPhysicsEngineParameters()["useRealTimeSimulation"] == 1
    for call in (lambda: p.setTimeOut("soon"), lambda: p.setGravity("a", 0, 0), lambda: p.setTimeStep(None)):
        with pytest.raises(TypeError):
            call()


def record_error_reduction(p: Any, folder: Path) -> Any:
    """The velocity that a sunken ball, an exceeded limit and a stretched constraint get in one step."""
    file = folder / "hinge.urdf"
    link = (
        '<link name="{}"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )
    file.write_text(
        '<robot name="hinge">' + link.format("a") + link.format("b") + '<joint name="j" type="revolute">'
        '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
        '<limit lower="-0.5" upper="0.5" effort="1" velocity="1"/></joint></robot>'
    )

    def velocities() -> list[float]:
        floor = p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 5, 1])
        p.createMultiBody(0, floor, -1, [0, 0, -1])
        shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
        sunken, held = (p.createMultiBody(1, shape, -1, [x, 0, z]) for x, z in ((0, 0.09), (2, 0.5)))
        hinge = p.loadURDF(str(file), [4, 0, 1], useFixedBase=1, flags=2)
        p.setJointMotorControl2(hinge, 0, p.VELOCITY_CONTROL, force=0)
        p.resetJointState(hinge, 0, 0.52)
        pull = p.createConstraint(held, -1, -1, -1, p.JOINT_POINT2POINT, [0] * 3, [0] * 3, [2, 0, 0.6])
        p.changeConstraint(pull, maxForce=1e6)
        p.stepSimulation()
        found = [p.getBaseVelocity(body)[0][2] for body in (sunken, held)]
        return [*found, p.getJointState(hinge, 0)[1]]

    found = [velocities()]
    p.resetSimulation()
    p.setDefaultContactERP(0.9)
    found.append(velocities())
    p.resetSimulation()
    found.append(velocities())
    p.resetSimulation()
    p.setPhysicsEngineParameter(erp=0.7, contactERP=0.5)
    found.append(velocities())
    return found


def test_error_reduction(agrees: Callable[..., None]) -> None:
    agrees(record_error_reduction, 2e-2)


def _roll() -> list[int]:
    """Return cylinders that fall over each other, whose pairs keep points from step to step."""
    p.resetSimulation()
    p.setGravity(0, 0, -10)
    p.createMultiBody(
        0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[2, 2, 0.1]), basePosition=[0, 0, -0.1]
    )
    shape = p.createCollisionShape(p.GEOM_CYLINDER, radius=0.1, height=0.3)
    return [
        p.createMultiBody(1, shape, basePosition=[0.03 * k, 0.02 * k, 0.2 + 0.35 * k], baseOrientation=turn)
        for k, turn in enumerate(((0, 0, 0, 1), (0, 0.6, 0, 0.8), (0.6, 0, 0, 0.8), (0, 0, 0, 1)))
    ]


def test_a_file_restores_the_points_that_pairs_keep(client: int, tmp_path: Path) -> None:
    """Steps go on to the last bit; without them a pair would begin with the one point that is deepest."""
    file = str(tmp_path / "rolling.bullet")

    def go_on(bodies: list[int]) -> list[object]:
        for _ in range(20):
            p.stepSimulation()
        return [(p.getBasePositionAndOrientation(body), p.getBaseVelocity(body)) for body in bodies]

    bodies = _roll()
    for _ in range(100):
        p.stepSimulation()
    p.saveBullet(file)
    with np.load(file) as arrays:
        stored = dict(arrays)
    assert stored["contact_counts"].max() > 1
    wanted = go_on(bodies)
    bodies = _roll()
    p.restoreState(fileName=file)
    assert go_on(bodies) == wanted
    owners, counts, points = (stored[f"contact_{name}"] for name in ("owners", "counts", "points"))
    for wrong in (
        {"contact_owners": owners + 99},
        {"contact_counts": counts + 100},
        {"contact_counts": np.int32(1)},
        {"contact_points": np.full_like(points, np.nan)},
        {"contact_points": points[:, :2]},
    ):
        np.savez(tmp_path / "wrong.npz", **(stored | wrong))
        p.restoreState(fileName=str(tmp_path / "wrong.npz"))
        assert go_on(bodies) != wanted, "it goes on without them"

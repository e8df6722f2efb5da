"""Loops that reset the simulation and build it again, against the same with every world compiled."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from tests.pybullet.conftest import close_all

import roboyard.pybullet as p
from roboyard.pybullet.bullet_rules.placed_shapes import shape_rows
from roboyard.pybullet.connections import CLIENTS
from roboyard.sim import simulated_bodies
from roboyard.sim.engine import Engine
from roboyard.sim.pool.body_pool import BodyPool
from roboyard.sim.pool.kept_worlds import KeptWorld
from roboyard.sim.pool.rows import PoolRows
from roboyard.sim.stepping.points import bound_points
from roboyard.sim.stepping.sequential import motors

PLANE = """<robot name="floor"><link name="floor"><contact><lateral_friction value="0.9"/></contact>
<collision><geometry><plane normal="0 0 1"/></geometry></collision></link></robot>"""
BOX = """<robot name="box"><link name="box"><inertial><mass value="0.3"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.1 0.12 0.14"/></geometry></collision></link></robot>"""
WEDGE = """v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"""
ARM = """<robot name="arm">
<link name="base"><inertial><mass value="2"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="wedge.obj"/></geometry></collision></link>
<link name="upper"><inertial><origin xyz="0 0 0.1"/><mass value="0.5"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 0.1"/><geometry><capsule radius="0.03" length="0.1"/></geometry></collision>
</link>
<link name="fore"><inertial><mass value="0.2"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><sphere radius="0.05"/></geometry></collision></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<origin xyz="0.05 0.05 0.1"/><limit lower="-1" upper="1" effort="50" velocity="5"/></joint>
<joint name="slider" type="prismatic"><parent link="upper"/><child link="fore"/><axis xyz="0 0 1"/>
<origin xyz="0 0 0.25"/><limit lower="0" upper="0.1" effort="50" velocity="5"/></joint></robot>"""
EPISODES = 6
STEPS = 12


@pytest.fixture
def files(tmp_path: Path) -> Iterator[Path]:
    for name, text in (("plane.urdf", PLANE), ("box.urdf", BOX), ("arm.urdf", ARM), ("wedge.obj", WEDGE)):
        (tmp_path / name).write_text(text)
    yield tmp_path
    close_all()


def world(client: int | None = None) -> Any:
    """Return the world of a client; of the first one by default."""
    number = next(iter(CLIENTS)) if client is None else client
    return cast(Any, CLIENTS[number]).scene.world


Bodies = dict[str, int]
Edit = Callable[[Bodies, int], Any]
"""Called with the bodies and the number of the episode."""


def build(files: Path, episode: int, *, moves: bool = False, reads: bool = False) -> Bodies:
    shift = 0.013 * episode if moves else 0.0
    turn = p.getQuaternionFromEuler([0.1, 0.2 + shift, 0.3])
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.06)
    bodies = {
        "plane": p.loadURDF(str(files / "plane.urdf"), useFixedBase=True),
        "box": p.loadURDF(str(files / "box.urdf"), [shift, 0, 0.2], turn),
        "arm": p.loadURDF(str(files / "arm.urdf"), [0.4, shift, 0], turn, useFixedBase=True),
    }
    if reads:
        read(bodies["arm"], episode)
    bodies["free"] = p.loadURDF(str(files / "arm.urdf"), [-0.4, shift, 0.3])
    if reads:
        read(bodies["free"], episode)
    bodies["ball"] = p.createMultiBody(0.2, shape, basePosition=[0.02, 0.03 + shift, 0.4])
    return bodies


def read(arm: int, episode: int) -> None:
    """Read and write the state of an arm before others are loaded, as programs do."""
    for joint in range(p.getNumJoints(arm)):
        limits = p.getJointInfo(arm, joint)[8:10]
        p.resetJointState(arm, joint, 0.3 * limits[1] + 0.01 * episode)
    position, orientation = p.getLinkState(arm, 1)[:2]
    p.setJointMotorControl2(arm, 0, p.POSITION_CONTROL, 0.1 * position[0], force=30)
    p.applyExternalForce(arm, 1, [0.3, 0, orientation[0]], [0, 0, 0], p.LINK_FRAME)
    p.getContactPoints(arm)


def trace(bodies: Bodies) -> list[Any]:
    found: list[Any] = []
    for body in bodies.values():
        found += [p.getBasePositionAndOrientation(body), p.getBaseVelocity(body), p.getAABB(body)]
        joints = range(p.getNumJoints(body))
        found += [p.getJointStates(body, joints), p.getLinkStates(body, joints) if len(joints) else ()]
        found += [p.getDynamicsInfo(body, link) for link in range(-1, len(joints))]
        found.append([row[:7] for row in p.getVisualShapeData(body)])
    found.append(p.getContactPoints())
    found.append(p.rayTest([0.02, 0.03, 1], [0.02, 0.03, -1]))
    return found


def run(
    files: Path,
    *,
    before: Edit | None = None,
    during: Edit | None = None,
    moves: bool = False,
    reads: bool = False,
) -> list[Any]:
    p.connect(p.DIRECT)
    found: list[Any] = []
    for episode in range(EPISODES):
        p.resetSimulation()
        p.setGravity(0, 0, -9.8)
        bodies = build(files, episode, moves=moves, reads=reads)
        if before is not None:
            found.append(before(bodies, episode))
        for step in range(STEPS):
            p.stepSimulation()
            if during is not None and step == STEPS // 2:
                found.append(during(bodies, episode))
        found.append(trace({name: body for name, body in bodies.items() if name in bodies}))
    found.append(world().spec.to_xml())
    p.disconnect()
    return found


@pytest.fixture
def taken(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The numbers of bodies of the worlds that were taken over."""
    found: list[int] = []
    renew = KeptWorld.renew

    def noted(self: KeptWorld, key: Any, changes: Any) -> None:
        found.append(len(key.bodies))
        renew(self, key, changes)

    monkeypatch.setattr(KeptWorld, "renew", noted)
    return found


def agree(files: Path, monkeypatch: pytest.MonkeyPatch, **arguments: Any) -> None:
    reused = run(files, **arguments)
    with monkeypatch.context() as patch:
        patch.setattr(Engine, "_compile_key", lambda _: None)
        patch.setattr(simulated_bodies, "plan", lambda *_: None)
        assert reused == run(files, **arguments)


@pytest.mark.parametrize("moves", [False, True])
def test_a_repeated_world_is_taken_over_and_moves_alike(
    files: Path, monkeypatch: pytest.MonkeyPatch, taken: list[int], moves: bool
) -> None:
    agree(files, monkeypatch, moves=moves)
    assert len(taken) == EPISODES - 3  # the first sees the meshes, two more that the key is the same


@pytest.mark.parametrize("moves", [False, True])
def test_a_world_that_is_read_between_loads_is_taken_over_at_each_compile(
    files: Path, monkeypatch: pytest.MonkeyPatch, taken: list[int], moves: bool
) -> None:
    agree(files, monkeypatch, moves=moves, reads=True)
    assert taken == [3, 4, 5] * (EPISODES - 3)


def test_a_world_with_constraints_is_taken_over(client: int, files: Path, taken: list[int]) -> None:
    """Those of the start are in its first compile, later ones in another."""
    for episode in range(EPISODES):
        p.resetSimulation()
        bodies = build(files, episode)
        p.createConstraint(bodies["box"], -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 0.3])
        p.stepSimulation()
        p.createConstraint(bodies["ball"], -1, -1, -1, p.JOINT_POINT2POINT, [0, 0, 0], [0, 0, 0], [0, 0, 1])
        p.stepSimulation()
    assert taken == [5, 5] * (EPISODES - 3)


def change_dynamics(bodies: Bodies, episode: int) -> None:
    p.changeDynamics(bodies["box"], -1, lateralFriction=0.2 + 0.1 * episode, restitution=0.4)
    p.changeDynamics(bodies["arm"], 1, mass=0.4 + 0.1 * episode, linearDamping=0.1)
    p.changeDynamics(bodies["plane"], -1, lateralFriction=0.3, spinningFriction=0.01 * episode)
    p.changeDynamics(
        bodies["free"], 0, mass=1.0, rollingFriction=0.02, contactStiffness=4e3, contactDamping=9
    )


def change_some_dynamics(bodies: Bodies, episode: int) -> None:
    if episode % 2:
        change_dynamics(bodies, episode)


def change_mass_by_machine_code(bodies: Bodies, episode: int) -> None:
    for k in range(6):
        p.changeDynamics(bodies["box"], -1, mass=0.3 + 0.1 * k + 0.01 * episode)
        p.changeDynamics(bodies["box"], -1, lateralFriction=0.3 + 0.1 * k + 0.01 * episode)


def free_a_base(bodies: Bodies, episode: int) -> None:
    if episode == 4:
        p.changeDynamics(bodies["arm"], -1, mass=1.0)


def reset_joints(bodies: Bodies, episode: int) -> None:
    p.resetJointState(bodies["arm"], 0, 0.1 * episode, 0.2)
    p.resetJointState(bodies["free"], 1, 0.05)
    p.resetBaseVelocity(bodies["free"], [0.1, 0, 0], [0, 0, 0.3])


def move_bases(bodies: Bodies, episode: int) -> None:
    p.resetBasePositionAndOrientation(bodies["arm"], [0.4, 0.1 * episode, 0.02], [0, 0, 0.6, 0.8])
    p.resetBasePositionAndOrientation(bodies["box"], [0.1, 0.01 * episode, 0.5], [0, 0.6, 0, 0.8])


def set_motors(bodies: Bodies, episode: int) -> None:
    p.setJointMotorControl2(bodies["arm"], 0, p.POSITION_CONTROL, 0.3, force=20.0 + episode)
    p.setJointMotorControl2(bodies["arm"], 1, p.VELOCITY_CONTROL, targetVelocity=0.1, force=5)
    p.setJointMotorControl2(bodies["free"], 0, p.VELOCITY_CONTROL, force=0)
    p.setJointMotorControl2(bodies["free"], 0, p.TORQUE_CONTROL, force=0.2)


def constrain(bodies: Bodies, episode: int) -> None:
    if episode != 3:
        p.createConstraint(
            *(
                bodies["box"],
                -1,
                -1,
                -1,
                p.JOINT_POINT2POINT,
                [0, 0, 0],
                [0, 0, 0],
                [0, 0, 0.3 + 0.01 * episode],
            )
        )


def constrain_links(bodies: Bodies, episode: int) -> None:
    """Create the same constraints at other places, of which one ends."""
    kinds, ids = (p.JOINT_POINT2POINT, p.JOINT_FIXED, p.JOINT_PRISMATIC), []
    for k, kind in enumerate(kinds):
        pivots = [0, 0, 0.01 * episode], [0, 0.05, 0.1]
        ids.append(p.createConstraint(bodies["free"], k - 1, bodies["box"], -1, kind, [0, 0, 1], *pivots))
    p.changeConstraint(ids[0], maxForce=5.0 + episode)
    p.stepSimulation()
    p.removeConstraint(ids[1])


def change_settings(bodies: Bodies, episode: int) -> None:
    del bodies
    p.setGravity(0, 0.1 * episode, -5)
    p.setTimeStep(1 / 240 if episode % 2 else 1 / 500)
    p.setPhysicsEngineParameter(numSolverIterations=20 + episode, erp=0.1 + 0.01 * (episode % 3))


def filter_collisions(bodies: Bodies, episode: int) -> None:
    p.setCollisionFilterGroupMask(bodies["ball"], -1, 0, 0)
    p.setCollisionFilterPair(bodies["box"], bodies["plane"], -1, -1, int(episode < 4))


def filter_in_between(bodies: Bodies, episode: int) -> None:
    p.setCollisionFilterPair(bodies["ball"], bodies["box"], -1, -1, episode % 2)


def color(bodies: Bodies, episode: int) -> None:
    p.changeVisualShape(bodies["box"], -1, rgbaColor=[0.1 * episode, 0, 0, 1])
    p.addUserDebugLine([0, 0, 0], [0, 0, 1 + episode])
    p.addUserData(bodies["box"], "key", str(episode))


def limit(bodies: Bodies, episode: int) -> None:
    p.changeDynamics(bodies["arm"], 0, jointLowerLimit=-0.05 * episode, jointUpperLimit=0.05)
    p.changeDynamics(bodies["free"], 1, jointDamping=0.1 * episode)


def add_another(bodies: Bodies, episode: int) -> None:
    if episode != 3:
        shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05, 0.05, 0.05])
        bodies["more"] = p.createMultiBody(0.1, shape, basePosition=[0.3, 0.3, 0.5])


def remove_the_ball(bodies: Bodies, episode: int) -> None:
    if episode % 3 == 0:
        p.removeBody(bodies.pop("ball"))


def push(bodies: Bodies, episode: int) -> None:
    p.applyExternalForce(bodies["box"], -1, [3.0 + episode, 0, 0], [0, 0, 0], p.LINK_FRAME)
    p.enableJointForceTorqueSensor(bodies["arm"], 0, 1)


def save_and_restore(bodies: Bodies, episode: int) -> None:
    state = p.saveState()
    p.changeDynamics(bodies["box"], -1, lateralFriction=0.9)
    p.stepSimulation()
    p.restoreState(state)
    del episode


EDITS = [
    change_dynamics, change_some_dynamics, change_mass_by_machine_code, free_a_base, reset_joints, move_bases,
    set_motors, constrain, constrain_links, change_settings, filter_collisions, filter_in_between, color,
    limit, add_another, remove_the_ball, push, save_and_restore,
]  # fmt: skip


@pytest.mark.parametrize("edit", EDITS, ids=lambda edit: edit.__name__)
@pytest.mark.parametrize(("when", "reads"), [("before", False), ("during", False), ("during", True)])
def test_nothing_of_an_episode_reaches_the_next(
    files: Path, monkeypatch: pytest.MonkeyPatch, edit: Edit, when: str, reads: bool
) -> None:
    arguments: dict[str, Any] = {when: edit, "reads": reads}
    if edit is change_mass_by_machine_code:
        for _ in range(6):
            run(files, **arguments)  # until machine code, which rounds otherwise, makes all changes
    agree(files, monkeypatch, **arguments)


def test_changes_of_single_episodes_do_not_end_it(
    files: Path, monkeypatch: pytest.MonkeyPatch, taken: list[int]
) -> None:
    for edit in (reset_joints, set_motors, change_settings, push, move_bases):
        taken.clear()
        agree(files, monkeypatch, during=edit)
        assert len(taken) >= EPISODES - 3, edit.__name__


def test_another_file_of_the_same_name_is_read(files: Path, taken: list[int]) -> None:
    p.connect(p.DIRECT)

    def height() -> float:
        p.resetSimulation()
        p.setGravity(0, 0, -10)
        p.loadURDF(str(files / "plane.urdf"), useFixedBase=True)
        arm = p.loadURDF(str(files / "arm.urdf"), [0, 0, 0.3])
        for _ in range(240):
            p.stepSimulation()
        return p.getAABB(arm, -1)[1][2] - p.getAABB(arm, -1)[0][2]

    before = [height() for _ in range(4)]
    assert taken
    assert len({*before}) == 1
    (files / "wedge.obj").write_text(WEDGE.replace("0.1", "0.15"))
    assert height() > before[0] + 0.03


def test_bodies_that_are_removed_before_a_step_leave_nothing(client: int, files: Path) -> None:
    build(files, 0)
    for _ in range(5):
        made = p.loadURDF(str(files / "box.urdf"), [0, 0, 0.6])
        p.changeDynamics(made, -1, lateralFriction=0.3)
        p.resetBasePositionAndOrientation(made, [0, 0, 0.7], [0, 0, 0, 1])
        assert p.getBasePositionAndOrientation(made)[0] == (0, 0, 0.7)
        p.removeBody(made)
    assert p.getNumBodies() == 5
    p.stepSimulation()
    assert world().live_model.nbody == 1 + 1 + 1 + 3 + 3 + 1
    assert world().spec.to_xml().count('<body name="box') == 1


def test_worlds_of_two_clients_are_apart(files: Path) -> None:
    one, two = p.connect(p.DIRECT), p.connect(p.DIRECT)
    boxes = {}
    for _ in range(5):
        for client, height in ((one, 0.3), (two, 0.5)):
            p.resetSimulation(physicsClientId=client)
            boxes[client] = p.loadURDF(str(files / "box.urdf"), [0, 0, height], physicsClientId=client)
            p.stepSimulation(physicsClientId=client)
        assert p.getBasePositionAndOrientation(boxes[one], physicsClientId=one)[0] == (0, 0, 0.3)
        assert p.getBasePositionAndOrientation(boxes[two], physicsClientId=two)[0] == (0, 0, 0.5)
    models = {id(world(number).live_model) for number in CLIENTS}
    assert len(models) == 2


def test_the_first_changed_world_is_compiled_again(client: int, files: Path, taken: list[int]) -> None:
    def episode(count: int) -> int:
        p.resetSimulation()
        for k in range(count):
            p.loadURDF(str(files / "box.urdf"), [0.2 * k, 0, 1])
        p.stepSimulation()
        return int(world().live_model.nbody) - 1

    assert [episode(count) for count in (2, 2, 2, 3, 2, 2, 2)] == [2, 2, 2, 3, 2, 2, 2]
    assert taken == [2, 2]
    assert np.isfinite(p.getBasePositionAndOrientation(0)[0]).all()


def test_bodies_of_random_sizes_and_friction_are_taken_over(
    files: Path, monkeypatch: pytest.MonkeyPatch, taken: list[int]
) -> None:
    def episodes() -> list[float]:
        p.connect(p.DIRECT)
        drawn, found = np.random.default_rng(4), list[float]()
        for _ in range(EPISODES):
            p.resetSimulation()
            p.setGravity(0, 0, -9.8)
            p.loadURDF(str(files / "plane.urdf"), useFixedBase=True)
            arm = p.loadURDF(str(files / "arm.urdf"), [0.4, 0, 0], useFixedBase=True)
            p.changeDynamics(arm, 1, lateralFriction=drawn.uniform(0.2, 1.0))
            for k in range(3):
                shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=drawn.uniform(0.03, 0.08, 3).tolist())
                made = p.createMultiBody(drawn.uniform(0.1, 1.0), shape, basePosition=[0.3 * k - 0.8, 0, 0.1])
                p.changeDynamics(made, -1, lateralFriction=drawn.uniform(0.2, 1.0))
            for _step in range(STEPS):
                p.stepSimulation()
            for body in range(p.getNumBodies()):
                found += [*p.getBasePositionAndOrientation(body)[0], *p.getBaseVelocity(body)[0]]
                found += [value for corner in p.getAABB(body) for value in corner]
                found += p.getDynamicsInfo(body, -1)[:2]
            found += [number for row in p.getContactPoints() for number in row[9:11]]
        p.disconnect()
        return found

    reused = episodes()
    assert len(taken) >= EPISODES - 3
    with monkeypatch.context() as patch:
        patch.setattr(Engine, "_compile_key", lambda _: None)
        assert reused == pytest.approx(episodes(), rel=1e-9, abs=1e-9)


SDF = """<sdf version="1.4"><model name="box"><pose>0 0 {height} 0 0 0</pose><link name="a">
<inertial><mass>2</mass></inertial>
<collision name="c"><geometry><box><size>0.2 0.2 0.2</size></box></geometry></collision></link>
</model></sdf>"""
MJCF = """<mujoco model="two"><worldbody><body name="a" pos="0 0 {height}"><joint type="hinge" axis="0 1 0"/>
<geom type="sphere" size="0.1"/><body name="b" pos="0 0 0.3"><joint name="own" type="slide" axis="1 0 0"/>
<geom type="box" size="0.1 0.1 0.1"/></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize(("suffix", "text"), [("sdf", SDF), ("xml", MJCF)])
def test_worlds_of_other_files_are_taken_over_until_these_change(
    client: int, tmp_path: Path, taken: list[int], suffix: str, text: str
) -> None:
    file = tmp_path / f"model.{suffix}"

    def height() -> float:
        p.resetSimulation()
        (body,) = p.loadSDF(str(file)) if suffix == "sdf" else p.loadMJCF(str(file))
        p.stepSimulation()
        return p.getAABB(body, -1 if suffix == "sdf" else p.getNumJoints(body) - 1)[0][2]

    file.write_text(text.format(height=1))
    first = [height() for _ in range(5)]
    assert len({*first}) == 1
    assert taken
    file.write_text(text.format(height="1.5"))
    assert height() == pytest.approx(first[0] + 0.5, abs=1e-6)


def test_unnamed_joints_get_new_numbers_each_time(client: int, tmp_path: Path) -> None:
    file = tmp_path / "model.xml"
    file.write_text(MJCF.format(height=1))

    def names() -> list[str]:
        (body,) = p.loadMJCF(str(file))
        return [p.getJointInfo(body, joint)[1].decode() for joint in range(p.getNumJoints(body))]

    found = [names() for _ in range(3)]
    start = int(found[0][0].removeprefix("joint").split("_")[0])
    for k, loaded in enumerate(found):  # as in PyBullet: three of each, in the order in which they are read
        first = start + 3 * k
        assert loaded == [
            f"joint{first}_2_0", f"jointfix_{first + 2}_2", "own", f"jointfix_{first + 1}_4",
        ]  # fmt: skip


def create_and_remove(files: Path) -> list[Any]:
    p.connect(p.DIRECT)
    p.setGravity(0, 0, -9.8)
    bodies, found = build(files, 0), []
    shapes = [p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05, 0.05, size]) for size in (0.05, 0.06)]
    for k in range(16):
        made = p.createMultiBody(0.1, shapes[k % 2], basePosition=[0.05, 0.02, 0.6])
        if k % 3:
            p.changeDynamics(bodies["box"], -1, collisionMargin=0.001 * (k % 4))
        held = p.createConstraint(
            *(bodies["box"], -1, made if k % 4 == 1 else -1, -1, p.JOINT_POINT2POINT),
            *([0, 0, 0], [0, 0, 0], [0, 0, 0.2]),
        )
        p.stepSimulation()
        found.append(trace({**bodies, "made": made}))
        p.removeConstraint(held)
        if k % 5 == 4:
            p.stepSimulation()
        p.removeBody(made)
        found.append(p.getContactPoints())
        p.stepSimulation()
        found.append(trace(bodies))
    p.disconnect()
    return found


def test_sets_of_bodies_that_come_again_move_alike(files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Arrays that are kept for such sets, against arrays that are made each time."""
    create_and_remove(files)
    kept = create_and_remove(files)
    monkeypatch.setattr(bound_points, "_SETS", 0)
    monkeypatch.setattr(shape_rows, "_SHAPE_SETS", 0)
    monkeypatch.setattr(motors, "_ORDERS", 0)
    assert create_and_remove(files) == kept


def change_friction(bodies: Bodies, episode: int) -> None:
    p.changeDynamics(bodies["arm"], 0, lateralFriction=0.1 * episode, rollingFriction=0.01 * (episode % 2))


def load_again(files: Path, *, fixed: bool, edit: Edit | None = None) -> list[Any]:
    """Remove an arm and load it again, several times, beside a box; return all that is read and the spec."""
    p.connect(p.DIRECT)
    p.setGravity(0, 0, -9.8)
    found: list[Any] = []
    plane = p.loadURDF(str(files / "plane.urdf"), useFixedBase=True)
    box = p.loadURDF(str(files / "box.urdf"), [0.3, 0, 0.2])
    for episode in range(8):
        flags = p.URDF_USE_SELF_COLLISION if episode == 5 else 0
        place = [0.02 * episode, 0, 0.3]
        arm = p.loadURDF(str(files / "arm.urdf"), place, useFixedBase=fixed, flags=flags)
        bodies = {"plane": plane, "box": box, "arm": arm, "free": arm}
        p.setJointMotorControl2(arm, 0, p.POSITION_CONTROL, 0.1 * episode, force=20)
        for step in range(STEPS):
            p.stepSimulation()
            if edit is not None and step == STEPS // 2:
                found.append(edit(bodies, episode))
        found.append(trace(bodies))
        if episode == 6:
            found.append(world().spec.to_xml())
        p.removeBody(arm)
        for _ in range(3 * (episode % 3)):
            p.stepSimulation()
        found.append(trace({"plane": plane, "box": box}))
    found.append(world().spec.to_xml())
    p.disconnect()
    return found


@pytest.mark.parametrize(
    "edit", [None, change_friction, change_dynamics, reset_joints, move_bases, set_motors, push, limit]
)
@pytest.mark.parametrize("fixed", [False, True])
def test_an_arm_that_is_loaded_again_is_that_of_a_compile(
    files: Path, monkeypatch: pytest.MonkeyPatch, fixed: bool, edit: Edit | None
) -> None:
    load_again(files, fixed=fixed, edit=edit)  # meshes are known then
    ours = load_again(files, fixed=fixed, edit=edit)
    used: list[int] = []
    former = PoolRows.former
    with monkeypatch.context() as patch:
        patch.setattr(PoolRows, "former", lambda self, *given: used.append(1) or former(self, *given))
        load_again(files, fixed=fixed, edit=edit)
        patch.setattr(BodyPool, "_former_template", lambda *_: None)
        _are_close(ours, load_again(files, fixed=fixed, edit=edit))
    assert used or edit not in (None, change_friction, set_motors, push)  # others change its elements


def _are_close(one: Any, other: Any) -> None:
    """Compare what was read; inactive bodies change the last digits of steps."""
    if isinstance(one, tuple | list):
        assert len(one) == len(other)
        for mine, theirs in zip(one, other, strict=True):
            _are_close(mine, theirs)
    else:
        assert one == other or one == pytest.approx(other, abs=1e-10)

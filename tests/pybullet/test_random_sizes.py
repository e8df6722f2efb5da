"""Loops with robots of other sizes in each episode, whose numbers go into the arrays of the world before."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.pybullet import test_reset_loops as loops
from tests.pybullet.conftest import close_all
from tests.sim.model_numbers import differing

import roboyard.pybullet as p
from roboyard._mujoco import mujoco
from roboyard.sim import compiled_world
from roboyard.sim.pool.former_arrays import FormerArrays
from roboyard.sim.pool.kept_worlds import FormerWorld

INERTIAL = '<inertial><origin xyz="0 {y} {z}"/><mass value="{m}"/>{moments}</inertial>'
MOMENTS = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
ROBOT = """<robot name="made"><link name="a">{inertial}<contact><lateral_friction value="{x}"/></contact>
<collision><geometry><box size="{x} {y} 0.1"/></geometry></collision></link>
<link name="b">{inertial}<collision><origin xyz="0 {y} 0" rpy="{x} 0 {z}"/>
<geometry><cylinder radius="0.05" length="{z}"/></geometry></collision></link>
<link name="c">{inertial}<collision><origin xyz="0 0 0.1"/><geometry><sphere radius="{y}"/></geometry>
</collision></link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 {x} 0.2"/>
<axis xyz="0 1 {z}"/><limit lower="-{x}" upper="{z}" effort="10" velocity="5"/>
<dynamics damping="{y}"/></joint>
<joint name="k" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0 0 0.3"/>
<axis xyz="1 0 0"/><limit lower="0" upper="{y}" effort="10" velocity="5"/></joint></robot>"""


@pytest.fixture
def files(tmp_path: Path) -> Iterator[Path]:
    for name, text in (("plane", loops.PLANE), ("box", loops.BOX)):
        (tmp_path / f"{name}.urdf").write_text(text)
    yield tmp_path
    close_all()


@pytest.fixture
def taken(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Whether arrays were used again, each time that this was tried."""
    found: list[bool] = []
    take = FormerArrays.take

    def noted(self: FormerArrays, model: Any) -> bool:
        found.append(take(self, model))
        return found[-1]

    monkeypatch.setattr(FormerArrays, "take", noted)
    return found


def robot(files: Path, draw: random.Random) -> str:
    """Write a file with a robot of random sizes and return its name."""
    file = files / f"robot{draw.random()}.urdf"
    x, y, z, m = (round(draw.uniform(0.1, 0.4), 3) for _ in range(4))
    inertial = INERTIAL.format(y=y, z=z, m=m, moments=MOMENTS)
    file.write_text(ROBOT.format(inertial=inertial, x=x, y=y, z=z))
    return str(file)


def build(files: Path, episode: int, draw: random.Random) -> loops.Bodies:
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=draw.uniform(0.05, 0.1))
    turn = p.getQuaternionFromEuler([draw.random(), 0.2, 0.3])
    bodies = {
        "plane": p.loadURDF(str(files / "plane.urdf"), useFixedBase=True),
        "box": p.loadURDF(str(files / "box.urdf"), [0, 0, 0.2], turn),
        "arm": p.loadURDF(robot(files, draw), [0.4, draw.random(), 0.3], turn, useFixedBase=True),
        "free": p.loadURDF(robot(files, draw), [-0.4, 0, 0.3 + 0.1 * draw.random()]),
        "ball": p.createMultiBody(draw.random(), shape, basePosition=[0.02, 0.03, 0.4]),
    }
    return bodies


def run(files: Path, edit: loops.Edit | None, *, during: bool = False) -> list[Any]:
    p.connect(p.DIRECT)
    draw, found = random.Random(1), list[Any]()
    for episode in range(loops.EPISODES):
        p.resetSimulation()
        p.setGravity(0, 0, -9.8)
        bodies = build(files, episode, draw)
        if edit is not None and not during:
            found.append(edit(bodies, episode))
        for step in range(3 * loops.STEPS):
            p.setJointMotorControl2(bodies["free"], 0, p.POSITION_CONTROL, 0.01 * step, force=5)
            p.stepSimulation()
            if edit is not None and during and step == loops.STEPS:
                found.append(edit(bodies, episode))
        found.append(loops.trace({name: body for name, body in bodies.items() if name in bodies}))
        found.append(p.getClosestPoints(bodies["box"], bodies["free"], 1.0))
    found.append(loops.world().spec.to_xml())
    p.disconnect()
    return found


def agree(
    files: Path, monkeypatch: pytest.MonkeyPatch, edit: loops.Edit | None, *, during: bool = False
) -> None:
    reused = run(files, edit, during=during)
    with monkeypatch.context() as patch:
        patch.setattr(FormerArrays, "take", lambda *_: False)
        assert reused == run(files, edit, during=during)


def test_a_robot_of_another_size_moves_as_in_new_arrays(
    files: Path, monkeypatch: pytest.MonkeyPatch, taken: list[bool]
) -> None:
    agree(files, monkeypatch, None)
    assert taken == [True] * (loops.EPISODES - 1)


@pytest.mark.parametrize("during", [False, True])
@pytest.mark.parametrize("edit", loops.EDITS, ids=lambda edit: edit.__name__)
def test_nothing_of_an_episode_reaches_the_next(
    files: Path, monkeypatch: pytest.MonkeyPatch, edit: loops.Edit, during: bool
) -> None:
    (files / "arm.urdf").write_text(loops.ARM)
    (files / "wedge.obj").write_text(loops.WEDGE)
    agree(files, monkeypatch, edit, during=during)


def test_the_numbers_are_those_of_a_compile(files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found, take = list[list[str]](), FormerArrays.take

    def compared(self: FormerArrays, model: Any) -> bool:
        done = take(self, model)
        found.append(differing(model, self.model))
        found.append(differing(model.opt, self.model.opt) + differing(model.stat, self.model.stat))
        found.append(differing(mujoco.MjData(model), self.data))
        return done

    monkeypatch.setattr(FormerArrays, "take", compared)
    run(files, loops.change_dynamics)
    assert found == [[]] * 3 * (loops.EPISODES - 1)


@pytest.mark.parametrize("other", ["axis", "shape", "joint", "plane"])
def test_another_structure_gets_arrays_of_its_own(files: Path, taken: list[bool], other: str) -> None:
    changes = {
        "axis": ('type="revolute"', 'type="continuous"'),
        "shape": ('<box size="0.2 0.2 0.1"/>', '<sphere radius="0.1"/>'),
        "joint": ('type="prismatic"', 'type="fixed"'),
        "plane": ("", ""),
    }
    inertial = INERTIAL.format(y=0, z=0, m=1, moments=MOMENTS)
    text = ROBOT.format(inertial=inertial, x=0.2, y=0.2, z=0.2)
    before, after = changes[other]
    (files / "one.urdf").write_text(text)
    (files / "two.urdf").write_text(text.replace(before, after) if before else text)
    p.connect(p.DIRECT)
    for name in ("one", "two"):
        p.resetSimulation()
        if other == "plane" and name == "two":
            p.loadURDF(str(files / "plane.urdf"))
        p.loadURDF(str(files / f"{name}.urdf"))
        p.stepSimulation()
    assert taken == [False]


def test_arrays_that_programs_may_hold_are_not_used_again(files: Path) -> None:
    draw = random.Random(3)
    p.connect(p.DIRECT)
    build(files, 0, draw)
    p.stepSimulation()
    world = loops.world()
    former = world.retire()
    assert isinstance(former, FormerWorld)
    assert former.arrays is not None
    assert world.model is former.arrays.model
    assert world.retire() is None


def test_large_arrays_are_given_back(files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    p.connect(p.DIRECT)
    build(files, 0, random.Random(4))
    p.stepSimulation()
    world = loops.world()
    former = world.retire()
    assert former is not None
    assert former.arrays is not None
    monkeypatch.setattr(compiled_world, "MOST_BYTES", 1000)
    former = world.retire()
    assert former is not None
    assert former.arrays is None

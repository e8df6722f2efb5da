"""Loops of links stay closed: a four-bar linkage, in a world, as MJCF, as USD and through an import."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from roboyard.description import RobotDescription, load_description
from roboyard.description.robot_model import RobotModel
from roboyard.description.semantic import SemanticDescription
from roboyard.export import mjcf, usd
from roboyard.importer.steps.merge_fixed import merge_links
from roboyard.sim import World

LINK = (
    '<link name="{}"><inertial><origin xyz="{}"/><mass value="1"/>'
    '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>'
)
JOINT = (
    '<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/><origin xyz="{}"/>'
    '<axis xyz="0 1 0"/></joint>'
)


def four_bar(kind: str = "revolute") -> RobotDescription:
    """A parallelogram of 2 x 1 m, standing: crank and rocker turn by the same angle."""
    return load_description(
        '<robot name="linkage">'
        + LINK.format("ground", "0 0 0")
        + LINK.format("crank", "0 0 0.5")
        + LINK.format("rod", "1 0 0")
        + LINK.format("rocker", "0 0 0.5")
        + JOINT.format("a", "ground", "crank", "0 0 0")
        + JOINT.format("b", "crank", "rod", "0 0 1")
        + JOINT.format("c", "ground", "rocker", "2 0 0")
        + f'<loop name="closing" type="{kind}"><predecessor link="rod"><origin xyz="2 0 0"/></predecessor>'
        '<successor link="rocker"><origin xyz="0 0 1"/></successor><axis xyz="0 1 0"/></loop></robot>'
    )


@pytest.mark.parametrize("kind", ["revolute", "spherical"])
def test_a_parallelogram_swings_as_one(kind: str) -> None:
    world = World()
    body = world.add_urdf(four_bar(kind), fixed_base=True)
    body.joint("a").position = body.joint("c").position = 0.3
    body.joint("b").position = -0.3
    for _ in range(400):
        world.step()
        a, b, c = (body.joint(name).position for name in "abc")
        assert abs(a - c) < 2e-3
        assert abs(a + b) < 2e-3
    assert abs(a - 0.3) > 0.3, "it fell"


def test_a_fixed_loop_makes_it_stiff() -> None:
    world = World()
    body = world.add_urdf(four_bar("fixed"), fixed_base=True)
    for _ in range(200):
        world.step()
    assert max(abs(body.joint(name).position) for name in "abc") < 0.02


def _model(description: RobotDescription) -> RobotModel:
    semantic = SemanticDescription(base_link=description.root.name)
    return RobotModel(name="linkage", description=description, semantic=semantic)


def test_mjcf_keeps_the_loop(tmp_path: Path) -> None:
    mjcf.write(_model(four_bar()), tmp_path / "linkage.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "linkage.xml"))
    data = mujoco.MjData(model)
    data.qpos[:] = [0.3, -0.3, 0.3]
    for _ in range(500):
        mujoco.mj_step(model, data)
    assert model.neq == 2
    assert abs(data.qpos[0] - data.qpos[2]) < 2e-3
    assert abs(data.qpos[0] - 0.3) > 0.1


def test_usd_keeps_the_loop(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    usd.write(_model(four_bar()), tmp_path / "linkage.usda")
    (loop,) = load_description(tmp_path / "linkage.usda").loops
    before = four_bar().loops[0]
    assert (loop.name, loop.type, loop.first, loop.second) == ("closing", "revolute", "rod", "rocker")
    axis = loop.first_origin.matrix()[:3, :3] @ np.array(loop.axis)
    np.testing.assert_allclose(axis, before.axis, atol=1e-6)
    np.testing.assert_allclose(loop.first_origin.position, (2, 0, 0), atol=1e-6)
    np.testing.assert_allclose(loop.second_origin.position, (0, 0, 1), atol=1e-6)


def test_merged_links_take_their_loops_along() -> None:
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><link name="c"/>'
        '<joint name="j" type="fixed"><parent link="a"/><child link="b"/>'
        f'<origin xyz="1 0 0" rpy="0 0 {math.pi / 2}"/></joint>'
        '<joint name="k" type="floating"><parent link="a"/><child link="c"/></joint>'
        '<loop name="l" type="spherical"><predecessor link="b"><origin xyz="1 0 0"/></predecessor>'
        '<successor link="c"/></loop></robot>'
    )
    description = load_description(text)
    merged = merge_links(description, {}, set())[1]
    assert merged.loops[0].first == "a"
    np.testing.assert_allclose(merged.loops[0].first_origin.position, (1, 1, 0), atol=1e-12)


def test_a_loop_that_says_too_little_stays_open() -> None:
    description = load_description(
        '<robot name="r"><link name="a"/><loop name="l" type="gear"/><loop name="m" type="fixed">'
        '<predecessor link="a"/><successor link="z"/></loop></robot>'
    )
    assert description.loops == ()
    assert len(description.extra) == 2
    assert sum("stays open" in note for note in description.notes) == 2

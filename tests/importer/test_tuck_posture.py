"""Tucked postures of robots that drive."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.description import load_description
from roboyard.description.robot_model import CollisionSphere, RobotModel
from roboyard.importer.planning.self_collision import PostureSampler, adjacent_pairs
from roboyard.importer.planning.sphere_pairs import SphereSets
from roboyard.importer.planning.tuck_posture import GAP, tuck_posture
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.morphology.analyze import infer_semantics

WHEEL = """<link name="{name}"><collision><origin rpy="1.5707963 0 0"/><geometry>
<cylinder radius="0.1" length="0.05"/></geometry></collision></link>
<joint name="{name}_joint" type="continuous"><parent link="base"/><child link="{name}"/>
<origin xyz="0 {y} 0.1"/><axis xyz="0 1 0"/></joint>"""
AXES = ("0 0 1", "0 1 0", "1 0 0", "0 1 0", "1 0 0", "0 1 0")


def arm(side: str, y: float) -> str:
    """Six links of 0.2 m along x, from a shoulder at the height of 0.9 m."""
    text, parent, start = "", "base", f"0.1 {y} 0.9"
    for k, axis in enumerate(AXES):
        name = f"{side}{k}"
        text += (
            f'<link name="{name}"><collision><origin xyz="0.1 0 0"/><geometry><box size="0.2 0.05 0.05"/>'
            f'</geometry></collision></link><joint name="j{name}" type="revolute"><parent link="{parent}"/>'
            f'<child link="{name}"/><origin xyz="{start}"/><axis xyz="{axis}"/>'
            '<limit lower="-2.5" upper="2.5" effort="10" velocity="1"/></joint>'
        )
        parent, start = name, "0.2 0 0"
    return text


def robot(*arms: str, wheels: bool = True) -> RobotModel:
    shape = '<origin xyz="0 0 0.55"/><geometry><box size="0.2 0.2 0.8"/></geometry>'
    base = f'<link name="base"><collision>{shape}</collision></link>'
    rolling = "".join(WHEEL.format(name=n, y=y) for n, y in (("l", 0.2), ("r", -0.2))) if wheels else ""
    description = load_description(f'<robot name="x">{base}{rolling}{"".join(arms)}</robot>')
    return RobotModel(name="x", description=description, semantic=infer_semantics(description))


def spheres(model: RobotModel) -> dict[str, tuple[CollisionSphere, ...]]:
    column = tuple(CollisionSphere(center=(0, 0, z), radius=0.1) for z in np.arange(0.2, 0.95, 0.1))
    rod = tuple(CollisionSphere(center=(x, 0, 0), radius=0.03) for x in (0.03, 0.1, 0.17))
    links = [link.name for link in model.description.links if link.name not in ("base", "l", "r")]
    return {"base": column, **dict.fromkeys(links, rod)}


def measured(model: RobotModel, posture: dict[str, float]) -> tuple[float, float]:
    """Largest level distance of the arms' links, and smallest gap of links that no joint connects (m)."""
    own = spheres(model)
    names = list(own)
    sets = SphereSets.of(names, own)
    sampler = PostureSampler(model.description)
    positions, rotations = sampler.frames([sampler.posture(posture)], names)
    gaps = sets.gaps(positions[0], rotations[0])
    for a, b in adjacent_pairs(model.description, names):
        gaps[names.index(a), names.index(b)] = gaps[names.index(b), names.index(a)] = np.inf
    return float(np.linalg.norm(positions[0][1:, :2], axis=1).max()), float(gaps.min())


def ignored(model: RobotModel) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for a, b in adjacent_pairs(model.description, list(spheres(model))):
        found.setdefault(a, []).append(b)
    return found


def test_two_arms_tuck_near_the_body_without_contact_and_mirror_each_other() -> None:
    model = robot(arm("p", 0.15), arm("q", -0.15))
    rest = {joint.name: 0.0 for joint in model.description.joints}
    tucked = tuck_posture(model, rest, spheres(model), ignored(model))
    reach, gap = measured(model, tucked)
    assert measured(model, rest)[0] == pytest.approx(1.1, abs=0.05)
    assert reach < 0.9 and gap > GAP
    assert all(abs(value) <= 2.5 for value in tucked.values())
    signs = {"0 0 1": -1, "0 1 0": 1, "1 0 0": -1}
    for k, axis in enumerate(AXES):
        assert tucked[f"jq{k}"] == pytest.approx(signs[axis] * tucked[f"jp{k}"])
    assert tuck_posture(model, rest, spheres(model), ignored(model)) == tucked


def test_an_arm_on_the_floor_and_a_base_without_arms_have_no_tucked_posture() -> None:
    for model in (robot(arm("p", 0.15), wheels=False), robot()):
        rest = {joint.name: 0.0 for joint in model.description.joints}
        assert tuck_posture(model, rest, spheres(model), ignored(model)) == {}


def test_a_shape_without_spheres_keeps_above_the_floor_in_the_tucked_posture() -> None:
    """Such as the box that some vendors draw around a hand; it stood on the floor."""
    box = '<link name="guard"><collision><geometry><box size="0.1 0.1 1.1"/></geometry></collision></link>'
    fixed = '<joint name="guard_joint" type="fixed"><parent link="p5"/><child link="guard"/></joint>'
    model = robot(arm("p", 0.15) + box + fixed)
    rest = {joint.name: 0.0 for joint in model.description.joints if joint.is_moving}
    own = {name: balls for name, balls in spheres(model).items() if name != "guard"}
    tucked = tuck_posture(model, rest, own, ignored(model))
    assert tucked
    guard = forward_kinematics(model.description, tucked)["guard"]
    corners = (
        guard[:3, 3]
        + np.array([(x, y, z) for x in (-0.05, 0.05) for y in (-0.05, 0.05) for z in (-0.55, 0.55)])
        @ guard[:3, :3].T
    )
    assert corners[:, 2].min() > 0.05 - 1e-9
    free = tuck_posture(robot(arm("p", 0.15)), rest, own, ignored(model))
    assert free != {name: tucked[name] for name in free}, "the box makes a difference"

"""Flying robots land on their bases, with their arms raised."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.description import load_description
from roboyard.importer.planning.landed_arms import landed_arms
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.morphology.analyze import infer_semantics

PART = (
    '<link name="{name}"><inertial><mass value="{mass}"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" '
    'iyz="0" izz="0.01"/></inertial><collision><origin xyz="0 0 {z}"/>'
    '<geometry><box size="{size}"/></geometry></collision></link>'
)
JOINT = (
    '<joint name="j_{child}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
    '<origin xyz="0 0 {z}"/><axis xyz="0 1 0"/><limit lower="{low}" upper="{high}" effort="5" velocity="5"/>'
    "</joint>"
)


def drone(low: float, high: float, name: str = "flying_arm") -> str:
    """Return a body that is 0.2 m high, with an arm of two links of 0.3 m that hang from its middle."""
    text = PART.format(name="body", mass=3, z=0, size="0.5 0.5 0.2")
    for k, (parent, z) in enumerate((("body", 0.0), (f"{name}_0", -0.3))):
        child = f"{name}_{k}"
        text += PART.format(name=child, mass=0.2, z=-0.15, size="0.02 0.02 0.3")
        text += JOINT.format(parent=parent, child=child, z=z, low=low, high=high)
    return f'<robot name="x">{text}</robot>'


def test_links_that_are_named_flying_make_a_drone() -> None:
    named = infer_semantics(load_description(drone(-1.7, 1.7)))
    assert (named.kind, named.base) == ("drone", "floating")
    assert [arm.joints for arm in named.arms] == [("j_flying_arm_0", "j_flying_arm_1")]
    assert infer_semantics(load_description(drone(-1.7, 1.7, name="arm"))).kind != "drone"


@pytest.mark.parametrize(("low", "high"), [(-1.7, 1.7), (-2.5, 0.1), (-0.1, 2.5)])
def test_a_hanging_arm_is_raised_above_the_lowest_point_of_the_base(low: float, high: float) -> None:
    description = load_description(drone(low, high))
    arms = infer_semantics(description).arms
    rest = {name: 0.0 for arm in arms for name in arm.joints}
    found = {**rest, **landed_arms(description, arms, rest)}
    poses = forward_kinematics(description, found)
    ends = [(poses[link] @ np.array([0, 0, -0.3, 1]))[2] for link in ("flying_arm_0", "flying_arm_1")]
    assert min(ends) > -0.1
    assert all(low <= value <= high for value in found.values())


def test_an_arm_that_cannot_be_raised_stays() -> None:
    description = load_description(drone(-0.3, 0.3))
    arms = infer_semantics(description).arms
    assert landed_arms(description, arms, {name: 0.0 for arm in arms for name in arm.joints}) == {}

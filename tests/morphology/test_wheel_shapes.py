"""Which links count as wheels, at the edges of the rules: roundness, tilt, height, swivels and mimics."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from small_robots import joint, link, robot

from roboyard.morphology.analyze import infer_semantics
from roboyard.morphology.wheels import find_rolling_links, find_wheel_pair, find_wheels

BASE = link("base", "box 0.5 0.3 0.1", 5)


def prism(sides: int, name: str = "wheel") -> str:
    """A regular prism of 0.1 m radius around y, as boxes that turn around the axle."""
    half = 0.1 * math.cos(math.pi / sides)
    boxes = "".join(
        f'<collision><origin rpy="0 {2 * math.pi * k / sides} 0"/><geometry>'
        f'<box size="{2 * half} 0.04 {2 * 0.1 * math.sin(math.pi / sides)}"/></geometry></collision>'
        for k in range(sides // 2)
    )
    return f'<link name="{name}">{boxes}</link>'


def turning(name: str, *, xyz: str = "0 0.2 0", axis: str = "0 1 0", parent: str = "base", **options) -> str:
    return joint(f"{name}_joint", parent, name, kind="continuous", xyz=xyz, axis=axis, **options)


def links(*parts: str) -> list[str]:
    return [wheel.link for wheel in find_wheels(robot(BASE, *parts))]


@pytest.mark.parametrize(("sides", "round_enough"), [(4, False), (6, False), (8, True), (16, True)])
def test_a_prism_is_a_wheel_from_eight_sides_on(sides: int, round_enough: bool) -> None:
    assert links(prism(sides), turning("wheel")) == (["wheel"] if round_enough else [])


@pytest.mark.parametrize(("degrees", "found"), [(0, True), (5, True), (7, False), (45, False), (90, False)])
def test_an_axle_may_tilt_by_less_than_six_degrees(degrees: float, found: bool) -> None:
    axis = f"0 {math.cos(math.radians(degrees))} {math.sin(math.radians(degrees))}"
    assert links(link("wheel", "sphere 0.1"), turning("wheel", axis=axis)) == (["wheel"] if found else [])


def test_the_axis_is_measured_in_the_frame_of_the_joint() -> None:
    # the joint's z axis is turned onto -y of the base
    part = joint("j", "base", "wheel", kind="continuous", xyz="0 0.2 0", rpy="1.5707963 0 0", axis="0 0 1")
    (wheel,) = find_wheels(robot(BASE, link("wheel", "cylinder 0.1 0.04"), part))
    assert wheel.axis == pytest.approx([0, -1, 0], abs=1e-6)
    assert wheel.radius == pytest.approx(0.1, rel=1e-3)


@pytest.mark.parametrize(("height", "found"), [(0.0, True), (0.014, True), (0.016, False), (0.3, False)])
def test_a_wheel_hangs_at_most_15_percent_of_its_radius_above_the_lowest_point(
    height: float, found: bool
) -> None:
    """The other wheel reaches 10 cm below the axle: it is the floor."""
    floor = link("low", "sphere 0.1") + turning("low", xyz="0 -0.2 0")
    high = link("high", "sphere 0.1") + turning("high", xyz=f"0 0.2 {height}")
    assert links(floor, high) == (["low", "high"] if found else ["low"])


def test_a_wheel_needs_a_joint_without_limits() -> None:
    sphere = link("wheel", "sphere 0.1")
    assert links(sphere, joint("j", "base", "wheel", xyz="0 0.2 0", axis="0 1 0")) == []
    slide = joint("j", "base", "wheel", kind="prismatic", xyz="0 0.2 0", axis="0 1 0")
    assert links(sphere, slide) == []


def test_a_wheel_that_copies_another_is_not_driven() -> None:
    one = link("left", "sphere 0.1") + turning("left")
    copy = link("right", "sphere 0.1") + turning("right", xyz="0 -0.2 0", mimic='<mimic joint="left_joint"/>')
    assert links(one, copy) == ["left"]


def test_the_centre_is_in_the_middle_of_the_shape_along_the_axle() -> None:
    """The disc of the link is 5 cm beside its frame."""
    disc = (
        '<link name="wheel"><collision><origin xyz="0 0.05 0" rpy="1.5707963 0 0"/><geometry>'
        '<cylinder radius="0.1" length="0.02"/></geometry></collision></link>'
    )
    (wheel,) = find_wheels(robot(BASE, disc, turning("wheel", xyz="0.1 0.2 0.01")))
    assert wheel.centre == pytest.approx([0.1, 0.25, 0.01], abs=1e-6)


def test_a_disc_off_its_axle_is_no_wheel() -> None:
    cam = link("cam", "sphere 0.1", origin="0.03 0 0")
    assert links(cam, turning("cam")) == []


@pytest.mark.parametrize(
    ("axis", "kind", "caster"),
    [("0 0 1", "continuous", True), ("0 0 -1", "continuous", True), ("0 0 1", "revolute", False),
     ("1 0 0", "continuous", False)],
)  # fmt: skip
def test_a_caster_swivels_without_limits_about_an_upright_axis(axis: str, kind: str, caster: bool) -> None:
    fork = link("fork") + joint("swivel", "base", "fork", kind=kind, xyz="-0.2 0 0", axis=axis)
    wheel = link("wheel", "sphere 0.1") + turning("wheel", parent="fork", xyz="0 0 0")
    (found,) = find_rolling_links(robot(BASE, fork, wheel))
    assert (found.is_caster, found.is_direct) == (caster, False)


def cart(*wheels: tuple[float, float]) -> tuple[str, ...]:
    return tuple(
        link(f"w{k}", "sphere 0.1", 1) + turning(f"w{k}", xyz=f"{x} {y} 0") for k, (x, y) in enumerate(wheels)
    )


def test_four_wheels_on_two_sides_skid_and_are_no_pair() -> None:
    description = robot(BASE, *cart((0.2, 0.2), (0.2, -0.2), (-0.2, 0.2), (-0.2, -0.2)))
    semantic = infer_semantics(description)
    assert (semantic.base, semantic.drive) == ("differential", "skid")
    assert semantic.base_joints == tuple(f"w{k}_joint" for k in range(4))
    assert semantic.wheel_pair is None


@pytest.mark.parametrize(
    ("second", "paired"),
    [((0.0, -0.2), True), ((0.004, -0.2), True), ((0.02, -0.2), False), ((0.0, 0.19), False)],
)
def test_a_pair_is_side_by_side_on_one_axle(second: tuple[float, float], paired: bool) -> None:
    found = find_wheel_pair(find_wheels(robot(BASE, *cart((0.0, 0.2), second))))
    assert (found is not None) == paired
    if found is not None:
        assert (found.left, found.right) == ("w0_joint", "w1_joint")
        assert found.length == pytest.approx(0.4)


def test_left_and_right_follow_from_the_places_not_from_the_order() -> None:
    found = find_wheel_pair(find_wheels(robot(BASE, *cart((0.0, -0.2), (0.0, 0.2)))))
    assert found is not None
    assert (found.left, found.right) == ("w1_joint", "w0_joint")


def test_visual_shapes_count_where_the_robot_has_no_collision_shapes() -> None:
    drawn = [part.replace("collision>", "visual>") for part in (BASE, link("wheel", "sphere 0.1"))]
    (wheel,) = find_wheels(robot(*drawn, turning("wheel")))
    assert wheel.radius == pytest.approx(0.1, rel=1e-3)
    assert np.linalg.norm(wheel.axis) == pytest.approx(1.0)

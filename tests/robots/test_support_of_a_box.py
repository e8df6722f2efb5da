"""Stability margins of a box on four wheels and a tower, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from controller_states import square_margins

from roboyard.description import load_description
from roboyard.robots import Robot, add_robot
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.robots.stability.support_polygon import (
    MAX_COM_SHIFT,
    MAX_ZMP_SHIFT,
    RESERVE,
    SupportPolygon,
    support_polygon_of,
)
from roboyard.sim import World

G = 9.81
HALF_LENGTH, HALF_WIDTH, WHEEL = 0.3, 0.2, 0.05
LOAD, LIFT = 12.0, 0.7
SHIFT = 0.06
"""Forward position of the load (m)."""
MASS = (
    "<inertial><mass value='{mass}'/>"
    "<inertia ixx='{i}' iyy='{i}' izz='{i}' ixy='0' ixz='0' iyz='0'/></inertial>"
)


def box_robot(corners=((1, 1), (1, -1), (-1, 1), (-1, -1))) -> Robot:
    """Return a load on a mast that slides forwards, on wheels of next to no mass."""
    links, joints, above = ["<link name='world_link'/>"], [], "world_link"
    light, load = MASS.format(mass=1e-6, i=1e-9), MASS.format(mass=LOAD, i=1e-6)
    for name, axis in zip(VIRTUAL_JOINTS, ("1 0 0", "0 1 0", "0 0 1") * 2, strict=True):
        child = "base" if name == VIRTUAL_JOINTS[-1] else name.replace("joint", "link")
        kind = "prismatic" if name[-7] in "xyz" and "_r" not in name else "revolute"
        links.append(f"<link name='{child}'>{light if child == 'base' else ''}</link>")
        joints.append(
            f"<joint name='{name}' type='{kind}'><parent link='{above}'/><child link='{child}'/>"
            f"<axis xyz='{axis}'/><limit lower='-99' upper='99' effort='1000' velocity='2'/></joint>"
        )
        above = child
    for k, (x, y) in enumerate(corners):
        shape = f"<collision><geometry><sphere radius='{WHEEL}'/></geometry></collision>"
        links.append(f"<link name='wheel{k}'>{light}{shape}</link>")
        joints.append(
            f"<joint name='w{k}' type='fixed'><parent link='base'/><child link='wheel{k}'/>"
            f"<origin xyz='{x * HALF_LENGTH} {y * HALF_WIDTH} {WHEEL}'/></joint>"
        )
    links.append(f"<link name='load'>{load}</link>")
    joints.append(
        "<joint name='slide' type='prismatic'><parent link='base'/><child link='load'/>"
        f"<origin xyz='{SHIFT} 0 {LIFT}'/><axis xyz='1 0 0'/>"
        "<limit lower='-1' upper='1' effort='500' velocity='1'/></joint>"
    )
    description = load_description(f"<robot name='box'>{''.join(links + joints)}</robot>")
    definition = {
        "raw_controller_order": ["base", "trunk"],
        "default_controllers": {},
        "base_footprint_link_name": "base",
        "holonomic_base": {},
        "articulated_trunk": {"trunk_joint_names": ["slide"]},
        "locomotion": {
            "base_joint_names": [VIRTUAL_JOINTS[k] for k in (0, 1, 5)],
            "floor_touching_base_link_names": [f"wheel{k}" for k in range(len(corners))],
        },
    }
    return add_robot(World(), description, definition=definition)


def margins_of(robot: Robot):
    support = support_polygon_of(robot)
    assert isinstance(support, SupportPolygon)
    robot.joint_arrays.refresh()
    return support.balance(np.arange(len(robot.joint_names)))


def by_normal(margins, values: np.ndarray) -> dict[tuple[int, int], float]:
    """Return a value of each edge by its outward normal in the base's axes."""
    keys = [(round(x), round(y)) for x, y in margins.outwards]
    return dict(zip(keys, values.tolist(), strict=True))


@pytest.mark.parametrize("yaw", [0.0, 0.8])
def test_margins_of_a_box_on_four_wheels(yaw: float) -> None:
    robot = box_robot()
    robot.set_pose((1.0, -2.0, 0.0), (0, 0, np.sin(yaw / 2), np.cos(yaw / 2)))
    margins = margins_of(robot)
    expected = {
        (1, 0): HALF_LENGTH - SHIFT,
        (-1, 0): HALF_LENGTH + SHIFT,
        (0, 1): HALF_WIDTH,
        (0, -1): HALF_WIDTH,
    }
    ways = {(1, 0): HALF_LENGTH, (-1, 0): HALF_LENGTH, (0, 1): HALF_WIDTH, (0, -1): HALF_WIDTH}
    edge, reserve = by_normal(margins, margins.edge), by_normal(margins, margins.reserve)
    com, zmp = by_normal(margins, margins.com_margin), by_normal(margins, margins.zmp_margin)
    assert edge == pytest.approx(expected, abs=1e-5)
    for normal, way in ways.items():
        assert zmp[normal] == pytest.approx(MAX_ZMP_SHIFT * way, rel=1e-5)
        assert reserve[normal] == pytest.approx(RESERVE * way, rel=1e-5)
        assert com[normal] == pytest.approx(edge[normal] - (1 - MAX_COM_SHIFT) * way, abs=1e-5)
    assert margins.height == pytest.approx(LIFT / G, rel=1e-4)
    assert margins.moment == pytest.approx([LIFT * SHIFT / G, 0.0], abs=1e-5)
    assert margins.lost == pytest.approx(np.zeros(4), abs=1e-9)


def test_a_sliding_load_shifts_the_centre_of_mass_and_the_zero_moment_point() -> None:
    """One metre of the load is one metre of the centre of mass; a m/s^2 shifts the point back by a h / g."""
    robot = box_robot()
    margins = margins_of(robot)
    slide = robot.joint_arrays.index["slide"]
    com, zmp = (
        by_normal(margins, margins.com_shift[:, slide]),
        by_normal(margins, margins.zmp_shift[:, slide]),
    )
    assert com == pytest.approx({(1, 0): 1, (-1, 0): -1, (0, 1): 0, (0, -1): 0}, abs=1e-4)
    assert zmp == pytest.approx({(1, 0): -LIFT / G, (-1, 0): LIFT / G, (0, 1): 0, (0, -1): 0}, abs=1e-4)


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_the_swing_of_a_load_on_a_turning_base_is_centrifugal(speed: float) -> None:
    """The load at distance r pulls outwards with m w^2 r at height h: a shift of h w^2 r / g."""
    robot = box_robot()
    robot.joint_velocities = {VIRTUAL_JOINTS[5]: speed}
    margins = margins_of(robot)
    swing = by_normal(margins, margins.swing)
    expected = LIFT * speed**2 * SHIFT / G
    assert swing[1, 0] == pytest.approx(expected, rel=1e-3, abs=1e-6)
    assert swing[0, 1] == pytest.approx(0.0, abs=1e-5)


def test_a_load_beyond_the_wheels_has_a_negative_distance_to_the_edge() -> None:
    robot = box_robot()
    robot.joint_positions = {"slide": 0.4}
    margins = margins_of(robot)
    assert by_normal(margins, margins.edge)[1, 0] == pytest.approx(HALF_LENGTH - SHIFT - 0.4, abs=1e-5)


def test_three_wheels_support_a_triangle() -> None:
    margins = margins_of(box_robot(((1, 0), (-1, 1), (-1, -1))))
    slant = np.hypot(2 * HALF_LENGTH, HALF_WIDTH)
    apex_distance = (HALF_LENGTH - SHIFT) * HALF_WIDTH / slant
    assert sorted(margins.edge) == pytest.approx(
        [apex_distance, apex_distance, HALF_LENGTH + SHIFT], abs=1e-5
    )


def test_wheels_in_a_line_support_no_area() -> None:
    assert margins_of(box_robot(((1, 0), (0, 0), (-1, 0)))) is None


def test_margins_are_computed_again_only_after_they_are_discarded() -> None:
    robot = box_robot()
    support = support_polygon_of(robot)
    assert support is not None
    indices = np.array([robot.joint_arrays.index["slide"]])
    robot.joint_arrays.refresh()
    first = support.balance(indices)
    robot.joint_positions = {"slide": 0.1}
    robot.joint_arrays.refresh()
    assert support.balance(indices).edge == pytest.approx(first.edge)
    support.forget()
    assert support.balance(indices).edge.min() == pytest.approx(HALF_LENGTH - SHIFT - 0.1, abs=1e-5)
    assert support.balance(indices).com_shift.shape == (4, 1)


def test_a_tilting_base_loses_margin_ahead_of_its_motion() -> None:
    """A roll rate w moves the load sideways at h w; twice its capture distance is lost on that side."""
    robot = box_robot()
    robot.joint_velocities = {VIRTUAL_JOINTS[3]: 0.2}
    margins = margins_of(robot)
    lost = by_normal(margins, margins.lost)
    ahead = 2.0 * LIFT * 0.2 * np.sqrt(LIFT / G)
    assert lost == pytest.approx({(0, -1): ahead, (0, 1): 0, (1, 0): 0, (-1, 0): 0}, abs=1e-4)


H, B = 0.8, 0.2


@pytest.mark.parametrize(
    ("twist", "change", "expected"),
    [
        ((0, 0, 0), (1.0, 0, 0), (-H / G, 0)),
        ((0, 0, 0), (0, 2.0, 0), (0, -2.0 * H / G)),
        ((1.5, 0, 2.0), (0, 0, 0), (0.04, -H / G * 3.0 - 0.08)),
        ((0, 1.5, 2.0), (0, 0, 0), (H / G * 3.0 + 0.04, -0.08)),
        ((0, 0, 2.0), (0, 0, 0), (4.0 * 0.01, 4.0 * -0.02)),
        ((0, 0, 0), (0, 0, 3.0), (3.0 * -0.02, -3.0 * 0.01)),
    ],
)
def test_driving_shifts_the_zero_moment_point(twist, change, expected) -> None:
    margins = square_margins(B, H, G, moment=np.array([0.01, -0.02]))
    push = margins.push(np.array(twist, float), np.array(change, float))
    assert push == pytest.approx([expected[0], expected[1], -expected[0], -expected[1]])


def test_a_steady_curve_scales_with_the_square_of_its_speed() -> None:
    margins = square_margins(B, H, G)
    for factor in (1.0, 2.0, 4.0):
        twist = factor * np.array([1.2, 0.0, 1.6])
        part = margins.steady(twist)
        assert margins.push(part * twist, np.zeros(3)).max() == pytest.approx(
            min(0.7 * B, H / G * 1.92 * factor**2)
        )
    assert margins.steady(np.array([1e3, 0, 1e3])) == 0.1


def test_springs_are_released_where_they_would_tip_the_robot() -> None:
    shift = np.array([[1.0], [0.0], [-1.0], [0.0]])
    margins = square_margins(B, H, G, com_shift=shift, zmp_shift=-shift * H / G)
    assert margins.pull(np.array([0.1]), np.array([0.1])) == 1.0
    assert margins.pull(np.array([0.1]), np.array([0.3])) == 0.0
    assert margins.pull(np.array([-0.1]), np.array([0.3])) == 1.0
    strong = 4.0 * B * G / H
    assert margins.pull(np.array([strong]), np.array([0.0])) == pytest.approx(0.25)


def test_opposite_joints_cancel_only_half_of_their_shifts() -> None:
    rows = np.array([[0.1, -0.1], [0.0, 0.0], [-0.1, 0.1], [0.0, 0.0]])
    margins = square_margins(B, H, G, zmp_shift=rows)
    assert margins.together(np.array([4.0, 4.0])) == pytest.approx(0.5)
    assert margins.together(np.array([4.0, -4.0])) == pytest.approx(0.25)
    assert margins.together(np.array([0.5, 0.5])) == 1.0


def test_joints_slow_down_when_their_swing_exceeds_the_margin() -> None:
    assert square_margins(B, H, G, swing=np.array([4 * B, 0, -4 * B, 0])).calm() == pytest.approx(0.5)
    assert square_margins(B, H, G).calm() == 1.0

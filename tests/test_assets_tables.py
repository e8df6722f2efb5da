"""The joint tables of the droid and the skid-steer rover, from first principles.

PyBullet reports a joint's origin and axis in the frames of the centres of mass (the inertial frames); here
they are composed from the URDF's numbers alone and compared with the values that PyBullet prints for the
classic robots of those names.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from roboyard.assets import asset_path

TYPE = {"revolute": 0, "continuous": 0, "prismatic": 1, "fixed": 4}
TURN = (0.7070904020014416, 0.7071231599922604)
"""Sine and cosine of half of 1.57075 rad."""
S, C = TURN
NONE = (0.0, -1.0, 0.0, 0.0)
UNIT = (0.0, 0.0, 0.0, 1.0)
Z0 = (0.0, 0.0, 0.0)
SLIDE = (-0.38, 0.0, 1000.0, 0.5)
FINGER = (0.0, 0.548, 1000.0, 0.5)
WHEEL = (0.0, -1.0, 100.0, 100.0)
FOOT = (0.2999999996780742, 0.0, -1.3898038463944216e-05)

# name, type, qIndex, uIndex, (lower, upper, force, velocity), link, axis, position, orientation, parent
R2D2 = [
    ("base_to_right_leg", 4, -1, -1, NONE, "right_leg", Z0, (0.22, 0, 0.25), (0, -S, 0, C), -1),
    ("right_base_joint", 4, -1, -1, NONE, "right_base", Z0, FOOT, (0, S, 0, C), 0),
    ("right_front_wheel_joint", 0, 7, 6, WHEEL, "right_front_wheel", (0, 0, 1), (0, 0.133333333333, -0.085),
     (0, -S, 0, C), 1),
    ("right_back_wheel_joint", 0, 8, 7, WHEEL, "right_back_wheel", (0, 0, 1), (0, -0.133333333333, -0.085),
     (0, -S, 0, C), 1),
    ("base_to_left_leg", 4, -1, -1, NONE, "left_leg", Z0, (-0.22, 0, 0.25), (0, -S, 0, C), -1),
    ("left_base_joint", 4, -1, -1, NONE, "left_base", Z0, FOOT, (0, S, 0, C), 4),
    ("left_front_wheel_joint", 0, 9, 8, WHEEL, "left_front_wheel", (0, 0, 1), (0, 0.133333333333, -0.085),
     (0, -S, 0, C), 5),
    ("left_back_wheel_joint", 0, 10, 9, WHEEL, "left_back_wheel", (0, 0, 1), (0, -0.133333333333, -0.085),
     (0, -S, 0, C), 5),
    ("gripper_extension", 1, 11, 10, SLIDE, "gripper_pole", (1, 0, 0), (0, 0.19, 0.2), (0, 0, -S, C), -1),
    ("left_gripper_joint", 0, 12, 11, FINGER, "left_gripper", (0, 0, 1), (0.2, 0.02, 0), UNIT, 8),
    ("left_tip_joint", 4, -1, -1, NONE, "left_tip", Z0, Z0, UNIT, 9),
    ("right_gripper_joint", 0, 13, 12, FINGER, "right_gripper", (0, 0, -1), (0.2, -0.02, 0), UNIT, 8),
    ("right_tip_joint", 4, -1, -1, NONE, "right_tip", Z0, Z0, UNIT, 11),
    ("head_swivel", 0, 14, 13, SLIDE, "head", (0, 0, 1), (0, 0, 0.3), UNIT, -1),
    ("tobox", 4, -1, -1, NONE, "box", Z0, (0, 0.1214, 0.1214), UNIT, 13),
]  # fmt: skip
Y = (0, 1, 0)
HUSKY = [
    ("chassis_joint", 4, -1, -1, NONE, "base_link", Z0, (0, 0, 0.14493), UNIT, -1),
    ("imu_joint", 4, -1, -1, NONE, "imu_link", Z0, (0.08748, 0.00085, 0.09053), UNIT, 0),
    ("front_left_wheel", 0, 7, 6, NONE, "front_left_wheel_link", Y, (0.34348, 0.28625, -0.06665), UNIT, 0),
    ("front_right_wheel", 0, 8, 7, NONE, "front_right_wheel_link", Y, (0.34348, -0.28455, -0.06665), UNIT, 0),
    ("rear_left_wheel", 0, 9, 8, NONE, "rear_left_wheel_link", Y, (-0.16852, 0.28625, -0.06665), UNIT, 0),
    ("rear_right_wheel", 0, 10, 9, NONE, "rear_right_wheel_link", Y, (-0.16852, -0.28455, -0.06665), UNIT, 0),
    ("top_plate", 4, -1, -1, NONE, "top_plate_link", Z0, (0.08748, 0.00085, -0.09947), UNIT, 0),
    ("user_rail", 4, -1, -1, NONE, "user_rail_link", Z0, (0.35948, 0.00085, 0.14553), UNIT, 0),
    ("front_bumper", 4, -1, -1, NONE, "front_bumper_link", Z0, (0.56748, 0.00085, -0.00847), UNIT, 0),
    ("rear_bumper", 4, -1, -1, NONE, "rear_bumper_link", Z0, (-0.39252, 0.00085, -0.00847),
     (0, 0, 0.9999999999991198, -1.3267948966775328e-06), 0),
]  # fmt: skip


def numbers(element: ET.Element | None, key: str) -> np.ndarray:
    return (
        np.array([float(x) for x in element.get(key, "0 0 0").split()])
        if element is not None
        else np.zeros(3)
    )


def pose(element: ET.Element | None) -> np.ndarray:
    """(4, 4) of an <origin>."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(numbers(element, "rpy")), np.sin(numbers(element, "rpy"))
    roll = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    yaw = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    out = np.eye(4)
    out[:3, :3] = yaw @ pitch @ roll
    out[:3, 3] = numbers(element, "xyz")
    return out


def quaternion_matrix(q: tuple[float, ...]) -> np.ndarray:
    x, y, z, w = q
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def depth_first(robot: ET.Element) -> list[ET.Element]:
    """Joints depth first, siblings in file order."""
    joints = robot.findall("joint")
    children = {j.find("child").get("link") for j in joints}
    (root,) = (link.get("name") for link in robot.findall("link") if link.get("name") not in children)
    out: list[ET.Element] = []

    def visit(link: str) -> None:
        for joint in joints:
            if joint.find("parent").get("link") == link:
                out.append(joint)
                visit(joint.find("child").get("link"))

    visit(root)
    return out


@pytest.mark.parametrize(("name", "table"), [("r2d2", R2D2), ("husky", HUSKY)])
def test_joint_table(name: str, table: list[tuple]) -> None:
    robot = ET.parse(asset_path(name)).getroot()
    inertial = {link.get("name"): pose(link.find("inertial/origin")) for link in robot.findall("link")}
    joints = depth_first(robot)
    assert [j.get("name") for j in joints] == [row[0] for row in table]
    index = {j.find("child").get("link"): i for i, j in enumerate(joints)}
    moving = 0
    for joint, row in zip(joints, table, strict=True):
        _, kind, q_index, u_index, bounds, link, axis, position, orientation, parent_index = row
        assert TYPE[joint.get("type")] == kind
        movable = kind != 4
        assert (q_index, u_index) == ((7 + moving, 6 + moving) if movable else (-1, -1))
        moving += movable
        parent, child = joint.find("parent").get("link"), joint.find("child").get("link")
        assert child == link
        assert index.get(parent, -1) == parent_index
        limit = joint.find("limit")
        read = {
            k: float(limit.get(k, 0)) if limit is not None else 0.0
            for k in ("lower", "upper", "effort", "velocity")
        }
        if joint.get("type") in ("fixed", "continuous"):
            read |= {"lower": 0.0, "upper": -1.0}
        assert tuple(read.values()) == bounds
        assert joint.find("dynamics") is None  # damping and friction 0
        T_parent_com, T_child_com = inertial[parent], inertial[child]
        T_parent_child = pose(joint.find("origin"))
        T_coms = np.linalg.inv(T_parent_com) @ T_parent_child @ T_child_com
        at_joint = np.linalg.inv(T_parent_com) @ T_parent_child
        np.testing.assert_allclose(at_joint[:3, 3], position, atol=1e-12)
        np.testing.assert_allclose(T_coms[:3, :3].T, quaternion_matrix(orientation), atol=1e-12)
        if movable:
            found = T_child_com[:3, :3].T @ numbers(joint.find("axis"), "xyz")
            np.testing.assert_allclose(found, axis, atol=1e-12)


def test_husky_reports_its_footprint_as_its_centre_of_mass() -> None:
    robot = ET.parse(asset_path("husky")).getroot()
    footprint = robot.find("link")
    assert footprint.get("name") == "base_footprint"
    np.testing.assert_array_equal(pose(footprint.find("inertial/origin")), np.eye(4))
    assert float(footprint.find("inertial/mass").get("value")) > 0


def test_wheels_of_husky_and_ground_grip() -> None:
    """With friction 1 on its tyres the dropped rover rests where the tutorial prints; with less it slides."""
    for name, links in (("husky", 4), ("plane", 1)):
        robot = ET.parse(asset_path(name)).getroot()
        values = [e.get("value") for e in robot.findall("link/contact/lateral_friction")]
        assert values == ["1"] * links

"""Robots built in memory: a seven-joint arm, a lift with two arms and a gripper, a planar two-link arm."""

import numpy as np
import pytest

from roboyard.description.model import Joint, Limit, Link, Mimic, Pose, RobotDescription
from roboyard.kinematics import from_description
from roboyard.transforms import quaternion_from_rpy

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@pytest.fixture(autouse=True)
def every_call_is_checked(monkeypatch):
    """Compare the types of every call of a compiled loop, not of the first alone."""
    monkeypatch.setenv("ROBOYARD_CHECK_LOOPS", "1")


def joint(name, kind, parent, child, xyz=(0, 0, 0), rpy=(0, 0, 0), axis=X, limits=None, mimic=None):
    return Joint(
        name=name,
        type=kind,
        parent=parent,
        child=child,
        origin=Pose(position=tuple(map(float, xyz)), quaternion=tuple(quaternion_from_rpy(rpy).tolist())),
        axis=axis,
        limit=None if limits is None else Limit(lower=limits[0], upper=limits[1], effort=50.0, velocity=2.0),
        mimic=mimic,
    )


def robot(name, joints):
    names = dict.fromkeys(n for j in joints for n in (j.parent, j.child))
    return RobotDescription(name=name, links=tuple(Link(name=n) for n in names), joints=tuple(joints))


@pytest.fixture(scope="session")
def arm_description():
    rows = [
        (Z, (0.0, 0.0, 0.3), (0.0, 0.0, 0.2), (-2.9, 2.9)),
        (Y, (0.0, 0.0, 0.1), (0.0, 0.0, 0.0), (-1.8, 1.8)),
        (Z, (0.0, 0.02, 0.2), (0.0, 0.0, 0.0), (-2.9, 2.9)),
        ((0.0, -1.0, 0.0), (0.03, 0.0, 0.2), (0.1, 0.0, 0.0), (-2.5, 0.1)),
        (Z, (-0.02, 0.0, 0.2), (0.0, 0.0, 0.0), (-2.9, 2.9)),
        ((0.0, 0.8, 0.6), (0.0, 0.0, 0.2), (0.0, -0.3, 0.0), (-0.2, 3.0)),
        ((0.0, 0.0, -1.0), (0.05, 0.0, 0.05), (0.0, 0.0, 0.0), (-2.9, 2.9)),
    ]
    joints = [
        joint(f"joint{i}", "revolute", f"link{i - 1}", f"link{i}", xyz, rpy, axis, limits)
        for i, (axis, xyz, rpy, limits) in enumerate(rows, start=1)
    ]
    joints.append(joint("flange", "fixed", "link7", "tool", (0.0, 0.01, 0.1), (0.3, -0.2, 0.5)))
    return robot("arm", joints)


@pytest.fixture(scope="session")
def arm(arm_description):
    return from_description(arm_description, "tool")


@pytest.fixture(scope="session")
def straight_arm():
    axes = [Z, Y, Z, (0.0, -1.0, 0.0), Z, Y, Z]
    joints = [
        joint(f"joint{i}", "revolute", f"link{i - 1}", f"link{i}", (0, 0, 0.2), axis=axis, limits=(-3, 3))
        for i, axis in enumerate(axes, start=1)
    ]
    return robot("straight", joints)


@pytest.fixture(scope="session")
def home():
    return np.array([0.1, 0.5, -0.2, -1.2, 0.1, 0.9, 0.3])


@pytest.fixture(scope="session")
def two_arms_description():
    joints = [
        joint("lift", "prismatic", "base", "column", (0, 0, 0.2), axis=Z, limits=(0.0, 0.4)),
        joint("turn", "continuous", "column", "chest", (0, 0, 0.3), axis=Z),
    ]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        previous = "chest"
        rows = [
            (X, (0, 0.2 * sign, 0.2)),
            (Y, (0, 0.05 * sign, 0)),
            (Z, (0, 0, 0.1)),
            (Y, (0.25, 0, 0)),
            (X, (0.2, 0, 0)),
        ]
        for i, (axis, xyz) in enumerate(rows, start=1):
            here = f"{side}_arm{i}"
            joints.append(joint(f"{side}{i}", "revolute", previous, here, xyz, axis=axis, limits=(-2.0, 2.0)))
            previous = here
        joints.append(joint(f"{side}_mount", "fixed", previous, f"{side}_hand", (0.1, 0, 0), (0, 0.2, 0)))
    joints += [
        joint("finger_a", "prismatic", "left_hand", "finger_a", (0.05, 0, 0), axis=Y, limits=(0.0, 0.04)),
        joint("finger_b", "prismatic", "left_hand", "finger_b", (0.05, 0, 0), axis=Y, limits=(-0.05, 0.0),
              mimic=Mimic(joint="finger_a", multiplier=-2.0, offset=0.01)),
    ]  # fmt: skip
    return robot("two_arms", joints)


@pytest.fixture(scope="session")
def two_arms(two_arms_description):
    return from_description(two_arms_description, ["left_hand", "right_hand"])


@pytest.fixture(scope="session")
def planar():
    """Two links of 1 m and 0.5 m about z, without limits."""
    joints = [
        joint("shoulder", "continuous", "base", "upper", axis=Z),
        joint("elbow", "continuous", "upper", "fore", (1.0, 0, 0), axis=Z),
        joint("end", "fixed", "fore", "tip", (0.5, 0, 0)),
    ]
    return from_description(robot("planar", joints), "tip")


@pytest.fixture(scope="session")
def build():
    """(joint, robot): makers for a test's own robots."""
    return joint, robot

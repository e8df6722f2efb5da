"""The USD stage, as Newton's importer understands it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboyard.description.robot_model import RobotModel
from roboyard.export import usd

pytest.importorskip("newton_usd_schemas", reason="Newton is not a dependency")

pytestmark = pytest.mark.filterwarnings("ignore")


def read(robot: RobotModel, folder: Path) -> Any:
    # here, as it takes seconds to load
    newton = pytest.importorskip("newton", reason="Newton is not a dependency")
    builder = newton.ModelBuilder()
    usd.write(robot, folder / "robot.usda")
    builder.add_usd(str(folder / "robot.usda"))
    return builder


@pytest.mark.parametrize("name", ["r1", "husky", "arm7"])
def test_newton_builds_the_same_robot(
    bundled: Callable[[str], RobotModel], tmp_path: Path, name: str
) -> None:
    robot = bundled(name)
    builder = read(robot, tmp_path)
    description = robot.description
    bodies = {label.rpartition("/")[2]: i for i, label in enumerate(builder.body_label)}
    assert set(bodies) == {link.name for link in description.links}
    for link in description.links:
        if link.inertial is not None and link.inertial.mass > 0:
            assert builder.body_mass[bodies[link.name]] == pytest.approx(link.inertial.mass, rel=1e-5)
            assert np.allclose(builder.body_com[bodies[link.name]], link.inertial.origin.position, atol=1e-6)
    joints = {label.rpartition("/")[2]: i for i, label in enumerate(builder.joint_label)}
    for joint in description.joints:
        index = joints[joint.name]
        limits = joint.position_limits()
        if limits is not None:
            axis = builder.joint_qd_start[index]
            assert builder.joint_limit_lower[axis] == pytest.approx(limits[0], abs=1e-5)
            assert builder.joint_limit_upper[axis] == pytest.approx(limits[1], abs=1e-5)


def test_newton_sees_every_kind_of_joint(robot: RobotModel, tmp_path: Path) -> None:
    builder = read(robot, tmp_path)
    assert builder.body_count == len(robot.description.links)
    assert builder.joint_count in (len(robot.description.joints), len(robot.description.joints) + 1)
    total = sum(link.inertial.mass for link in robot.description.links if link.inertial)
    assert sum(builder.body_mass) == pytest.approx(total, rel=1e-4)
    builder.finalize(device="cpu")

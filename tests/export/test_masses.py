"""Mass properties for engines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from roboyard.description.mass_properties import link_masses, massless_parts, trace_mass
from roboyard.description.robot_model import RobotModel
from roboyard.export.mjcf.joints import moved_inertia
from roboyard.transforms import matrix_from_quaternion


def test_a_link_without_inertial_has_no_mass(robot: RobotModel) -> None:
    masses = link_masses(robot.description)
    assert masses["tool"] is None
    assert masses["base"] is not None and masses["base"].mass == 10.0


def test_principal_moments_give_the_tensor_back(robot: RobotModel) -> None:
    mass = link_masses(robot.description)["arm.1"]
    inertial = robot.description.link_by_name["arm.1"].inertial
    assert mass is not None and inertial is not None
    axes = matrix_from_quaternion(mass.quaternion)
    turn = matrix_from_quaternion(inertial.origin.quaternion)
    expected = turn @ inertial.matrix() @ turn.T
    assert np.allclose(axes @ np.diag(mass.principal) @ axes.T, expected, atol=1e-12)


def test_only_parts_that_move_need_mass(robot: RobotModel) -> None:
    # tool is fixed to a link with mass; weightless is alone on a ball joint
    masses = link_masses(robot.description)
    assert massless_parts(robot.description, masses, fixed_base=True) == ("weightless",)


def test_a_trace_is_a_millionth_of_the_robot(robot: RobotModel) -> None:
    total = sum(link.inertial.mass for link in robot.description.links if link.inertial)
    assert trace_mass(robot.description, link_masses(robot.description)).mass == pytest.approx(total * 1e-6)


def test_moved_inertia_is_the_diagonal_of_the_mass_matrix(robot: RobotModel, tmp_path: Path) -> None:
    import mujoco

    from roboyard.export import mjcf

    mjcf.write(robot, tmp_path / "robot.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    moved = moved_inertia(robot.description)
    for name in ("0", "1", "slide", "spin", "grip"):
        address = model.joint(name).dofadr[0]
        # links without mass count with a trace here, and only where they must in the model
        assert moved[name] == pytest.approx(matrix[address, address], rel=1e-3)

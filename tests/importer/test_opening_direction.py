"""A gripper whose jaw opens towards its lower limit opens with action +1, imported or from its file alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from roboyard import World, add_robot
from roboyard.errors import ConfigError
from roboyard.importer.build import build_package
from roboyard.robots.robot import Robot
from roboyard.transforms import rotate


def _box(name: str, size: str, origin: str = "0 0 0", mass: float = 0.5) -> str:
    shape = f'<origin xyz="{origin}"/><geometry><box size="{size}"/></geometry>'
    return (
        f'<link name="{name}"><visual>{shape}</visual><collision>{shape}</collision><inertial>'
        f'<origin xyz="{origin}"/><mass value="{mass}"/>'
        '<inertia ixx="0.004" iyy="0.004" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def _joint(name: str, parent: str, child: str, xyz: str, axis: str, low: float, high: float) -> str:
    kind = "prismatic" if name.startswith("f") else "revolute"
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>'
        f'<limit lower="{low}" upper="{high}" effort="40" velocity="2"/></joint>'
    )


def _arm(right: tuple[str, float, float]) -> str:
    """An arm of five joints with two sliding jaws; the left one opens downwards, the right one as given."""
    parts = [_box("base", "0.2 0.2 0.1", mass=5)]
    above, place = "base", "0 0 0.05"
    for k, axis in enumerate(("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0")):
        parts += [
            _box(f"l{k}", "0.06 0.06 0.2", "0 0 0.1"),
            _joint(f"j{k}", above, f"l{k}", place, axis, -2, 2),
        ]
        above, place = f"l{k}", "0 0 0.2"
    jaw = "0.02 0.01 0.08"
    parts += [
        _box("left", jaw, "0 0 0.04", 0.05),
        _joint("fl", above, "left", "0 0.01 0.2", "0 -1 0", -0.04, 0),
    ]
    axis, low, high = right
    parts += [
        _box("right", jaw, "0 0 0.04", 0.05),
        _joint("fr", above, "right", "0 -0.01 0.2", axis, low, high),
    ]
    return f'<robot name="jaws">{"".join(parts)}</robot>'


BOTH_DOWN = ("0 1 0", -0.04, 0.0)
ONE_UP = ("0 -1 0", 0.0, 0.04)


def _gap(robot: Robot) -> float:
    """Return the distance between the jaws (m)."""
    left, right = (robot.body.link(name).pose[0] for name in ("left", "right"))
    return float(np.linalg.norm(left - right))


def _moved(robot: Robot, world: World, command: float) -> float:
    (name,) = (name for name in robot.groups if name.startswith("gripper_"))
    for _ in range(60 * robot.steps_per_control):
        robot.apply_action({name: [command]})
        world.step()
    return _gap(robot)


@pytest.mark.parametrize("right", [BOTH_DOWN, ONE_UP])
@pytest.mark.parametrize("imported", [False, True])
def test_action_one_opens_a_gripper_whatever_its_limits(tmp_path: Path, right, imported: bool) -> None:
    file = tmp_path / "jaws.urdf"
    file.write_text(_arm(right))
    definition = None
    if imported:
        package = build_package(file, out=tmp_path / "data")
        stated = yaml.safe_load(package.definition.read_text())["manipulation"]["opening_direction"]
        (way,) = stated.values()
        assert way == ("decreasing" if right is BOTH_DOWN else {"increasing": ["fr"], "decreasing": ["fl"]})
        file, definition = package.folder / "urdf" / "jaws.urdf", package.definition
    world = World()
    robot = add_robot(world, file, definition=definition)
    assert _moved(robot, world, 1.0) == pytest.approx(0.1, abs=0.004)
    assert _moved(robot, world, -1.0) == pytest.approx(0.02, abs=0.004)


def test_directions_of_joints_that_the_gripper_lacks_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "jaws.urdf"
    file.write_text(_arm(BOTH_DOWN))
    package = build_package(file, out=tmp_path / "data")
    data = yaml.safe_load(package.definition.read_text())
    arm = data["manipulation"]["arm_names"][0]
    for wrong, message in (
        ({arm: {"fx": "increasing"}}, "'fx' is no finger joint"),
        ({arm: {"increasing": ["fx"]}}, "'fx' is no finger joint"),
        ({arm: {"opening": ["fl"]}}, "opening_direction"),
        ({"x": "increasing"}, "'x'"),
    ):
        data["manipulation"]["opening_direction"] = wrong
        with pytest.raises(ConfigError, match=message):
            add_robot(World(), package.folder / "urdf" / "jaws.urdf", definition=data)


def test_the_definition_has_grasp_points_between_the_jaws_and_a_workspace_range(tmp_path: Path) -> None:
    file = tmp_path / "jaws.urdf"
    file.write_text(_arm(ONE_UP))
    package = build_package(file, out=tmp_path / "data")
    block = yaml.safe_load(package.definition.read_text())["manipulation"]
    (start,), (end,) = (block[f"assisted_grasp_{key}_points"]["0"] for key in ("start", "end"))
    assert {start[0], end[0]} == {"left", "right"}
    assert block["arm_workspace_range"]["0"][0] < block["arm_workspace_range"]["0"][1]
    robot = add_robot(World(), package.folder / "urdf" / "jaws.urdf", definition=package.definition)
    assert robot.manipulation is not None
    assert robot.manipulation.workspace_range() == pytest.approx(
        np.deg2rad(block["arm_workspace_range"]["0"])
    )
    spots = []
    for link, point in (start, end):
        pose, quaternion = robot.body.link(link).pose
        spots.append(pose + rotate(quaternion, np.array(point)))
    # the jaws are 0.01 m thick
    assert np.linalg.norm(spots[0] - spots[1]) == pytest.approx(_gap(robot) - 0.01, abs=0.002)


def test_jaws_rest_and_are_locked_open(tmp_path: Path) -> None:
    """Both jaws open towards their lower limits of -0.04 m, which their upper ones close."""
    file = tmp_path / "jaws.urdf"
    file.write_text(_arm(BOTH_DOWN))
    planning = build_package(file, name="jaws", out=tmp_path / "data").robot.planning
    assert planning is not None
    assert planning.lock_joints == {"fl": -0.04, "fr": -0.04}

"""Every key changes its entry of the action, and the robot moves accordingly."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.recording import SceneSetup, set_up
from roboyard.teleop.key_bindings import KeyBindings
from roboyard.teleop.raw_keys import decode
from roboyard.transforms import matrix_from_quaternion


@pytest.fixture(scope="module")
def r1() -> SceneSetup:
    scene_setup = set_up({"scene": "empty", "robot": "r1"})
    scene_setup.scene.world.step(60)
    return scene_setup


@pytest.fixture(scope="module")
def rover() -> SceneSetup:
    scene_setup = set_up({"scene": "empty", "robot": "rover"})
    scene_setup.scene.world.step(60)
    return scene_setup


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def _changed(bindings: KeyBindings, key: str) -> dict[int, float]:
    """Entries of the next action that differ from doing nothing."""
    still = bindings.action()
    assert bindings.press(key)
    action = bindings.action()
    assert np.array_equal(bindings.action(), still), "a tap lasts one step"
    return {int(k): float(action[k]) for k in np.flatnonzero(action != still)}


@pytest.mark.parametrize(
    ("key", "component", "value"),
    [
        ("up", 0, 0.1), ("down", 0, -0.1), ("left", 1, 0.1), ("right", 1, -0.1),
        ("p", 2, 0.1), (";", 2, -0.1), ("n", 3, 0.1), ("b", 3, -0.1),
        ("o", 4, 0.1), ("u", 4, -0.1), ("v", 5, 0.1), ("c", 5, -0.1),
    ],
)  # fmt: skip
def test_arm_keys_change_one_component_of_the_selected_arm(
    r1: SceneSetup, key: str, component: int, value: float
) -> None:
    bindings = KeyBindings(r1.robot)
    parts = r1.robot.controller_action_idx
    assert _changed(bindings, key) == {parts["arm_left"].start + component: value}
    bindings.press("4")
    assert _changed(bindings, key) == {parts["arm_right"].start + component: value}
    bindings.press("3")
    assert _changed(bindings, key) == {parts["arm_left"].start + component: value}


def test_osc_arms_have_larger_steps_and_commands_without_orientation_no_rotation_keys(r1: SceneSetup) -> None:
    robot = r1.robot
    try:
        robot.reload_controllers(
            {
                "arm_left": "OperationalSpaceController",
                "arm_right": {"name": "InverseKinematicsController", "mode": "position_fixed_ori"},
            }
        )
        bindings, parts = KeyBindings(robot), robot.controller_action_idx
        assert _changed(bindings, "up") == {parts["arm_left"].start: 0.25}
        bindings.press("4")
        assert _changed(bindings, "up") == {parts["arm_right"].start: 0.1}
        assert not bindings.press("n")
    finally:
        robot.reload_controllers()


def test_joints_are_selected_in_a_ring_and_moved(r1: SceneSetup) -> None:
    bindings, parts = KeyBindings(r1.robot), r1.robot.controller_action_idx
    names = [name for name, _, _ in bindings.joints]
    assert names[:3] == [f"base_footprint_{a}_joint" for a in ("x", "y", "rz")]
    assert names[3:] == list(r1.robot.groups["trunk"].joints)
    assert _changed(bindings, "]") == {parts["base"].start: 0.1}
    bindings.press("2")
    assert _changed(bindings, "[") == {parts["base"].start + 1: -0.1}
    bindings.press("1")
    bindings.press("1")
    assert bindings.status().startswith("joint torso_joint4")
    assert _changed(bindings, "]") == {parts["trunk"].start + 3: 0.1}


def test_prismatic_joints_have_smaller_steps(r1: SceneSetup) -> None:
    """Only delta position controllers of prismatic joints have a fifth of the step."""
    robot = r1.robot
    fingers = {"name": "JointController", "motor_type": "position", "command_output_limits": None}
    assert {robot.body.joint(name).type for name in robot.groups["gripper_left"].joints} == {"prismatic"}
    try:
        robot.reload_controllers(
            {
                "gripper_left": {**fingers, "use_delta_commands": True},
                "gripper_right": {**fingers, "use_delta_commands": False},
            }
        )
        steps = {name: step for name, _, step in KeyBindings(robot).joints}
        assert {steps[name] for name in robot.groups["gripper_left"].joints} == {0.1 * 0.2}
        assert {steps[name] for name in robot.groups["gripper_right"].joints} == {0.1}
        assert steps["torso_joint1"] == 0.1
    finally:
        robot.reload_controllers()


def test_grippers_start_open_keep_their_command_and_ignore_repeats(r1: SceneSetup) -> None:
    clock = Clock()
    bindings, parts = KeyBindings(r1.robot, clock), r1.robot.controller_action_idx
    left, right = parts["gripper_left"].start, parts["gripper_right"].start
    assert bindings.action()[[left, right]].tolist() == [1.0, 1.0]
    clock.now = 10.0
    bindings.press("t")
    for _ in range(5):
        clock.now += 0.05
        bindings.press("t")
    assert bindings.action()[[left, right]].tolist() == [-1.0, 1.0]
    assert bindings.action()[left] == -1.0
    clock.now += 1.0
    bindings.press("6")
    bindings.press("t")
    assert bindings.action()[[left, right]].tolist() == [-1.0, -1.0]
    assert "gripper_right closed" in bindings.status()
    bindings.reset()
    assert bindings.action()[[left, right]].tolist() == [1.0, 1.0]


def test_unbound_keys_do_nothing(r1: SceneSetup) -> None:
    bindings = KeyBindings(r1.robot)
    for key in ("x", "q", "\n", "i", "j"):
        assert not bindings.press(key)
    assert np.count_nonzero(bindings.action()) == 2


@pytest.mark.parametrize(
    ("key", "axis", "sign"),
    [("up", 0, 1), ("down", 0, -1), ("left", 1, 1), ("right", 1, -1), ("p", 2, 1), (";", 2, -1)],
)
def test_a_held_key_moves_the_end_effector(r1: SceneSetup, key: str, axis: int, sign: int) -> None:
    robot, world = r1.robot, r1.scene.world
    robot.reset()
    bindings = KeyBindings(robot)
    for _ in range(20):
        robot.apply_action(bindings.action())
        world.step(robot.steps_per_control)
    before = np.array(robot.arms["left"].pose_in_base[0])
    for _ in range(30):
        bindings.press(key)
        robot.apply_action(bindings.action())
        world.step(robot.steps_per_control)
    moved = np.array(robot.arms["left"].pose_in_base[0]) - before
    assert sign * moved[axis] > 0.02, moved


@pytest.mark.parametrize(
    ("key", "axis", "sign"), [("n", 0, 1), ("b", 0, -1), ("o", 1, 1), ("u", 1, -1), ("v", 2, 1), ("c", 2, -1)]
)
def test_a_held_key_rotates_the_end_effector(r1: SceneSetup, key: str, axis: int, sign: int) -> None:
    robot, world = r1.robot, r1.scene.world
    robot.reset()
    bindings = KeyBindings(robot)
    for _ in range(20):
        robot.apply_action(bindings.action())
        world.step(robot.steps_per_control)
    before = matrix_from_quaternion(robot.arms["left"].pose_in_base[1])
    for _ in range(20):
        bindings.press(key)
        robot.apply_action(bindings.action())
        world.step(robot.steps_per_control)
    turned = matrix_from_quaternion(robot.arms["left"].pose_in_base[1]) @ before.T
    about = np.array([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]])
    assert sign * about[axis] > 0.1, about
    assert np.abs(about).argmax() == axis


def test_selected_joints_and_grippers_move(r1: SceneSetup) -> None:
    robot, world = r1.robot, r1.scene.world
    robot.reset()
    bindings = KeyBindings(robot, Clock())

    def hold(*keys: str, steps: int = 20) -> np.ndarray:
        was = robot.joint_positions
        for _ in range(steps):
            for key in keys:
                bindings.press(key)
            robot.apply_action(bindings.action())
            world.step(robot.steps_per_control)
        return robot.joint_positions - was

    hold()
    bindings.press("2")
    place = robot.joint_names.index("base_footprint_y_joint")
    assert "base_footprint_y_joint" in bindings.status()
    assert hold("]")[place] > 0.03
    hold()
    assert hold("[")[place] < -0.03
    fingers = robot.control_idx["gripper_right"]
    bindings.press("5")
    bindings.press("t")
    assert (hold()[fingers] < -0.04).all()


@pytest.mark.parametrize(
    "name",
    [f"torso_joint{k}" for k in range(1, 5)] + [f"left_arm_joint{k}" for k in range(1, 7)],
)
def test_a_held_key_moves_its_joint_and_no_other(r1: SceneSetup, name: str) -> None:
    robot, world = r1.robot, r1.scene.world
    arms = {"arm_left": "JointController"} if name.startswith("left") else {}
    try:
        robot.reload_controllers(arms)
        for key, sign in (("]", 1.0), ("[", -1.0)):
            robot.reset()
            bindings = KeyBindings(robot, Clock())
            while f"joint {name}," not in bindings.status():
                bindings.press("2")
            was = robot.joint_positions
            place = robot.joint_names.index(name)
            for k in range(45):
                if k < 30:
                    bindings.press(key)
                robot.apply_action(bindings.action())
                world.step(robot.steps_per_control)
                moved = robot.joint_positions - was
                others = np.delete(moved, [0, 1, 5, place])
                assert np.abs(others).max() < 0.03, (key, robot.joint_names)
            assert min(sign * moved[place], 0.078) > 0.077, (key, moved[place])
    finally:
        robot.reload_controllers()


def test_a_differential_drive_moves_and_turns(rover: SceneSetup) -> None:
    robot, world = rover.robot, rover.scene.world
    bindings = KeyBindings(robot)
    if not bindings.wheels:
        robot.reload_controllers({"base": "DifferentialDriveController"})
        bindings = KeyBindings(robot)
    start = robot.controller_action_idx["base"].start
    for key, place, value in (("i", 0, 0.4), ("k", 0, -0.4), ("j", 1, 0.2), ("l", 1, -0.2)):
        assert _changed(bindings, key) == {start + place: value}

    def go(key: str) -> tuple[float, float]:
        for _ in range(20):  # to a halt first
            robot.apply_action(bindings.action())
            world.step(robot.steps_per_control)
        was = np.array(robot.position)
        x, y, z, w = robot.orientation
        yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        for _ in range(30):
            bindings.press(key)
            robot.apply_action(bindings.action())
            world.step(robot.steps_per_control)
        step = np.array(robot.position) - was
        x, y, z, w = robot.orientation
        turned = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) - yaw
        return float(step[0] * np.cos(yaw) + step[1] * np.sin(yaw)), float(turned)

    assert go("i")[0] > 0.05
    assert go("k")[0] < -0.05
    assert go("j")[1] > 0.02
    assert go("l")[1] < -0.02


def test_terminal_bytes_become_keys() -> None:
    assert decode(b"a\x1b[A\x1bOB\x1b[C\x1b[D]", final=False) == (
        ["a", "up", "down", "right", "left", "]"],
        b"",
    )
    assert decode(b"P;", final=False) == (["p", ";"], b"")
    assert decode(b"\x1b", final=False) == ([], b"\x1b")
    assert decode(b"\x1b", final=True) == (["escape"], b"")
    assert decode(b"\x1b[", final=False) == ([], b"\x1b[")
    assert decode(b"\x1b[1;5", final=False) == ([], b"\x1b[1;5")
    assert decode(b"\x1b[3~x", final=False) == (["x"], b""), "sequences of other keys are skipped completely"
    assert decode(b"\x1b[1;5Ax", final=False) == (["up", "x"], b"")

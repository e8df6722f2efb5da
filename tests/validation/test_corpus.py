"""Robots of other people, found in installed packages: imported, defined in a few lines, validated,
driven.
"""

from __future__ import annotations

import importlib.metadata
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from roboyard import import_robot
from roboyard.description import load_description
from roboyard.kinematics.joint_order import breadth_first_joint_names
from roboyard.robots import REGISTERED_ROBOTS, RegisteredRobot, Robot, add_robot, parse_definition
from roboyard.sim import World
from roboyard.validation import validate


def package_folder(distribution: str, marker: str) -> Path:
    try:
        files = importlib.metadata.distribution(distribution).files or ()
    except importlib.metadata.PackageNotFoundError:
        pytest.skip(f"{distribution} is not installed")
    for file in files:
        before, found, _ = str(file).partition(marker)
        if found:
            return Path(file.locate()).parents[
                len(Path(str(file)).parts) - len(Path(before + marker).parts) - 1
            ]
    pytest.skip(f"{distribution} has no {marker}")


def arm(name: str, joints: list[str], tip: str, fingers: list[str] | None = None) -> dict[str, Any]:
    return {"name": name, "joints": joints, "tip": tip, "fingers": fingers or []}


def manipulation(*arms: dict[str, Any]) -> dict[str, Any]:
    return {
        "n_arms": len(arms),
        "arm_names": [a["name"] for a in arms],
        "arm_joint_names": {a["name"]: a["joints"] for a in arms},
        "eef_link_names": {a["name"]: a["tip"] for a in arms},
        "finger_joint_names": {a["name"]: a["fingers"] for a in arms if a["fingers"]},
    }


def numbered(pattern: str, count: int) -> list[str]:
    return [pattern.format(k) for k in range(1, count + 1)]


BAXTER = ["s0", "s1", "e0", "e1", "w0", "w1", "w2"]
LEGS = [f"{leg}_{part}_joint" for leg in ("FL", "FR", "RL", "RR") for part in ("hip", "thigh", "calf")]

ROBOTS: dict[str, dict[str, Any]] = {
    "panda": {
        "urdf": "panda_description/urdf/panda.urdf",
        "rest": dict(zip(numbered("panda_joint{}", 7), [0, -0.4, 0, -2.2, 0, 1.9, 0.8], strict=True)),
        "definition": {
            "raw_controller_order": ["arm_0", "gripper_0"],
            "default_controllers": {
                "arm_0": "InverseKinematicsController",
                "gripper_0": "MultiFingerGripperController",
            },
            "manipulation": manipulation(
                arm("0", numbered("panda_joint{}", 7), "panda_hand_tcp", numbered("panda_finger_joint{}", 2))
            ),
        },
    },
    "ur5": {
        "urdf": "ur_description/urdf/ur5_robot.urdf",
        "rest": {
            "shoulder_lift_joint": -1.5,
            "elbow_joint": 1.5,
            "wrist_1_joint": -1.5,
            "wrist_2_joint": -1.5,
        },
        "definition": {
            "raw_controller_order": ["arm_0"],
            "default_controllers": {"arm_0": "InverseKinematicsController"},
            "manipulation": manipulation(
                arm(
                    "0",
                    [
                        "shoulder_pan_joint",
                        "shoulder_lift_joint",
                        "elbow_joint",
                        *numbered("wrist_{}_joint", 3),
                    ],
                    "tool0",
                )
            ),
        },
    },
    "tiago": {
        "urdf": "tiago_description/robots/tiago.urdf",
        "rest": {
            "torso_lift_joint": 0.15,
            **dict(zip(numbered("arm_{}_joint", 7), [0.2, -1.34, -0.2, 1.94, -1.57, 1.37, 0], strict=True)),
        },
        "definition": {
            "raw_controller_order": ["base", "trunk", "camera", "arm_0", "gripper_0"],
            "default_controllers": {
                "arm_0": "InverseKinematicsController",
                "gripper_0": "MultiFingerGripperController",
            },
            "base_footprint_link_name": "base_link",
            "self_collisions": False,
            "two_wheel": {"wheel_radius": 0.0985, "wheel_axle_length": 0.4044},
            "locomotion": {
                "base_joint_names": ["wheel_left_joint", "wheel_right_joint"],
                "floor_touching_base_link_names": [
                    f"caster_{end}_{side}_2_link" for end in ("front", "back") for side in ("left", "right")
                ],
            },
            "articulated_trunk": {"trunk_joint_names": ["torso_lift_joint"]},
            "active_camera": {"camera_joint_names": numbered("head_{}_joint", 2)},
            "manipulation": manipulation(
                arm(
                    "0",
                    numbered("arm_{}_joint", 7),
                    "arm_tool_link",
                    [
                        *(f"hand_{part}_joint" for part in ("thumb", "index", "mrl", "index_virtual_3")),
                        *(
                            f"hand_{finger}_{part}_joint"
                            for finger in ("middle", "ring", "little")
                            for part in ("abd", "virtual_3")
                        ),
                    ],
                )
            ),
        },
    },
    "baxter": {
        "urdf": "baxter_description/urdf/baxter.urdf",
        "rest": {
            **{
                f"{side}_{joint}": value * (mirror if joint in ("s0", "e0", "w0", "w2") else 1.0)
                for side, mirror in (("left", 1.0), ("right", -1.0))
                for joint, value in zip(BAXTER, [-0.08, -1.0, -1.19, 1.94, 0.67, 0.8, -0.5], strict=True)
            },
            **{f"{s}_gripper_{f}_finger_joint": x for s in "lr" for f, x in (("l", 0.02), ("r", -0.02))},
        },
        "definition": {
            "raw_controller_order": ["camera", "arm_left", "gripper_left", "arm_right", "gripper_right"],
            "default_controllers": {
                f"{kind}_{side}": name
                for side in ("left", "right")
                for kind, name in [
                    ("arm", "InverseKinematicsController"),
                    ("gripper", "MultiFingerGripperController"),
                ]
            },
            "self_collisions": False,
            "active_camera": {"camera_joint_names": ["head_pan"]},
            "manipulation": manipulation(
                *(
                    arm(
                        side,
                        [f"{side}_{joint}" for joint in BAXTER],
                        f"{side}_gripper",
                        [f"{side[0]}_gripper_l_finger_joint"],
                    )
                    for side in ("left", "right")
                )
            ),
        },
    },
    "go2": {
        "urdf": "go2_description/urdf/go2.urdf",
        "rest": {
            f"{leg}_{part}_joint": value
            for leg in ("FL", "FR", "RL", "RR")
            for part, value in [("thigh", 0.8), ("calf", -1.5)]
        },
        "definition": {
            "raw_controller_order": ["base"],
            "default_controllers": {"base": "JointController"},
            "disabled_collision_pairs": [["FL_thigh", "base"], ["FR_thigh", "base"]],
            "locomotion": {"base_joint_names": LEGS},
        },
    },
}


def imported(name: str, data: Path) -> RegisteredRobot:
    """The robot, imported once, with its definition in place."""
    if name not in REGISTERED_ROBOTS:
        recipe = ROBOTS[name]
        folder = package_folder("example-robot-data", "share/example-robot-data")
        result = import_robot(
            folder / "robots" / recipe["urdf"],
            name=name,
            out=data,
            packages={"example-robot-data": folder},
            validate=False,
            report=False,
        )
        joints = breadth_first_joint_names(load_description(result.model_folder / "urdf" / f"{name}.urdf"))
        rest = [float(recipe["rest"].get(joint, 0.0)) for joint in joints]
        definition = {**recipe["definition"], "default_joint_pos": rest}
        parse_definition(definition)
        result.definition.write_text(yaml.safe_dump(definition))
    return REGISTERED_ROBOTS[name]


@pytest.mark.slow
@pytest.mark.parametrize("name", list(ROBOTS))
def test_robots_of_other_vendors_validate(name: str, data: Path) -> None:
    report = validate(imported(name, data))
    assert [(gate.name, gate.figure, list(gate.findings)[:3]) for gate in report.failed] == []


def followed(make: Callable[[World], Robot], twist: tuple[float, float]) -> tuple[float, float]:
    """Mean forward speed and turning rate over two seconds after the first one."""
    world = World()
    world.add_plane()
    robot = make(world)
    action = robot.controllers["base"].scaling.invert(np.array(twist))
    seen = []
    for k in range(90):
        robot.apply_action({"base": action})
        world.step(8)
        if k >= 30:
            linear, angular = robot.velocity_in_base
            seen.append((linear[0], angular[2]))
    v, w = np.mean(seen, axis=0)
    return float(v), float(w)


TWISTS = [(0.3, 0.0), (-0.1, 0.0), (0.0, 0.8), (0.0, -0.3), (0.3, 0.4), (-0.2, 0.5)]


@pytest.mark.slow
@pytest.mark.parametrize("twist", TWISTS)
def test_tiago_follows_twists(data: Path, twist: tuple[float, float]) -> None:
    robot = imported("tiago", data)
    assert followed(lambda world: add_robot(world, robot), twist) == pytest.approx(twist, rel=0.02, abs=0.003)


STRETCH = {
    "raw_controller_order": ["base"],
    "default_controllers": {"base": "DifferentialDriveController"},
    "two_wheel": {"wheel_radius": 0.0508, "wheel_axle_length": 0.3407},
    "locomotion": {
        "base_joint_names": ["joint_left_wheel", "joint_right_wheel"],
        "floor_touching_base_link_names": ["link_left_wheel", "link_right_wheel", "caster_link"],
    },
}


def stretch_file() -> Path:
    folder = package_folder("hello-robot-stretch-urdf", "stretch_urdf/SE3")
    return folder / "stretch_description_SE3_eoa_wrist_dw3_tool_sg3.urdf"


@pytest.mark.slow
@pytest.mark.parametrize("twist", TWISTS)
def test_stretch_follows_twists_with_vendor_shapes(twist: tuple[float, float]) -> None:
    """Wheels with 22 N m s/rad of damping, a hull that ends on the floor, hubs that reach inwards."""
    file, definition = stretch_file(), {**STRETCH, "self_collisions": False}
    got = followed(lambda world: add_robot(world, str(file), definition=definition), twist)
    assert got == pytest.approx(twist, rel=0.02, abs=0.003)


@pytest.mark.slow
@pytest.mark.parametrize("spheres", [True, False])
def test_stretch_drives_as_imported(tmp_path: Path, spheres: bool) -> None:
    config = {
        "urdf_path": str(stretch_file()),
        "name": "stretch",
        "base_motion": {
            "wheel_links": ["link_left_wheel", "link_right_wheel"],
            "wheel_joints": ["joint_left_wheel", "joint_right_wheel"],
            "use_sphere_wheels": spheres,
            "use_holonomic_joints": False,
        },
    }
    result = import_robot(config, out=tmp_path, report=False, validate=False)
    pairs = yaml.safe_load(result.definition.read_text())["disabled_collision_pairs"]
    definition = {**STRETCH, "disabled_collision_pairs": pairs}
    urdf = result.model_folder / "urdf" / "stretch.urdf"
    report = validate(urdf, definition=definition, gates=["drive", "drift"])
    assert [(gate.name, gate.figure, list(gate.findings)[:3]) for gate in report.failed] == []

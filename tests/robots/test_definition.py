"""Definition files: the whole schema, and one sentence for each wrong field."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from roboyard.assets import asset_path, assets_root
from roboyard.description import load_description
from roboyard.errors import ConfigError
from roboyard.robots import REGISTERED_ROBOTS, load_definition, parse_definition
from roboyard.robots.definition.load import check_fits, dotted

R1_FILE = assets_root() / "r1" / "r1.yaml"

ROVER = """
raw_controller_order: [base]
default_controllers: {base: DifferentialDriveController}
two_wheel: {wheel_radius: "pi/40", wheel_axle_length: 0.3}
locomotion: {base_joint_names: [left_wheel_joint, right_wheel_joint]}
"""


def test_every_block_of_r1_is_loaded() -> None:
    definition = load_definition(R1_FILE)
    assert definition.capabilities == (
        "manipulation",
        "holonomic_base",
        "locomotion",
        "articulated_trunk",
        "mobile_manipulation",
    )
    assert list(definition.controller_names()) == [
        "base",
        "trunk",
        "arm_left",
        "gripper_left",
        "arm_right",
        "gripper_right",
    ]
    assert definition.arm_names == ("left", "right")
    assert not definition.may_float
    assert definition.mobile_manipulation is not None
    assert len(definition.mobile_manipulation.untucked_default_joint_pos) == 26
    assert definition.linear_velocity_gain_for_primitives == 0.3


def test_default_controllers_follow_from_the_blocks() -> None:
    text = ROVER.replace("base: DifferentialDriveController", "")
    assert parse_definition(text).controller_names() == {"base": "DifferentialDriveController"}
    assert parse_definition(ROVER).may_float


def test_arms_without_names_are_numbered() -> None:
    definition = parse_definition(
        {
            "raw_controller_order": ["arm_0", "arm_1"],
            "default_controllers": {},
            "manipulation": {
                "n_arms": 2,
                "arm_joint_names": {"0": ["a"], "1": ["b"]},
                "eef_link_names": {"0": "x", "1": "y"},
            },
        }
    )
    assert definition.arm_names == ("0", "1")


def put(*path: object, value: object) -> Callable[[dict], None]:
    def change(data: dict) -> None:
        for key in path[:-1]:
            data = data[key]  # type: ignore[index, assignment]
        data[path[-1]] = value  # type: ignore[index]

    return change


def drop(*path: object) -> Callable[[dict], None]:
    def change(data: dict) -> None:
        for key in path[:-1]:
            data = data[key]  # type: ignore[index, assignment]
        del data[path[-1]]  # type: ignore[arg-type]

    return change


WRONG = [
    (put("colour", value="red"), "colour: unknown key"),
    (
        put("manipulation", "arm_name", value=["left"]),
        r"manipulation\.arm_name: unknown key; did you mean 'arm_names'",
    ),
    (drop("raw_controller_order"), "raw_controller_order: is required"),
    (drop("default_controllers"), "default_controllers: is required"),
    (put("raw_controller_order", value="base"), "raw_controller_order: must be a list"),
    (
        put("raw_controller_order", 1, value="torso"),
        r"raw_controller_order\[1\]: no block defines a group 'torso'",
    ),
    (drop("raw_controller_order", 1), "raw_controller_order: the group 'trunk' is missing"),
    (
        put("default_controllers", "base", value="JointController"),
        r"default_controllers\.base: 'base' cannot have",
    ),
    (put("default_controllers", "base", value="Foo"), r"default_controllers\.base: must be one of"),
    (
        put("default_controllers", "tail", value="JointController"),
        r"default_controllers\.tail: no block defines",
    ),
    (put("disabled_collision_pairs", 0, value=["a"]), r"disabled_collision_pairs\[0\]: must have 2 entries"),
    (drop("base_footprint_link_name"), "base_footprint_link_name: is required with holonomic_base"),
    (put("self_collisions", value="maybe"), "self_collisions: must be true or false"),
    (put("usd_path", value=3), "usd_path: must be text"),
    (put("default_joint_pos", value=[1, "x"]), r"default_joint_pos\[1\]: 'x' is not a number"),
    (
        put("linear_velocity_gain_for_primitives", value=[1]),
        "linear_velocity_gain_for_primitives: must be a number",
    ),
    (
        put("holonomic_base", "force_sphere_wheel_approximation", value="x"),
        "force_sphere_wheel_approximation: must be",
    ),
    (
        put("two_wheel", value={"wheel_radius": 1, "wheel_axle_length": 1}),
        "two_wheel: a holonomic base cannot",
    ),
    (drop("locomotion"), "locomotion: is required with holonomic_base"),
    (put("locomotion", "base_joint_names", value=["a"]), r"locomotion\.base_joint_names: must be \["),
    (
        put("articulated_trunk", "trunk_joint_names", value=[]),
        r"articulated_trunk\.trunk_joint_names: is empty",
    ),
    (put("active_camera", value={"camera_joint_names": []}), r"active_camera\.camera_joint_names: is empty"),
    (
        put("mobile_manipulation", "tucked_default_joint_pos", value=[0]),
        "tucked_default_joint_pos: has 1 values but",
    ),
    (
        put("mobile_manipulation", "joint_names", value=["a"]),
        r"mobile_manipulation\.joint_names: has 1 names for 26",
    ),
    (
        put("mobile_manipulation", "default_arm_pose_key", value="up"),
        "default_arm_pose_key: no default_arm_poses",
    ),
    (put("manipulation", "n_arms", value=3), r"manipulation\.arm_names: lists 2 arms but n_arms is 3"),
    (put("manipulation", "n_arms", value="two"), r"manipulation\.n_arms: must be a whole number"),
    (put("manipulation", "n_arms", value=0), r"manipulation\.n_arms: must be at least 1"),
    (
        drop("manipulation", "eef_link_names", "left"),
        r"manipulation\.eef_link_names: has no entry for arm 'left'",
    ),
    (
        put("manipulation", "finger_link_names", "middle", value=["a"]),
        r"finger_link_names\.middle: there is no arm",
    ),
    (put("manipulation", "arm_joint_names", "left", value=[]), r"arm_joint_names\.left: is empty"),
    (
        put("manipulation", "arm_joint_names", "left", value=[3]),
        r"arm_joint_names\.left\[0\]: must be text",
    ),
    (
        put("manipulation", "arm_workspace_range", "left", value=[45, -45]),
        "arm_workspace_range.left: has lower limit",
    ),
    (put("manipulation", "teleop_rotation_offset", value={"left": [1, 2]}), "must have 3 or 4 entries"),
    (
        put("manipulation", "end_effectors", value={"hook": {"model": "x"}}),
        r"end_effectors\.hook\.eef_link_names: is",
    ),
    (
        drop("mobile_manipulation"),
        "default_joint_pos: is required because 'arm_left' has an InverseKinematics",
    ),
]


@pytest.mark.parametrize(("change", "message"), WRONG, ids=[message[:40] for _, message in WRONG])
def test_a_wrong_field_gives_one_message_that_names_it(r1_data: dict, change: Callable, message: str) -> None:
    import re

    change(r1_data)
    with pytest.raises(ConfigError) as error:
        parse_definition(r1_data)
    lines = [line for line in str(error.value).splitlines() if re.search(message, line)]
    assert len(lines) == 1, str(error.value)


def places(value: object, where: tuple = ()) -> Iterator[tuple[tuple, object]]:
    """Every field of plain data, with its place."""
    if where:
        yield where, value
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from places(inner, (*where, key))


def spoilt(where: tuple, value: object) -> Iterator[tuple[str, Callable[[dict], None]]]:
    """Return invalid values of one field by name."""
    yield "other kind", put(*where, value=[1] if isinstance(value, dict) else {"wrong": ["kind"]})
    if isinstance(value, str):
        yield "number", put(*where, value=7)
        yield "empty", put(*where, value="")
        if not where[0].endswith("_path"):
            yield "unknown name", put(*where, value="no_such_thing")
    elif isinstance(value, bool):
        yield "word", put(*where, value="perhaps")
    elif isinstance(value, int | float):
        yield "text", put(*where, value="lots")
        yield "not a number", put(*where, value=math.nan)
    elif isinstance(value, list) and value:
        yield "one twice", put(*where, value=[*value, value[-1]])
    if isinstance(where[-1], str):

        def misspell(data: dict) -> None:
            at = data
            for key in where[:-1]:
                at = at[key]
            at[where[-1] + "x"] = at.pop(where[-1])

        yield "misspelled", misspell


FREE_LENGTHS = ("disabled_collision_pairs", "floor_touching_base_link_names", "_link_names", "grasp_", "/")
"""Lists of links and points may name one twice: nothing depends on it."""


def test_every_invalid_field_of_r1_gives_one_message_that_names_it(r1_data: dict) -> None:
    r1 = REGISTERED_ROBOTS["r1"]
    description, cases, wrong = r1.description(r1.definition), 0, []
    for where, value in places(r1_data):
        for kind, change in spoilt(where, value):
            path = dotted(where)
            if kind == "one twice" and any(word in path for word in FREE_LENGTHS):
                continue
            data = copy.deepcopy(r1_data)
            change(data)
            cases += 1
            try:
                parse_definition(data, description)
                wrong.append(f"{path}, {kind}: accepted")
            except ConfigError as error:
                (first, *more) = str(error).splitlines()
                above = dotted(where[:-1]) if isinstance(where[-1], int) else path
                if more or not (f" {above}" in first or f"{where[-1]}" in first):
                    wrong.append(f"{path}, {kind}: {error}")
    assert wrong == []
    assert cases > 500


def test_files_give_lines(tmp_path: Path) -> None:
    file = tmp_path / "r1.yaml"
    file.write_text(R1_FILE.read_text().replace("n_arms: 2", "n_arms: two"))
    line = next(i for i, text in enumerate(file.read_text().splitlines(), 1) if "n_arms" in text)
    with pytest.raises(
        ConfigError, match=rf"^r1\.yaml:{line}: manipulation\.n_arms: must be a whole number; got 'two'$"
    ):
        load_definition(file)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file is empty"),
        ("- 1", "is not a mapping"),
        ("a: [", "not valid YAML"),
        ("a: 1\na: 2", "duplicate key"),
        ("a: !!python/object:os.system x", "not allowed"),
    ],
)
def test_files_that_are_not_definitions(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "x.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=message):
        load_definition(file)


def test_names_and_lengths_are_compared_with_the_robot() -> None:
    rover = load_description(asset_path("rover"))
    check_fits(parse_definition(ROVER), rover)
    spoiled = ROVER.replace("left_wheel_joint", "left_wheel_jiont") + "default_joint_pos: [0, 0, 0]\n"
    with pytest.raises(ConfigError) as error:
        parse_definition(spoiled, rover)
    first, second = str(error.value).splitlines()
    assert "locomotion.base_joint_names[0]: the robot has no moving joint 'left_wheel_jiont'" in first
    assert "did you mean 'left_wheel_joint'?" in first
    assert (
        "default_joint_pos: has 3 values; the robot has 2 joints (left_wheel_joint, right_wheel_joint)"
        in second
    )


def test_a_robot_without_virtual_joints_cannot_be_holonomic(r1_data: dict) -> None:
    source = load_description(asset_path("r1"), missing_meshes="note")
    with pytest.raises(
        ConfigError, match="holonomic_base: the robot has no joint 'base_footprint_x_joint'; import"
    ):
        check_fits(parse_definition(r1_data), source)

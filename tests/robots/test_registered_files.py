"""Files of registered robots: which are found, which one a name means, and the problem of each broken one."""

from __future__ import annotations

from pathlib import Path

import pytest

from roboyard.errors import ConfigError
from roboyard.robots import REGISTERED_ROBOTS, Registry, list_robots
from roboyard.robots.spawn import is_robot_file, load_source

URDF = (
    "<robot name='{name}'><link name='base'/><link name='a'/><joint name='j' type='revolute'>"
    "<parent link='base'/><child link='a'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>"
    "</robot>"
)
DEFINITION = (
    "raw_controller_order: [trunk]\ndefault_controllers: {}\narticulated_trunk: {trunk_joint_names: [j]}\n"
)


def place(data: Path, dataset: str, name: str, text: str = DEFINITION, urdf: str | None = "") -> Path:
    folder = data / dataset / "models" / name
    (folder / "urdf").mkdir(parents=True)
    (folder / f"{name}.yaml").write_text(text)
    if urdf is not None:
        (folder / "urdf" / f"{name}.urdf").write_text(urdf or URDF.format(name=name))
    return folder


def test_robots_of_all_datasets_are_listed_by_name(tmp_path: Path) -> None:
    place(tmp_path, "b", "zebra")
    place(tmp_path, "a", "yak")
    place(tmp_path, "b", "ape")
    registry = Registry(tmp_path, with_bundled=False)
    assert list(registry) == ["ape", "yak", "zebra"]
    assert len(registry) == 3
    assert registry["yak"].dataset == tmp_path / "a"
    assert registry["ape"].folder == tmp_path / "b" / "models" / "ape"


def test_of_two_datasets_with_one_name_the_first_in_the_alphabet_is_used(tmp_path: Path) -> None:
    for dataset in ("second", "first"):
        place(tmp_path, dataset, "bot")
    assert Registry(tmp_path, with_bundled=False)["bot"].dataset == tmp_path / "first"


def test_names_are_found_in_any_case_but_the_exact_one_comes_first(tmp_path: Path) -> None:
    place(tmp_path, "a", "bot")
    place(tmp_path, "a", "BOT")
    registry = Registry(tmp_path, with_bundled=False)
    assert registry.find("BOT").name == "BOT"
    assert registry.find("Bot").name == "bot"


def test_a_folder_without_robots_is_an_empty_registry(tmp_path: Path) -> None:
    registry = Registry(tmp_path / "none", with_bundled=False)
    assert list(registry) == [] and registry.problems() == {}
    with pytest.raises(ConfigError, match="no robot named 'r1'"):
        registry.find("r1")
    assert "r1" in Registry(tmp_path / "none")


@pytest.mark.parametrize(
    ("text", "urdf", "problem"),
    [
        (DEFINITION, None, "urdf/bot.urdf"),
        (DEFINITION + "urdf_path: models/bot/urdf/other.urdf\n", "", "models/bot/urdf/other.urdf"),
        (
            DEFINITION + "urdf_path: /etc/passwd\n",
            "",
            "urdf_path: must be a path inside the dataset, got '/etc",
        ),
        (DEFINITION.replace("[j]", "[]"), "", "bot.yaml:3: articulated_trunk.trunk_joint_names: is empty"),
        ("a: [", "", "bot.yaml"),
        ("", "", "the file is empty"),
    ],
)
def test_a_broken_robot_is_listed_with_its_problem(tmp_path: Path, text: str, urdf, problem: str) -> None:
    place(tmp_path, "mine", "bot", text, urdf)
    place(tmp_path, "mine", "sound")
    registry = Registry(tmp_path, with_bundled=False)
    assert list(registry) == ["bot", "sound"]
    problems = registry.problems()
    assert list(problems) == ["bot"]
    assert problem in problems["bot"]
    assert registry["sound"].problem is None


def test_a_urdf_elsewhere_in_the_dataset_is_loaded(tmp_path: Path) -> None:
    place(tmp_path, "mine", "bot", DEFINITION + "urdf_path: shared/one.urdf\n", urdf=None)
    shared = tmp_path / "mine" / "shared"
    shared.mkdir()
    (shared / "one.urdf").write_text(URDF.format(name="one"))
    robot = Registry(tmp_path, with_bundled=False)["bot"]
    assert robot.urdf_of(robot.definition) == shared / "one.urdf"
    source = load_source(robot)
    assert (source.model, source.description.name) == ("bot", "one")
    assert source.definition_file == robot.file


@pytest.mark.parametrize("picture", ["preview.png", "misc/thumbnail.png", "bot.png"])
def test_the_picture_of_a_robot_is_found_beside_its_definition(tmp_path: Path, picture: str) -> None:
    folder = place(tmp_path, "mine", "bot")
    robot = Registry(tmp_path, with_bundled=False)["bot"]
    assert robot.picture is None
    (folder / picture).parent.mkdir(exist_ok=True)
    (folder / picture).write_bytes(b"png")
    assert robot.picture == folder / picture


def test_a_definition_given_by_the_caller_replaces_the_registered_one(tmp_path: Path) -> None:
    place(tmp_path, "mine", "bot")
    robot = Registry(tmp_path, with_bundled=False)["bot"]
    given = {"raw_controller_order": ["camera"], "default_controllers": {}}
    source = load_source(robot, {**given, "active_camera": {"camera_joint_names": ["j"]}})
    assert source.definition.capabilities == ("active_camera",)
    assert source.definition_file is None


def test_listed_names_are_those_of_the_registry() -> None:
    assert list_robots() == tuple(sorted(REGISTERED_ROBOTS))
    assert "rover" in list_robots()


@pytest.mark.parametrize(
    ("text", "is_file"),
    [("r1", False), ("a/b.URDF", True), ("x.xacro", True), ("x.xml", True), ("x.sdf", True), ("v1.2", False)],
)
def test_texts_with_the_ending_of_a_robot_file_are_files(text: str, is_file: bool) -> None:
    assert is_robot_file(text) is is_file


def test_a_description_is_read_once_and_again_after_an_edit(tmp_path: Path) -> None:
    folder = place(tmp_path, "a", "yak")
    robot = Registry(tmp_path, with_bundled=False)["yak"]
    first = robot.description(robot.definition)
    assert robot.description(robot.definition) is first
    file = folder / "urdf" / "yak.urdf"
    file.write_text(URDF.format(name="cow"))
    assert robot.description(robot.definition).name == "cow"

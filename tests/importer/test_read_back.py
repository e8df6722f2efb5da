"""Reading a package back finds each spoiled file; resolved findings; building and moving of packages."""

from __future__ import annotations

import json
import multiprocessing
import os
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from roboyard import import_robot
from roboyard.assets import asset_path
from roboyard.description.robot_model import RobotModel
from roboyard.description.urdf.parse import parse_urdf
from roboyard.errors import ConfigError
from roboyard.importer.config.schema import ImportConfig
from roboyard.importer.context import ImportContext
from roboyard.importer.import_log import ImportLog
from roboyard.importer.package import PackageFolders, building
from roboyard.importer.resolved_findings import mark_resolved
from roboyard.importer.source import load_source, name_from_text, source_file
from roboyard.importer.verify.read_back import check_curobo, check_files, check_mjcf, check_urdf, check_usd


@pytest.fixture(scope="module")
def imported(tmp_path_factory: pytest.TempPathFactory):
    out = tmp_path_factory.mktemp("data")
    return import_robot(asset_path("r2d2"), name="r2", out=out, validate=False, report=False)


def changed_mass(robot: RobotModel, link: str, factor: float) -> RobotModel:
    links = tuple(
        replace(one, inertial=replace(one.inertial, mass=one.inertial.mass * factor))
        if one.name == link and one.inertial is not None
        else one
        for one in robot.description.links
    )
    return replace(robot, description=replace(robot.description, links=links))


def first_heavy_link(robot: RobotModel) -> str:
    return next(one.name for one in robot.description.links if one.inertial is not None)


def test_files_of_an_import_read_back_without_difference(imported) -> None:
    assert imported.facts["read_back"]["urdf"] == imported.facts["read_back"]["mjcf"] == []
    assert check_urdf(imported.robot, imported.folder / "urdf" / "r2.urdf") == []
    assert check_mjcf(imported.robot, imported.folder / "mjcf" / "r2.xml") == []


def test_a_changed_mass_is_found(imported) -> None:
    name = first_heavy_link(imported.robot)
    (problem,) = check_urdf(changed_mass(imported.robot, name, 2.0), imported.folder / "urdf" / "r2.urdf")
    assert problem.startswith(f"link {name!r} has a mass of")
    nearly = changed_mass(imported.robot, name, 1 + 1e-8)
    assert check_urdf(nearly, imported.folder / "urdf" / "r2.urdf") == []


def moved(robot: RobotModel, joint: str, by: float) -> RobotModel:
    joints = tuple(
        replace(
            one, origin=replace(one.origin, position=(one.origin.position[0] + by, *one.origin.position[1:]))
        )
        if one.name == joint
        else one
        for one in robot.description.joints
    )
    return replace(robot, description=replace(robot.description, joints=joints))


@pytest.mark.parametrize(("by", "found"), [(1e-7, False), (1e-3, True)])
def test_a_moved_joint_is_found_in_urdf_and_mjcf(imported, by: float, found: bool) -> None:
    joint = imported.robot.description.depth_first_joints[0]
    robot = moved(imported.robot, joint.name, by)
    for problems in (
        check_urdf(robot, imported.folder / "urdf" / "r2.urdf"),
        check_mjcf(robot, imported.folder / "mjcf" / "r2.xml"),
    ):
        assert bool(problems) == found
        if found:
            assert f"link {joint.child!r} is 0.001 m off its pose" in problems


def test_missing_links_and_joints_are_named(imported) -> None:
    extra = replace(
        imported.robot.description.depth_first_joints[0], name="ghost_joint", child="ghost", type="fixed"
    )
    description = imported.robot.description
    link = replace(description.links[-1], name="ghost", visuals=(), collisions=(), inertial=None)
    robot = replace(
        imported.robot,
        description=replace(
            description, links=(*description.links, link), joints=(*description.joints, extra)
        ),
    )
    urdf = check_urdf(robot, imported.folder / "urdf" / "r2.urdf")
    assert urdf == ["link 'ghost' is missing", "joint 'ghost_joint' is missing"]
    assert check_mjcf(robot, imported.folder / "mjcf" / "r2.xml") == ["body 'ghost' is missing"]


def test_the_usd_has_to_have_every_body_and_joint(imported) -> None:
    pytest.importorskip("pxr")
    file = imported.folder / "usd" / "r2.usda"
    assert check_usd(imported.robot, file) == []
    description = imported.robot.description
    ghost = replace(description.links[-1], name="ghost")
    joint = replace(description.depth_first_joints[0], name="ghost_joint", child="ghost")
    more = replace(description, links=(*description.links, ghost), joints=(*description.joints, joint))
    count = len(description.links)
    assert f"{count} rigid bodies for {count + 1} links" in check_usd(
        replace(imported.robot, description=more), file
    )


def test_planner_files_may_name_only_what_the_robot_has(imported, tmp_path: Path) -> None:
    file = imported.folder / "curobo" / "r2_description_curobo_default.yaml"
    assert check_curobo(imported.robot, file) == []
    data = yaml.safe_load(file.read_text())
    fields = data["robot_cfg"].get("kinematics", data["robot_cfg"])
    fields["lock_joints"] = {**(fields["lock_joints"] or {}), "no_such_joint": 0.0}
    fields["collision_spheres"]["no_such_link"] = []
    copy = tmp_path / "planner.yaml"
    copy.write_text(yaml.safe_dump(data))
    problems = check_curobo(imported.robot, copy)
    assert problems == ["no joint 'no_such_joint'", "collision_spheres: no link 'no_such_link'"]


def test_checks_that_cannot_run_are_reported_like_differences(imported, tmp_path: Path) -> None:
    """An empty build folder: only the URDF, given as parsed, is there."""
    urdf = imported.folder / "urdf" / "r2.urdf"
    context = ImportContext(
        config=ImportConfig(urdf_path="r2.urdf", name="r2"),
        urdf=urdf,
        source=parse_urdf(urdf),
        build=tmp_path,
        log=ImportLog(),
    )
    check_files(imported.robot, context, parse_urdf(urdf))
    assert context.log.facts["read_back"]["urdf"] == []
    assert {one.message.split(":")[0] for one in context.log.warnings} >= {"mjcf", "curobo"}
    assert any(d.message == "urdf: read back and equal" for d in context.log.decisions)


def audited(text: str, folder: Path) -> ImportContext:
    file = folder / "r.urdf"
    file.write_text(text)
    return ImportContext(
        config=ImportConfig(urdf_path="r.urdf", name="r"),
        urdf=file,
        source=parse_urdf(file),
        build=folder,
        log=ImportLog(),
    )


MOMENTS = '<inertia ixx="1" iyy="1" izz="{}" ixy="0" ixz="0" iyz="0"/>'
FLAT = f'<robot name="r"><link name="a"><inertial><mass value="1"/>{MOMENTS}</inertial></link></robot>'


@pytest.mark.parametrize(("izz", "remains"), [(5.0, True), (1.0, False)])
def test_warnings_of_the_vendors_file_remain_only_where_the_written_file_has_them(
    izz: float, remains: bool, imported, tmp_path: Path
) -> None:
    """A moment of inertia above the sum of the other two; the second written file has it fixed."""
    context = audited(FLAT.format(izz), tmp_path)
    context.log.warn("as the vendor has it", 'link "a"', code="inertia-triangle")
    context.log.warn("of the import itself")
    mark_resolved(imported.robot, context, context.source)
    codes = [one.code for one in context.log.warnings if one.code]
    assert codes == (["inertia-triangle"] if remains else [])
    assert [one["code"] for one in context.log.facts["unresolved"]] == codes
    assert any(one.message == "of the import itself" for one in context.log.warnings)


# -------------------------------------------------------------------------------------------------- package


def place(folder: Path, name: str = "pair") -> PackageFolders:
    return PackageFolders(data=folder, dataset="set", name=name)


def fill(build: Path, text: str) -> None:
    for part in ("object", "model"):
        (build / part / "file").write_text(text)


def content(where: PackageFolders) -> tuple[str, str]:
    return (where.object / "file").read_text(), (where.model / "file").read_text()


def test_a_package_is_moved_in_whole_at_the_end(tmp_path: Path) -> None:
    where = place(tmp_path / "new" / "data")
    with building(where, overwrite=False) as build:
        fill(build, "one")
        assert not where.object.exists() and not where.model.exists()
    assert content(where) == ("one", "one")
    assert where.object == tmp_path / "new/data/set/objects/robot/pair"
    assert where.model == tmp_path / "new/data/set/models/pair"
    assert [p.name for p in where.root.iterdir() if p.name.startswith(".")] == []


def test_an_existing_package_is_refused_unless_it_may_be_replaced(tmp_path: Path) -> None:
    where = place(tmp_path)
    with building(where, overwrite=False) as build:
        fill(build, "one")
    (where.object / "stale").touch()
    with (
        pytest.raises(ConfigError, match=r"'pair' exists already in .*give --overwrite"),
        building(where, overwrite=False),
    ):
        raise AssertionError("the block must not run")
    assert content(where) == ("one", "one")
    with building(where, overwrite=True) as build:
        fill(build, "two")
        assert content(where) == ("one", "one")
    assert content(where) == ("two", "two")
    assert not (where.object / "stale").exists()


def test_half_a_package_is_refused_too(tmp_path: Path) -> None:
    where = place(tmp_path)
    where.model.mkdir(parents=True)
    with pytest.raises(ConfigError, match="models"), building(where, overwrite=False):
        pass


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_failed_build_leaves_the_old_package_and_no_folder(
    tmp_path: Path, error: type[BaseException]
) -> None:
    where = place(tmp_path / "data")
    with pytest.raises(error), building(where, overwrite=False) as build:
        fill(build, "one")
        raise error
    assert not (tmp_path / "data").exists()  # it was made for this import
    with building(where, overwrite=False) as build:
        fill(build, "one")
    with pytest.raises(error), building(where, overwrite=True) as build:
        fill(build, "two")
        raise error
    assert content(where) == ("one", "one")
    assert not list(where.root.glob(".import*"))


def test_folders_that_hold_other_files_survive_a_failed_build(tmp_path: Path) -> None:
    where = place(tmp_path)
    with building(place(tmp_path, "other"), overwrite=False) as build:
        fill(build, "other")
    with pytest.raises(ValueError, match="stop"), building(where, overwrite=False):
        raise ValueError("stop")
    assert content(place(tmp_path, "other")) == ("other", "other")


def test_what_a_killed_build_left_is_removed_by_the_next_import_of_that_name_only(tmp_path: Path) -> None:
    root = tmp_path / "set"
    for name in (".import-pair-abc", ".import-pair_2-abc", ".import-pair-x-abc"):
        (root / name / "object").mkdir(parents=True)
    (root / ".import-pair-link").symlink_to(tmp_path)
    with building(place(tmp_path), overwrite=False) as build:
        fill(build, "one")
    left = {p.name for p in root.iterdir() if p.name.startswith(".import")}
    assert left == {".import-pair_2-abc", ".import-pair-x-abc", ".import-pair-link"}
    assert tmp_path.exists()


def test_a_move_that_was_marked_ready_is_finished(tmp_path: Path) -> None:
    """The mark holds the inodes of the new parts; the object folder had been moved in before the kill."""
    where = place(tmp_path)
    with building(where, overwrite=False) as build:
        fill(build, "old")
    build = where.root / ".import-pair-xyz"
    for part in ("object", "model"):
        (build / part).mkdir(parents=True)
    fill(build, "new")
    numbers = {part: (build / part).stat().st_ino for part in ("object", "model")}
    (build / "ready").write_text(json.dumps(numbers))
    (build / "object").rename(build / "moved")
    where.object.rename(build / "object")
    (build / "moved").rename(where.object)
    with pytest.raises(ConfigError, match="exists already"), building(where, overwrite=False):
        pass
    assert content(where) == ("new", "new")
    assert not build.exists()


def _import_again(folder: str, answers) -> None:
    try:
        with building(place(Path(folder)), overwrite=True) as build:
            fill(build, "second")
        answers.put("done")
    except ConfigError as error:
        answers.put(str(error))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_two_imports_of_one_name_exclude_each_other(tmp_path: Path) -> None:
    fork = multiprocessing.get_context("fork")
    answers = fork.SimpleQueue()

    def ask() -> str:
        process = fork.Process(target=_import_again, args=(str(tmp_path), answers))
        process.start()
        process.join(30)
        return answers.get()

    with building(place(tmp_path), overwrite=False) as build:
        fill(build, "first")
        assert "another import of 'pair' is under way" in ask()
        with building(place(tmp_path, "other"), overwrite=False) as second:
            fill(second, "other name")
    assert content(place(tmp_path)) == ("first", "first")
    assert ask() == "done"
    assert content(place(tmp_path)) == ("second", "second")


# --------------------------------------------------------------------------------------------------- source


@pytest.mark.parametrize(
    ("text", "name"),
    [("R1-Pro v2", "r1_pro_v2"), ("7bot", "_7bot"), ("", "robot"), ("Ärm", "_rm"), ("ok_1", "ok_1")],
)
def test_names_are_made_from_any_text(text: str, name: str) -> None:
    assert name_from_text(text) == name


def test_a_description_becomes_a_temporary_urdf_that_reads_back(imported) -> None:
    description = imported.robot.description
    with source_file(description) as file:
        assert isinstance(file, Path)
        assert check_urdf(imported.robot, file) == []
    assert not file.exists()


def test_a_robot_file_alone_keeps_its_root_and_has_defaults() -> None:
    loaded = load_source(asset_path("r2d2"), None, {"name": None, "dataset_name": "mine"}, {})
    assert (loaded.has_config, loaded.config.canonical_frame) == (False, False)
    assert (loaded.config.name, loaded.config.dataset_name) == ("r2d2", "mine")


def test_a_configuration_and_a_robot_file_go_together(tmp_path: Path) -> None:
    data = {"urdf_path": "missing.urdf", "name": "a", "category": "toy"}
    loaded = load_source(asset_path("r2d2"), data, {"name": "b"}, {})
    assert (loaded.has_config, loaded.config.name, loaded.config.category) == (True, "b", "toy")
    assert loaded.urdf == Path(asset_path("r2d2")).absolute()


@pytest.mark.parametrize(
    ("source", "config", "text"),
    [
        (None, None, "there is no source"),
        ("a.yaml", {"name": "a"}, "is a configuration already"),
        ("absent.urdf", None, "there is no file"),
    ],
)
def test_sources_that_cannot_be_used_are_refused(source, config, text) -> None:
    with pytest.raises(ConfigError, match=text):
        load_source(source, config, {}, {})

"""Finding packages in workspaces as ROS lays them out, and moved files by the end of their paths."""

from pathlib import Path

import pytest

from roboyard.description import load_description
from roboyard.description.files.moved_files import is_mesh_or_image, moved_file
from roboyard.description.files.resolver import Resolver
from roboyard.description.files.workspaces import MAX_DEPTH, package_folders, package_name, packages_below
from roboyard.errors import DescriptionError


@pytest.fixture(autouse=True)
def fresh() -> None:
    packages_below.cache_clear()


def package(folder: Path, name: str | None = None) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    inside = "" if name is None else f"<name>{name}</name>"
    (folder / "package.xml").write_text(f"<package>{inside}</package>")
    return folder


def mesh(file: Path) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("solid\nendsolid\n")
    return file


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("<package><name>arm</name></package>", "arm"),
        ('<package format="3">\n <name>\n arm \n</name><name>other</name></package>', "arm"),
        ("<package/>", None),
        ("", None),
        ("<name></name>", ""),
        ("<name>a<b/></name>", None),
        ("not xml at all <name>x</name>", "x"),
    ],
)
def test_the_name_of_a_package_is_read_from_its_manifest(tmp_path: Path, text: str, name: str | None) -> None:
    (tmp_path / "package.xml").write_text(text)
    assert package_name(tmp_path) == name


def test_a_manifest_of_over_a_mebibyte_or_a_folder_has_no_name(tmp_path: Path) -> None:
    (tmp_path / "package.xml").write_text("<name>x</name>" + " " * (1 << 20))
    assert package_name(tmp_path) is None
    (tmp_path / "sub" / "package.xml").mkdir(parents=True)
    assert package_name(tmp_path / "sub") is None


def test_packages_are_found_by_manifest_and_folder_name_and_not_inside_each_other(tmp_path: Path) -> None:
    outer = package(tmp_path / "group" / "arm-2", "arm")
    package(outer / "inner", "inner")
    found = packages_below(tmp_path)
    assert found == {"arm": outer, "arm-2": outer}


def test_the_nearest_of_two_packages_of_one_name_is_taken(tmp_path: Path) -> None:
    package(tmp_path / "a" / "deep" / "arm")
    near = package(tmp_path / "z" / "arm")
    assert packages_below(tmp_path)["arm"] == near


@pytest.mark.parametrize("mark", ["CATKIN_IGNORE", "COLCON_IGNORE", "AMENT_IGNORE", "rospack_nosubdirs"])
def test_ignored_hidden_and_linked_folders_are_not_searched(tmp_path: Path, mark: str) -> None:
    root = tmp_path / "ws"
    package(root / "old" / "arm")
    (root / "old" / mark).touch()
    package(root / ".hidden" / "leg")
    (root / "linked").symlink_to(package(tmp_path / "outside" / "tail").parent)
    kept = package(root / "new" / "head")
    assert packages_below(root) == {"head": kept}


def test_packages_are_searched_to_a_bounded_depth(tmp_path: Path) -> None:
    levels = [f"d{i}" for i in range(MAX_DEPTH - 1)]
    inside = package(tmp_path.joinpath("a", *levels[1:], "near"))
    package(tmp_path.joinpath("b", *levels, "far"))
    assert packages_below(tmp_path) == {"near": inside}


@pytest.mark.parametrize("mark", ["devel", "install", "build", "log", ".catkin_tools"])
def test_the_sources_of_a_workspace_are_found_beside_its_build_folders(tmp_path: Path, mark: str) -> None:
    workspace = tmp_path / "ws"
    (workspace / mark).mkdir(parents=True)
    (workspace / "src").mkdir()
    above = (workspace / mark / "x", workspace / mark, workspace, tmp_path)
    assert workspace / "src" in package_folders(above)
    assert package_folders((tmp_path / "elsewhere", tmp_path)) == ()


@pytest.mark.parametrize("scheme", ["package", "model"])
def test_a_robot_of_a_catkin_workspace_loads_with_a_mesh_of_another_package(
    tmp_path: Path, scheme: str
) -> None:
    source = tmp_path / "ws" / "src"
    (tmp_path / "ws" / "devel").mkdir(parents=True)
    hand = package(source / "vendor" / "hands" / "hand_v3", "hand_description")
    file = mesh(hand / "meshes" / "palm.stl")
    arm = package(source / "arm_description", "arm_description") / "urdf" / "arm.urdf"
    arm.parent.mkdir()
    uri = f"{scheme}://hand_description/meshes/palm.stl"
    arm.write_text(
        '<robot name="r"><link name="a"><visual><geometry>'
        f'<mesh filename="{uri}"/></geometry></visual></link></robot>'
    )
    robot = load_description(arm, strict=True)
    assert robot.links[0].visuals[0].geometry.path == file  # type: ignore[union-attr]
    assert robot.links[0].visuals[0].geometry.uri == uri  # type: ignore[union-attr]
    (hand / "package.xml").unlink()
    packages_below.cache_clear()
    with pytest.raises(DescriptionError, match=r"arm\.urdf:1.*pass packages=\{'hand_description': folder\}"):
        load_description(arm)
    assert load_description(arm, packages={"hand_description": hand}, strict=True).notes == ()


def test_a_given_package_precedes_one_of_the_workspace(tmp_path: Path) -> None:
    own = mesh(package(tmp_path / "src" / "arm") / "a.stl")
    given = mesh(tmp_path / "given" / "a.stl")
    base = tmp_path / "src" / "arm"
    plain = Resolver(base=base, environment={})
    chosen = Resolver(base=base, packages={"arm": given.parent}, environment={})
    assert plain.resolve("package://arm/a.stl").path == own
    assert chosen.resolve("package://arm/a.stl").path == given


@pytest.mark.parametrize("scheme", ["http", "https", "ftp", "data", "omniverse"])
def test_other_schemes_are_not_fetched(tmp_path: Path, scheme: str) -> None:
    found = Resolver(base=tmp_path, environment={}).resolve(f"{scheme}://host/a.stl")
    assert found.path is None
    assert found.problem == f"{scheme}:// is not fetched; download the file and name it by path or package://"


def test_a_file_uri_with_a_relative_path_is_read_with_a_note(tmp_path: Path) -> None:
    file = mesh(tmp_path / "meshes" / "a.stl")
    found = Resolver(base=tmp_path, environment={}).resolve("file://meshes/a.stl")
    assert found.path == file
    assert found.note is not None


def test_links_in_a_ring_are_not_followed_forever(tmp_path: Path) -> None:
    (tmp_path / "a.stl").symlink_to(tmp_path / "b.stl")
    (tmp_path / "b.stl").symlink_to(tmp_path / "a.stl")
    assert Resolver(base=tmp_path, environment={}).resolve("a.stl").path is None


def test_a_link_inside_the_robot_to_a_file_inside_the_robot_is_followed(tmp_path: Path) -> None:
    file = mesh(tmp_path / "arm" / "store" / "a.stl")
    (tmp_path / "arm" / "b.stl").symlink_to(file)
    found = Resolver(base=tmp_path / "arm", environment={}).resolve("b.stl")
    assert found.path is not None
    assert found.path.samefile(file)


@pytest.mark.parametrize(
    ("named", "deep", "least", "found"),
    [
        ("old/arm/meshes/visual/a.stl", False, 2, "meshes/visual/a.stl"),
        ("old/visual/a.stl", False, 2, None),
        ("visual/a.stl", True, 2, "meshes/visual/a.stl"),
        ("a.stl", True, 2, None),
        ("far/away/a.stl", True, 2, None),
        ("MESHES/Visual/A.STL", False, 2, "meshes/visual/a.stl"),
        ("meshes/visual/a.txt", True, 1, None),
        ("top.obj", False, 1, "top.obj"),
        ("", True, 1, None),
    ],
)
def test_moved_files_are_those_whose_path_ends_alike(
    tmp_path: Path, named: str, deep: bool, least: int, found: str | None
) -> None:
    for name in ("meshes/visual/a.stl", "meshes/collision/a.stl", "meshes/visual/a.txt", "top.obj"):
        mesh(tmp_path / name)
    assert moved_file(tmp_path, named, deep=deep, least=least) == (
        None if found is None else tmp_path / found
    )


@pytest.mark.parametrize(
    ("name", "expected"), [("a.STL", True), ("b.jpeg", True), ("c.urdf", False), ("d", False)]
)
def test_meshes_and_images_are_known_by_their_suffix(name: str, expected: bool) -> None:
    assert is_mesh_or_image(Path(name)) is expected


def linked_source(folder: Path, mark: str, target: Path) -> Path:
    """A robot's folder that looks like a workspace whose `src` leads elsewhere."""
    (folder / mark).mkdir(parents=True)
    (folder / "src").symlink_to(target, target_is_directory=True)
    return folder


@pytest.mark.parametrize("mark", ["log", "build", "install", "devel", ".catkin_tools", ".rosinstall"])
@pytest.mark.parametrize("form", ["{}", "file://{}", "../private/plan.stl", "package://src/private/plan.stl"])
def test_a_linked_src_makes_nothing_outside_part_of_the_robot(tmp_path: Path, mark: str, form: str) -> None:
    plan = mesh(package(tmp_path / "private", "plans") / "plan.stl")
    robot = linked_source(tmp_path / "arm_2", mark, Path("/"))
    found = Resolver(base=robot, environment={}).resolve(form.format(plan))
    assert found.path is None
    assert found.problem is not None


def test_a_link_above_the_workspace_changes_nothing(tmp_path: Path) -> None:
    plan = mesh(tmp_path / "ws" / "src" / "arm" / "meshes" / "a.stl")
    (tmp_path / "ws" / "build").mkdir()
    (tmp_path / "short").symlink_to(tmp_path / "ws")
    base = tmp_path / "short" / "install" / "arm" / "robots"
    base.mkdir(parents=True)
    found = Resolver(base=base, environment={}).resolve(str(plan))
    assert found.path == plan


def test_a_package_that_is_a_link_out_of_a_search_path_needs_a_manifest(tmp_path: Path) -> None:
    plan = mesh(tmp_path / "private" / "plan.stl")
    given = tmp_path / "given"
    given.mkdir()
    (given / "arm").symlink_to(plan.parent)
    files = Resolver(search_paths=[given], environment={})
    assert files.resolve("package://arm/plan.stl").path is None
    package(plan.parent, "arm")
    assert files.resolve("package://arm/plan.stl").path == given / "arm" / "plan.stl"


def test_a_manifest_full_of_blanks_is_read_at_once(tmp_path: Path) -> None:
    (tmp_path / "package.xml").write_text("<package><name>" + " " * 900_000 + "x")
    assert package_name(tmp_path) is None

"""Finding mesh files, and refusing those that are none of the robot's business."""

from pathlib import Path

import pytest

from roboyard.description.files.resolver import Resolver
from roboyard.description.files.workspaces import package_name, packages_below


def touch(file: Path) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("solid")
    return file


def resolver(base: Path, **options) -> Resolver:
    return Resolver(base=base, environment={}, **options)


def test_relative_to_the_description(tmp_path):
    mesh = touch(tmp_path / "robot" / "meshes" / "a (1).stl")
    found = resolver(tmp_path / "robot").resolve("meshes/a (1).stl")
    assert found.path == mesh
    assert found.note is None


def test_mesh_folder_beside_the_description(tmp_path):
    mesh = touch(tmp_path / "xx" / "meshes" / "a.stl")
    (tmp_path / "xx" / "any").mkdir()
    assert resolver(tmp_path / "xx" / "any").resolve("../meshes/a.stl").path == mesh


def test_package_is_a_folder_above_of_that_name(tmp_path):
    mesh = touch(tmp_path / "arm_description" / "meshes" / "a.stl")
    base = tmp_path / "arm_description" / "urdf" / "v2"
    base.mkdir(parents=True)
    assert resolver(base).resolve("package://arm_description/meshes/a.stl").path == mesh


def test_package_is_a_sibling_of_a_folder_above(tmp_path):
    mesh = touch(tmp_path / "src" / "hand_description" / "meshes" / "a.stl")
    base = tmp_path / "src" / "arm_description" / "urdf"
    base.mkdir(parents=True)
    assert resolver(base).resolve("package://hand_description/meshes/a.stl").path == mesh


def test_package_is_named_by_its_package_xml(tmp_path):
    mesh = touch(tmp_path / "unpacked-main" / "meshes" / "a.stl")
    (tmp_path / "unpacked-main" / "package.xml").write_text(
        "<package><name> arm_description </name></package>"
    )
    base = tmp_path / "unpacked-main" / "urdf"
    base.mkdir()
    found = resolver(base).resolve("package://arm_description/meshes/a.stl")
    assert found.path == mesh
    assert found.note is None
    assert package_name(tmp_path / "unpacked-main") == "arm_description"


def test_renamed_package_is_found_and_noted(tmp_path):
    mesh = touch(tmp_path / "renamed" / "meshes" / "a.stl")
    base = tmp_path / "renamed" / "urdf"
    base.mkdir()
    found = resolver(base).resolve("package://arm_description/meshes/a.stl")
    assert found.path == mesh
    assert "package 'arm_description' was not found; its files were found in renamed/" in found.note


def test_a_part_of_a_package_that_is_a_repository_of_its_own(tmp_path):
    """AgileX's arms: `package://agx_arm_description/agx_arm_urdf/...`, cloned as `agx_arm_urdf` alone."""
    mesh = touch(tmp_path / "arm_urdf" / "piper" / "meshes" / "a.stl")
    base = tmp_path / "arm_urdf" / "nero" / "urdf"
    base.mkdir(parents=True)
    found = resolver(base).resolve("package://arm_description/arm_urdf/piper/meshes/a.stl")
    assert found.path == mesh
    assert "package 'arm_description' was not found; its files were found in arm_urdf/" in found.note


@pytest.mark.parametrize("scheme", ["package", "model"])
def test_packages_and_search_paths_of_the_caller(tmp_path, scheme):
    mesh = touch(tmp_path / "store" / "arm" / "a.stl")
    base = tmp_path / "elsewhere" / "deep"
    base.mkdir(parents=True)
    uri = f"{scheme}://arm/a.stl"
    assert resolver(base).resolve(uri).path is None
    assert resolver(base, packages={"arm": tmp_path / "store" / "arm"}).resolve(uri).path == mesh
    assert resolver(base, search_paths=[tmp_path / "store"]).resolve(uri).path == mesh
    assert resolver(base, search_paths=[tmp_path / "store" / "arm"]).resolve(uri).path == mesh
    assert resolver(base, search_paths=[tmp_path / "store" / "arm"]).resolve("a.stl").path == mesh


@pytest.mark.parametrize(
    ("variable", "folder"),
    [("ROS_PACKAGE_PATH", "ws/src"), ("GAZEBO_MODEL_PATH", "ws/src"), ("AMENT_PREFIX_PATH", "ws/src/..")],
)
def test_search_paths_of_the_environment(tmp_path, variable, folder):
    mesh = touch(tmp_path / "ws" / "src" / "arm" / "a.stl")
    share = touch(tmp_path / "ws" / "share" / "arm" / "a.stl")
    base = tmp_path / "elsewhere"
    base.mkdir()
    environment = {variable: f"/nowhere:{tmp_path / folder}"}
    found = Resolver(base=base, environment=environment).resolve("package://arm/a.stl")
    assert found.path == (share if variable.startswith("AMENT") else mesh)


def test_file_uri_and_absolute_path_inside_the_package(tmp_path):
    mesh = touch(tmp_path / "pkg" / "my meshes" / "a.stl")
    (tmp_path / "pkg" / "package.xml").write_text("<package/>")
    base = tmp_path / "pkg" / "urdf"
    base.mkdir()
    for uri in (f"file://{mesh}", mesh.as_uri(), str(mesh), f"file://localhost{mesh}"):
        assert resolver(base).resolve(uri).path == mesh, uri


def test_percent_codes_and_backslashes(tmp_path):
    mesh = touch(tmp_path / "arm" / "meshes" / "my part.stl")
    assert resolver(tmp_path / "arm").resolve("package://arm/meshes/my%20part.stl").path == mesh
    found = resolver(tmp_path / "arm").resolve("meshes\\my part.stl")
    assert found.path == mesh
    assert found.note == 'backslashes in the file name read as "/"'


def test_case_is_forgiven_with_a_note(tmp_path):
    mesh = touch(tmp_path / "arm" / "Meshes" / "Part.STL")
    found = resolver(tmp_path / "arm").resolve("meshes/part.stl")
    assert found.path == mesh
    assert found.note == "found as 'Part.STL', which differs in upper and lower case"


def test_two_files_that_differ_in_case_alone_are_not_guessed(tmp_path):
    touch(tmp_path / "Part.stl")
    touch(tmp_path / "PART.stl")
    assert resolver(tmp_path).resolve("part.stl").path is None


@pytest.mark.parametrize(
    "uri",
    [
        "../../secret.stl",
        "../outside/secret.stl",
        "package://arm/../../outside/secret.stl",
        "package://outside/../outside/../../secret.stl",
        "package://../outside/secret.stl",
        "file:///etc/hostname",
        "/etc/hostname",
        "meshes/../../outside/secret.stl",
        "meshes/link.stl",
        "meshes/folder_link/secret.stl",
        "package://linked_package/secret.stl",
        "..%2Foutside%2Fsecret.stl",
        "..\\outside\\secret.stl",
    ],
)
def test_nothing_outside_is_opened(tmp_path, uri):
    touch(tmp_path / "secret.stl")
    outside = touch(tmp_path / "outside" / "secret.stl")
    base = tmp_path / "in" / "arm"
    (base / "meshes").mkdir(parents=True)
    (base / "meshes" / "link.stl").symlink_to(outside)
    (base / "meshes" / "folder_link").symlink_to(outside.parent)
    (base / "linked_package").symlink_to(outside.parent)
    found = resolver(base).resolve(uri)
    assert found.path is None
    assert "search_paths" in found.problem or "packages=" in found.problem


def test_outside_is_named_with_the_remedy(tmp_path):
    touch(tmp_path / "outside" / "a.stl")
    base = tmp_path / "arm"
    base.mkdir()
    found = resolver(base).resolve("../outside/a.stl")
    assert "is outside the robot's folders" in found.problem
    allowed = resolver(base, search_paths=[tmp_path / "outside"])
    assert allowed.resolve("../outside/a.stl").path == tmp_path / "outside" / "a.stl"


def test_not_found_names_the_package_and_the_places(tmp_path):
    problem = resolver(tmp_path).resolve("package://arm/a.stl").problem
    assert problem.startswith("no such file (looked in ")
    assert "pass packages={'arm': folder}" in problem


def test_a_file_that_a_known_package_lacks_is_asked_for_there(tmp_path):
    base = tmp_path / "arm" / "urdf"
    touch(tmp_path / "arm" / "meshes" / "b.stl")
    base.mkdir()
    problem = resolver(base).resolve("package://arm/meshes/a.stl").problem
    assert problem.startswith(f"no such file in the package's folder {tmp_path / 'arm'}; add it")


def test_folders_and_blank_names(tmp_path):
    (tmp_path / "part.stl").mkdir()
    assert resolver(tmp_path).resolve("part.stl").problem.endswith("part.stl is a folder; name a file")
    assert resolver(tmp_path).resolve("  ").problem == "the file name is blank; name a file"
    assert resolver(tmp_path).resolve("a\0b").path is None
    assert resolver(tmp_path).resolve("x" * 5000).path is None
    assert resolver(tmp_path).resolve(f"package://{'x' * 5000}/a.stl").path is None


def test_description_reached_through_a_link_may_use_its_own_package(tmp_path):
    mesh = touch(tmp_path / "store" / "arm" / "meshes" / "a.stl")
    real = tmp_path / "store" / "arm" / "urdf"
    real.mkdir()
    shown = tmp_path / "env" / "arm" / "urdf"
    (tmp_path / "env" / "arm" / "meshes").mkdir(parents=True)
    (tmp_path / "env" / "arm" / "meshes" / "a.stl").symlink_to(mesh)
    assert Resolver(base=shown, environment={}).resolve("../meshes/a.stl").path is None
    found = Resolver(base=shown, real_base=real, environment={}).resolve("../meshes/a.stl")
    assert found.path.samefile(mesh)


def test_a_description_in_memory_uses_the_callers_roots_alone(tmp_path, monkeypatch):
    mesh = touch(tmp_path / "a.stl")
    monkeypatch.chdir(tmp_path)
    assert Resolver(environment={}).resolve("a.stl").path is None
    assert Resolver(environment={}, search_paths=[tmp_path]).resolve("a.stl").path == mesh


def test_package_anywhere_in_the_workspace(tmp_path):
    """`rospack find` sees packages in any folder below a workspace's src."""
    ours, theirs = (
        tmp_path / "ws" / "src" / "arms" / "arm",
        tmp_path / "ws" / "src" / "parts" / "more" / "hand-2",
    )
    mesh = touch(theirs / "meshes" / "a.stl")
    (theirs / "package.xml").write_text("<package><name>hand</name></package>")
    base = ours / "urdf"
    base.mkdir(parents=True)
    (ours / "package.xml").write_text("<package><name>arm</name></package>")
    assert resolver(base).resolve("package://hand/meshes/a.stl").path == mesh
    generated = tmp_path / "ws"
    (generated / "devel").mkdir()
    assert resolver(generated).resolve("package://hand/meshes/a.stl").path == mesh
    elsewhere = tmp_path / "home" / "elsewhere"
    elsewhere.mkdir(parents=True)
    named = Resolver(base=elsewhere, environment={"ROS_PACKAGE_PATH": str(tmp_path / "ws")})
    assert named.resolve("package://hand/meshes/a.stl").path == mesh
    packages_below.cache_clear()
    (theirs.parent / "COLCON_IGNORE").touch()
    assert resolver(base).resolve("package://hand/meshes/a.stl").path is None


def test_files_of_a_moved_robot_are_found_by_the_end_of_their_path(tmp_path):
    mesh = touch(tmp_path / "arm" / "meshes" / "v2" / "visual" / "a.stl")
    other = touch(tmp_path / "arm" / "meshes" / "v2" / "collision" / "a.stl")
    base = tmp_path / "arm" / "urdf"
    base.mkdir()
    for uri in (
        "package://vendor/models/arm/meshes/v2/visual/a.stl",
        "package://visual/a.stl",
        "/somebody/src/arm/meshes/v2/visual/a.stl",
        "file:///C:/robots/arm/meshes/v2/visual/a.stl",
        "C:\\robots\\arm\\meshes\\v2\\visual\\a.stl",
    ):
        found = resolver(base).resolve(uri)
        assert found.path == mesh, uri
        assert "'meshes/v2/visual/a.stl' in the robot's own folder" in found.note
    assert resolver(base).resolve("package://collision/a.stl").path == other
    for uri in ("package://camera/meshes/visual/a.stl", "package://a.stl", "v3/a.stl"):
        assert resolver(base).resolve(uri).path is None, uri


def test_a_folder_full_of_robots_lends_no_files(tmp_path):
    touch(tmp_path / "downloads" / "other" / "meshes" / "a.stl")
    assert resolver(tmp_path / "downloads").resolve("meshes/a.stl").path is None


def test_mesh_folders_of_neighbours_and_parents(tmp_path):
    arm = touch(tmp_path / "robots" / "arms" / "arm" / "meshes" / "visual" / "a.obj")
    touch(tmp_path / "robots" / "arms" / "arm" / "meshes" / "secret.txt")
    touch(tmp_path / "robots" / "arms" / "arm" / "other.obj")
    above = touch(tmp_path / "robots" / "both" / "meshes" / "b.obj")
    base = tmp_path / "robots" / "both" / "arm_and_hand"
    base.mkdir()
    assert resolver(base).resolve("../../arms/arm/meshes/visual/a.obj").path.samefile(arm)
    assert resolver(base).resolve("meshes/b.obj").path == above
    for uri in ("../../arms/arm/meshes/secret.txt", "../../arms/arm/other.obj"):
        assert "is outside the robot's folders" in resolver(base).resolve(uri).problem


def test_installed_packages_may_be_links_to_their_sources(tmp_path):
    """`colcon build --symlink-install` leaves links to the workspace's src, one prefix to a package."""
    mesh = touch(tmp_path / "ws" / "src" / "parts" / "hand" / "meshes" / "a.stl")
    share = tmp_path / "ws" / "install" / "hand" / "share" / "hand"
    (share / "meshes").mkdir(parents=True)
    (share / "meshes" / "a.stl").symlink_to(mesh)
    (share / "package.xml").write_text("<package><name>hand</name></package>")
    base = tmp_path / "ws" / "install" / "arm" / "share" / "arm" / "urdf"
    base.mkdir(parents=True)
    assert resolver(base).resolve("package://hand/meshes/a.stl").path.samefile(mesh)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    sourced = Resolver(base=elsewhere, environment={"AMENT_PREFIX_PATH": str(tmp_path / "ws/install/hand")})
    assert sourced.resolve("package://hand/meshes/a.stl").path.samefile(mesh)
    assert sourced.resolve("package://hand/../../../../src/parts/hand/meshes/a.stl").path is None

"""OmniGibson's nine helpers: names, arguments, return values, and the recipe that its document gives."""

import inspect
import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

import roboyard
from roboyard.description import load_description
from roboyard.errors import ConfigError, DescriptionError
from roboyard.omnigibson import (
    copy_robot_to_models,
    link_has_dedicated_collision,
    override_joint_limits,
    rewrite_mesh_paths,
    sanitize_names,
    set_joint_dynamics,
    stage_meshes,
    strip_mimic_joints,
    urdf_audit,
)

ENVIRONMENT = dict(os.environ, PYTHONPATH=str(Path(roboyard.__file__).parents[1]))
STL = (
    "solid t\n"
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0.1 0 0\nvertex 0 0.1 0\nendloop\nendfacet\n"
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 0.1 0\nvertex 0 0 0.1\nendloop\nendfacet\n"
    "endsolid t\n"
)
VENDOR = """<?xml version="1.0"?>
<robot name="vendor">
  <link name="base (main) link">
    <visual><geometry>
      <mesh filename="package://robot_description/meshes/base link (1).stl"/>
    </geometry></visual>
    <collision><geometry>
      <mesh filename="package://robot_description/meshes/base link (1).stl"/>
    </geometry></collision>
  </link>
  <link name="left finger">
    <inertial>
      <mass value="0.1"/><inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/>
    </inertial>
    <visual><geometry><mesh filename="package://robot_description/meshes/finger.STL"/></geometry></visual>
    <collision><geometry><box size="0.01 0.01 0.05"/></geometry></collision>
  </link>
  <link name="right finger"/>
  <joint name="left finger_joint" type="prismatic">
    <parent link="base (main) link"/><child link="left finger"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0" effort="0" velocity="0"/>
  </joint>
  <joint name="right finger_joint" type="prismatic">
    <parent link="base (main) link"/><child link="right finger"/><axis xyz="-1 0 0"/>
    <limit lower="0" upper="0.05" effort="10" velocity="1"/>
    <mimic joint="left finger_joint"/>
  </joint>
  <transmission name="t"><joint name="left finger_joint"/></transmission>
  <gazebo reference="left finger"/>
</robot>
"""


@pytest.fixture
def vendor(tmp_path: Path) -> Path:
    """Folder with vendor/robot.urdf and the package that its meshes are in."""
    meshes = tmp_path / "robot_description" / "meshes"
    meshes.mkdir(parents=True)
    (meshes / "base link (1).stl").write_text(STL)
    (meshes / "finger.STL").write_text(STL)
    (tmp_path / "vendor").mkdir()
    (tmp_path / "vendor" / "robot.urdf").write_text(VENDOR)
    return tmp_path


def tree_of(xml: str) -> ET.ElementTree:
    return ET.ElementTree(ET.fromstring(xml))


RECIPE = """
import xml.etree.ElementTree as ET
from {module} import (
    rewrite_mesh_paths, stage_meshes, strip_mimic_joints, sanitize_names,
    override_joint_limits, urdf_audit,
)

tree = ET.parse("vendor/robot.urdf")
rewrite_mesh_paths(tree, [("package://robot_description/", "{root}/robot_description/")])
stage_meshes(tree, "staging/meshes_clean")
strip_mimic_joints(tree)
renames = sanitize_names(tree)
override_joint_limits(tree, {{
    renames.get("left finger_joint", "left finger_joint"): {{
        "effort": 30, "velocity": 0.1, "lower": 0, "upper": 0.05}},
}})
tree.write("staging/robot.urdf", encoding="utf-8", xml_declaration=True)
assert urdf_audit("staging/robot.urdf")["package_uris"] == 0
"""


@pytest.mark.parametrize("module", ["roboyard.omnigibson", "omnigibson.utils.urdf_preprocessing"])
def test_the_documents_recipe_gives_a_clean_robot(vendor: Path, module: str) -> None:
    script = vendor / "recipe.py"
    script.write_text(RECIPE.format(module=module, root=vendor.as_posix()))
    command = [sys.executable, "-m", "roboyard", "run", str(script)]
    done = subprocess.run(command, cwd=vendor, capture_output=True, text=True, env=ENVIRONMENT, timeout=120)
    assert done.returncode == 0, done.stderr
    clean = urdf_audit(vendor / "staging" / "robot.urdf")
    assert [
        clean[k] for k in ("package_uris", "broken_relative_paths", "mimic_joints", "nonascii_paths")
    ] == [0] * 4
    robot = load_description(vendor / "staging" / "robot.urdf")
    assert [link.name for link in robot.links] == ["base__main__link", "left_finger", "right_finger"]
    limit = robot.joint_by_name["left_finger_joint"].limit
    assert limit is not None
    assert (limit.lower, limit.upper, limit.effort, limit.velocity) == (0, 0.05, 30, 0.1)
    assert sorted(file.name for file in (vendor / "staging" / "meshes_clean").iterdir()) == [
        "base_link__1_.stl",
        "finger.STL",
    ]


def test_the_recipe_script_needs_roboyard_run_for_the_alias(vendor: Path) -> None:
    code = "import importlib.util, sys; sys.exit(importlib.util.find_spec('omnigibson') is not None)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_real_omnigibson_is_never_shadowed(tmp_path: Path) -> None:
    package = tmp_path / "omnigibson" / "utils"
    package.mkdir(parents=True)
    (tmp_path / "omnigibson" / "__init__.py").write_text("real = True\n")
    (package / "__init__.py").write_text("")
    (package / "urdf_preprocessing.py").write_text("def sanitize_names(tree):\n    return 'the real one'\n")
    code = (
        "from roboyard.omnigibson import install_omnigibson_alias as install\n"
        "install(); install()\n"
        "import sys; assert sum('_Alias' in type(f).__name__ for f in sys.meta_path) == 1\n"
        "from omnigibson.utils.urdf_preprocessing import sanitize_names\n"
        "assert sanitize_names(None) == 'the real one'\n"
        "try:\n    import omnigibson.macros\nexcept ImportError:\n    pass\n"
        "else:\n    raise SystemExit('mixed the real one with ours')\n"
    )
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join([str(tmp_path), ENVIRONMENT["PYTHONPATH"]]))
    subprocess.run([sys.executable, "-c", code], env=environment, check=True, timeout=60)


def test_the_alias_gives_the_data_path(tmp_path: Path) -> None:
    code = (
        "from roboyard.omnigibson import install_omnigibson_alias as install; install()\n"
        "from omnigibson.macros import gm; print(gm.DATA_PATH)\n"
    )
    environment = dict(ENVIRONMENT, ROBOYARD_DATA=str(tmp_path))
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == str(tmp_path)


def test_argument_names_are_omnigibsons() -> None:
    expected = {
        urdf_audit: ["path"],
        rewrite_mesh_paths: ["tree", "replacements"],
        stage_meshes: ["tree", "dest_dir", "invalid_chars", "replacement"],
        sanitize_names: ["tree", "invalid_chars", "replacement"],
        strip_mimic_joints: ["tree"],
        override_joint_limits: ["tree", "overrides"],
        set_joint_dynamics: ["tree", "joints", "attrs"],
        link_has_dedicated_collision: ["link_el"],
        copy_robot_to_models: ["name", "data_path", "dataset_name"],
    }
    for function, names in expected.items():
        assert list(inspect.signature(function).parameters) == names
    assert (
        inspect.signature(copy_robot_to_models).parameters["dataset_name"].default
        == "omnigibson-robot-assets"
    )


# ------------------------------------------------------------------------------------------------ urdf_audit


def test_audit_counts_what_is_there(vendor: Path) -> None:
    assert urdf_audit(str(vendor / "vendor" / "robot.urdf")) == {
        "n_links": 3,
        "n_joints": 2,
        "joint_type_counts": {"prismatic": 2},
        "mimic_joints": 1,
        "mesh_refs": 3,
        "mesh_formats": {".stl": 3},
        "package_uris": 3,
        "nonascii_paths": 0,
        "broken_relative_paths": 0,
        "links_without_inertial": 2,
        "root_link": "base (main) link",
    }


def test_audit_tells_whole_from_broken_references(tmp_path: Path) -> None:
    (tmp_path / "here.obj").write_text("v 0 0 0\n")
    absolute = (tmp_path / "here.obj").as_posix()
    uris = ["here.obj", f"file://{absolute}", absolute, "gone.dae", "../gone.dae", "méshes/gone.obj"]
    meshes = "".join(f'<visual><geometry><mesh filename="{uri}"/></geometry></visual>' for uri in uris)
    file = tmp_path / "r.urdf"
    file.write_text(f'<robot name="r"><link name="a">{meshes}</link><link name="b"/></robot>')
    counts = urdf_audit(file)
    assert counts["broken_relative_paths"] == 3
    assert counts["nonascii_paths"] == 1
    assert counts["mesh_formats"] == {".dae": 2, ".obj": 4}
    assert counts["root_link"] is None  # two roots


def test_audit_refuses_entities(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf"
    file.write_text('<!DOCTYPE robot [<!ENTITY x "y">]><robot name="&x;"/>')
    with pytest.raises(DescriptionError, match="DOCTYPE"):
        urdf_audit(file)


# ------------------------------------------------------------------------------------------------- meshes


def test_replacements_apply_in_order_and_references_are_counted_once() -> None:
    tree = tree_of('<robot><mesh filename="a/b.stl"/><mesh filename="c.stl"/><mesh/></robot>')
    assert rewrite_mesh_paths(tree, [("a/", "x/"), ("x/b", "y/b")]) == 1
    assert [m.get("filename") for m in tree.iter("mesh")] == ["y/b.stl", "c.stl", None]


def test_staging_copies_each_source_once_and_keeps_names_apart(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "arm (left).stl").write_text(folder)
    (tmp_path / "one" / "arm_(left).stl").write_text("third")
    one, two, third, gone = (
        (tmp_path / p).as_posix()
        for p in ("one/arm (left).stl", "two/arm (left).stl", "one/arm_(left).stl", "one/gone here.stl")
    )
    uris = [one, two, f"file://{one}", third, gone]
    tree = tree_of("<robot>" + "".join(f'<mesh filename="{uri}"/>' for uri in uris) + "</robot>")
    assert stage_meshes(tree, tmp_path / "clean") == 3
    got = [Path(m.get("filename") or "") for m in tree.iter("mesh")]
    assert [path.name for path in got] == [
        "arm__left_.stl", "arm__left__1.stl", "arm__left_.stl", "arm__left__2.stl", "gone_here.stl",
    ]  # fmt: skip
    assert all(path.is_absolute() for path in got)
    assert [path.read_text() for path in got[:4]] == ["one", "two", "one", "third"]
    assert not got[4].exists()


def test_staging_a_relative_reference_starts_at_the_working_directory(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.stl").write_text("m")
    tree = tree_of('<robot><mesh filename="m.stl"/></robot>')
    assert stage_meshes(tree, "staged", invalid_chars="m", replacement="n") == 1
    assert (tmp_path / "staged" / "n.stl").read_text() == "m"


# -------------------------------------------------------------------------------------------------- names


def test_renaming_follows_every_reference() -> None:
    tree = tree_of(VENDOR)
    renames = sanitize_names(tree)
    assert renames == {
        "base (main) link": "base__main__link",
        "left finger": "left_finger",
        "right finger": "right_finger",
        "left finger_joint": "left_finger_joint",
        "right finger_joint": "right_finger_joint",
    }
    root = tree.getroot()
    assert {e.get("link") for e in root.iter("child")} == {"left_finger", "right_finger"}
    assert {e.get("link") for e in root.iter("parent")} == {"base__main__link"}
    assert root.find("joint/mimic").get("joint") == "left_finger_joint"
    assert root.find("transmission/joint").get("name") == "left_finger_joint"
    assert root.find("gazebo").get("reference") == "left_finger"
    assert sanitize_names(tree) == {}


def test_renaming_never_makes_two_elements_one() -> None:
    tree = tree_of('<robot><link name="a_b"/><link name="a b"/><link name="a(b"/><joint name="a b"/></robot>')
    renames = sanitize_names(tree)
    links = [link.get("name") for link in tree.getroot().findall("link")]
    assert links[0] == "a_b"
    assert len(set(links)) == 3
    assert links[1:] == [renames["a b"], renames["a(b"]]
    assert tree.getroot().find("joint").get("name") == renames["a b"]


def test_a_link_and_a_joint_may_share_a_name() -> None:
    tree = tree_of('<robot><link name="a b"/><joint name="a_b"/></robot>')
    assert sanitize_names(tree) == {"a b": "a_b"}  # two name spaces


# ------------------------------------------------------------------------------------------------- joints


def test_mimics_are_stripped_and_counted() -> None:
    tree = tree_of(VENDOR)
    assert strip_mimic_joints(tree) == 1
    assert tree.getroot().find("joint/mimic") is None
    assert strip_mimic_joints(tree) == 0


def test_limits_are_set_and_created() -> None:
    tree = tree_of('<robot><joint name="a"><limit lower="-1" effort="0"/></joint><joint name="b"/></robot>')
    assert (
        override_joint_limits(tree, {"a": {"effort": 30}, "b": {"upper": 0.05}, "ghost": {"upper": 1}}) == 2
    )
    a, b = (joint.find("limit").attrib for joint in tree.getroot().findall("joint"))
    assert a == {"lower": "-1", "effort": "30"}
    assert b == {"upper": "0.05"}


def test_dynamics_are_set_on_the_named_joints() -> None:
    tree = tree_of(
        '<robot><joint name="a"><dynamics damping="1"/></joint><joint name="b"/><joint name="c"/></robot>'
    )
    assert set_joint_dynamics(tree, ["a", "c"], friction=0) == 2
    found = [j.find("dynamics") for j in tree.getroot().findall("joint")]
    assert found[0].attrib == {"damping": "1", "friction": "0"}
    assert found[1] is None
    assert found[2].attrib == {"friction": "0"}


@pytest.mark.parametrize(
    ("collisions", "expected"),
    [
        ("", False),
        ('<collision><geometry><mesh filename="v.stl"/></geometry></collision>', False),
        ('<collision><geometry><mesh filename="c.stl"/></geometry></collision>', True),
        ('<collision><geometry><box size="1 1 1"/></geometry></collision>', True),
        (
            '<collision><geometry><mesh filename="v.stl"/></geometry></collision>'
            '<collision><geometry><sphere radius="1"/></geometry></collision>',
            True,
        ),
    ],
)
def test_dedicated_collision(collisions: str, expected: bool) -> None:
    visual = '<visual><geometry><mesh filename="v.stl"/></geometry></visual>'
    assert link_has_dedicated_collision(ET.fromstring(f"<link>{visual}{collisions}</link>")) is expected


# -------------------------------------------------------------------------------------------------- models


def test_an_import_is_copied_to_the_models(tmp_path: Path) -> None:
    source = tmp_path / "omnigibson-robot-assets" / "objects" / "robot" / "r1" / "usd"
    source.mkdir(parents=True)
    (source / "r1.usda").write_text("new")
    target = tmp_path / "omnigibson-robot-assets" / "models" / "r1"
    (target / "usd").mkdir(parents=True)
    (target / "usd" / "r1.usda").write_text("old")
    (target / "r1.yaml").write_text("mine")
    for _ in range(2):
        assert copy_robot_to_models("r1", tmp_path) == target
        assert (target / "usd" / "r1.usda").read_text() == "new"
        assert (target / "r1.yaml").read_text() == "mine"


@pytest.mark.parametrize("name", ["absent", "../r1", "", "a/b"])
def test_copying_what_is_not_there_says_so(tmp_path: Path, name: str) -> None:
    with pytest.raises(ConfigError, match=r"no imported robot|plain folder name"):
        copy_robot_to_models(name, tmp_path)


def test_staged_meshes_have_plain_names(tmp_path: Path) -> None:
    """Non-ASCII, blanks and parentheses: the recipe for a messy URDF ends with a count of 0."""
    (tmp_path / "méshes").mkdir()
    root = ET.Element("robot", name="r")
    tree = ET.ElementTree(root)
    for name in ("bras (é).stl", "胳膊.stl", "胸部.stl"):
        (tmp_path / "méshes" / name).write_bytes(name.encode())
        ET.SubElement(root, "mesh", filename=str(tmp_path / "méshes" / name))
    dest = tmp_path / "clean"
    assert stage_meshes(tree, dest) == 3
    tree.write(tmp_path / "r.urdf")
    if str(tmp_path).isascii():
        assert urdf_audit(tmp_path / "r.urdf")["nonascii_paths"] == 0
    assert {path.name for path in dest.iterdir()} == {"bras__e_.stl", "__.stl", "___1.stl"}
    assert sorted(path.read_bytes().decode() for path in dest.iterdir()) == sorted(
        ["bras (é).stl", "胳膊.stl", "胸部.stl"]
    )

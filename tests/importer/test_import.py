"""The document's configuration on the bundled R1, a bare URDF, refusals, and an import cut short."""

import json

import numpy as np
import pytest
import yaml

from roboyard import import_robot
from roboyard.assets import asset_path
from roboyard.description import load_description
from roboyard.errors import ConfigError, DescriptionError
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.sim import World

CONFIG = asset_path("r1").parent / "r1_source_config.yaml"
BASE = [f"base_footprint_{axis}_joint" for axis in ("x", "y", "z", "rx", "ry", "rz")]


@pytest.fixture(scope="module")
def r1(tmp_path_factory):
    return import_robot(CONFIG, out=tmp_path_factory.mktemp("data"))


def test_the_tree_of_files_is_the_documents(r1):
    root = r1.folder
    assert root.parts[-4:] == ("omnigibson-robot-assets", "objects", "robot", "r1")
    for name in (
        "urdf/r1.urdf",
        "usd/r1.usda",
        "mjcf/r1.xml",
        "sdf/r1.sdf",
        "isaac_lab/r1.py",
        "newton/r1.py",
        "sdf/model.config",
        "curobo/r1_description_curobo_default.yaml",
        "curobo/r1_description_curobo_base.yaml",
        "curobo/r1_description_curobo_arm.yaml",
        "curobo/r1_description_curobo_arm_no_torso.yaml",
        "curobo/r1.yml",
        "curobo/r1.xrdf",
        "misc/metadata.json",
        "understanding.json",
        "import_log.json",
        "import_report.html",
    ):
        if name.startswith("usd/"):
            pytest.importorskip("pxr")
        assert (root / name).stat().st_size > 0, name
    assert r1.definition.name == "r1.yaml" and r1.definition.exists()
    leftovers = [p for p in root.parents[2].iterdir() if p.name.startswith(".import")]
    assert not [p for p in leftovers if p.is_dir()]


def test_planner_files_say_what_the_configuration_decides(r1):
    file = r1.folder / "curobo" / "r1_description_curobo_default.yaml"
    robot = yaml.safe_load(file.read_text())["robot_cfg"]
    config = yaml.safe_load(CONFIG.read_text())["curobo"]
    assert robot["base_link"] == "base_footprint_x"
    assert robot["cspace"][:6] == BASE
    assert robot["cspace"][6:10] == [f"torso_joint{k}" for k in (1, 2, 3, 4)]
    assert len(robot["cspace"]) == len(robot["retract_config"]) == len(robot["null_space_weight"]) == 26
    by_name = dict(zip(robot["cspace"], robot["retract_config"], strict=True))
    for side in ("left", "right"):
        posture = [by_name[f"{side}_arm_joint{k}"] for k in range(1, 7)]
        assert posture == pytest.approx([0, 1.906, -0.991, 1.571, 0.915, -1.571])
        assert by_name[f"{side}_gripper_axis1"] == pytest.approx(0.03)
    assert {"base_footprint_z_joint", "base_footprint_rx_joint", "left_gripper_axis2"} <= set(
        robot["lock_joints"]
    )
    assert set(robot["extra_links"]) == {"attached_object_left_eef_link", "attached_object_right_eef_link"}
    for link, spheres in config["collision_spheres"].items():
        assert [s["radius"] for s in robot["collision_spheres"][link]] == [s["radius"] for s in spheres]
    for link, others in config["self_collision_ignore"].items():
        assert set(others) <= set(robot["self_collision_ignore"][link])


def planner(r1, variant="default"):
    file = r1.folder / "curobo" / f"r1_description_curobo_{variant}.yaml"
    return yaml.safe_load(file.read_text())["robot_cfg"]


def arm(side, *joints):
    return [f"{side}_arm_joint{k}" for k in joints]


TORSO = [f"torso_joint{k}" for k in (1, 2, 3, 4)]
FINGERS = {side: [f"{side}_gripper_axis{k}" for k in (1, 2)] for side in ("left", "right")}
UPPER = [*TORSO, *arm("left", 1), *arm("right", 1), *arm("left", *range(2, 7)), *FINGERS["left"]]
CSPACE = [*BASE, *UPPER, *arm("right", *range(2, 7)), *FINGERS["right"]]
"""The document's printed order: link by link depth first, each with its own joints."""
HELD = ["attached_object_right_eef_link", "attached_object_left_eef_link"]


def test_the_planner_file_has_the_documents_names_and_orders(r1):
    robot, config = planner(r1), yaml.safe_load(CONFIG.read_text())["curobo"]
    assert robot["cspace"] == CSPACE
    assert robot["usd_robot_root"] == "/r1"
    assert (robot["ee_link"], robot["link_names"]) == ("right_eef_link", ["left_eef_link"])
    links = [*config["collision_spheres"], *HELD]
    assert set(robot["collision_link_names"]) == set(robot["mesh_link_names"]) == set(links)
    assert robot["collision_link_names"][-2:] == HELD
    assert robot["extra_collision_spheres"] == dict.fromkeys(HELD, 32)
    for name in HELD:
        assert robot["extra_links"][name] == {
            "parent_link_name": name.removeprefix("attached_object_"),
            "link_name": name,
            "joint_name": f"{name}_joint",
            "joint_type": "FIXED",
            "fixed_transform": [0, 0, 0, 1, 0, 0, 0],
        }


def test_the_planner_file_locks_ignores_and_covers_as_the_document_does(r1):
    robot, config = planner(r1), yaml.safe_load(CONFIG.read_text())["curobo"]
    still = {f"base_footprint_{axis}_joint": 0.0 for axis in ("z", "rx", "ry")}
    open_grippers = dict.fromkeys([*FINGERS["left"], *FINGERS["right"]], 0.05)
    assert robot["lock_joints"] == pytest.approx({**still, **open_grippers})
    ignore = {link: list(others) for link, others in config["self_collision_ignore"].items()}
    for side in ("left", "right"):
        for finger in (1, 2):
            ignore.setdefault(f"{side}_gripper_link{finger}", []).append(f"attached_object_{side}_eef_link")
    assert robot["self_collision_ignore"] == ignore
    for link, spheres in config["collision_spheres"].items():
        made = robot["collision_spheres"][link]
        assert [(*s["center"], s["radius"]) for s in made] == [(*s["center"], s["radius"]) for s in spheres]
    numbers = ("collision_sphere_buffer", "max_acceleration", "max_jerk")
    assert [robot[key] for key in numbers] == [0.002, 15.0, 500.0]


def test_each_variant_leaves_its_own_joints_to_the_planner(r1):
    arms = [*arm("left", 1), *arm("right", 1), *arm("left", *range(2, 7)), *arm("right", *range(2, 7))]
    base = [f"base_footprint_{axis}_joint" for axis in ("x", "y", "rz")]
    wanted = {
        "default": [*base, *TORSO, *arms],
        "base": base,
        "arm": [*TORSO, *arms],
        "arm_no_torso": arms,
    }
    default = planner(r1)
    for variant, free in wanted.items():
        robot = planner(r1, variant)
        assert [name for name in robot["cspace"] if name not in robot["lock_joints"]] == free, variant
        differs = {key for key in default if robot[key] != default[key]}
        assert set(robot) == set(default) and differs <= {"lock_joints", "ee_link", "link_names"}
    assert (planner(r1, "base")["ee_link"], planner(r1, "base")["link_names"]) == ("base_link", [])


def test_images_lie_in_the_packages_material_folder(r1):
    Usd = pytest.importorskip("pxr.UsdUtils")
    images = {file.name for file in (r1.folder / "material").iterdir()}
    _, assets, unresolved = Usd.ComputeAllDependencies(str(r1.folder / "usd" / "r1.usda"))
    assert images and {asset.replace("\\", "/").rsplit("/", 1)[-1] for asset in assets} == images
    assert not unresolved and not (r1.folder / "usd" / "material").exists()


def test_the_robot_keeps_its_masses_and_gains_a_gliding_base(r1):
    vendor = load_description(asset_path("r1"))
    written = load_description(r1.folder / "urdf" / "r1.urdf")
    assert written.root.name == "base_footprint_x"
    for link in vendor.links:
        if link.inertial is not None:
            assert written.link_by_name[link.name].inertial.mass == pytest.approx(
                link.inertial.mass, rel=1e-9
            )
    fixed = [f"{part}_joint{k}" for part in ("servo", "wheel") for k in (1, 2, 3)]
    assert all(written.joint_by_name[name].type == "fixed" for name in fixed)
    assert {"left_eef_link", "right_eef_link", "eyes"} <= set(written.link_by_name)
    before, after = forward_kinematics(vendor), forward_kinematics(written)
    for name in ("torso_link4", "left_arm_link6", "right_gripper_link2"):
        np.testing.assert_allclose(
            np.linalg.inv(before["torso_link1"]) @ before[name],
            np.linalg.inv(after["torso_link1"]) @ after[name],
            atol=1e-9,
        )


def test_the_imported_robot_stands_in_a_world(r1):
    world = World()
    world.add_plane()
    robot = world.add_urdf(r1.folder / "urdf" / "r1.urdf", fixed_base=True)
    assert robot.bounds[0][2] == pytest.approx(0.0, abs=5e-3)
    world.step(60)
    assert np.isfinite(world.data.qpos).all()


def test_files_read_back_as_meant(r1):
    found = r1.facts["read_back"]
    assert found["urdf"] == found["mjcf"] == found["curobo"] == []
    log = json.loads((r1.folder / "import_log.json").read_text())
    assert {"stage_and_clean", "collision", "planning"} <= {d["step"] for d in log["decisions"]}


def test_the_imported_robot_passes_every_gate(r1):
    assert [gate.line() for gate in r1.validation.failed] == []
    log = json.loads((r1.folder / "import_log.json").read_text())
    assert log["validation"]["passed"] and len(log["validation"]["gates"]) > 8
    page = r1.report.read_text()
    assert "every gate passed" in page and page.count("<svg") >= 5
    for folder in (r1.folder, r1.model_folder):
        assert (folder / "import_report.html").read_bytes() == page.encode()


def test_a_bare_urdf_keeps_its_root_and_gets_spheres(tmp_path):
    result = import_robot(asset_path("husky"), out=tmp_path)
    assert result.name == "husky"
    written = load_description(result.folder / "urdf" / "husky.urdf")
    assert written.root.name == load_description(asset_path("husky")).root.name
    planner = yaml.safe_load((result.folder / "curobo" / "husky_description_curobo_default.yaml").read_text())
    assert "front_left_wheel_link" in planner["robot_cfg"]["collision_spheres"]


def test_an_import_is_not_replaced_unasked(tmp_path):
    first = import_robot(asset_path("plane"), out=tmp_path, name="thing")
    before = (first.folder / "import_log.json").read_bytes()
    with pytest.raises(ConfigError, match="overwrite"):
        import_robot(asset_path("cube"), out=tmp_path, name="thing")
    assert (first.folder / "import_log.json").read_bytes() == before
    again = import_robot(asset_path("cube"), out=tmp_path, name="thing", overwrite=True)
    assert load_description(again.folder / "urdf" / "thing.urdf").root.name != "plane_never"


def test_every_problem_of_a_configuration_is_named_with_its_line(tmp_path):
    text = CONFIG.read_text().replace("hull_count: 8", "hull_count: -3").replace("headless:", "headles:")
    text = text.replace("parent_link: torso_link4", "parent_link: torso_link9")
    text = text.replace("urdf_path: r1_pro_source.urdf", f"urdf_path: {asset_path('r1')}")
    file = tmp_path / "broken.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError) as caught:
        import_robot(file, out=tmp_path / "data")
    message = str(caught.value)
    for expected in ("hull_count", "headles", "torso_link9"):
        line = next(k for k, row in enumerate(text.splitlines(), start=1) if expected in row)
        assert f"broken.yaml:{line}:" in message and expected in message
    assert not (tmp_path / "data").exists()


def test_a_bad_urdf_leaves_nothing_behind(tmp_path):
    file = tmp_path / "bad.urdf"
    file.write_text('<robot name="b"><link name="a"/><link name="b"/></robot>')
    with pytest.raises((DescriptionError, ConfigError), match=r"bad\.urdf"):
        import_robot(file, out=tmp_path / "data")
    assert not list((tmp_path / "data").rglob("*.urdf"))


def test_one_wrong_value_hides_no_other_problem(tmp_path):
    """A value of neither kind that it may have is one problem, and the rest of its block is still checked."""
    file = tmp_path / "two.yaml"
    file.write_text(
        f"urdf_path: {asset_path('r1')}\nname: r1\ncurobo:\n  lock_joints: {{nojoint: 0.2}}\n"
        "  default_qpos: 3\ncollision:\n  hull_count: -3\nunknown: 1\n"
    )
    with pytest.raises(ConfigError) as caught:
        import_robot(file, out=tmp_path / "data")
    lines = str(caught.value).splitlines()
    assert [line.split(": ")[0] for line in lines] == [f"two.yaml:{k}" for k in (4, 5, 7, 8)]
    assert "nojoint" in lines[0] and lines[1].endswith("must be a list or a mapping of keys to values; got 3")


def test_wrong_flags_are_named(tmp_path):
    with pytest.raises(ConfigError) as caught:
        import_robot(asset_path("cube"), name="1 x", dataset="../x", out=tmp_path)
    name, dataset = str(caught.value).splitlines()
    assert name.startswith("--name: '1 x'") and dataset.startswith("--dataset: '../x'")


def test_a_missing_mesh_is_reported_with_the_searched_folders(tmp_path):
    text = (
        '<robot name="a"><link name="l"><visual><geometry><mesh filename="package://arm/a.stl"/></geometry>'
    )
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "arm.urdf").write_text(f"{text}</visual></link></robot>")
    with pytest.raises(DescriptionError) as caught:
        import_robot(tmp_path / "in" / "arm.urdf", out=tmp_path / "data", missing_meshes="error")
    message = str(caught.value)
    assert "--package arm=FOLDER" in message
    assert str(tmp_path / "in") in message and ".import-" not in message

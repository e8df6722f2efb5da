"""Files that a repair writes, values that it computes, and input that it refuses or keeps."""

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from audit_cases import (
    CUBE,
    INERTIAL,
    arm,
    arm_with_joint,
    both,
    collision,
    inertial,
    joint,
    link,
    mesh,
    mimic,
    obj,
    robot,
    separate,
    stl,
    visual,
    write_case,
)

from roboyard.description import load_description
from roboyard.errors import ConfigError, DescriptionError
from roboyard.repair import repair_urdf


def test_the_folder_is_complete_and_relative(tmp_path: Path) -> None:
    home = tmp_path / "pkg" / "arm"
    for folder in ("visual", "collision"):
        (home / "meshes" / folder).mkdir(parents=True)
    (home / "meshes" / "visual" / "left tip.stl").write_bytes(stl(0.1 * CUBE))
    (home / "meshes" / "collision" / "left tip.stl").write_bytes(stl(0.08 * CUBE))
    (home / "wood.png").write_bytes(b"png")
    shapes = visual(
        mesh("package://arm/meshes/visual/left tip.stl"),
        more='<material name="m"><texture filename="wood.png"/></material>',
    ) + collision(mesh("package://arm/meshes/collision/left tip.stl"))
    file = home / "my arm.urdf"
    file.write_text(arm(tip=INERTIAL + shapes))
    out = tmp_path / "out"
    result = repair_urdf(file, out)
    names = sorted(str(path.relative_to(out)) for path in out.rglob("*") if path.is_file())
    assert names == [
        "meshes/left_tip.stl",
        "meshes/left_tip_1.stl",
        "my_arm.urdf",
        "renames.json",
        "repair.diff",
        "repair_log.json",
        "textures/wood.png",
    ]
    tip = load_description(result.urdf).link_by_name["tip"]
    assert [tip.visuals[0].geometry.uri, tip.collisions[0].geometry.uri] == names[:2]
    assert (out / names[0]).read_bytes() == stl(0.1 * CUBE)
    assert (out / names[1]).read_bytes() == stl(0.08 * CUBE)
    log = json.loads((out / "repair_log.json").read_text())
    assert [fix["before"] for fix in log["fixes"]] == [
        "package://arm/meshes/visual/left tip.stl",
        "package://arm/meshes/collision/left tip.stl",
    ]
    assert log["usable"] is True
    diff = (out / "repair.diff").read_text()
    assert '-        <mesh filename="package://arm/meshes/visual/left tip.stl" />' in diff
    assert '+        <mesh filename="meshes/left_tip.stl" />' in diff
    assert not list(tmp_path.glob(".out.*"))


def test_an_input_path_that_looks_like_a_staged_one_stays_itself(tmp_path: Path) -> None:
    """package://arm/a/part.stl is staged as meshes/part.stl, where the robot has another file."""
    home = tmp_path / "arm"
    for folder, size in (("a", 0.1), ("meshes", 0.05)):
        (home / folder).mkdir(parents=True)
        (home / folder / "part.stl").write_bytes(stl(size * CUBE))
    (home / "arm.urdf").write_text(
        arm(tip=INERTIAL + visual(mesh("package://arm/a/part.stl")) + collision(mesh("meshes/part.stl")))
    )
    result = repair_urdf(home / "arm.urdf", tmp_path / "out")
    tip = load_description(result.urdf).link_by_name["tip"]
    for shape, size in ((tip.visuals[0], 0.1), (tip.collisions[0], 0.05)):
        assert shape.geometry.path is not None
        assert shape.geometry.path.read_bytes() == stl(size * CUBE)


def test_no_copy_takes_the_name_of_a_missing_file(tmp_path: Path) -> None:
    """Or the missing mesh would be found in the repaired robot: another one."""
    home = tmp_path / "pkg" / "arm"
    (home / "meshes" / "coarse").mkdir(parents=True)
    (home / "package.xml").write_text("<package><name>arm</name></package>")
    (home / "meshes" / "coarse" / "tip.stl").write_bytes(stl(0.08 * CUBE))
    shapes = visual(mesh("package://arm/meshes/tip.stl"))
    shapes += collision(mesh("package://arm/meshes/coarse/tip.stl"))
    file = home / "arm.urdf"
    file.write_text(arm(tip=INERTIAL + shapes))
    first = repair_urdf(file, tmp_path / "one")
    assert first.before.of("mesh-missing") and first.after.of("mesh-missing")
    second = repair_urdf(first.urdf, tmp_path / "two")
    assert (second.fixes, second.diff) == ((), "")


def test_an_impossible_tensor_without_shapes_is_changed_as_little_as_helps(tmp_path: Path) -> None:
    tip = inertial(mass="1", tensor=(0.01, 0, 0, 0.01, 0, 0.04))
    result = repair_urdf(write_case(arm(tip=tip), tmp_path), tmp_path / "out")
    assert [fix.code for fix in result.fixes] == ["inertia-triangle"]
    repaired = load_description(result.urdf).link_by_name["tip"].inertial
    assert repaired is not None
    np.testing.assert_allclose(repaired.matrix(), np.diag([0.02, 0.02, 0.04]), rtol=1e-5, atol=1e-12)


def test_external_files_of_a_mesh_are_copied(tmp_path: Path) -> None:
    file = write_case(obj("here.mtl", with_library=True), tmp_path)
    (file.parent / "textures").mkdir()
    (file.parent / "textures" / "my wood.png").write_bytes(b"png")
    (file.parent / "here.mtl").write_text("newmtl red\nmap_Kd -s 1 1 1 textures/my wood.png\n")
    repair_urdf(file, tmp_path / "out")
    folder = tmp_path / "out" / "meshes" / "part"
    assert sorted(path.name for path in folder.iterdir()) == ["here.mtl", "my_wood.png", "part.obj"]
    assert (folder / "here.mtl").read_text() == "newmtl red\nmap_Kd -s 1 1 1 my_wood.png\n"


def test_renames_are_reported_and_followed(tmp_path: Path) -> None:
    text = robot(
        link("base-1"),
        link("base_1"),
        link("基座"),
        joint("0", "base-1", "base_1"),
        joint("右", "base_1", "基座", origin='<origin xyz="0 0 0.4"/>', more=mimic("0")),
        '<transmission name="t"><joint name="0"/></transmission><gazebo reference="基座"/>',
    )
    result = repair_urdf(write_case(text, tmp_path), tmp_path / "out")
    assert json.loads((tmp_path / "out" / "renames.json").read_text()) == {
        "links": {"base-1": "base_1_1", "基座": "u57fa_u5ea7"},
        "joints": {"0": "_0", "右": "u53f3"},
    }
    after = load_description(result.urdf)
    assert after.joint_by_name["u53f3"].mimic.joint == "_0"
    root = ET.parse(result.urdf).getroot()
    assert root.find("transmission/joint").get("name") == "_0"
    assert root.find("gazebo").get("reference") == "u57fa_u5ea7"


# ------------------------------------------------------------------------------------------------ inertias


def test_a_missing_inertial_is_that_of_the_box_at_the_density_of_water(tmp_path: Path) -> None:
    text = arm(tip=both('<box size="0.1 0.2 0.3"/>', '<origin xyz="0.01 0 0"/>'))
    tip = (
        load_description(repair_urdf(write_case(text, tmp_path), tmp_path / "out").urdf)
        .link_by_name["tip"]
        .inertial
    )
    assert tip.mass == pytest.approx(6.0, rel=1e-8)
    assert tip.origin.position == pytest.approx((0.01, 0, 0), abs=1e-9)
    assert tip.inertia == pytest.approx(
        (6 * 0.13 / 12, 0, 0, 6 * 0.1 / 12, 0, 6 * 0.05 / 12), rel=1e-8, abs=1e-12
    )


def test_an_impossible_tensor_keeps_mass_and_center(tmp_path: Path) -> None:
    origin = '<origin xyz="0.02 0 0" rpy="0 0 1.5707963267948966"/>'
    body = inertial("2", (1, 0, 0, 0.1, 0, 0.1), origin) + both('<cylinder radius="0.05" length="0.2"/>')
    tip = (
        load_description(repair_urdf(write_case(arm(tip=body), tmp_path), tmp_path / "o").urdf)
        .link_by_name["tip"]
        .inertial
    )
    assert tip.mass == 2
    assert tip.origin.position == (0.02, 0, 0)
    across = 2 * (3 * 0.05**2 + 0.2**2) / 12
    assert tip.inertia == pytest.approx((across, 0, 0, across, 0, 2 * 0.05**2 / 2), rel=1e-6, abs=1e-9)


def test_a_mesh_tensor_uses_the_scale(tmp_path: Path) -> None:
    home = tmp_path / "arm"
    home.mkdir()
    (home / "part.stl").write_bytes(stl(100.0 * CUBE))
    (home / "arm.urdf").write_text(arm(tip=both(mesh("part.stl", "0.001 -0.002 0.003"))))
    tip = load_description(repair_urdf(home / "arm.urdf", tmp_path / "out").urdf).link_by_name["tip"].inertial
    assert tip.mass == pytest.approx(6.0, rel=1e-6)
    assert tip.inertia == pytest.approx(
        (6 * 0.13 / 12, 0, 0, 6 * 0.1 / 12, 0, 6 * 0.05 / 12), rel=1e-6, abs=1e-9
    )


def test_a_body_with_mass_elsewhere_gets_none(tmp_path: Path) -> None:
    text = robot(
        link("base"),
        link("tip"),
        link("cap", both()),
        joint(),
        joint("f", "tip", "cap", "fixed"),
    )
    result = repair_urdf(write_case(text, tmp_path), tmp_path / "out")
    assert result.fixes == ()
    assert load_description(result.urdf).link_by_name["cap"].inertial is None


def test_millimetres_are_scaled_before_the_inertia_is_computed(tmp_path: Path) -> None:
    case = separate(0.1, 100.0)

    def without_inertial(folder: Path) -> str:
        assert callable(case)
        return case(folder).replace(f'<link name="tip">{INERTIAL}', '<link name="tip">')

    tip = load_description(
        repair_urdf(write_case(without_inertial, tmp_path), tmp_path / "out").urdf
    ).link_by_name["tip"]
    assert tip.collisions[0].geometry.scale == (0.001, 0.001, 0.001)
    assert tip.inertial.mass == pytest.approx(1.0, rel=1e-6)


def test_a_chain_of_mimics_is_flattened_exactly(tmp_path: Path) -> None:
    text = robot(
        *(link(name) for name in "abcd"),
        joint("p", "a", "b"),
        joint("q", "b", "c", more=mimic("p", "0.5", "0.1")),
        joint("r", "c", "d", more=mimic("q", "-2", "0.3")),
    )
    after = load_description(repair_urdf(write_case(text, tmp_path), tmp_path / "out").urdf)
    leader = after.joint_by_name["r"].mimic
    assert (leader.joint, leader.multiplier) == ("p", -1.0)
    assert leader.offset == pytest.approx(-2 * 0.1 + 0.3, abs=1e-15)


# ---------------------------------------------------------------------------------------------- refusals


def test_the_original_is_never_touched(tmp_path: Path) -> None:
    file = write_case(arm_with_joint(axis='<axis xyz="0 0 2"/>'), tmp_path)
    before = file.read_bytes()
    for out in (file.parent, tmp_path):
        with pytest.raises(ConfigError, match="holds the robot itself"):
            repair_urdf(file, out)
    assert file.read_bytes() == before


def test_a_file_that_cannot_be_read_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    file = write_case("<robot><link></robot>", tmp_path)
    with pytest.raises(DescriptionError, match=r"arm\.urdf:1: not well-formed"):
        repair_urdf(file, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("code", "words"), [("axis-not-unti", "did you mean 'axis-not-unit'"), ("axis-zero", "is not fixed")]
)
def test_codes_that_cannot_be_chosen_are_named(tmp_path: Path, code: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        repair_urdf(write_case(arm(), tmp_path), tmp_path / "out", only=[code])


def test_what_needs_a_guess_is_left_and_reported(tmp_path: Path) -> None:
    file = write_case(arm_with_joint(limit='<limit lower="1" upper="-1" effort="0" velocity="1"/>'), tmp_path)
    result = repair_urdf(file, tmp_path / "out")
    assert {finding.code for finding in result.left} == {"limit-reversed", "limit-effort-zero"}
    limit = load_description(result.urdf).joint_by_name["j"].limit
    assert (limit.lower, limit.upper, limit.effort) == (1, -1, 0)


def test_other_files_in_the_folder_stay(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "notes.txt").write_text("mine")
    (out / "arm.urdf").write_text("old")
    repair_urdf(write_case(arm(), tmp_path), out)
    assert (out / "notes.txt").read_text() == "mine"
    assert load_description(out / "arm.urdf").name == "arm"


def test_unread_xml_survives(tmp_path: Path) -> None:
    text = arm(more='<gazebo><plugin name="p" filename="x.so"> text <deep a="1"/></plugin></gazebo>')
    root = ET.parse(repair_urdf(write_case(text, tmp_path), tmp_path / "out").urdf).getroot()
    plugin = root.find("gazebo/plugin")
    assert plugin.attrib == {"name": "p", "filename": "x.so"}
    assert plugin.text.strip() == "text"
    assert plugin.find("deep").get("a") == "1"


def test_repaired_robots_settle_in_a_world(tmp_path: Path) -> None:
    from roboyard.sim import World

    parts = [
        link("base", inertial("1", [0] * 6) + both()),
        link("tip", both()),
        link("left (hand)", inertial("1", (0.01, 0.05, 0, 0.01, 0, 0.01)) + both()),
        joint(axis='<axis xyz="0 2 0"/>'),
        joint("k", "tip", "left (hand)", axis='<axis xyz="0 1, 0"/>'),
    ]
    result = repair_urdf(write_case(robot(*parts), tmp_path), tmp_path / "out")
    assert result.after.is_usable
    world = World()
    world.add_plane()
    body = world.add_urdf(result.urdf, position=(0, 0, 0.3))
    world.step(480)
    assert np.isfinite(world.data.qpos).all()
    assert np.abs(world.data.qvel).max() < 0.5
    assert body.name


def test_ranges_of_a_continuous_joint_go_at_once(tmp_path: Path) -> None:
    """A second <limit> becomes the joint's once the first one is removed."""
    file = tmp_path / "robot" / "arm.urdf"
    file.parent.mkdir()
    limits = '<limit upper="1"/><limit lower="0" effort="2"/><limit effort="3"/>'
    file.write_text(
        f"""<robot name="arm"><link name="a"/><link name="b"/><joint name="j" type="continuous">
        <parent link="a"/><child link="b"/><axis xyz="0 0 1"/>{limits}</joint></robot>"""
    )
    first = repair_urdf(file, tmp_path / "one")
    ranges = [fix for fix in first.fixes if fix.code == "continuous-with-limits"]
    assert [fix.after for fix in ranges] == ["removed", '<limit effort="2">']
    assert repair_urdf(first.urdf, tmp_path / "two").fixes == ()

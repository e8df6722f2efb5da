"""The XML that each fix writes, against values worked out by hand."""

import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from audit_cases import (
    CUBE,
    INERTIAL,
    arm,
    both,
    chain,
    collision,
    coloured,
    inertial,
    joint,
    link,
    mesh,
    robot,
    rods,
    stl,
    visual,
)
from scipy.spatial.transform import Rotation

from roboyard.audit.renames import identifier
from roboyard.description import load_description
from roboyard.description.model import Mesh
from roboyard.repair import Repair, repair_urdf
from roboyard.shapes import load_mesh
from roboyard.transforms import rotate

Fixer = Callable[[str], Repair]


@pytest.fixture
def repaired(tmp_path: Path) -> Fixer:
    """Write the text as arm.urdf and repair it."""

    def run(text: str) -> Repair:
        (tmp_path / "arm").mkdir(exist_ok=True)
        (tmp_path / "arm" / "arm.urdf").write_text(text)
        return repair_urdf(tmp_path / "arm" / "arm.urdf", tmp_path / "out")

    return run


def element(result: Repair, path: str) -> ET.Element:
    found = ET.parse(result.urdf).getroot().find(path)
    assert found is not None
    return found


JOINTS = {
    "axis not unit": (arm(axis='<axis xyz="0 3 4"/>'), "joint/axis", {"xyz": "0 0.6 0.8"}),
    "axis missing": (arm(axis=""), "joint/axis", {"xyz": "1 0 0"}),
    "axis blank": (arm(axis='<axis xyz=" "/>'), "joint/axis", {"xyz": "1 0 0"}),
    "continuous with a range": (
        arm(kind="continuous"),
        "joint/limit",
        {"effort": "10", "velocity": "2"},
    ),
    "type in upper case": (arm(kind=" Prismatic"), "joint", {"name": "j", "type": "prismatic"}),
    "comma after a number": (
        arm(limit='<limit lower="-1," upper="1;" effort="10" velocity="2"/>'),
        "joint/limit",
        {"lower": "-1", "upper": "1", "effort": "10", "velocity": "2"},
    ),
    "blank attribute": (
        arm(limit='<limit lower="-1" upper="1" effort="" velocity="2"/>'),
        "joint/limit",
        {"lower": "-1", "upper": "1", "velocity": "2"},
    ),
    "commas between numbers": (arm(origin='<origin xyz="0,0,0.2"/>'), "joint/origin", {"xyz": "0 0 0.2"}),
    "quaternion of length 5": (
        arm(origin='<origin xyz="0 0 0.2" quat_xyzw="3 0 0 4"/>'),
        "joint/origin",
        {"xyz": "0 0 0.2", "quat_xyzw": "0.6 0 0 0.8"},
    ),
    "default left by xacro": (
        arm(origin='<origin xyz="$(optenv OFFSET 0 0 0.2)"/>'),
        "joint/origin",
        {"xyz": "0 0 0.2"},
    ),
    "no name": (robot(link("base"), name=""), ".", {"name": "arm"}),
}


@pytest.mark.parametrize("name", JOINTS)
def test_a_joint_or_robot_fix_writes_the_expected_element(name: str, repaired: Fixer) -> None:
    text, path, attributes = JOINTS[name]
    result = repaired(text)
    assert element(result, path).attrib == attributes
    assert load_description(result.urdf, strict=True).notes == ()


@pytest.mark.parametrize(
    ("written", "fixed"),
    [
        ("255 128 0 255", (1, 128 / 255, 0, 1)),
        ("255 128 0 0.5", (1, 128 / 255, 0, 0.5)),
        ("51 102 153", (0.2, 0.4, 0.6, 1)),
        ("0.25 0.5 0.75", (0.25, 0.5, 0.75, 1)),
        ("2 0 0 1", (2 / 255, 0, 0, 1)),
    ],
)
def test_colours_are_brought_to_one(written: str, fixed: tuple[float, ...], repaired: Fixer) -> None:
    color = element(repaired(coloured(written)), "link/visual/material/color")
    np.testing.assert_allclose([float(v) for v in color.get("rgba", "").split()], fixed, rtol=1e-8)


@pytest.mark.parametrize("written", ["1.5 0 0 1", "-0.5 0 0 1", "300 0 0 1", "127.5 0 0 1"])
def test_colours_of_no_plain_scale_stay(written: str, repaired: Fixer) -> None:
    result = repaired(coloured(written))
    assert element(result, "link/visual/material/color").get("rgba") == written
    assert "color-range" in result.after.codes


def tensor(result: Repair, name: str = "tip") -> tuple[float, np.ndarray, np.ndarray]:
    """Mass (kg), centre (m) and tensor about it in link axes (kg m²) of a link."""
    found = load_description(result.urdf).link_by_name[name].inertial
    assert found is not None
    turn = Rotation.from_quat(found.origin.quaternion).as_matrix()
    return found.mass, np.array(found.origin.position), turn @ found.matrix() @ turn.T


A, R, L = 0.2, 0.05, 0.3
"""Edge, radius and length of the shapes below (m)."""
CYLINDER = 1000 * np.pi * R**2 * L
BALL = 1000 * 4 / 3 * np.pi * R**3
CAPSULE_ACROSS = CYLINDER * (R**2 / 4 + L**2 / 12) + BALL * (2 / 5 * R**2 + 3 / 8 * R * L + L**2 / 4)
"""Moment of a capsule, a cylinder between two half spheres, about an axis across it (kg m²)."""
SOLIDS = {
    "box": (
        f'<box size="{A} {A / 2} {A / 4}"/>',
        1000 * A**3 / 8,
        1000 * A**3 / 8 / 12 * A**2 * np.array([1 / 4 + 1 / 16, 1 + 1 / 16, 1 + 1 / 4]),
    ),
    "sphere": (f'<sphere radius="{R}"/>', BALL, 2 / 5 * BALL * R**2 * np.ones(3)),
    "cylinder": (
        f'<cylinder radius="{R}" length="{L}"/>',
        CYLINDER,
        CYLINDER * np.array([R**2 / 4 + L**2 / 12, R**2 / 4 + L**2 / 12, R**2 / 2]),
    ),
    "capsule": (
        f'<capsule radius="{R}" length="{L}"/>',
        CYLINDER + BALL,
        np.array([CAPSULE_ACROSS, CAPSULE_ACROSS, CYLINDER * R**2 / 2 + BALL * 2 / 5 * R**2]),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("missing", ["", inertial("0"), '<inertial><origin xyz="5 5 5"/></inertial>'])
def test_a_missing_mass_is_that_of_the_solid_of_water_where_it_is(
    name: str, missing: str, repaired: Fixer
) -> None:
    geometry, mass, moments = SOLIDS[name]
    turn = Rotation.from_euler("xyz", [0.3, -0.5, 0.7])
    origin = '<origin xyz="0.1 -0.2 0.3" rpy="0.3 -0.5 0.7"/>'
    found_mass, center, found = tensor(repaired(arm(tip=missing + both(geometry, origin))))
    assert found_mass == pytest.approx(mass, rel=1e-6)
    np.testing.assert_allclose(center, (0.1, -0.2, 0.3), atol=1e-8)
    np.testing.assert_allclose(
        found, turn.as_matrix() @ np.diag(moments) @ turn.as_matrix().T, atol=1e-6 * moments.max()
    )


def test_two_boxes_add_up_by_the_parallel_axis_theorem(repaired: Fixer) -> None:
    """Cubes of 0.1 m (1 kg) with their centres at ±0.3 m along x."""
    cube = '<box size="0.1 0.1 0.1"/>'
    shapes = collision(cube, '<origin xyz="0.3 0 0"/>') + collision(cube, '<origin xyz="-0.3 0 0"/>')
    mass, center, found = tensor(repaired(arm(tip=visual() + shapes)))
    own, steiner = 2 * 0.1**2 / 6, 2 * 0.3**2
    assert mass == pytest.approx(2)
    np.testing.assert_allclose(center, 0, atol=1e-12)
    np.testing.assert_allclose(found, np.diag([own, own + steiner, own + steiner]), rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize(
    "bad",
    [
        '<inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>',
        "",
        '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="3"/>',
        '<inertia ixx="-1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>',
        '<inertia ixx="1" ixy="0" iyy="1"/>',
    ],
)
def test_an_impossible_tensor_is_that_of_the_shapes_at_the_given_mass(bad: str, repaired: Fixer) -> None:
    """A cube of 0.1 m with 6 kg, its inertial frame turned: m a² / 6 about every axis."""
    origin = '<origin xyz="0.01 0 0" rpy="0.4 0.5 0.6"/>'
    body = f'<inertial>{origin}<mass value="6"/>{bad}</inertial>' + both()
    mass, center, found = tensor(repaired(arm(tip=body)))
    assert mass == 6
    np.testing.assert_allclose(center, (0.01, 0, 0), atol=1e-12)
    np.testing.assert_allclose(found, 0.01 * np.eye(3), atol=1e-10)


def test_an_impossible_tensor_of_a_link_without_shapes_keeps_its_largest_moment(repaired: Fixer) -> None:
    body = inertial("1", (1, 0, 0, 2, 0, 5))
    _, _, found = tensor(repaired(arm(tip=body)))
    small, middle, large = np.diag(found)
    assert large == pytest.approx(5)
    assert (small - 1, middle - 2) == pytest.approx((1, 1), rel=1e-5)
    assert small + middle >= large


@pytest.mark.parametrize("factor", [1.0, 0.5])
def test_a_mesh_in_millimetres_is_scaled_by_a_thousandth(
    factor: float, repaired: Fixer, tmp_path: Path
) -> None:
    (tmp_path / "arm").mkdir()
    (tmp_path / "arm" / "small.stl").write_bytes(stl(0.1 * CUBE))
    (tmp_path / "arm" / "large.stl").write_bytes(stl(100 / factor * CUBE))
    shapes = visual(mesh("small.stl")) + collision(mesh("large.stl", f"{factor} {factor} {factor}"))
    result = repaired(arm(tip=shapes))
    scale = element(result, "link[@name='tip']/collision/geometry/mesh").get("scale")
    assert scale == " ".join([f"{factor / 1000:g}"] * 3)
    mass, _, found = tensor(result)
    assert mass == pytest.approx(1, rel=1e-6)
    np.testing.assert_allclose(found, np.eye(3) / 600, rtol=1e-6)


def test_meshes_drawn_with_y_up_are_turned_onto_their_links(repaired: Fixer, tmp_path: Path) -> None:
    """A rod drawn along y, with another scale along it, is along z after the repair."""
    (tmp_path / "arm").mkdir()
    text = rods("Y_UP")(tmp_path / "arm").replace('filename="rod.dae"', 'filename="rod.dae" scale="1 1 0.5"')
    result = repaired(text)
    shape = load_description(result.urdf).link_by_name["rod2"].visuals[0]
    assert isinstance(shape.geometry, Mesh)
    rod = load_mesh(tmp_path / "arm" / "rod.dae").vertices * shape.geometry.scale
    points = rotate(shape.origin.quaternion, rod) + shape.origin.position
    np.testing.assert_allclose(points.min(axis=0), (-0.025, -0.025, 0), atol=1e-9)
    np.testing.assert_allclose(points.max(axis=0), (0.025, 0.025, 0.2), atol=1e-9)


def test_one_factor_of_scale_is_written_three_times(repaired: Fixer, tmp_path: Path) -> None:
    (tmp_path / "arm").mkdir()
    (tmp_path / "arm" / "part.stl").write_bytes(stl(100 * CUBE))
    result = repaired(arm(tip=INERTIAL + both(mesh("part.stl", "0.001"))))
    assert element(result, "link[@name='tip']/visual/geometry/mesh").get("scale") == "0.001 0.001 0.001"


def mimic_chain(*factors: tuple[float, float]) -> str:
    names = [f"j{i}" for i in range(len(factors) + 1)]
    links = [f"l{i}" for i in range(len(factors) + 2)]
    wide = '<limit lower="-100" upper="100" effort="10" velocity="2"/>'
    joints = [joint("j0", "l0", "l1")]
    for i, (multiplier, offset) in enumerate(factors):
        follow = f'<mimic joint="{names[i]}" multiplier="{multiplier}" offset="{offset}"/>'
        joints.append(joint(names[i + 1], links[i + 1], links[i + 2], limit=wide, more=follow))
    return chain(*reversed(joints), links=links)


def test_a_long_chain_of_mimics_follows_its_first_joint_by_the_composed_line(repaired: Fixer) -> None:
    factors = [(2.0, 0.5), (-0.5, 0.25), (3.0, 0.0), (1.0, -1.0)]
    result = repaired(mimic_chain(*factors))
    robot_after = load_description(result.urdf)
    lead = 0.7
    value = lead
    for i, (multiplier, offset) in enumerate(factors, start=1):
        value = multiplier * value + offset
        mimic = robot_after.joint_by_name[f"j{i}"].mimic
        assert mimic is not None
        assert mimic.joint == "j0"
        assert mimic.multiplier * lead + mimic.offset == pytest.approx(value, abs=1e-15)
    assert [fix.code for fix in result.fixes] == ["mimic-chain"] * 3


@pytest.mark.parametrize("leader", ["ghost", "k"])
def test_a_mimic_of_no_joint_or_of_itself_is_removed(leader: str, repaired: Fixer) -> None:
    text = chain(joint("j"), joint("k", "tip", "hand", more=f'<mimic joint="{leader}"/>'))
    result = repaired(text)
    assert ET.parse(result.urdf).getroot().findall(".//mimic") == []
    assert [fix.after for fix in result.fixes] == ["removed"]


@pytest.mark.parametrize(
    ("name", "plain"),
    [
        ("left arm", "left_arm"),
        ("a--b", "a__b"),
        ("2nd", "_2nd"),
        ("-", "unnamed"),
        ("Käfer", "Kafer"),
        ("手", "u624b"),
        ("a/b.c:d", "a_b_c_d"),
        ("µ1", "u3bc1"),
        ("Ⅳ", "IV"),
        ("１", "_1"),
    ],
)
def test_identifiers_are_ascii_and_start_with_no_digit(name: str, plain: str) -> None:
    assert identifier(name) == plain
    assert identifier(name).isidentifier()
    assert identifier(name).isascii()


def test_renamed_elements_stay_distinct_and_every_reference_follows(repaired: Fixer) -> None:
    names = ("base", "left arm", "left-arm", "left_arm")
    text = chain(
        joint("turn 1", "base", "left arm"),
        joint("turn-1", "left arm", "left-arm", more='<mimic joint="turn 1"/>'),
        joint("turn_1", "left-arm", "left_arm"),
        links=names,
        more='<transmission name="t"><joint name="turn 1"/></transmission><gazebo reference="left-arm"/>',
    )
    result = repaired(text)
    after = load_description(result.urdf)
    assert [each.name for each in after.links] == ["base", "left_arm_1", "left_arm_2", "left_arm"]
    assert [each.name for each in after.joints] == ["turn_1_1", "turn_1_2", "turn_1"]
    assert [(each.parent, each.child) for each in after.joints] == [
        ("base", "left_arm_1"),
        ("left_arm_1", "left_arm_2"),
        ("left_arm_2", "left_arm"),
    ]
    assert after.joints[1].mimic is not None
    assert after.joints[1].mimic.joint == "turn_1_1"
    assert element(result, "transmission/joint").get("name") == "turn_1_1"
    assert element(result, "gazebo").get("reference") == "left_arm_2"
    assert result.renames["links"] == {"left arm": "left_arm_1", "left-arm": "left_arm_2"}


def test_shapes_without_a_geometry_are_removed_and_the_others_stay_in_order(repaired: Fixer) -> None:
    result = repaired(
        arm(tip=INERTIAL + "<visual/>" + visual() + "<collision><geometry/></collision>" + both())
    )
    tip = element(result, "link[@name='tip']")
    assert [child.tag for child in tip] == ["inertial", "visual", "visual", "collision"]


def test_the_diff_turns_the_plain_layout_of_the_original_into_the_result(
    repaired: Fixer, tmp_path: Path
) -> None:
    result = repaired(arm(axis='<axis xyz="0 0 2"/>'))
    changed = [
        line for line in result.diff.splitlines() if line[:1] in "+-" and line[:3] not in ("+++", "---")
    ]
    assert changed == ['-    <axis xyz="0 0 2" />', '+    <axis xyz="0 0 1" />']
    assert (tmp_path / "out" / "repair.diff").read_text() == result.diff

"""One fault a file: what is refused, what is put right, and how it is said."""

from pathlib import Path

import pytest

from roboyard.description import load_description
from roboyard.errors import DescriptionError

DATA = Path(__file__).parents[1] / "data" / "urdf"

ERRORS = {
    "broken_xml": "broken_xml.urdf:8: not well-formed XML, column 5: mismatched tag",
    "cut_off": "cut_off.urdf:7: not well-formed XML",
    "doctype": "doctype.urdf:1: a DOCTYPE (DTD, entity declarations) is not accepted; remove it",
    "empty": "empty.urdf: the file is empty (0 bytes); a URDF starts with a <robot> element",
    "not_a_robot": "not_a_robot.urdf:1: the root element is <model>, not <robot>; give a URDF",
    "no_link": "no_link.urdf:1: robot: there is no <link>; a robot needs at least one link",
    "link_without_name": "link_without_name.urdf:3: link: a <link> has no name; give it a unique name",
    "link_twice": 'link_twice.urdf:3: link "base": the name is used twice (first in line 2); rename',
    "joint_twice": 'joint_twice.urdf:10: joint "hinge": the name is used twice (first in line 5); rename',
    "joint_without_name": "joint_without_name.urdf:4: joint: a <joint> has no name; give it a unique name",
    "joint_without_type": 'joint_without_type.urdf:4: joint "hinge": it has no type; give one of revolute, ',
    "joint_without_parent": 'joint "hinge": it has no parent link; add <parent link="..."/>',
    "joint_without_child": 'joint_without_child.urdf:4: joint "hinge": it has no child link; add <child',
    "unknown_joint_type": "joint \"hinge\": unknown joint type 'revolut'; did you mean 'revolute'?",
    "unknown_parent": "joint \"hinge\": parent: no link named 'bse'; did you mean 'base'? (available: ba",
    "unknown_child": "joint \"hinge\": child: no link named 'tpi'; did you mean 'tip'? (available: ba",
    "two_parents": 'joint "second": link "tip" is already the child of joint "hinge"; give it one parent',
    "two_roots": 'two_roots.urdf:4: link "island": 2 root links ("base", "island"); a robot has one root',
    "loop": 'joint "back": closes a loop of links ("base" <- "tip") that no root reaches; remove one joint',
    "detached_ring": 'joint "ba": closes a loop of links ("a" <- "b") that no root reaches; remove one joint',
    "zero_axis": 'zero_axis.urdf:7: joint "hinge": <axis> is (0, 0, 0); give a non-zero axis',
    "nan_origin": 'nan_origin.urdf:7: joint "hinge": <origin xyz="0 nan 0">: \'nan\' is not finite; give',
    "infinite_mass": 'infinite_mass.urdf:4: link "base": <mass value="1e999">: \'1e999\' is not finite',
    "inertial_without_mass": 'link "base": <inertial> has no mass; add <mass value="..."/> (kg)',
    "word_for_number": 'joint "hinge": <limit lower="low">: \'low\' is not a number; give a finite number',
    "two_of_three_numbers": 'joint "hinge": <origin xyz="1 2"> holds 2 of 3 numbers; give 3 numbers',
    "xacro_expression": '<origin xyz="0 0 ${height}"> is unexpanded xacro; run: xacro FILE.xacro > FILE.urdf',
    "xacro_macro": "xacro_macro.urdf:3: <xacro:arm> is xacro; expand it first: xacro FILE.xacro > FILE.urdf",
    "missing_mesh": "missing_mesh.urdf:5: link \"base\": mesh 'meshes/gone.stl': no such file (looked in ",
    "mesh_from_the_web": "https:// is not fetched; download the file and name it by path or package://",
    "mesh_without_name": 'link "base": <mesh> names no file; add filename="..."',
    "flat_mesh_scale": '<mesh scale="1 1 0"> flattens the mesh; give factors other than zero',
    "unknown_geometry": 'link "base": unknown geometry <cone>; give one of box, sphere, cylinder, capsule,',
    "box_without_size": 'link "base": <box> has no size; add it (m)',
    "negative_radius": 'link "base": <sphere> has a negative size (-1); give lengths above zero',
    "mimic_names_nothing": 'joint "hinge": <mimic> names no joint; add joint="..."',
}

REPAIRS = {
    "blank_line_before_declaration": "blank space before the XML declaration removed",
    "text_before_root": "text before the root element removed",
    "text_after_root": "text after the end of the root element removed",
    "declaration_in_the_middle": "XML declaration that is not at the start removed",
    "dashes_in_comment": 'comments that hold "--" removed',
    "bare_ampersand": 'bare "&" read as itself',
    "attribute_twice": "attributes given twice, the first one counts (line 4: name)",
    "latin_1_comment": "line 2: bytes that are not valid UTF-8; read as Windows-1252",
    "no_robot_name": "no_robot_name.urdf:1: robot: <robot> has no name; called 'no_robot_name'",
    "comma_after_number": '<limit lower="-0.07,"> is sloppy; read as -0.07',
    "commas_between_numbers": '<origin xyz="0.1,0.2, 0.3"> is sloppy; read as 0.1 0.2 0.3',
    "four_of_three_numbers": '<origin xyz="1 2 3 4"> holds 4 numbers; the first 3 are taken',
    "optenv_default": "was left by xacro; its default is taken",
    "long_axis": "<axis> has length 5; scaled to unit length",
    "upper_case_type": "type 'Revolute' read as 'revolute'",
    "blank_effort": '<limit effort=""> is blank; read as not given',
    "mimic_of_nothing": "mimic: no joint named 'ghost' (available: hinge); it moves freely",
    "mimic_of_itself": "mimic: it follows itself; it moves freely",
    "one_number_for_scale": "<mesh scale> holds one number; 0.5 is taken for all three axes",
    "visual_without_geometry": "<visual> has no geometry; it is ignored",
    "material_nowhere_defined": 'material "rust": is named but nowhere defined; no colour',
    "three_colour_numbers": "<color rgba> holds 3 numbers; opaque",
    "missing_texture": "texture 'wood.png': no such file",
    "inertial_without_inertia": "<inertial> has no <inertia>; the tensor is read as zero",
}


@pytest.mark.parametrize("fault", ERRORS)
def test_refused_with_file_line_element_and_remedy(fault):
    file = DATA / "errors" / f"{fault}.urdf"
    with pytest.raises(DescriptionError) as caught:
        load_description(file)
    assert ERRORS[fault] in str(caught.value)
    assert len(caught.value.problems) == 1
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(f"{fault}.urdf:")
    assert caught.value.file == file


@pytest.mark.parametrize("fault", REPAIRS)
def test_put_right_and_noted(fault):
    robot = load_description(DATA / "repairs" / f"{fault}.urdf")
    assert any(REPAIRS[fault] in note for note in robot.notes), robot.notes
    assert all(note.startswith(f"{fault}.urdf:") for note in robot.notes)


@pytest.mark.parametrize("fault", REPAIRS)
def test_strict_refuses_what_would_be_put_right(fault):
    with pytest.raises(DescriptionError) as caught:
        load_description(DATA / "repairs" / f"{fault}.urdf", strict=True)
    assert REPAIRS[fault] in str(caught.value)


def test_every_fault_file_is_tested():
    assert {file.stem for file in (DATA / "errors").iterdir()} == set(ERRORS)
    assert {file.stem for file in (DATA / "repairs").iterdir()} == set(REPAIRS)


def test_sloppy_numbers_have_the_value_that_strtod_reads():
    joint = load_description(DATA / "repairs" / "comma_after_number.urdf").joints[0]
    assert (joint.limit.lower, joint.limit.upper) == (-0.07, 1.57)
    joint = load_description(DATA / "repairs" / "optenv_default.urdf").joints[0]
    assert joint.origin.position == (0.1, 0, 0.2)
    joint = load_description(DATA / "repairs" / "commas_between_numbers.urdf").joints[0]
    assert joint.origin.position == (0.1, 0.2, 0.3)


def test_non_unit_axis_is_scaled():
    axis = load_description(DATA / "repairs" / "long_axis.urdf").joints[0].axis
    assert axis == pytest.approx((0, 0.6, 0.8), abs=1e-15)


def test_unusable_mimic_is_kept_as_xml():
    joint = load_description(DATA / "repairs" / "mimic_of_nothing.urdf").joints[0]
    assert joint.mimic is None
    assert [(element.tag, element.get("joint")) for element in joint.extra] == [("mimic", "ghost")]


def test_repaired_text_keeps_names_and_lines():
    robot = load_description(DATA / "repairs" / "bare_ampersand.urdf")
    assert robot.links[0].name == "nuts & bolts"
    robot = load_description(DATA / "repairs" / "blank_line_before_declaration.urdf")
    assert robot.links[0].source.line == 4
    robot = load_description(DATA / "repairs" / "attribute_twice.urdf")
    assert robot.joints[0].name == "hinge"


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(DescriptionError, match=r"nowhere\.urdf: no such file in .*; check the path"):
        load_description(tmp_path / "nowhere.urdf")
    with pytest.raises(DescriptionError, match="is a folder; give the URDF file in it"):
        load_description(tmp_path)


def test_a_loop_of_mimics_moves_freely():
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<mimic joint="j{(i + 1) % 3}"/></joint>'
        for i in range(3)
    )
    links = "".join(f'<link name="l{i}"/>' for i in range(4))
    robot = load_description(f'<robot name="r">{links}{joints}</robot>')
    assert [joint.mimic for joint in robot.joints] == [None, None, None]
    assert len(robot.notes) == 3


def test_an_unexpanded_colour_of_a_visual_shape_is_omitted_with_a_note() -> None:
    """Vendors ship expanded files in which macros for colours are left; other programs ignore them."""
    text = (
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="a"><visual><geometry>'
        '<box size="1 1 1"/></geometry><xacro:grey/></visual>{more}</link></robot>'
    )
    described = load_description(text.format(more=""))
    assert len(described.links[0].visuals) == 1
    assert any("xacro" in note and "1 visual shapes" in note for note in described.notes)
    with pytest.raises(DescriptionError, match="is xacro"):
        load_description(text.format(more="<visual><xacro:box/></visual>"))
    with pytest.raises(DescriptionError, match="is xacro"):
        load_description(text.format(more='<visual><geometry/><xacro:box size="2"/></visual>'))

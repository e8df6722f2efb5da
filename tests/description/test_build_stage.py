"""The build stage: every element and attribute of URDF becomes its value in the model, or a located error.

Defaults are those of the specification (wiki.ros.org/urdf/XML).
"""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from roboyard.description import load_description
from roboyard.description.model import (
    Box,
    Capsule,
    Contact,
    Cylinder,
    Geometry,
    Inertial,
    Joint,
    Limit,
    Link,
    Mimic,
    Plane,
    Pose,
    RobotDescription,
    Sphere,
)
from roboyard.errors import DescriptionError


def one_link(inside: str) -> RobotDescription:
    return load_description(f'<robot name="r">\n<link name="a">\n{inside}\n</link></robot>')


def one_joint(inside: str, kind: str = "revolute") -> Joint:
    return load_description(
        '<robot name="r"><link name="a"/><link name="b"/><joint name="lead" type="floating">'
        f'<parent link="b"/><child link="c"/></joint><link name="c"/><joint name="j" type="{kind}">'
        f'<parent link="a"/><child link="b"/>{inside}</joint></robot>'
    ).joint_by_name["j"]


def problems_of(text: str) -> tuple[str, ...]:
    with pytest.raises(DescriptionError) as caught:
        load_description(text)
    return tuple(caught.value.problems)


def test_a_bare_link_has_nothing() -> None:
    link = one_link("").links[0]
    assert (link.inertial, link.visuals, link.collisions, link.contact) == (None, (), (), None)
    assert (link.extra, link.attributes) == ((), ())


def test_a_bare_joint_has_the_defaults_of_the_specification() -> None:
    joint = one_joint("")
    assert joint.origin == Pose()
    assert joint.axis == (1, 0, 0)
    assert (joint.limit, joint.mimic, joint.damping, joint.friction) == (None, None, 0, 0)


def test_a_mimic_has_multiplier_one_and_offset_zero_by_default() -> None:
    assert one_joint('<mimic joint="lead"/>').mimic == Mimic(joint="lead", multiplier=1, offset=0)


@pytest.mark.parametrize(
    ("inside", "field", "value"),
    [
        ('<axis xyz="0 -1 0"/>', "axis", (0, -1, 0)),
        ('<origin xyz="1 2 3"/>', "origin", Pose(position=(1, 2, 3))),
        ('<limit lower="-1"/>', "limit", Limit(lower=-1)),
        ('<limit upper="2"/>', "limit", Limit(upper=2)),
        ('<limit effort="3"/>', "limit", Limit(effort=3)),
        ('<limit velocity="4"/>', "limit", Limit(velocity=4)),
        ('<limit lower="0" effort="0"/>', "limit", Limit(lower=0, effort=0)),
        ("<limit/>", "limit", Limit()),
        ('<dynamics damping="0.7"/>', "damping", 0.7),
        ('<dynamics friction="0.3"/>', "friction", 0.3),
        ('<mimic joint="lead" multiplier="-2"/>', "mimic", Mimic(joint="lead", multiplier=-2)),
        ('<mimic joint="lead" offset="0.5"/>', "mimic", Mimic(joint="lead", offset=0.5)),
    ],
)
def test_each_attribute_of_a_joint_is_its_field(inside: str, field: str, value: object) -> None:
    joint = one_joint(inside)
    assert getattr(joint, field) == value
    bare = one_joint("")
    for other in ("axis", "origin", "limit", "damping", "friction", "mimic"):
        if other != field:
            assert getattr(joint, other) == getattr(bare, other)


@pytest.mark.parametrize(
    "kind", ["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical"]
)
def test_each_joint_type_is_read_in_any_case(kind: str) -> None:
    assert one_joint("", kind).type == kind
    assert one_joint("", f" {kind.upper()} ").type == kind


@pytest.mark.parametrize("kind", ["fixed", "floating", "spherical"])
def test_the_axis_of_a_joint_without_one_is_kept_as_xml(kind: str) -> None:
    joint = one_joint('<axis xyz="0 0 7"/>', kind)
    assert joint.axis == (1, 0, 0)
    assert [(element.tag, element.get("xyz")) for element in joint.extra] == [("axis", "0 0 7")]


@pytest.mark.parametrize(
    ("text", "geometry"),
    [
        ('<box size="1 2 3"/>', Box(size=(1, 2, 3))),
        ('<sphere radius="0.5"/>', Sphere(radius=0.5)),
        ('<cylinder radius="0.5" length="2"/>', Cylinder(radius=0.5, length=2)),
        ('<cylinder length="2" radius="0.5"/>', Cylinder(radius=0.5, length=2)),
        ('<capsule radius="0.5" length="2"/>', Capsule(radius=0.5, length=2)),
        ('<plane normal="0 1 0"/>', Plane(normal=(0, 1, 0))),
        ("<plane/>", Plane(normal=(0, 0, 1))),
        ('<box size="0 0 0"/>', Box(size=(0, 0, 0))),
    ],
)
@pytest.mark.parametrize("kind", ["visual", "collision"])
def test_each_shape_is_its_geometry(text: str, geometry: Geometry, kind: str) -> None:
    link = one_link(f'<{kind} name="n"><origin xyz="1 0 0"/><geometry>{text}</geometry></{kind}>').links[0]
    (shape,) = link.visuals if kind == "visual" else link.collisions
    assert shape.geometry == geometry
    assert shape.name == "n"
    assert shape.origin == Pose(position=(1, 0, 0))
    assert shape.source.line == 3


@pytest.mark.parametrize(
    ("text", "concave"), [("yes", True), ("TRUE", True), ("1", True), ("no", False), ("", False)]
)
def test_concave_collisions_are_those_that_say_so(text: str, concave: bool) -> None:
    link = one_link(
        f'<collision concave="{text}"><geometry><sphere radius="1"/></geometry></collision>'
    ).links[0]
    assert link.collisions[0].concave is concave


CONTACT = ("lateral_friction", "rolling_friction", "spinning_friction", "restitution", "stiffness", "damping")


@pytest.mark.parametrize("tag", [*CONTACT, "inertia_scaling"])
def test_each_contact_parameter_is_its_field_and_the_others_are_not_given(tag: str) -> None:
    contact = one_link(f'<contact><{tag} value="0.25"/></contact>').links[0].contact
    assert contact == Contact(**{tag: 0.25})


def test_the_first_of_several_children_counts_and_the_rest_is_kept() -> None:
    joint = one_joint('<limit effort="1"/><limit effort="2"/><axis xyz="0 1 0"/><axis xyz="0 0 1"/>')
    assert joint.limit == Limit(effort=1)
    assert joint.axis == (0, 1, 0)
    assert [(element.tag, dict(element.attrib)) for element in joint.extra] == [
        ("limit", {"effort": "2"}),
        ("axis", {"xyz": "0 0 1"}),
    ]


def test_shapes_keep_their_order_among_shapes_that_are_ignored() -> None:
    link = one_link(
        '<visual name="1"><geometry><sphere radius="1"/></geometry></visual><visual name="2"/>'
        '<collision name="3"><geometry/></collision>'
        '<visual name="4"><geometry><sphere radius="4"/></geometry></visual>'
    ).links[0]
    assert [(visual.name, visual.geometry) for visual in link.visuals] == [
        ("1", Sphere(radius=1)),
        ("4", Sphere(radius=4)),
    ]
    assert [element.get("name") for element in link.extra] == ["2", "3"]


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        ("<box/>", "<box> has no size; add it (m)"),
        ('<box size="1 2"/>', "holds 2 of 3 numbers; give 3 numbers"),
        ("<sphere/>", "<sphere> has no radius; add it (m)"),
        ('<cylinder radius="1"/>', "<cylinder> has no length; add it (m)"),
        ('<capsule length="1"/>', "<capsule> has no radius; add it (m)"),
        ('<capsule radius="1" length="-2"/>', "<capsule> has a negative size (-2)"),
        ('<box size="1 -1 1"/>', "<box> has a negative size (1 -1 1)"),
        ('<plane normal="0 0 0"/>', "<plane> has a normal of zero length; give a direction"),
        ('<mesh filename=" "/>', "<mesh> names no file"),
        ("<heightmap/>", "unknown geometry <heightmap>; give one of box, sphere, cylinder, "),
    ],
)
def test_a_wrong_shape_is_one_error_with_its_line_and_link(inside: str, message: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        one_link(f"<collision><geometry>\n{inside}</geometry></collision>")
    (problem,) = caught.value.problems
    assert message in problem
    assert caught.value.element == 'link "a"'
    assert caught.value.line == (3 if "heightmap" in inside else 4)


def test_errors_come_in_file_order_and_a_hundred_of_them_at_most() -> None:
    text = "".join(f'<link name="l{i}"><inertial/></link>\n' for i in range(150))
    problems = problems_of(f'<robot name="r">\n{text}</robot>')
    assert len(problems) == 101
    assert all(f'link "l{i}"' in problem for i, problem in enumerate(problems[:100]))
    assert problems[100].endswith("51 more problems")  # the last one counts the roots


def test_a_number_that_no_part_uses_is_no_error() -> None:
    """The origin of a shape without geometry, the axis of a fixed joint."""
    robot = one_link('<visual><origin xyz="bad"/></visual>')
    assert robot.links[0].visuals == ()
    assert one_joint('<axis xyz="bad"/>', "fixed").type == "fixed"
    assert problems_of(
        '<robot name="r"><link name="a"><visual><origin xyz="bad"/><geometry><sphere radius="1"/></geometry>'
        "</visual></link></robot>"
    )


def test_colours_of_three_numbers_are_opaque_and_of_two_are_errors() -> None:
    visual = (
        '<visual><geometry><sphere radius="1"/></geometry><material><color rgba="{}"/></material></visual>'
    )
    material = one_link(visual.format("0.1 0.2 0.3")).links[0].visuals[0].material
    assert material is not None
    assert material.rgba == (0.1, 0.2, 0.3, 1)
    with pytest.raises(DescriptionError, match="holds 2 of 4 numbers"):
        one_link(visual.format("0.1 0.2"))


def test_a_material_of_the_robot_precedes_one_of_a_visual_with_the_same_name() -> None:
    shape = '<geometry><sphere radius="1"/></geometry>'
    robot = load_description(
        f'<robot name="r"><link name="a"><visual>{shape}<material name="m"/></visual>'
        f'<visual>{shape}<material name="m"><color rgba="1 0 0 1"/></material></visual></link>'
        '<material name="m"><color rgba="0 0 1 1"/></material></robot>'
    )
    by_name, own = (visual.material for visual in robot.links[0].visuals)
    assert by_name is not None
    assert own is not None
    assert by_name.rgba == (0, 0, 1, 1)
    assert own.rgba == (1, 0, 0, 1)


def test_the_inertia_matrix_is_symmetric_with_the_six_numbers_in_place() -> None:
    link = one_link(
        '<inertial><mass value="2"/><inertia ixx="1" ixy="2" ixz="3" iyy="4" iyz="5" izz="6"/></inertial>'
    ).links[0]
    assert isinstance(link.inertial, Inertial)
    np.testing.assert_array_equal(link.inertial.matrix(), [[1, 2, 3], [2, 4, 5], [3, 5, 6]])


@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 1, 0), (-3, 4, 12), (1e-6, 0, 0), (0, 1e200, 1e200)])
def test_axes_of_any_length_are_scaled_to_unit_length(axis: tuple[float, float, float]) -> None:
    read = one_joint('<axis xyz="{} {} {}"/>'.format(*axis)).axis
    expected = np.array(axis) / np.max(np.abs(axis))
    np.testing.assert_allclose(read, expected / np.linalg.norm(expected), atol=1e-15)


def test_the_matrix_of_a_pose_turns_then_moves() -> None:
    pose = one_joint('<origin xyz="1 2 3" rpy="0.1 -0.2 0.3"/>').origin
    point = np.array([0.4, 0.5, -0.6])
    expected = Rotation.from_euler("xyz", [0.1, -0.2, 0.3]).apply(point) + np.array([1, 2, 3])
    np.testing.assert_allclose((pose.matrix() @ [*point, 1])[:3], expected, atol=1e-15)


@pytest.mark.parametrize(
    ("kind", "limit", "expected"),
    [
        ("revolute", Limit(lower=-1, upper=2), (-1, 2)),
        ("prismatic", Limit(upper=2), (0, 2)),
        ("revolute", Limit(lower=-2), (-2, 0)),
        ("revolute", Limit(lower=2), None),
        ("revolute", Limit(lower=1, upper=1), (1, 1)),
        ("revolute", Limit(lower=2, upper=1), None),
        ("revolute", Limit(effort=1), None),
        ("revolute", None, None),
        ("continuous", Limit(lower=-1, upper=1), None),
        ("planar", Limit(lower=-1, upper=1), None),
    ],
)
def test_position_limits_are_those_of_joints_with_a_range(
    kind: str, limit: Limit | None, expected: tuple[float, float] | None
) -> None:
    joint = Joint(name="j", type=kind, parent="a", child="b", limit=limit)  # type: ignore[arg-type]
    assert joint.position_limits() == expected


def test_depth_first_order_matches_a_plain_recursion_over_random_trees() -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        count = int(rng.integers(2, 30))
        joints = [
            Joint(name=f"j{i}", type="fixed", parent=f"l{rng.integers(i)}", child=f"l{i}")
            for i in range(1, count)
        ]
        rng.shuffle(joints)  # type: ignore[arg-type]
        robot = RobotDescription(
            name="r", links=tuple(Link(name=f"l{i}") for i in range(count)), joints=tuple(joints)
        )

        def below(name: str, joints: list[Joint] = joints) -> list[str]:
            own = [joint for joint in joints if joint.parent == name]
            return list(itertools.chain.from_iterable([joint.name, *below(joint.child)] for joint in own))

        assert [joint.name for joint in robot.depth_first_joints] == below("l0")
        assert robot.root.name == "l0"
        assert set(robot.parent_joint) == {f"l{i}" for i in range(1, count)}

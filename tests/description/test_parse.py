"""The parse stage: elements with their lines, faults of numbers, and no exception for any content."""

import itertools
import random
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from roboyard.description.files.resolver import Resolver
from roboyard.description.urdf.parse import UrdfElements, parse_urdf
from roboyard.description.urdf.xml import read_xml
from roboyard.errors import DescriptionError

ARM = Path(__file__).parents[1] / "data" / "urdf" / "arm.urdf"


def parsed(text: str) -> UrdfElements:
    root, notes = read_xml(text)
    return UrdfElements(file=None, root=root, resolver=Resolver(environment={}), xml_notes=notes)


def joints(*rows: str, links: str = "") -> UrdfElements:
    """A chain a -> b -> c ... with one joint for each row, which is (attributes, children)."""
    names = "abcdefghijkl"[: len(rows) + 1]
    text = "".join(f'<link name="{name}"/>' for name in names)
    for (parent, child), row in zip(itertools.pairwise(names), rows, strict=True):
        attributes, _, inside = row.partition("|")
        text += f'<joint {attributes}><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'
    return parsed(f'<robot name="r">{text}{links}</robot>')


def test_lines_are_those_of_the_start_tags() -> None:
    text = '<robot name="r">\n\n<link name="a"\n/>\n<link\n name="b">\n<visual>\n</visual>\n</link>\n</robot>'
    elements = parsed(text)
    assert [link.line for link in elements.links] == [3, 5]
    assert [shape.line for shape in elements.shapes] == [7]


def test_lines_count_through_comments_multi_line_text_and_windows_line_ends() -> None:
    text = '<robot>\r\n<!-- one\r\ntwo -->\r\n<![CDATA[\r\n]]><link name="a"/>\r\n<link name="b"/></robot>'
    assert [link.line for link in parsed(text).links] == [5, 6]


def test_the_first_of_several_equal_names_is_found_by_name() -> None:
    elements = parsed('<robot><link name="a"/>\n<link name="a"/>\n<link name=""/></robot>')
    assert len(elements.links) == 3
    assert elements.link_by_name == {"a": elements.links[0]}


def test_a_robot_name_is_stripped_and_may_be_missing() -> None:
    assert parsed('<robot name="  two words "/>').name == "two words"
    assert parsed("<robot/>").name == ""


def test_a_file_that_cannot_be_read_has_a_refusal_and_no_elements(tmp_path: Path) -> None:
    gone = parse_urdf(tmp_path / "gone.urdf")
    assert isinstance(gone.refusal, DescriptionError)
    assert gone.refusal.file == tmp_path / "gone.urdf"
    assert (gone.links, gone.joints, gone.number_faults) == ((), (), ())
    assert parse_urdf(tmp_path).refusal is not None
    assert parse_urdf(ARM).refusal is None


CONTENTS = {
    "nothing": b"",
    "zeros": bytes(64),
    "blanks": b" \n\t\n",
    "only a declaration": b'<?xml version="1.0"?>',
    "an unknown encoding": b'<?xml version="1.0" encoding="klingon"?><robot name="r"/>',
    "utf-16 without its mark": "<robot name='r'/>".encode("utf-16-le"),
    "half a character": '<robot name="é"'.encode()[:-2],
    "surrogates": b'<robot name="\xed\xa0\x80"><link name="a"/></robot>',
    "a bare entity": b"<robot>&</robot>",
    "an undefined entity": b"<robot>&lol;</robot>",
    "a character out of range": b'<robot name="&#0;"/>',
    "nested 200 deep": b"<a>" * 200 + b"</a>" * 200,
    "an entity bomb": b'<!DOCTYPE r [<!ENTITY a "aaaa">]><robot>&a;</robot>',
    "two roots": b"<robot/><robot/>",
    "an attribute twice": b'<robot name="a" name="b"/>',
    "an endless tag": b"<robot " + b"x" * 10_000,
    "a binary stl": b"solid" + bytes(range(256)) * 8,
}


@pytest.mark.parametrize("content", CONTENTS.values(), ids=CONTENTS)
def test_odd_contents_end_in_a_refusal_or_in_elements(content: bytes, tmp_path: Path) -> None:
    file = tmp_path / "odd.urdf"
    file.write_bytes(content)
    elements = parse_urdf(file)
    if elements.refusal is None:
        assert elements.root.tag in ("robot", "solid")
    else:
        assert str(elements.refusal).startswith("odd.urdf:")
    assert isinstance(elements.links, tuple)
    assert isinstance(elements.number_faults, tuple)


def test_no_change_of_bytes_raises_in_the_parser(tmp_path: Path) -> None:
    original = ARM.read_bytes()
    rng = random.Random(11)
    file = tmp_path / "changed.urdf"
    readable = 0
    for _ in range(300):
        data = bytearray(original)
        for _ in range(rng.randint(1, 6)):
            place = rng.randrange(len(data))
            action = rng.randrange(3)
            if action == 0:
                data[place] = rng.randrange(256)
            elif action == 1:
                del data[place : place + rng.randrange(1, 40)]
            else:
                data[place:place] = rng.choice(
                    [b"<", b">", b'"', b"&", b"]]>", b"<!--", b"\0", b"1e999", b"/>"]
                )
        file.write_bytes(data)
        elements = parse_urdf(file)
        assert len(elements.joints) <= 60
        list(elements.mesh_shapes), elements.tree, elements.mimic_rings, elements.reach
        readable += elements.refusal is None
    assert 20 < readable < 300


NUMBERS = [
    ("1.5", 1.5, None),
    ("+1.5", 1.5, None),
    ("-.5", -0.5, None),
    ("5.", 5.0, None),
    ("1e3", 1000.0, None),
    ("1E-3", 0.001, None),
    ("  7\n", 7.0, None),
    ("-0", 0.0, None),
    ("1.5,", 1.5, "sloppy"),
    ("1.5;", 1.5, "sloppy"),
    ("1 2", 1.0, "sloppy"),
    ("", None, "sloppy"),
    ("   ", None, "sloppy"),
    ("1,5", None, "wrong"),
    ("0x10", None, "wrong"),
    ("1d5", None, "wrong"),
    ("10mm", None, "wrong"),
    ("--1", None, "wrong"),
    ("1_000", None, "wrong"),
    ("٣", None, "wrong"),
    ("nan", None, "not finite"),
    ("-Infinity", None, "not finite"),
    ("1e999", None, "not finite"),
    ("2e9", None, "huge"),
    ("${2*pi}", None, "xacro"),
    ("$(arg x)", None, "xacro"),
    ("$(optenv HUSKY_X 0.25)", 0.25, "sloppy"),
]


@pytest.mark.parametrize(("text", "value", "kind"), NUMBERS)
def test_numbers_are_read_where_the_meaning_is_plain(
    text: str, value: float | None, kind: str | None
) -> None:
    elements = joints(f'name="j" type="revolute"|\n<dynamics damping="{text}"/>')
    assert elements.joints[0].damping == value
    faults = elements.number_faults
    assert [fault.kind for fault in faults] == ([] if kind is None else [kind])
    for fault in faults:
        assert (fault.key, fault.at.who, fault.at.line) == ("damping", 'joint "j"', 2)
        assert fault.at.link_names == ("b",)
        assert fault.is_error == (kind != "sloppy")
        assert bool(fault.remedy) == fault.is_error


@pytest.mark.parametrize(
    ("text", "value", "kind"),
    [
        ("1 2 3", (1, 2, 3), None),
        ("1\t2\n3", (1, 2, 3), None),
        ("1,2,3", (1, 2, 3), "sloppy"),
        ("1 2 3 4", (1, 2, 3), "sloppy"),
        ("1 2", (0, 0, 0), "wrong"),
        ("1,2,3,4", (0, 0, 0), "wrong"),
        ("0,1 0,2 0,3", (0, 0, 0), "wrong"),
        ("1 2 x", (0, 0, 0), "wrong"),
        ("1 2 inf", (0, 0, 0), "not finite"),
        ("", (0, 0, 0), "sloppy"),
    ],
)
def test_vectors_are_read_whole_or_not_at_all(text: str, value: tuple[float, ...], kind: str | None) -> None:
    elements = joints(f'name="j" type="fixed"|<origin xyz="{text}"/>')
    assert elements.joints[0].pose.position == value
    assert [fault.kind for fault in elements.number_faults] == ([] if kind is None else [kind])


@pytest.mark.parametrize("tag", ["lower", "upper", "effort", "velocity"])
def test_limits_of_any_size_are_read_and_lengths_beyond_a_robot_are_not(tag: str) -> None:
    elements = joints(f'name="j" type="revolute"|<origin xyz="0 0 1.1e9"/><limit {tag}="1e30"/>')
    assert getattr(elements.joints[0], tag) == 1e30
    assert [(fault.kind, fault.key) for fault in elements.number_faults] == [("huge", "xyz")]


def test_words_among_numbers_read_as_zero_on_request_like_strtod() -> None:
    root, _ = read_xml(
        '<robot><link name="a"><inertial><mass value="${m}"/><origin xyz="1mm two 3,"/></inertial>'
        "</link></robot>"
    )
    elements = UrdfElements(file=None, root=root, resolver=Resolver(environment={}), words_are_zero=True)
    inertial = elements.links[0].inertial
    assert inertial is not None
    assert inertial.mass == 0.0
    assert inertial.pose.position == (1.0, 0.0, 3.0)
    assert elements.number_faults == ()


def test_an_origin_by_angles_turns_about_fixed_axes_roll_first() -> None:
    pose = joints('name="j" type="fixed"|<origin rpy="0.3 -0.4 2.5" xyz="1 2 3"/>').joints[0].pose
    expected = Rotation.from_euler("xyz", [0.3, -0.4, 2.5]).as_matrix()
    np.testing.assert_allclose(pose.matrix()[:3, :3], expected, atol=1e-14)
    assert pose.rpy == (0.3, -0.4, 2.5)


def test_a_quaternion_of_zero_length_is_recorded_and_of_other_lengths_scaled() -> None:
    elements = joints(
        'name="i" type="fixed"|<origin quat_xyzw="0 0 0 0"/>',
        'name="j" type="fixed"|<origin quat_xyzw="3e200 0 0 4e200"/>',
        'name="k" type="fixed"|<origin quat_xyzw="0.6 0 0 0.8" rpy="1 1 1"/>',
    )
    zero, huge, unit = (joint.pose.quaternion for joint in elements.joints)
    assert zero == (0, 0, 0, 1)
    assert huge == pytest.approx((0.6, 0, 0, 0.8), abs=1e-15)
    assert unit == pytest.approx((0.6, 0, 0, 0.8), abs=1e-15)
    assert [fault.kind for fault in elements.number_faults] == ["wrong", "sloppy"]


@pytest.mark.parametrize(
    ("geometry", "sizes", "bounds"),
    [
        ('<box size="1 2 3"/>', (1, 2, 3), (0.5, 1, 1.5)),
        ('<sphere radius="2"/>', (2,), (2, 2, 2)),
        ('<cylinder radius="1" length="4"/>', (1, 4), (1, 1, 2)),
        ('<capsule radius="1" length="4"/>', (1, 4), (1, 1, 3)),
        ('<plane normal="0 1 0"/>', (), None),
        ('<box size="1 2"/>', (None, None, None), None),
        ('<cylinder radius="1"/>', (1, None), None),
        ('<cone radius="1"/>', (), None),
    ],
)
def test_shapes_know_their_bounds_in_closed_form(
    geometry: str, sizes: tuple[float, ...], bounds: tuple[float, ...] | None
) -> None:
    elements = parsed(
        f'<robot><link name="a"><visual><geometry>{geometry}</geometry></visual></link></robot>'
    )
    shape = next(elements.shapes)
    assert shape.sizes == sizes
    if bounds is None:
        assert shape.bounds is None
    else:
        np.testing.assert_allclose(shape.bounds, [np.negative(bounds), bounds])


def test_bounds_of_a_link_enclose_its_turned_and_moved_shapes() -> None:
    """A box of 2 x 4 x 6 m turned by 90° about z covers 4 x 2 x 6 m."""
    elements = parsed(
        '<robot><link name="a"><visual><origin xyz="10 0 0" rpy="0 0 1.5707963267948966"/>'
        '<geometry><box size="2 4 6"/></geometry></visual>'
        '<collision><geometry><sphere radius="0.5"/></geometry></collision></link></robot>'
    )
    np.testing.assert_allclose(elements.links[0].bounds, [[-0.5, -1, -3], [12, 1, 3]], atol=1e-12)


def test_the_first_known_geometry_counts_among_several_children() -> None:
    elements = parsed(
        '<robot><link name="a"><visual><geometry><note/><sphere radius="1"/><box size="1 1 1"/></geometry>'
        "</visual></link></robot>"
    )
    shape = next(elements.shapes)
    assert shape.geometry is not None
    assert shape.geometry.tag == "sphere"


@pytest.mark.parametrize(
    ("kind", "limit", "expected"),
    [
        ("revolute", 'lower="0.5" upper="1"', 0.5),
        ("revolute", 'lower="-2" upper="-1"', -1.0),
        ("revolute", 'lower="-1" upper="1"', 0.0),
        ("revolute", 'lower="1" upper="0.5"', 0.0),
        ("revolute", 'lower="0.5"', 0.0),
        ("continuous", 'lower="0.5" upper="1"', 0.0),
    ],
)
def test_rest_is_the_position_within_limits_nearest_to_zero(kind: str, limit: str, expected: float) -> None:
    joint = joints(f'name="j" type="{kind}"|<axis xyz="0 0 5"/><limit {limit}/>').joints[0]
    turned = Rotation.from_matrix(joint.rest[:3, :3]).as_rotvec()
    np.testing.assert_allclose(turned, (0, 0, expected), atol=1e-14)


def test_rest_of_a_slider_is_moved_along_its_axis_in_the_joint_frame() -> None:
    row = 'name="j" type="prismatic"|<origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/><axis xyz="2 0 0"/>'
    joint = joints(row + '<limit lower="0.3" upper="0.4"/>').joints[0]
    np.testing.assert_allclose(joint.rest[:3, 3], (1, 0.3, 0), atol=1e-15)


def test_reach_is_the_largest_distance_of_a_frame_from_the_root() -> None:
    elements = joints(
        'name="i" type="fixed"|<origin xyz="3 0 0"/>',
        'name="j" type="revolute"|<origin xyz="0 4 0"/>',
        'name="k" type="fixed"|<origin xyz="-3 -3.5 0"/>',
    )
    assert elements.reach == pytest.approx(5.0)


def test_rings_of_mimics_and_the_joints_that_lead_to_them() -> None:
    elements = joints(
        'name="a" type="revolute"|<mimic joint="b"/>',
        'name="b" type="revolute"|<mimic joint="c"/>',
        'name="c" type="revolute"|<mimic joint="b"/>',
        'name="d" type="revolute"|<mimic joint="d"/>',
        'name="e" type="revolute"|<mimic joint="f"/>',
        'name="f" type="revolute"',
        'name="g" type="revolute"|<mimic joint="gone"/>',
    )
    assert elements.mimic_rings == (("b", "c"), ("d",))
    assert elements.mimic_ring_entries == {"a": "b", "b": "b", "c": "c", "d": "d"}


def test_massless_bodies_are_those_that_move_without_any_mass() -> None:
    mass = '<inertial><mass value="1"/></inertial>'
    text = (
        f'<link name="root"/><link name="heavy">{mass}</link><link name="light"/><link name="tip"/>'
        f'<link name="tool">{mass}</link>'
    )
    rows = [
        ("1", "revolute", "root", "heavy"),
        ("2", "revolute", "heavy", "light"),
        ("3", "fixed", "light", "tip"),
        ("4", "revolute", "tip", "tool"),
    ]
    for name, kind, parent, child in rows:
        text += f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/></joint>'
    elements = parsed(f"<robot>{text}</robot>")
    assert [set(elements.tree.bodies[index]) for index in elements.massless_bodies] == [{"light", "tip"}]


def test_an_editable_copy_leaves_the_original_as_it_is() -> None:
    elements = joints('name="j" type="fixed"')
    copy = elements.editable_copy()
    copy.root.find("joint").set("type", "revolute")  # type: ignore[union-attr]
    assert copy.parsed_again().joints[0].type == "revolute"
    assert elements.parsed_again().joints[0].type == "fixed"
    assert copy.joints[0].line == elements.joints[0].line

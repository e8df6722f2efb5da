"""Which collision shapes an import gives each link, hulls inside others, merged inertia, and overlaps."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from roboyard.description import RobotDescription, load_description
from roboyard.description.model import Inertial, Mesh, Pose
from roboyard.description.robot_model import RobotModel
from roboyard.description.semantic import SemanticDescription
from roboyard.description.urdf.parse import parse_urdf
from roboyard.importer.config.schema import ImportConfig
from roboyard.importer.context import ImportContext
from roboyard.importer.import_log import ImportLog
from roboyard.importer.steps.collision import (
    hull_collision,
    make_collision_shapes,
    redundant,
    time_for_coacd,
)
from roboyard.importer.steps.merge_fixed import combined_inertial, merge_links
from roboyard.importer.verify.quality import neighbour_overlaps
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.shapes import primitives
from roboyard.shapes.load import load_mesh
from roboyard.transforms import pose_matrix, quaternion_from_axis_angle

INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
CUBE = """v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"""
SEEN = '<visual><geometry><mesh filename="seen.obj"/></geometry></visual>'
OWN = '<collision><geometry><mesh filename="own.obj"/></geometry></collision>'
SAME = '<collision><geometry><mesh filename="seen.obj" scale="2 2 2"/></geometry></collision>'
BOX = '<collision><origin xyz="1 0 0"/><geometry><box size="1 1 1"/></geometry></collision>'


@pytest.fixture
def shaped(tmp_path: Path):
    """Return a maker of a robot of one link, imported up to its collision shapes."""

    def make(body: str, **collision) -> tuple[RobotModel, ImportContext]:
        folder = tmp_path / "urdf"
        folder.mkdir(exist_ok=True)
        for name in ("seen.obj", "own.obj"):
            (folder / name).write_text(CUBE)
        file = folder / "r.urdf"
        file.write_text(f'<robot name="r"><link name="a">{INERTIAL}{body}</link></robot>')
        context = ImportContext(
            config=ImportConfig.model_validate({"urdf_path": "r.urdf", "name": "r", "collision": collision}),
            urdf=file,
            source=parse_urdf(file),
            build=tmp_path,
            log=ImportLog(),
        )
        robot = RobotModel(
            name="r", description=load_description(file), semantic=SemanticDescription(base_link="a")
        )
        return make_collision_shapes(robot, context), context

    return make


@pytest.mark.parametrize(
    ("body", "settings", "method", "why"),
    [
        (SEEN, {}, "convex", "has no collision shape"),
        (SEEN + SAME, {}, "convex", "collides as its visual mesh"),
        (SEEN + OWN, {}, "keep", "has collision shapes of its own"),
        (SEEN + SAME + BOX, {}, "keep", "has collision shapes of its own"),
        ("", {}, "keep", "has no shapes"),
        (SEEN, {"decompose_method": None}, "keep", "has no collision shape; decompose_method is null"),
        (SEEN + OWN, {"convex_links": ["a"]}, "convex", "in convex_links"),
        (SEEN + SAME, {"no_decompose_links": ["a"]}, "keep", "in no_decompose_links"),
        (SEEN + OWN, {"no_collision_links": ["a"], "convex_links": ["a"]}, "none", "in no_collision_links"),
        (SEEN, {"convex_links": ["a"], "no_decompose_links": ["a"]}, "convex", "in convex_links"),
    ],
)
def test_the_first_matching_rule_decides_the_method(body, settings, method, why, shaped) -> None:
    made, context = shaped(body, **settings)
    fact = context.log.facts["collision"]["a"]
    assert (fact["method"], fact["why"]) == (method, why)
    assert fact["shapes"] == len(made.description.links[0].collisions)


def test_a_hull_replaces_a_mesh_with_its_scale_applied(shaped) -> None:
    """The collision mesh is the visual one, twice as large: its hull is a cube of 2 m."""
    made, context = shaped(SEEN + SAME)
    (shape,) = made.description.links[0].collisions
    assert isinstance(shape.geometry, Mesh) and shape.geometry.path is not None
    assert shape.geometry.uri == "meshes/collision/a_col_0.obj"
    hull = load_mesh(shape.geometry.path)
    assert np.ptp(hull.vertices, axis=0) == pytest.approx([2, 2, 2])
    assert len(np.unique(hull.vertices.round(6), axis=0)) == 8
    (fact,) = context.log.facts["collision"]["a"]["meshes"]
    assert fact["hulls"] == 1
    assert fact["excess_volume"] == pytest.approx(0, abs=0.02)
    (solid,) = made.solids["a"]
    assert isinstance(solid.geometry, Mesh) and solid.geometry.scale == (2, 2, 2)


def test_links_without_collision_have_no_solid_form_either(shaped) -> None:
    made, _ = shaped(SEEN + OWN, no_collision_links=["a"])
    assert made.description.links[0].collisions == ()
    assert made.solids == {"a": ()}


def test_a_link_that_only_shows_a_primitive_gets_it_as_collision(shaped) -> None:
    made, _ = shaped('<visual><origin xyz="0 0 2"/><geometry><sphere radius="0.5"/></geometry></visual>')
    (shape,) = made.description.links[0].collisions
    assert shape.origin.position == (0, 0, 2)
    assert shape.geometry == made.solids["a"][0].geometry


def test_hulls_of_links_alike_but_for_a_slash_get_files_of_their_own(shaped) -> None:
    made, context = shaped(SEEN)
    origin = made.description.links[0].visuals[0]
    names = [
        hull_collision(link, 0, primitives.box(), context, origin_of=origin).name
        for link in ("b_c", "b/c", "b/c")
    ]
    assert names == ["b_c_col_0", "b_c_col_0_", "b_c_col_0__"]


def cube(size: float, centre=(0.0, 0.0, 0.0)) -> np.ndarray:
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    return corners * size / 2 + centre


def test_hulls_inside_a_kept_one_are_redundant() -> None:
    nested = [cube(0.5), cube(1.0), cube(0.5, (0.6, 0, 0)), cube(0.9), cube(0.2, (0.75, 0, 0))]
    assert redundant(nested) == {0, 3, 4}
    assert redundant([cube(1.0), cube(1.0)]) == {1}  # of two equal ones, one stays
    flat = cube(1.0) * (1, 1, 0)
    assert redundant([flat]) == set()
    assert redundant([flat, cube(1.0)]) == {0}


@pytest.mark.parametrize(("links", "seconds"), [(0, 46.0), (20, 39.0), (60, 25.0), (1000, 10.0)])
def test_coacd_gets_less_time_for_more_links_but_never_less_than_a_fifth(links: int, seconds: float) -> None:
    assert time_for_coacd(links) == pytest.approx(seconds)


def box_inertial(mass: float, size, position=(0.0, 0.0, 0.0), quaternion=(0.0, 0.0, 0.0, 1.0)) -> Inertial:
    """A solid box: m (b² + c²) / 12 about each axis."""
    a, b, c = (value**2 for value in size)
    moments = (mass * (b + c) / 12, 0.0, 0.0, mass * (a + c) / 12, 0.0, mass * (a + b) / 12)
    return Inertial(mass=mass, origin=Pose(position=position, quaternion=quaternion), inertia=moments)


def test_parts_of_a_box_have_the_inertia_of_the_box() -> None:
    """A box of 3 x 1 x 1 m cut into three cubes, each given in a frame of its own that is turned."""
    parts = []
    for k, angle in enumerate((0.0, math.pi / 2, -math.pi / 2)):
        turn = tuple(quaternion_from_axis_angle((0, 0, 1), angle).tolist())
        parts.append((box_inertial(2.0, (1, 1, 1)), pose_matrix((k - 1 + 0.5, 0.2, 0.0), turn)))
    whole = combined_inertial(parts)
    expected = box_inertial(6.0, (3, 1, 1))
    assert whole.mass == pytest.approx(6.0)
    assert whole.origin.position == pytest.approx((0.5, 0.2, 0.0))
    assert whole.matrix() == pytest.approx(expected.matrix(), abs=1e-12)


def test_parts_without_mass_keep_the_place_of_the_first() -> None:
    nothing = Inertial(mass=0.0, origin=Pose(position=(1.0, 0.0, 0.0)), inertia=(0.0,) * 6)
    whole = combined_inertial([(nothing, pose_matrix((0, 2, 0), (0, 0, 0, 1))), (nothing, np.eye(4))])
    assert whole.mass == 0
    assert whole.origin.position == pytest.approx((1, 2, 0))


def tree() -> RobotDescription:
    """a -fixed- b -hinge- c -fixed- d -fixed- e, each 1 m along x and turned a quarter about z."""
    links = "".join(f'<link name="{name}">{INERTIAL}</link>' for name in "abcde")
    joints = "".join(
        f'<joint name="{p}{c}" type="{kind}"><parent link="{p}"/><child link="{c}"/>'
        f'<origin xyz="1 0 0" rpy="0 0 {math.pi / 2}"/></joint>'
        for p, c, kind in (
            ("a", "b", "fixed"),
            ("b", "c", "continuous"),
            ("c", "d", "fixed"),
            ("d", "e", "fixed"),
        )
    )
    return load_description(f'<robot name="r">{links}{joints}</robot>')


def test_merged_links_keep_the_poses_of_those_that_remain() -> None:
    before = tree()
    merged, after, _ = merge_links(before, {}, keep={"e"})
    assert merged == {"b": "a", "d": "c"}
    assert [link.name for link in after.links] == ["a", "c", "e"]
    assert [joint.name for joint in after.joints] == ["bc", "de"]
    old, new = (forward_kinematics(one, {"bc": 0.7}) for one in (before, after))
    for name in ("a", "c", "e"):
        assert new[name] == pytest.approx(old[name]), name
    assert sum(link.inertial.mass for link in after.links if link.inertial) == pytest.approx(5)


def test_overlaps_of_neighbours_are_measured_at_rest() -> None:
    """Boxes of 0.2 m; the slide rests where they overlap by 5 cm."""
    box = '<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision>'
    links = "".join(f'<link name="{name}">{INERTIAL}{box}</link>' for name in "ab")
    slide = (
        '<joint name="j" type="prismatic"><parent link="a"/><child link="b"/><origin xyz="0 0 0.25"/>'
        '<axis xyz="0 0 1"/><limit lower="-0.2" upper="0" effort="1" velocity="1"/></joint>'
    )
    description = load_description(f'<robot name="r">{links}{slide}</robot>')

    def overlaps(rest: float) -> dict[tuple[str, str], float]:
        semantic = SemanticDescription(base_link="a", postures={"rest": {"j": rest}})
        return neighbour_overlaps(RobotModel(name="r", description=description, semantic=semantic))

    assert overlaps(-0.1) == {("a", "b"): pytest.approx(0.05, abs=1e-6)}
    assert overlaps(0.0) == {}

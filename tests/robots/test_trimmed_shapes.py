"""Driven wheels found by their shapes, and hulls trimmed above the floor: lengths and volumes by hand."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from roboyard.description import load_description
from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Link,
    Mesh,
    Pose,
    RobotDescription,
    Sphere,
)
from roboyard.robots import parse_definition
from roboyard.robots.definition.description_edits import bounding_sphere, edit_description
from roboyard.robots.stability.ground_clearance import CLEARANCE, links_below_floor, trim
from roboyard.robots.stability.wheels import as_sphere, driven_wheels, extent_along
from roboyard.shapes.mesh import TriangleMesh

MASS = "<inertial><mass value='{}'/><inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial>"
CART = """<robot name="cart">
<link name="base"><inertial><origin xyz="{com} 0 0.2"/><mass value="5"/>
<inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="0 0 {visual}"/><geometry><box size="0.4 0.2 0.1"/></geometry></visual>
<collision><origin xyz="0 0 0.1"/><geometry><box size="0.4 0.2 {hull}"/></geometry></collision></link>
<link name="left">{mass}<collision><origin rpy="{roll} 0 0"/>
<geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
<link name="right">{mass}<collision><origin rpy="{roll} 0 0"/>
<geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
<link name="caster">{mass}<collision><geometry><sphere radius="0.05"/></geometry></collision></link>
<joint name="l" type="continuous"><parent link="base"/><child link="left"/><origin xyz="0.1 0.2 0.1"/>
<axis xyz="0 1 0"/></joint>
<joint name="r" type="continuous"><parent link="base"/><child link="right"/><origin xyz="0.1 -0.2 0.1"/>
<axis xyz="0 {right_axis} 0"/></joint>
<joint name="c" type="fixed"><parent link="base"/><child link="caster"/><origin xyz="-0.2 0 0.05"/></joint>
</robot>"""


def cart(**changed) -> RobotDescription:
    values = {
        "com": 0.0,
        "visual": 0.1,
        "hull": 0.2,
        "right_axis": 1,
        "roll": np.pi / 2,
        "mass": MASS.format(0.1),
    }
    return load_description(CART.format(**{**values, **changed}))


def definition(axle: float = 0.4, radius: float = 0.1):
    return parse_definition(
        {
            "raw_controller_order": ["base"],
            "default_controllers": {},
            "two_wheel": {"wheel_radius": radius, "wheel_axle_length": axle},
            "locomotion": {
                "base_joint_names": ["l", "r"],
                "floor_touching_base_link_names": ["left", "right", "caster"],
            },
        }
    )


@pytest.mark.parametrize(
    ("geometry", "half"),
    [
        (Box(size=(0.2, 0.4, 0.6)), lambda a: np.abs(a) @ [0.1, 0.2, 0.3]),
        (Sphere(radius=0.3), lambda a: 0.3),
        (Capsule(radius=0.1, length=0.5), lambda a: 0.1 + 0.25 * abs(a[2])),
        (Cylinder(radius=0.2, length=0.6), lambda a: 0.3 * abs(a[2]) + 0.2 * np.hypot(a[0], a[1])),
    ],
)
def test_the_extent_of_a_shape_is_its_support_function(geometry, half) -> None:
    turn = Rotation.from_rotvec([0.4, -0.7, 0.2])
    place = np.array([0.1, -0.3, 0.5])
    origin = Pose(position=tuple(place), quaternion=tuple(turn.as_quat()))
    link = Link(name="x", collisions=(Collision(geometry=geometry, origin=origin),))
    for axis in ((1.0, 0.0, 0.0), (0.0, 0.6, -0.8)):
        reach = half(turn.inv().apply(axis))
        middle = float(place @ np.array(axis))
        assert extent_along(link, axis) == pytest.approx((middle - reach, middle + reach))


@pytest.mark.parametrize("right_axis", [1, -1])
def test_wheels_roll_at_the_axle_length_of_the_definition(right_axis: int) -> None:
    wheels = driven_wheels(definition(axle=0.41), cart(right_axis=right_axis))
    assert list(wheels) == ["left", "right"]
    assert [wheel.side for wheel in wheels.values()] == pytest.approx([0.205, -0.205])
    assert [wheel.centre for wheel in wheels.values()] == pytest.approx([0.005, -0.005 * right_axis])
    assert [wheel.radius for wheel in wheels.values()] == pytest.approx([0.1, 0.1])
    assert [wheel.half_width for wheel in wheels.values()] == pytest.approx([0.015, 0.015])


def test_wheels_never_roll_outside_their_shapes() -> None:
    wheels = driven_wheels(definition(axle=0.6), cart())
    assert [wheel.side for wheel in wheels.values()] == pytest.approx([0.22, -0.22])
    assert [wheel.half_width for wheel in wheels.values()] == pytest.approx([0.01, 0.01])


def test_a_robot_without_wheel_shapes_has_no_driven_wheels() -> None:
    bare = cart()
    links = tuple(Link(name=link.name, inertial=link.inertial) for link in bare.links)
    assert driven_wheels(definition(), RobotDescription(name="bare", links=links, joints=bare.joints)) == {}


@pytest.mark.parametrize("axis", [(0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (0.6, 0.0, 0.8)])
def test_the_rolling_sphere_has_its_z_axis_along_the_axle(axis: tuple[float, float, float]) -> None:
    one = driven_wheels(definition(axle=0.41), cart())["left"]
    wheel = type(one)(
        link="left", joint=type(one.joint)(name="l", type="continuous", parent="a", child="b", axis=axis),
        low=-0.02, high=0.02, centre=0.005, side=0.2, radius=0.1,
    )  # fmt: skip
    (shape,) = as_sphere(cart().link_by_name["left"], wheel, 0.09).collisions
    assert isinstance(shape.geometry, Sphere) and shape.geometry.radius == 0.09
    assert np.array(shape.origin.position) == pytest.approx(0.005 * np.array(axis))
    z = Rotation.from_quat(shape.origin.quaternion).as_matrix()[:, 2]
    assert np.abs(z) == pytest.approx(np.abs(axis), abs=1e-9)


def volume(link: Link) -> float:
    """Return the volume of the hull of a link's only collision shape, by SciPy (m^3)."""
    (shape,) = link.collisions
    assert isinstance(shape.geometry, Mesh) and shape.geometry.data is not None
    return float(ConvexHull(shape.geometry.data.vertices).volume)


def tilted_box(size, rotvec) -> Link:
    origin = Pose(quaternion=tuple(Rotation.from_rotvec(rotvec).as_quat()))
    return Link(name="x", collisions=(Collision(geometry=Box(size=size), origin=origin),))


@pytest.mark.parametrize("level", [-0.05, 0.0, 0.08])
def test_a_level_box_is_trimmed_to_the_part_above(level: float) -> None:
    cut = trim(tilted_box((0.4, 0.2, 0.2), (0, 0, 0.3)), np.eye(4), level)
    assert volume(cut) == pytest.approx(0.4 * 0.2 * (0.1 - level), rel=1e-6)


@pytest.mark.parametrize("level", [0.0, 0.05])
def test_a_box_on_its_edge_is_trimmed_to_a_triangular_prism(level: float) -> None:
    side, length = 0.2, 0.5
    cut = trim(tilted_box((length, side, side), (np.pi / 4, 0, 0)), np.eye(4), level)
    top = side / np.sqrt(2)
    assert volume(cut) == pytest.approx(length * (top - level) ** 2, rel=1e-6)


def test_a_turned_link_is_trimmed_along_the_vertical_of_the_root() -> None:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("y", 90, degrees=True).as_matrix()
    pose[2, 3] = 1.0
    cut = trim(tilted_box((0.4, 0.2, 0.6), (0, 0, 0)), pose, 0.9)
    assert volume(cut) == pytest.approx(0.2 * 0.6 * 0.3, rel=1e-6)


def test_shapes_above_the_height_stay_and_shapes_below_it_disappear() -> None:
    box = tilted_box((0.4, 0.2, 0.2), (0, 0, 0))
    assert trim(box, np.eye(4), -0.1).collisions == box.collisions
    assert trim(box, np.eye(4), 0.1 + 1e-9).collisions == ()


def test_a_hull_down_to_the_floor_is_trimmed_at_the_bottom_of_what_is_seen() -> None:
    wheels = driven_wheels(definition(), cart()).values()
    assert links_below_floor(definition(), cart(), wheels) == pytest.approx({"base": 0.05})
    assert links_below_floor(definition(), cart(visual=0.05), wheels) == pytest.approx({"base": CLEARANCE})
    assert links_below_floor(definition(), cart(hull=0.19), wheels) == {}


@pytest.mark.parametrize("com", [0.15, -0.3])
def test_a_hull_that_supports_the_robot_is_not_trimmed(com: float) -> None:
    """The centre of mass is ahead of the wheels or behind the caster."""
    given = cart(com=com)
    assert links_below_floor(definition(), given, driven_wheels(definition(), given).values()) == {}


def test_edits_of_a_cart_leave_its_visual_shapes_and_masses_unchanged() -> None:
    before = cart()
    after = edit_description(definition(), before)
    for link in before.links:
        edited = after.link_by_name[link.name]
        assert (edited.visuals, edited.inertial) == (link.visuals, link.inertial)
    assert [type(shape.geometry) for shape in after.link_by_name["left"].collisions] == [Sphere]
    assert after.link_by_name["caster"].collisions == before.link_by_name["caster"].collisions
    assert volume(after.link_by_name["base"]) == pytest.approx(0.4 * 0.2 * 0.15, rel=1e-6)


def test_disabled_links_do_not_collide_and_markers_are_hidden() -> None:
    shapes = "".join(
        f"<{kind}><geometry><sphere radius='1'/></geometry></{kind}>" for kind in ("visual", "collision")
    )
    arm = load_description(
        f"<robot name='a'><link name='base'>{shapes}</link><link name='mark'>{shapes}</link>"
        "<joint name='j' type='revolute'><parent link='base'/><child link='mark'/>"
        "<limit lower='0' upper='1' effort='1' velocity='1'/></joint></robot>"
    )
    given = parse_definition(
        {
            "raw_controller_order": ["arm_0", "gripper_0"],
            "default_controllers": {},
            "visual_only_eef_links": True,
            "disabled_collision_link_names": ["base"],
            "manipulation": {"arm_joint_names": {"0": ["j"]}, "eef_link_names": {"0": "mark"}},
        }
    )
    after = edit_description(given, arm).link_by_name
    assert (len(after["base"].visuals), len(after["base"].collisions)) == (1, 0)
    assert (len(after["mark"].visuals), len(after["mark"].collisions)) == (0, 0)


def test_the_bounding_sphere_of_a_scaled_mesh_is_around_the_centre_of_its_box() -> None:
    solid = trimesh.creation.box(extents=(1.0, 2.0, 4.0))
    solid.apply_translation((3.0, 0.0, 0.0))
    mesh = TriangleMesh(
        vertices=np.asarray(solid.vertices, np.float64), faces=np.asarray(solid.faces, np.int32)
    )
    turn = Rotation.from_euler("z", 90, degrees=True)
    origin = Pose(position=(0, 0, 1), quaternion=tuple(turn.as_quat()))
    shape = Collision(geometry=Mesh(uri="", path=None, data=mesh, scale=(0.5, 0.5, 0.5)), origin=origin)
    found = bounding_sphere(shape)
    assert isinstance(found.geometry, Sphere)
    assert found.geometry.radius == pytest.approx(0.25 * np.sqrt(1 + 4 + 16))
    assert found.origin.position == pytest.approx((0, 1.5, 1))
    plain = Collision(geometry=Box(size=(1, 1, 1)))
    assert bounding_sphere(plain) is plain

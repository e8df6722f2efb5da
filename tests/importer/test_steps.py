"""Single steps of an import on robots made by hand: frames, base, wheels, sensors, names, drives, log."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from roboyard.description import RobotDescription, load_description
from roboyard.description.model import Mesh
from roboyard.description.robot_model import Metadata, RobotModel
from roboyard.description.semantic import SemanticDescription
from roboyard.description.urdf.parse import parse_urdf
from roboyard.errors import ConfigError
from roboyard.importer.config.schema import ImportConfig
from roboyard.importer.context import ImportContext
from roboyard.importer.import_log import Decision, ImportLog, unique_warnings
from roboyard.importer.planning.rest_posture import lock_joints, rest_posture
from roboyard.importer.steps.canonical_frame import move_root_frame
from roboyard.importer.steps.drives import add_drives
from roboyard.importer.steps.holonomic_base import add_virtual_joints
from roboyard.importer.steps.metadata import measure_size, write_metadata
from roboyard.importer.steps.names import planned_names, renamed
from roboyard.importer.steps.positive_scale import mirror_meshes
from roboyard.importer.steps.semantics import add_semantics
from roboyard.importer.steps.sensors import add_sensors
from roboyard.importer.steps.sphere_wheels import mark_wheels
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.morphology.bounds import robot_bounds
from roboyard.morphology.point_model import PointModel
from roboyard.shapes.load import load_mesh

MOMENTS = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'


def link(name: str, geometry: str = "", origin: str = "", mass: float = 1.0) -> str:
    shape = f"<collision>{origin}<geometry>{geometry}</geometry></collision>" if geometry else ""
    return f'<link name="{name}"><inertial><mass value="{mass}"/>{MOMENTS}</inertial>{shape}</link>'


def joint(
    name: str,
    parent: str,
    child: str,
    kind: str = "revolute",
    xyz: str = "0 0 0",
    more: str = "",
    axis="0 0 1",
) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>{more}</joint>'
    )


def limit(lower: float, upper: float, effort: float = 10) -> str:
    return f'<limit lower="{lower}" upper="{upper}" effort="{effort}" velocity="2"/>'


TILT = '<origin xyz="0 0 0" rpy="1.5707963267948966 0 0"/>'
CART = (
    link("base", '<box size="0.4 0.3 0.2"/>', '<origin xyz="0 0 0.1"/>', mass=5)
    + link("left", '<cylinder radius="0.1" length="0.04"/>', TILT)
    + link("right", '<cylinder radius="0.1" length="0.04"/>', TILT)
    + link("arm", '<box size="0.05 0.05 0.3"/>', '<origin xyz="0 0 0.15"/>')
    + joint("left_joint", "base", "left", "continuous", "0 0.2 0", axis="0 1 0")
    + joint("right_joint", "base", "right", "continuous", "0 -0.2 0", axis="0 1 0")
    + joint("shoulder", "base", "arm", "revolute", "0.1 0 0.2", limit(0.5, 1.5), axis="0 1 0")
)


def described(parts: str) -> RobotDescription:
    return load_description(f'<robot name="r">{parts}</robot>')


def model(parts: str | RobotDescription = CART, **fields) -> RobotModel:
    description = described(parts) if isinstance(parts, str) else parts
    fields.setdefault("semantic", SemanticDescription(base_link=description.root.name))
    return RobotModel(name="r", description=description, **fields)


@pytest.fixture
def context(tmp_path: Path):
    """Return a maker of import contexts from keys of the configuration."""

    def make(**config) -> ImportContext:
        file = tmp_path / "r.urdf"
        file.write_text(f'<robot name="r">{CART}</robot>')
        return ImportContext(
            config=ImportConfig.model_validate({"urdf_path": "r.urdf", "name": "r", **config}),
            urdf=file,
            source=parse_urdf(file),
            build=tmp_path,
            log=ImportLog(),
        )

    return make


def messages(context: ImportContext, level: str) -> list[str]:
    return [d.message for d in context.log.decisions if d.level == level]


# ------------------------------------------------------------------------------------------ canonical frame


def test_the_root_frame_moves_to_the_lowest_point_and_nothing_else_does(context) -> None:
    sensors = {"link": "base", "offset": {"position": [0.2, 0, 0.05]}}
    before = add_sensors(model(), context(camera_links=[sensors]))
    after = move_root_frame(before, context())
    bounds = robot_bounds(after.description)
    assert bounds is not None
    assert bounds[0, 2] == pytest.approx(0.0, abs=1e-12)
    old, new = forward_kinematics(before.description), forward_kinematics(after.description)
    for name in ("left", "right", "arm"):
        assert new[name][:3, 3] - old[name][:3, 3] == pytest.approx([0, 0, 0.1])
        assert np.array_equal(new[name][:3, :3], old[name][:3, :3])
    centres = [PointModel(one.description) for one in (before, after)]
    moved = centres[1].centre_of_mass(centres[1].poses({})) - centres[0].centre_of_mass(centres[0].poses({}))
    assert moved == pytest.approx([0, 0, 0.1])
    assert after.sensors[0].offset.position == pytest.approx((0.2, 0.0, 0.15))


def test_the_root_frame_stays_where_the_configuration_says_so(context) -> None:
    here = context(canonical_frame=False)
    robot = model()
    assert move_root_frame(robot, here) is robot
    assert "lowest point is at z = -0.1 m" in messages(here, "note")[0]


def test_a_robot_that_stands_at_zero_already_is_unchanged(context) -> None:
    once = move_root_frame(model(), context())
    assert move_root_frame(once, context()) is once
    bare = model(link("base"))
    assert move_root_frame(bare, context()) is bare


# ------------------------------------------------------------------------------------------- holonomic base


def test_virtual_joints_move_the_vendors_root_in_the_plane(context) -> None:
    """x, y and rz of the chain give the pose that a planar base has."""
    base = {"use_holonomic_joints": True, "wheel_joints": ["left_joint", "right_joint"]}
    made = add_virtual_joints(model(), context(base_motion=base))
    x, y, turn = 1.25, -0.5, 0.7
    frames = forward_kinematics(
        made.description,
        {"base_footprint_x_joint": x, "base_footprint_y_joint": y, "base_footprint_rz_joint": turn},
    )
    expected = np.eye(4)
    expected[:2, :2] = [[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]
    expected[:2, 3] = x, y
    assert frames["base"] == pytest.approx(expected)
    assert made.description.root.name == "base_footprint_x"
    assert made.semantic.base == "holonomic"
    assert made.semantic.base_joints == tuple(f"base_footprint_{axis}_joint" for axis in ("x", "y", "rz"))


def test_wheel_joints_of_a_holonomic_base_become_fixed_and_so_do_their_followers(context) -> None:
    odometer = link("disc") + joint(
        "disc_joint", "base", "disc", "continuous", more='<mimic joint="left_joint"/>'
    )
    base = {"use_holonomic_joints": True, "wheel_joints": ["left_joint"]}
    here = context(base_motion=base)
    joints = add_virtual_joints(model(CART + odometer), here).description.joint_by_name
    types = {name: joints[name].type for name in ("left_joint", "right_joint", "disc_joint", "shoulder")}
    assert types == {
        "left_joint": "fixed", "right_joint": "continuous", "disc_joint": "fixed", "shoulder": "revolute"
    }  # fmt: skip
    assert joints["disc_joint"].mimic is None
    assert messages(here, "warning") == ["mimics a joint that became fixed; fixed too"]


def test_without_the_setting_the_base_keeps_its_joints(context) -> None:
    robot = model()
    assert add_virtual_joints(robot, context()) is robot


# --------------------------------------------------------------------------------------------------- wheels


def test_wheels_are_detected_where_the_configuration_names_none(context) -> None:
    here = context()
    assert mark_wheels(model(), here).semantic.wheel_links == ("left", "right")
    assert any("left, right" in message for message in messages(here, "note"))


def test_configured_wheels_override_detected_ones(context) -> None:
    here = context(base_motion={"wheel_links": ["arm"]})
    assert mark_wheels(model(), here).semantic.wheel_links == ("arm",)


def test_no_wheels_are_detected_on_a_holonomic_base(context) -> None:
    assert (
        mark_wheels(model(), context(base_motion={"use_holonomic_joints": True})).semantic.wheel_links == ()
    )


def test_sphere_wheels_of_two_shapes_become_one_hull_around_both(context) -> None:
    second = '</collision><collision><origin xyz="0 0.1 0"/><geometry><box size="0.1 0.02 0.1"/></geometry>'
    parts = CART.replace("</geometry></collision></link>", f"</geometry>{second}</collision></link>", 2)
    base = {"use_sphere_wheels": True, "wheel_links": ["left", "right"]}
    here = context(base_motion=base)
    before = model(parts)
    after = mark_wheels(before, here)
    assert after.approximations == {"left": "boundingSphere", "right": "boundingSphere"}
    (shape,) = after.description.link_by_name["left"].collisions
    assert isinstance(shape.geometry, Mesh) and shape.geometry.path is not None
    assert shape.geometry.path.is_relative_to(here.build)
    assert robot_bounds(after.description) == pytest.approx(robot_bounds(before.description), abs=2e-3)
    assert after.description.link_by_name["base"] == before.description.link_by_name["base"]


def test_a_sphere_wheel_without_shape_is_a_warning(context) -> None:
    parts = CART + link("bare") + joint("bare_joint", "base", "bare", "continuous")
    here = context(base_motion={"use_sphere_wheels": True, "wheel_links": ["bare"]})
    assert mark_wheels(model(parts), here).approximations == {}
    assert messages(here, "warning") == ["a wheel without collision shape cannot roll"]


# -------------------------------------------------------------------------------------------------- sensors


def test_a_sensor_below_a_parent_gets_a_link_at_the_offset(context) -> None:
    half = math.sqrt(0.5)
    entry = {
        "link": "eye",
        "parent_link": "arm",
        "offset": {"position": [0.1, 0, 0.3], "orientation": [0, 0, 1, 1]},  # a quarter turn about z
    }
    made = add_sensors(model(), context(camera_links=[entry]))
    frames = forward_kinematics(made.description, {"shoulder": 0.8})
    local = np.linalg.inv(frames["arm"]) @ frames["eye"]
    assert local[:3, 3] == pytest.approx([0.1, 0, 0.3])
    assert local[:3, :3] == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), abs=1e-12)
    (sensor,) = made.sensors
    assert (sensor.kind, sensor.link, sensor.name) == ("camera", "eye", "Camera")
    assert sensor.offset.position == (0, 0, 0)
    joint_made = made.description.joint_by_name["arm_eye_joint"]
    assert (joint_made.type, joint_made.origin.quaternion) == ("fixed", pytest.approx((0, 0, half, half)))
    assert made.solids["eye"] == ()


def test_later_sensors_may_use_the_link_of_an_earlier_one(context) -> None:
    marker = {"link": "tip", "parent_link": "arm", "offset": {"position": [0, 0, 0.3]}}
    lidar = {"link": "tip", "offset": {"position": [0, 0, 0.02]}}
    made = add_sensors(model(), context(eef_vis_links=[marker], lidar_links=[lidar]))
    assert [(s.kind, s.link) for s in made.sensors] == [("visual_sphere", "tip"), ("lidar", "tip")]
    assert made.sensors[1].offset.position == (0, 0, 0.02)


@pytest.mark.parametrize(
    ("entry", "text"),
    [
        ({"link": "nose"}, "there is no such link; add parent_link"),
        ({"link": "arm", "parent_link": "base"}, "the link must not"),
        ({"link": "eye", "parent_link": "nose"}, "the parent must exist"),
    ],
)
def test_a_sensor_that_fits_no_link_is_refused(entry, text, context) -> None:
    with pytest.raises(ConfigError, match=text):
        add_sensors(model(), context(camera_links=[entry]))


# ---------------------------------------------------------------------------------------------------- names


def test_names_that_tools_refuse_are_replaced_everywhere_and_stay_distinct() -> None:
    parts = (
        link("base link") + link("base_link") + link("arm (left)") + link("ok-1.2")
        + joint("joint a", "base link", "base_link", more=limit(-1, 1))
        + joint("joint_a", "base_link", "arm (left)", more=limit(-1, 1) + '<mimic joint="joint a"/>')
        + joint("ok/ns", "arm (left)", "ok-1.2", "fixed")
    )  # fmt: skip
    description = described(parts)
    renames = planned_names(description)
    made = renamed(description, renames)
    names = [one.name for one in made.links]
    assert len(set(names)) == 4
    assert {"base_link", "ok-1.2"} <= set(names)
    assert not [name for name in names if set(name) & set(" ()")]
    follower = made.joint_by_name["joint_a"]
    assert follower.mimic is not None
    assert follower.mimic.joint == renames.joints["joint a"] != "joint a"
    # the tree is the same, name by name
    for old, new in zip(description.joints, made.joints, strict=True):
        assert new.parent == renames.links.get(old.parent, old.parent)
        assert new.child == renames.links.get(old.child, old.child)
    assert made.root.name == renames.links["base link"]


def test_acceptable_names_are_kept() -> None:
    description = described(CART)
    assert renamed(description, planned_names(description)) is description


# --------------------------------------------------------------------------------------- drives, size, rest


def test_joints_with_limits_get_position_drives_and_wheels_velocity_drives(context) -> None:
    finger = link("f") + joint(
        "f_joint", "arm", "f", "prismatic", more=limit(0, 0.1) + '<mimic joint="shoulder"/>'
    )
    made = add_drives(model(CART + finger), context())
    assert made.drives == {
        "left_joint": "velocity", "right_joint": "velocity", "shoulder": "position", "f_joint": "none"
    }  # fmt: skip


def test_only_driven_virtual_joints_get_a_drive(context) -> None:
    here = context(base_motion={"use_holonomic_joints": True})
    made = add_drives(add_virtual_joints(model(), here), here)
    virtual = {name: kind for name, kind in made.drives.items() if name.startswith("base_footprint_")}
    assert {name for name, kind in virtual.items() if kind == "velocity"} == set(made.semantic.base_joints)
    assert set(virtual.values()) == {"velocity", "none"}


def test_a_joint_that_means_an_effort_of_zero_moves_freely(context) -> None:
    swing = "".join(
        link(f"l{k}") + joint(f"j{k}", "base", f"l{k}", more=limit(-1, 1, 0 if k == 3 else 5))
        for k in range(4)
    )
    here = context()
    made = add_drives(model(link("base") + swing), here)
    assert (made.drives["j3"], made.drives["j0"]) == ("none", "position")
    assert "moves freely" in messages(here, "warning")[0]


def test_efforts_unknown_throughout_are_estimated_with_a_warning(context) -> None:
    parts = link("base") + link("a") + joint("j", "base", "a", more=limit(-1, 1, 0))
    here = context()
    made = add_drives(model(parts), here)
    assert made.drives == {"j": "position"}
    found = made.description.joint_by_name["j"].limit
    assert found is not None and found.effort > 0
    assert "effort limits of 0 on j" in messages(here, "warning")[0]


def test_metadata_hold_the_box_around_the_visual_shapes(context, tmp_path: Path) -> None:
    visual = (
        '<link name="a"><visual><origin xyz="1 2 3"/><geometry><box size="0.2 0.4 0.6"/></geometry></visual>'
    )
    visual += '<collision><geometry><sphere radius="9"/></geometry></collision></link>'
    made = measure_size(model(visual), context())
    assert made.metadata.bbox_size == pytest.approx((0.2, 0.4, 0.6))
    assert made.metadata.base_link_offset == pytest.approx((1, 2, 3))
    write_metadata(made, tmp_path / "misc" / "metadata.json")
    data = json.loads((tmp_path / "misc" / "metadata.json").read_text())
    assert data["bbox_size"] == pytest.approx([0.2, 0.4, 0.6])
    assert data["base_link_offset"] == pytest.approx([1, 2, 3])


def test_collision_shapes_give_the_size_of_a_robot_without_visual_ones(context) -> None:
    made = measure_size(model(link("a", '<box size="1 2 3"/>')), context())
    assert made.metadata.bbox_size == pytest.approx((1, 2, 3))
    here = context()
    assert measure_size(model(link("a")), here).metadata == Metadata()
    assert messages(here, "warning") == ["the robot has no shape, so it has no size"]


CHAIN = (
    "".join(link(name) for name in "abcde")
    + joint("j1", "a", "b", more=limit(0.5, 1))
    + joint("j2", "b", "c", more=limit(-1, -0.25))
    + joint("j3", "c", "d", more=limit(-1, 1) + '<mimic joint="j4" multiplier="2" offset="0.1"/>')
    + joint("j4", "a", "e", more=limit(-1, 1) + '<mimic joint="j1" multiplier="-1"/>')
)


def test_the_rest_posture_is_the_limit_nearest_to_zero_and_followers_follow(context) -> None:
    rest = rest_posture(model(CHAIN), context().config)
    assert rest == pytest.approx({"j1": 0.5, "j2": -0.25, "j4": -0.5, "j3": 2 * -0.5 + 0.1})


def test_a_configured_posture_is_used_by_name_or_breadth_first(context) -> None:
    named = rest_posture(model(CHAIN), context(curobo={"default_qpos": {"j1": 0.75}}).config)
    assert (named["j1"], named["j2"], named["j4"]) == (0.75, -0.25, -0.75)
    # breadth first: j1 and j4 leave the root, then j2, then j3
    listed = rest_posture(model(CHAIN), context(curobo={"default_qpos": [0.6, 9.0, -0.5, 9.0]}).config)
    assert listed == pytest.approx({"j1": 0.6, "j2": -0.5, "j4": -0.6, "j3": -1.1})


def test_locked_joints_are_the_configured_ones_and_open_grippers(context) -> None:
    curobo = {
        "lock_joints": {"j1": None, "j2": -0.75},
        "eef_to_gripper_info": {"d": {"links": ["e"], "joints": ["j4", "j2"]}},
    }
    config = context(curobo=curobo).config
    robot = model(CHAIN)
    locked = lock_joints(robot, config, rest_posture(robot, config))
    assert locked == {"j1": 0.5, "j2": -0.75, "j4": 1.0}  # the gripper opens to its upper limit


# ------------------------------------------------------------------------------------- semantics and meshes


def test_the_configuration_overrides_detected_grippers_and_trunk(context) -> None:
    parts = link("base") + "".join(link(f"a{k}") for k in range(1, 6)) + link("f1") + link("f2")
    for k in range(1, 6):
        parts += joint(f"j{k}", f"a{k - 1}" if k > 1 else "base", f"a{k}", more=limit(-1, 1))
    parts += "".join(joint(f"g{k}", "a5", f"f{k}", more=limit(-1, 1)) for k in (1, 2))
    here = context()
    (detected,) = add_semantics(model(parts), here).semantic.end_effectors
    assert (detected.link, detected.gripper_links) == ("a5", ("f1", "f2"))
    assert any(message.startswith("arms.0: j1, j2, j3, j4, j5") for message in messages(here, "note"))
    curobo = {"eef_to_gripper_info": {"a4": {"links": ["f1"], "joints": ["g1"]}}, "torso_joints": ["j1"]}
    here = context(curobo=curobo)
    semantic = add_semantics(model(parts), here).semantic
    assert [(e.link, e.gripper_links, e.gripper_joints) for e in semantic.end_effectors] == [
        ("a4", ("f1",), ("g1",))
    ]
    assert semantic.trunk_joints == ("j1",)
    assert semantic.arms[0].joints == ("j2", "j3", "j4")
    stated = {found.field: found for found in semantic.conclusions}
    assert stated["arms.0"].value == ["j2", "j3", "j4"] and stated["arms.0"].confidence == 1.0
    assert not [message for message in messages(here, "note") if message.startswith(("arms", "trunk"))]


def test_mirrored_meshes_turn_inside_out_back_and_keep_their_volume(context, tmp_path: Path) -> None:
    """A tetrahedron in two mirrored copies: the new files face outwards, with the scale applied."""
    folder = tmp_path / "urdf"
    folder.mkdir()
    file = folder / "tetra.obj"
    file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    part = model(link("a", '<box size="1 1 1"/>') + link("b") + joint("j", "a", "b", "fixed"))
    links = list(part.description.links)
    collision = links[0].collisions[0]
    scales = ((-2.0, 1.0, 1.0), (-1.0, -1.0, 3.0), (1.0, 1.0, 1.0), (-2.0, 1.0, 1.0))
    shapes = tuple(
        replace(collision, geometry=Mesh(uri="tetra.obj", path=file, scale=scale)) for scale in scales
    )
    links[0] = replace(links[0], collisions=shapes)
    before = replace(part, description=replace(part.description, links=tuple(links)))
    after = mirror_meshes(before, context())
    made = [shape.geometry for shape in after.description.links[0].collisions]
    assert [geometry.path.name for geometry in made] == [
        "tetra_mirror_x.obj", "tetra_mirror_x_y.obj", "tetra.obj", "tetra_mirror_x.obj"
    ]  # fmt: skip
    for geometry, scale in zip(made, scales, strict=True):
        mesh = load_mesh(geometry.path)
        corners = mesh.vertices[mesh.faces]
        volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        assert volume == pytest.approx(abs(np.prod(scale)) / 6)
        assert geometry.scale == (1, 1, 1)
    assert robot_bounds(after.description) == pytest.approx(robot_bounds(before.description))


# ------------------------------------------------------------------------------------------------------ log


def test_the_log_files_decisions_under_the_step_that_made_them(tmp_path: Path) -> None:
    seen: list[tuple[str, float, str]] = []
    log = ImportLog(progress=lambda *report: seen.append(report))
    with log.step("one"):
        log.note("fine")
        log.report_progress(0.5, "half")
    with pytest.raises(ZeroDivisionError), log.step("two"):
        log.warn("odd", 'link "a"', code="mass-zero")
        _ = 1 / 0
    log.facts["ünï"] = [1]
    assert seen == [("one", 0.0, ""), ("one", 0.5, "half"), ("one", 1.0, ""), ("two", 0.0, "")]
    log.write(tmp_path / "log.json")
    data = json.loads((tmp_path / "log.json").read_text(encoding="utf-8"))
    assert [(d["step"], d["level"], d["element"]) for d in data["decisions"]] == [
        ("one", "note", ""), ("two", "warning", 'link "a"')
    ]  # fmt: skip
    assert set(data["seconds"]) == {"one", "two"}
    assert data["ünï"] == [1]


def test_a_log_with_a_number_that_json_lacks_is_refused(tmp_path: Path) -> None:
    log = ImportLog(facts={"mass": math.inf})
    with pytest.raises(ValueError, match="JSON"):
        log.write(tmp_path / "log.json")
    assert not (tmp_path / "log.json").exists()


def test_only_warnings_of_findings_are_downgraded() -> None:
    log = ImportLog()
    log.warn("from the audit", code="mesh-large")
    log.warn("from the import")
    log.downgrade_findings()
    assert [d.message for d in log.warnings] == ["from the import"]
    assert len(log.decisions) == 2


def test_warnings_of_one_kind_are_merged_with_all_their_elements() -> None:
    def warning(element: str, message: str, code: str = "") -> Decision:
        return Decision(step="s", level="warning", element=element, message=message, code=code)

    found = unique_warnings(
        [
            warning("a", "too heavy: 3", "mass"),
            warning("b", "same"),
            warning("c", "too heavy: 4", "mass"),
            warning("d", "same"),
            warning("c", "too heavy: 5", "mass"),
        ]
    )
    assert found == [("too heavy: 3 (and 2 more like this)", ["a", "c"]), ("same", ["b", "d"])]

"""The USD stage, as OpenUSD and its validators understand it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pxr", reason="OpenUSD is an optional dependency")

from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdShade, UsdValidation

from roboyard.description import Limit
from roboyard.description.robot_model import RobotModel
from roboyard.export import usd
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.transforms import matrix_from_quaternion


def open_stage(robot: RobotModel, folder: Path) -> Any:
    written = usd.write(robot, folder / "usd" / f"{robot.name}.usda")
    stage = Usd.Stage.Open(str(written.files[0]))
    assert stage
    return stage


@pytest.fixture
def stage(robot: RobotModel, tmp_path: Path) -> Any:
    return open_stage(robot, tmp_path)


LINKS = {
    "base": "base",
    "arm.1": "arm_1_2",
    "arm_1": "arm_1",
    "arm 1": "arm_1_3",
    "10": "_10",
    "tool": "tool",
    "finger_a": "finger_a",
    "finger_b": "finger_b",
    "puck": "puck",
    "weightless": "weightless",
}
JOINTS = {
    "0": "base/_0",
    "1": "arm_1_2/_1",
    "slide": "arm_1/slide",
    "spin": "arm_1_3/spin",
    "to_tool": "_10/to_tool",
    "grip": "tool/grip",
    "grip_follower": "tool/grip_follower",
    "flat": "base/flat",
    "ball": "puck/ball",
}


def link_prim(stage: Any, link: str) -> Any:
    prim = stage.GetPrimAtPath(f"/everything/{LINKS[link]}")
    assert prim, link
    return prim


def joint_prim(stage: Any, joint: str) -> Any:
    prim = stage.GetPrimAtPath(f"/everything/{JOINTS[joint]}")
    assert prim, joint
    return prim


def world(prim: Any) -> np.ndarray:
    """(4, 4) pose of a prim, column vectors."""
    return np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim)).T


def frame(prim: Any, side: int) -> np.ndarray:
    """(4, 4) of a joint's frame in its body."""
    out = np.eye(4)
    quaternion = Gf.Quatd(prim.GetAttribute(f"physics:localRot{side}").Get())
    out[:3, :3] = np.array(Gf.Matrix3d(Gf.Rotation(quaternion))).T
    out[:3, 3] = prim.GetAttribute(f"physics:localPos{side}").Get()
    return out


def errors(stage: Any) -> list[str]:
    registry = UsdValidation.ValidationRegistry()
    skipped = ("Usdz", "RootPackage")
    validators = [
        v
        for v in registry.GetOrLoadAllValidators()
        if not any(word in v.GetMetadata().name for word in skipped)
    ]
    return [
        f"{e.GetValidator().GetMetadata().name}: {e.GetMessage()}"
        for e in UsdValidation.ValidationContext(validators).Validate(stage)
    ]


def test_validators_find_nothing(stage: Any) -> None:
    assert errors(stage) == []


@pytest.mark.parametrize("name", ["r1", "husky", "arm7"])
def test_validators_find_nothing_in_bundled_robots(
    bundled: Callable[[str], RobotModel], tmp_path: Path, name: str
) -> None:
    assert errors(open_stage(bundled(name), tmp_path)) == []


def test_units_and_default_prim(stage: Any) -> None:
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert UsdPhysics.GetStageKilogramsPerUnit(stage) == 1.0
    assert stage.GetDefaultPrim().GetPath() == "/everything"


def test_metadata(stage: Any) -> None:
    root = stage.GetDefaultPrim()
    assert root.GetAttribute("ig:nativeBB").Get() == Gf.Vec3f(1, 2, 3)
    assert np.allclose(root.GetAttribute("ig:offsetBaseLink").Get(), [0, 0.1, 0.2])
    assert root.GetAttribute("ig:category").Get() == "robot"
    assert root.GetAttribute("ig:model").Get() == "everything"
    assert set(root.GetCustomDataByKey("metadata")) == {"object_parts", "orientations"} | {
        "meta_links",
        "link_tags",
    }


def test_links_are_flat_bodies_with_the_vendors_names(stage: Any) -> None:
    bodies = [p for p in stage.Traverse() if p.HasAPI(UsdPhysics.RigidBodyAPI)]
    assert {str(p.GetParent().GetPath()) for p in bodies} == {"/everything"}
    assert [p.GetName() for p in bodies] == [LINKS[n] for n in _depth_first()]
    assert link_prim(stage, "arm 1").GetDisplayName() == "arm 1"
    assert link_prim(stage, "arm.1").GetCustomDataByKey("urdf_name") == "arm.1"
    assert not link_prim(stage, "arm_1").HasCustomDataKey("urdf_name")
    assert joint_prim(stage, "0").GetDisplayName() == "0"


def _depth_first() -> list[str]:
    return [
        "base",
        "arm.1",
        "arm_1",
        "arm 1",
        "10",
        "tool",
        "finger_a",
        "finger_b",
        "puck",
        "weightless",
    ]


def test_a_vendors_name_survives_an_earlier_renaming(robot: RobotModel, tmp_path: Path) -> None:
    stage = open_stage(replace(robot, original_names={"base": "base (v2)"}), tmp_path)
    assert link_prim(stage, "base").GetDisplayName() == "base (v2)"


def test_transforms_are_translate_orient_scale_in_double_precision(stage: Any) -> None:
    prim = link_prim(stage, "arm_1")
    assert list(prim.GetAttribute("xformOpOrder").Get()) == [
        "xformOp:translate",
        "xformOp:orient",
        "xformOp:scale",
    ]
    assert isinstance(prim.GetAttribute("xformOp:orient").Get(), Gf.Quatd)
    assert isinstance(prim.GetAttribute("xformOp:translate").Get(), Gf.Vec3d)


def test_links_stand_where_they_are_with_all_joints_at_zero(robot: RobotModel, stage: Any) -> None:
    # at zero the mimic joint is at zero too, for any offset
    poses = forward_kinematics(robot.description, {"grip_follower": 0.0})
    for link, pose in poses.items():
        assert np.allclose(world(link_prim(stage, link)), pose, atol=1e-9)


def test_joint_frames_meet_and_axes_are_the_vendors(robot: RobotModel, stage: Any) -> None:
    units = {"X": 0, "Y": 1, "Z": 2}
    for joint in robot.description.joints:
        prim = joint_prim(stage, joint.name)
        parent, child = link_prim(stage, joint.parent), link_prim(stage, joint.child)
        assert prim.GetRelationship("physics:body0").GetTargets() == [parent.GetPath()]
        assert prim.GetRelationship("physics:body1").GetTargets() == [child.GetPath()]
        assert np.allclose(world(parent) @ frame(prim, 0), world(child) @ frame(prim, 1), atol=1e-6)
        if prim.HasAttribute("physics:axis") and joint.type != "spherical":
            axis = frame(prim, 1)[:3, units[prim.GetAttribute("physics:axis").Get()]]
            assert np.allclose(axis, joint.axis, atol=1e-6)
    assert joint_prim(stage, "0").GetAttribute("physics:axis").Get() == "Z"
    assert np.allclose(frame(joint_prim(stage, "0"), 1), np.eye(4)), "a plain axis needs no turned frame"


def test_joint_types(stage: Any) -> None:
    kinds = {name: str(joint_prim(stage, name).GetTypeName()) for name in JOINTS}
    assert kinds["0"] == kinds["spin"] == "PhysicsRevoluteJoint"
    assert kinds["slide"] == "PhysicsPrismaticJoint"
    assert kinds["to_tool"] == "PhysicsFixedJoint"
    assert kinds["ball"] == "PhysicsSphericalJoint"
    assert kinds["flat"] == "PhysicsJoint"
    axes = ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")
    flat = joint_prim(stage, "flat")
    locks = {axis for axis in axes if flat.HasAPI(UsdPhysics.LimitAPI, axis)}
    assert locks == {"transZ", "rotX", "rotY"}


def test_limits_in_degrees_and_metres(stage: Any) -> None:
    revolute = UsdPhysics.RevoluteJoint(joint_prim(stage, "0"))
    assert revolute.GetLowerLimitAttr().Get() == pytest.approx(math.degrees(-1.5))
    assert revolute.GetUpperLimitAttr().Get() == pytest.approx(math.degrees(2.0))
    slide = UsdPhysics.PrismaticJoint(joint_prim(stage, "slide"))
    assert slide.GetUpperLimitAttr().Get() == pytest.approx(0.3)
    spin = joint_prim(stage, "spin")
    assert not spin.GetAttribute("physics:lowerLimit").HasAuthoredValue()
    assert joint_prim(stage, "0").GetAttribute("physxJoint:maxJointVelocity").Get() == pytest.approx(
        math.degrees(2.0)
    )
    assert joint_prim(stage, "slide").GetAttribute("physxJoint:maxJointVelocity").Get() == pytest.approx(0.5)


def test_an_enormous_limit_is_none(robot: RobotModel, tmp_path: Path) -> None:
    joints = tuple(
        replace(j, limit=Limit(lower=-1e16, upper=1e16)) if j.name == "0" else j
        for j in robot.description.joints
    )
    stage = open_stage(replace(robot, description=replace(robot.description, joints=joints)), tmp_path)
    assert not joint_prim(stage, "0").GetAttribute("physics:lowerLimit").HasAuthoredValue()


def test_drives_say_how_the_joint_is_driven(stage: Any) -> None:
    def gains(joint: str, instance: str) -> tuple[bool, bool]:
        drive = UsdPhysics.DriveAPI(joint_prim(stage, joint), instance)
        return drive.GetStiffnessAttr().Get() > 0, drive.GetDampingAttr().Get() > 0

    assert gains("0", "angular") == (True, True)
    assert gains("1", "angular") == (False, False)
    assert gains("spin", "angular") == (False, True)
    assert gains("slide", "linear") == (True, True)
    assert UsdPhysics.DriveAPI(joint_prim(stage, "0"), "angular").GetMaxForceAttr().Get() == 80.0
    assert not joint_prim(stage, "grip_follower").HasAPI(UsdPhysics.DriveAPI)
    for joint in ("0", "grip_follower"):
        schemas = joint_prim(stage, joint).GetMetadata("apiSchemas").GetAppliedItems()
        assert any(schema.startswith("PhysicsJointStateAPI:") for schema in schemas)


def test_a_follower_names_its_leader(stage: Any) -> None:
    prim = joint_prim(stage, "grip_follower")
    leader = joint_prim(stage, "grip").GetPath()
    assert prim.GetRelationship("newton:mimicJoint").GetTargets() == [leader]
    assert prim.GetAttribute("newton:mimicCoef0").Get() == pytest.approx(0.01)
    assert prim.GetAttribute("newton:mimicCoef1").Get() == pytest.approx(1.5)
    assert prim.GetRelationship("physxMimicJoint:rotY:referenceJoint").GetTargets() == [leader]
    assert prim.GetAttribute("physxMimicJoint:rotY:gearing").Get() == pytest.approx(-1.5)


def test_masses_and_tensors(robot: RobotModel, stage: Any) -> None:
    for link in robot.description.links:
        api = UsdPhysics.MassAPI(link_prim(stage, link.name))
        assert api.GetCenterOfMassAttr().HasAuthoredValue()
        if link.inertial is None:
            assert 0 < api.GetMassAttr().Get() < 1e-4
            continue
        assert api.GetMassAttr().Get() == pytest.approx(link.inertial.mass)
        assert np.allclose(api.GetCenterOfMassAttr().Get(), link.inertial.origin.position, atol=1e-6)
        quaternion = Gf.Quatd(api.GetPrincipalAxesAttr().Get())
        axes = np.array(Gf.Matrix3d(Gf.Rotation(quaternion))).T
        turn = matrix_from_quaternion(link.inertial.origin.quaternion)
        tensor = axes @ np.diag(np.array(api.GetDiagonalInertiaAttr().Get(), float)) @ axes.T
        assert np.allclose(tensor, turn @ link.inertial.matrix() @ turn.T, atol=1e-6)


def test_the_articulation_starts_at_the_root(stage: Any) -> None:
    roots = [p for p in stage.Traverse() if p.HasAPI(UsdPhysics.ArticulationRootAPI)]
    assert roots == [link_prim(stage, "base")]


def test_shapes_are_where_they_should_be(stage: Any) -> None:
    boxes = UsdGeom.BBoxCache(
        Usd.TimeCode.Default(), [UsdGeom.Tokens.default_, UsdGeom.Tokens.guide], useExtentsHint=False
    )
    for path, size in (
        ("base/visuals/box", (0.4, 0.3, 0.2)),
        ("arm_1/visuals/cylinder", (0.1, 0.1, 0.2)),
        ("arm_1_3/collisions/sphere", (0.12, 0.12, 0.12)),
        ("_10/collisions/capsule", (0.06, 0.06, 0.16)),
        ("puck/collisions/mesh", (0.2, 0.1, 0.1)),
    ):
        prim = stage.GetPrimAtPath(f"/everything/{path}")
        found = boxes.ComputeUntransformedBound(prim).ComputeAlignedRange()
        scale = np.array(prim.GetAttribute("xformOp:scale").Get())
        assert np.allclose(np.array(found.GetSize()) * scale, size, atol=1e-6), path


def test_colliders_and_their_approximations(robot: RobotModel, tmp_path: Path) -> None:
    stage = open_stage(replace(robot, approximations={"puck": "boundingSphere"}), tmp_path)
    hull = stage.GetPrimAtPath("/everything/arm_1_2/collisions/mesh")
    ball = stage.GetPrimAtPath("/everything/puck/collisions/mesh")
    assert UsdPhysics.MeshCollisionAPI(hull).GetApproximationAttr().Get() == "convexHull"
    assert hull.GetAttribute("physxConvexHullCollision:hullVertexLimit").Get() == 60
    assert UsdPhysics.MeshCollisionAPI(ball).GetApproximationAttr().Get() == "boundingSphere"
    colliders = [p for p in stage.Traverse() if p.HasAPI(UsdPhysics.CollisionAPI)]
    assert len(colliders) == 7
    assert all(UsdGeom.Imageable(p).ComputePurpose() == "guide" for p in colliders)


def test_a_mesh_used_twice_is_stored_once(stage: Any) -> None:
    masters = stage.GetPrimAtPath("/colliders")
    assert [child.GetName() for child in masters.GetAllChildren()] == ["arm_1_2"]
    assert masters.IsAbstract(), "so that nothing there is drawn or collides"
    arm, puck = (
        UsdGeom.Mesh(stage.GetPrimAtPath(f"/everything/{link}/collisions/mesh"))
        for link in ("arm_1_2", "puck")
    )
    assert len(arm.GetPointsAttr().Get()) == len(puck.GetPointsAttr().Get()) == 24


def test_meshes_lie_in_a_binary_layer(robot: RobotModel, tmp_path: Path) -> None:
    written = usd.write(robot, tmp_path / "everything.usda")
    text, meshes = written.files
    assert meshes == tmp_path / "everything_meshes.usdc"
    assert meshes.read_bytes().startswith(b"PXR-USDC")
    stage = Usd.Stage.Open(str(text))
    arrays = [
        f"{prim.GetPath()}.{attribute.GetName()}"
        for prim in stage.Traverse()
        for attribute in prim.GetAttributes()
        if attribute.GetName() in ("points", "faceVertexIndices", "normals") and attribute.HasAuthoredValue()
        for spec in attribute.GetPropertyStack()
        if spec.layer == stage.GetRootLayer()
    ]
    assert not arrays


def color_of(prim: Any) -> tuple[float, ...]:
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    surface = material.ComputeSurfaceSource()[0]
    return tuple(round(v, 3) for v in surface.GetInput("diffuseColor").Get())


def test_materials(stage: Any) -> None:
    box = stage.GetPrimAtPath("/everything/base/visuals/box")
    assert color_of(box) == (0.8, 0.1, 0.1)
    material, _ = UsdShade.MaterialBindingAPI(box).ComputeBoundMaterial()
    assert material.GetPath() == "/everything/Looks/signal_red"
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/everything/arm_1_2/visuals/mesh"))
    subsets = UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Imageable(mesh.GetPrim()))
    shown = {color_of(s.GetPrim()): len(s.GetIndicesAttr().Get()) for s in subsets}
    assert shown == {(0.0, 0.0, 1.0): 10, (1.0, 0.0, 0.0): 2}


def test_surfaces(stage: Any) -> None:
    box = stage.GetPrimAtPath("/everything/base/collisions/box")
    material, _ = UsdShade.MaterialBindingAPI(box).ComputeBoundMaterial("physics")
    api = UsdPhysics.MaterialAPI(material.GetPrim())
    assert api.GetDynamicFrictionAttr().Get() == pytest.approx(0.7)
    assert api.GetRestitutionAttr().Get() == pytest.approx(0.1)


def test_images_lie_beside_the_stage(bundled: Callable[[str], RobotModel], tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    written = usd.write(bundled("r1"), here / "usd" / "r1.usda", textures=here / "material")
    assert {p.parent for p in written.files[2:]} == {here / "material"}
    here.rename(there)
    stage = Usd.Stage.Open(str(there / "usd" / "r1.usda"))
    assets = [
        attribute.Get()
        for prim in stage.Traverse()
        for attribute in prim.GetAttributes()
        if attribute.GetName() == "inputs:file"
    ]
    assert assets
    for asset in assets:
        assert asset.path.startswith("../material/")
        assert Path(asset.resolvedPath).is_file()


def test_sensors(robot: RobotModel, stage: Any) -> None:
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/everything/tool/Camera"))
    assert camera.GetFocalLengthAttr().Get() == 17.0
    assert np.allclose(camera.GetClippingRangeAttr().Get(), (0.001, 1e6))
    offset = np.linalg.inv(world(link_prim(stage, "tool"))) @ world(camera.GetPrim())
    assert np.allclose(offset, robot.sensors[1].offset.matrix(), atol=1e-9)
    lidar = stage.GetPrimAtPath("/everything/base/Lidar")
    assert lidar.GetTypeName() == "Lidar"
    expected = {"minRange": 0.4, "maxRange": 100.0, "horizontalFov": 360.0, "verticalResolution": 4.0}
    for name, value in expected.items():
        assert lidar.GetAttribute(name).Get() == pytest.approx(value)
    assert lidar.GetAttribute("xformOp:translate").Get() == Gf.Vec3d(0, 0, 0.2)
    marker = UsdGeom.Mesh(stage.GetPrimAtPath("/everything/tool/VisualSphere"))
    points = np.array(marker.GetPointsAttr().Get())
    assert np.allclose(np.linalg.norm(points, axis=1), 0.005, atol=1e-7)
    assert not marker.GetPrim().HasAPI(UsdPhysics.CollisionAPI)


def test_links_that_overlap_at_rest_are_filtered(stage: Any) -> None:
    base = UsdPhysics.FilteredPairsAPI(link_prim(stage, "base"))
    assert base.GetFilteredPairsRel().GetTargets() == [link_prim(stage, "puck").GetPath()]


def test_a_floating_joint_is_left_out_and_noted(robot: RobotModel, tmp_path: Path) -> None:
    joints = tuple(replace(j, type="floating") if j.name == "flat" else j for j in robot.description.joints)
    loose = replace(robot, description=replace(robot.description, joints=joints))
    written = usd.write(loose, tmp_path / "a.usda")
    assert any('"flat"' in note for note in written.notes)
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    assert not stage.GetPrimAtPath("/everything/base/flat")
    assert errors(stage) == []


def test_a_stage_already_open_can_be_written_over(robot: RobotModel, tmp_path: Path) -> None:
    before = open_stage(robot, tmp_path)
    usd.write(replace(robot, category="agent"), tmp_path / "usd" / "everything.usda")
    before.Reload()
    assert before.GetDefaultPrim().GetAttribute("ig:category").Get() == "agent"

"""Links as rigid bodies with mass, shapes and the pairs that may touch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from roboyard.description.mass_properties import MassProperties, link_masses, trace_mass
from roboyard.description.model import Collision, Link, Visual
from roboyard.export.geometry import stem, zero_poses
from roboyard.export.usd.geometry import MeshPrototypes, Placed, add_shape, shape_names
from roboyard.export.usd.library import Sdf, UsdGeom, UsdPhysics
from roboyard.export.usd.materials import MaterialWriter, add_surface
from roboyard.export.usd.naming import Paths, keep_name
from roboyard.export.usd.values import apply_by_name, place_at, quatf, set_attribute, vec3f

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel

HULL_VERTICES = 60
"""Vertices of a hull that PhysX can collide on the GPU."""


def add_links(
    stage: Any,
    robot: RobotModel,
    paths: Paths,
    masters: MeshPrototypes,
    looks: MaterialWriter,
    notes: list[str],
) -> None:
    """Define every link, in depth-first order."""
    description = robot.description
    masses, poses = link_masses(description), zero_poses(description)
    trace = trace_mass(description, masses)
    names = [description.root.name, *(joint.child for joint in description.depth_first_joints)]
    for name in names:
        link = description.link_by_name[name]
        prim = UsdGeom.Xform.Define(stage, paths.link(name)).GetPrim()
        keep_name(prim, name, robot)
        place_at(prim, poses[name])
        UsdPhysics.RigidBodyAPI.Apply(prim)
        apply_by_name(prim, "PhysxRigidBodyAPI")
        mass = masses[name] or trace
        _write_mass(prim, mass)
        if masses[name] is None:
            prim.SetCustomDataByKey("urdf_massless", True)
        if mass is not trace and mass.note:
            notes.append(f'link "{name}": {mass.note}; changed to what a body can have')
        _add_visuals(stage, link, paths, masters, looks, notes)
        _add_collisions(stage, robot, link, paths, masters, notes)
    root = stage.GetPrimAtPath(paths.link(description.root.name))
    UsdPhysics.ArticulationRootAPI.Apply(root)
    apply_by_name(root, "PhysxArticulationAPI")


def _write_mass(prim: Any, mass: MassProperties) -> None:
    api = UsdPhysics.MassAPI.Apply(prim)
    api.CreateMassAttr(float(mass.mass))
    api.CreateCenterOfMassAttr(vec3f(mass.position))
    api.CreateDiagonalInertiaAttr(vec3f(mass.principal))
    api.CreatePrincipalAxesAttr(quatf(mass.quaternion))


def _names(shapes: tuple[Visual, ...] | tuple[Collision, ...]) -> list[str]:
    return shape_names([stem(shape.name, shape.geometry) for shape in shapes])


def _add_visuals(
    stage: Any, link: Link, paths: Paths, masters: MeshPrototypes, looks: MaterialWriter, notes: list[str]
) -> None:
    if not link.visuals:
        return
    scope = f"{paths.link(link.name)}/visuals"
    UsdGeom.Xform.Define(stage, scope)
    for visual, name in zip(link.visuals, _names(link.visuals), strict=True):
        own_color = visual.material is not None and visual.material.rgba is not None
        placed = add_shape(
            masters,
            visual.geometry,
            visual.origin,
            f"{scope}/{name}",
            "visuals",
            paths.links[link.name],
            colored=not own_color,
        )
        if placed is None:
            notes.append(_left_out(link, "visual", visual))
            continue
        looks.dress(placed, visual.material)


def _add_collisions(
    stage: Any, robot: RobotModel, link: Link, paths: Paths, masters: MeshPrototypes, notes: list[str]
) -> None:
    if not link.collisions:
        return
    scope = f"{paths.link(link.name)}/collisions"
    UsdGeom.Imageable(UsdGeom.Xform.Define(stage, scope)).CreatePurposeAttr(UsdGeom.Tokens.guide)
    colliders = []
    for collision, name in zip(link.collisions, _names(link.collisions), strict=True):
        placed = add_shape(
            masters,
            collision.geometry,
            collision.origin,
            f"{scope}/{name}",
            "colliders",
            paths.links[link.name],
            colored=False,
        )
        if placed is None:
            notes.append(_left_out(link, "collision", collision))
            continue
        _make_collider(placed, robot, link, collision)
        colliders.append(placed.prim)
    if link.contact is not None:
        add_surface(stage, paths.root, paths.links[link.name], link.contact, colliders)


def _make_collider(placed: Placed, robot: RobotModel, link: Link, collision: Collision) -> None:
    prim = placed.prim
    UsdPhysics.CollisionAPI.Apply(prim).CreateCollisionEnabledAttr(True)
    if placed.mesh is None:
        return
    approximation = robot.approximations.get(link.name, "none" if collision.concave else "convexHull")
    UsdPhysics.MeshCollisionAPI.Apply(prim).CreateApproximationAttr(approximation)
    if approximation == "convexHull":
        apply_by_name(prim, "PhysxConvexHullCollisionAPI")
        set_attribute(prim, "physxConvexHullCollision:hullVertexLimit", Sdf.ValueTypeNames.Int, HULL_VERTICES)


def _left_out(link: Link, kind: str, shape: Visual | Collision) -> str:
    what = type(shape.geometry).__name__.lower()
    return f'link "{link.name}": {kind} {what} has no file or no place in USD; skipped'


def add_filtered_pairs(stage: Any, robot: RobotModel, paths: Paths) -> None:
    """Keep links that overlap at rest from pushing each other; joined links never collide anyway."""
    targets: dict[str, list[Any]] = {}
    for one, other in robot.semantic.disabled_collision_pairs:
        targets.setdefault(one, []).append(Sdf.Path(paths.link(other)))
    for link, others in targets.items():
        api = UsdPhysics.FilteredPairsAPI.Apply(stage.GetPrimAtPath(paths.link(link)))
        api.CreateFilteredPairsRel().SetTargets(others)

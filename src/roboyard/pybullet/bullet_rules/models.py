"""Conversion of a description to Bullet's model: masses, inertias, joints and link order."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import field, replace
from functools import cache, lru_cache, partial
from math import cos, pi, sin
from typing import Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import dataclass
from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Inertial,
    Joint,
    Link,
    Material,
    Mesh,
    Pose,
    RobotDescription,
    Sphere,
    Visual,
)
from roboyard.pybullet.bullet_rules.merging import merge_fixed_links
from roboyard.pybullet.bullet_rules.mesh_objects import split_objects
from roboyard.pybullet.bullet_rules.shape_bounds import LinkBounds, link_bounds
from roboyard.pybullet.bullet_rules.shape_inertia import Moments, principal_moments, shape_moments
from roboyard.pybullet.face import constants as c
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.transforms import matrix_from_quaternion, quaternion_from_matrix

_WHITE = (1.0, 1.0, 1.0, 1.0)
MASS_WITHOUT_INERTIAL = 1.0
CYLINDER_SIDES = 32
STATIC_LINK_NAME = "world"
LEAST_MASS = 1e-18
"""Mass (kg) in the World of a link without mass that has inertia, for the link that it is fixed to."""
IMMOVABLE_MASS = 1e6
"""Mass (kg) and moments (kg m²) of a movable base that no force moves."""
LEAST_MOMENT = 2.220446049250313e-16
"""Smaller moments (kg m²) are zero to Bullet."""
MomentsOf = Callable[[float, Pose, tuple[Collision, ...]], Moments]
"""Function from mass (kg), inertial frame and shapes of a link to moments (kg m²)."""
BoundsOf = Callable[[Pose, tuple[Collision, ...]], LinkBounds]
"""Function from inertial frame and shapes of a link to the box around the shapes."""


@dataclass(kw_only=True, slots=True)
class LinkModel:
    """One link as in Bullet; index 0 is the base."""

    name: str
    """Name of the link."""
    mass: float
    """Mass (kg)."""
    moments: tuple[float, float, float]
    """Moments about the inertial frame's axes (kg m²)."""
    frame: Pose
    """Inertial frame in the link frame."""
    collisions: tuple[Collision, ...]
    """Collision shapes."""
    visuals: tuple[Visual, ...]
    """Visual shapes."""
    joint: Joint | None = None
    """Joint to the parent; None for the base."""
    parent: int = -1
    """Link index of the parent; -1 for the base."""


@dataclass(kw_only=True, slots=True)
class BodyModel:
    """A body as in Bullet."""

    name: str
    """Name of the robot."""
    links: list[LinkModel]
    """Base, then links in order."""
    description: RobotDescription
    """Description for the World: with these masses and moments, in the same link order."""
    fixed_base: bool
    """Whether the base is fixed."""
    implicit_cylinder: bool
    """Whether cylinders are exact instead of 32-sided hulls."""
    bounds_of: BoundsOf
    """Rule for boxes around shapes."""
    has_two_spheres: bool = False
    """Whether capsules between two points are the hull of two spheres, as those of MJCF files."""
    nests_meshes: bool = True
    """Whether OBJ files are compounds of their own, as in the files of robots."""
    index_by_name: dict[str, int] = field(default_factory=dict)
    """Link name to link index."""
    shared: dict[str, Any] = field(default_factory=dict)
    """Results that all bodies of a file have in common: copies of this model share them."""

    def once(self, name: str, compute: Callable[[BodyModel], Any]) -> Any:
        """Return what a function computes of this model, once for all bodies that have it in common.

        Args:
            name: of the result in `shared`.
            compute: the function.
        """
        found = self.shared.get(name)
        if found is None:
            found = self.shared[name] = compute(self)
        return found

    def copied(self) -> BodyModel:
        """Return a model that shares all with this one but for whether its base is fixed."""
        return BodyModel(
            name=self.name,
            links=self.links,
            description=self.description,
            fixed_base=self.fixed_base,
            implicit_cylinder=self.implicit_cylinder,
            bounds_of=self.bounds_of,
            has_two_spheres=self.has_two_spheres,
            nests_meshes=self.nests_meshes,
            index_by_name=self.index_by_name,
            shared=self.shared,
        )


def bullet_model(
    description: RobotDescription,
    *,
    flags: int = 0,
    scale: float = 1.0,
    fixed_base: bool = False,
    moments_of: MomentsOf | None = None,
    bounds_of: BoundsOf | None = None,
) -> BodyModel:
    """Return Bullet's model of a description.

    Lengths are scaled, masses are not. Moments are computed from shapes or, with URDF_USE_INERTIA_FROM_FILE,
    taken unscaled from the file.

    Args:
        description: robot.
        flags: flags of loadURDF.
        scale: scale of lengths.
        fixed_base: whether the base is fixed.
        moments_of: rule for moments from shapes; None for Bullet's.
        bounds_of: rule for boxes around shapes; None for Bullet's.
    """
    description = scaled(description, scale)
    if flags & c.URDF_IGNORE_COLLISION_SHAPES:
        description = _edited(description, collisions=())
    if flags & c.URDF_IGNORE_VISUAL_SHAPES:
        description = _edited(description, visuals=())
    implicit = moments_of is not None or bool(flags & c.URDF_USE_IMPLICIT_CYLINDER)
    if flags & c.URDF_MERGE_FIXED_LINKS:
        description = merge_fixed_links(description, fixed_base=fixed_base)
    base = description.root
    joints = ordered_joints(description, keep_link_order=bool(flags & c.URDF_MAINTAIN_LINK_ORDER))
    if bounds_of is None:
        bounds_of = partial(link_bounds, implicit_cylinder=implicit, from_file=True)
    seen: list[tuple[Pose, tuple[Collision, ...], LinkBounds]] = []
    if moments_of is None:
        moments_of = _moments_within(bounds_of, seen)
    # a fixed base has no inertia to turn its frame to
    base_flags = flags & ~c.URDF_USE_INERTIA_FROM_FILE if fixed_base else flags
    links = [_link_model(base, base_flags, moments_of)]
    index = {base.name: -1}
    for k, joint in enumerate(joints):
        link = _link_model(description.link_by_name[joint.child], flags, moments_of)
        link.joint, link.parent = bullet_joint(joint), index[joint.parent]
        index[joint.child] = k
        links.append(link)
    is_fixed = fixed_base or links[0].mass == 0.0
    if fixed_base:
        links[0].mass, links[0].moments = 0.0, (0.0, 0.0, 0.0)
    return BodyModel(
        name=description.name,
        links=links,
        description=world_description(description, links, hull_cylinders=not implicit),
        fixed_base=is_fixed,
        implicit_cylinder=implicit,
        bounds_of=bounds_of,
        index_by_name=index,
        shared={"bounds": _bounds_by_link(links, seen)},
    )


def world_description(
    description: RobotDescription, links: Sequence[LinkModel], *, hull_cylinders: bool = False
) -> RobotDescription:
    """Return the description that the World builds: Bullet's masses and joints, in Bullet's link order.

    Args:
        description: robot.
        links: Bullet's links.
        hull_cylinders: whether cylinders collide as prisms, on whose edges wheels roll.
    """
    source = description.link_by_name
    shapes_of = _with_prisms if hull_cylinders else split_objects
    made = tuple(
        replace(
            source[link.name],
            inertial=_inertial(link, is_alone=len(links) == 1),
            collisions=shapes_of(link.collisions),
            visuals=link.visuals or _default_visuals(link.collisions),
        )
        for link in links
    )
    joints = tuple(link.joint for link in links if link.joint is not None)
    return replace(description, links=made, joints=joints)


def plain_description(links: Sequence[LinkModel]) -> RobotDescription:
    """Return the description that the World builds of links that are of no file."""
    return RobotDescription(
        name="",
        links=tuple(
            Link(
                name=link.name,
                inertial=_inertial(link, is_alone=len(links) == 1),
                collisions=split_objects(link.collisions),
                visuals=link.visuals or _default_visuals(link.collisions),
            )
            for link in links
        ),
        joints=tuple(link.joint for link in links if link.joint is not None),
    )


def _with_prisms(collisions: tuple[Collision, ...]) -> tuple[Collision, ...]:
    """Return the shapes of `split_objects` with Bullet's prisms in place of cylinders."""
    return tuple(
        replace(shape, geometry=prism(shape.geometry.radius, shape.geometry.length))
        if isinstance(shape.geometry, Cylinder)
        else shape
        for shape in split_objects(collisions)
    )


@lru_cache(1024)
def prism(radius: float, length: float) -> Mesh:
    """Return the hull that Bullet makes of a file's cylinder, with the very numbers of its corners."""
    sines, cosines, faces = _unit_prism()
    points = np.empty((2 * CYLINDER_SIDES, 3))
    points[0::2, 0] = points[1::2, 0] = radius * sines
    points[0::2, 1] = points[1::2, 1] = radius * cosines
    points[0::2, 2], points[1::2, 2] = length / 2, -length / 2
    points.setflags(write=False)
    mesh = TriangleMesh(vertices=points, faces=faces, hull_points=points)
    return Mesh(uri="cylinder", path=None, data=mesh)


@cache
def _unit_prism() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int32]]:
    """Return (n,) sines and cosines of the corners' angles, and the (m, 3) faces of a prism of n sides."""
    angles = [2.0 * pi * (k / CYLINDER_SIDES) for k in range(CYLINDER_SIDES)]
    upper = [2 * k for k in range(CYLINDER_SIDES)]
    faces = []
    for k, a in enumerate(upper):
        b = upper[k - 1]
        faces += [(a, b, b + 1), (a, b + 1, a + 1)]
        if 0 < k < CYLINDER_SIDES - 1:
            c = upper[k + 1]
            faces += [(c, a, 0), (1, a + 1, c + 1)]
    sines, cosines = [sin(angle) for angle in angles], [cos(angle) for angle in angles]
    return np.array(sines), np.array(cosines), read_only(np.array(faces), np.int32)


def _default_visuals(collisions: tuple[Collision, ...]) -> tuple[Visual, ...]:
    """Return the visuals of a link without visual shapes: its collision shapes."""
    white = Material(rgba=_WHITE)
    return tuple(Visual(geometry=shape.geometry, origin=shape.origin, material=white) for shape in collisions)


def ordered_joints(description: RobotDescription, *, keep_link_order: bool) -> tuple[Joint, ...]:
    """Return the joints depth first in file order, or in the order of the file's links."""
    if not keep_link_order:
        return description.depth_first_joints
    return tuple(
        description.parent_joint[link.name]
        for link in description.links
        if link.name in description.parent_joint
    )


def bullet_joint(joint: Joint) -> Joint:
    """Return a joint as in Bullet: mimic is ignored, floating becomes fixed."""
    kind = "fixed" if joint.type == "floating" else joint.type
    return replace(joint, type=kind, mimic=None)


def _moments_within(
    bounds_of: BoundsOf, seen: list[tuple[Pose, tuple[Collision, ...], LinkBounds]]
) -> MomentsOf:
    """Return the rule for moments of solids within the bounds, which are added to `seen`."""

    def moments(mass: float, frame: Pose, collisions: tuple[Collision, ...]) -> Moments:
        if not mass:
            return 0.0, 0.0, 0.0
        bounds = bounds_of(frame, collisions)
        seen.append((frame, collisions, bounds))
        return shape_moments(mass, bounds)

    return moments


def _bounds_by_link(
    links: Sequence[LinkModel], seen: Iterable[tuple[Pose, tuple[Collision, ...], LinkBounds]]
) -> dict[int, LinkBounds]:
    """Return the bounds of links, -1 for the base, that are known: those of meshes take long.

    Links whose inertial frame Bullet shows with another sign are omitted; see `matrix_signed`.
    """
    known = {(id(frame), id(collisions)): bounds for frame, collisions, bounds in seen}
    found = {}
    for k, link in enumerate(links):
        bounds = known.get((id(link.frame), id(link.collisions)))
        if bounds is not None and link.frame.quaternion[3] > 0.5:
            found[k - 1] = bounds
    return found


def _link_model(link: Link, flags: int, moments_of: MomentsOf) -> LinkModel:
    inertial = link.inertial
    if inertial is None:
        mass = 0.0 if link.name == STATIC_LINK_NAME else MASS_WITHOUT_INERTIAL
        inertial = Inertial(mass=mass, inertia=(mass, 0.0, 0.0, mass, 0.0, mass))
    frame = inertial.origin
    if flags & c.URDF_USE_INERTIA_FROM_FILE:
        frame, moments = _file_moments(inertial)
    else:
        moments = moments_of(inertial.mass, frame, link.collisions)
    if inertial.mass and link.contact is not None and link.contact.inertia_scaling is not None:
        x, y, z = moments
        k = link.contact.inertia_scaling
        moments = k * x, k * y, k * z
    return LinkModel(
        name=link.name,
        mass=inertial.mass,
        moments=moments,
        frame=frame,
        collisions=link.collisions,
        visuals=tuple(_colored(visual, flags) for visual in link.visuals),
    )


def _colored(visual: Visual, flags: int) -> Visual:
    """Return a visual that is white without a colour, unless the flags and its OBJ file say otherwise.

    Source:
        Bullet, TinyRendererVisualShapeConverter.cpp, convertURDFToVisualShapeInternal.
    """
    geometry, material = visual.geometry, visual.material
    if (
        flags & c.URDF_USE_MATERIAL_COLORS_FROM_MTL
        and isinstance(geometry, Mesh)
        and geometry.path is not None
        and geometry.path.suffix.lower() == ".obj"
    ):
        return visual
    if material is None:
        return replace(visual, material=Material(rgba=_WHITE))
    return visual if material.rgba is not None else replace(visual, material=replace(material, rgba=_WHITE))


def _file_moments(inertial: Inertial) -> tuple[Pose, tuple[float, float, float]]:
    """Return principal frame and moments of the file's inertia; zero if it is not physically possible."""
    xx, xy, xz, yy, yz, zz = inertial.inertia
    if xy == xz == yz == 0.0:
        moments, frame = (xx, yy, zz), inertial.origin
    else:
        moments, axes = principal_moments(inertial.inertia)
        turned = matrix_from_quaternion(inertial.origin.quaternion) @ axes
        qx, qy, qz, qw = (float(q) for q in quaternion_from_matrix(turned))
        frame = Pose(position=inertial.origin.position, quaternion=(qx, qy, qz, qw))
    x, y, z = moments
    if min(moments) < 0 or x > y + z or y > x + z or z > x + y:
        return inertial.origin, (0.0, 0.0, 0.0)
    return frame, moments


def never_turns(moments: Moments) -> bool:
    """Return whether a body of one link with these moments keeps its angular velocity for ever.

    Source:
        Bullet, btMultiBody.cpp, solveImatrix: without links, one moment of zero is enough.
    """
    return min(moments) < LEAST_MOMENT


def world_moments(moments: Moments, *, is_alone: bool) -> Moments:
    """Return the moments (kg m²) that a link has in the World: heavy if it is a body that never turns."""
    if is_alone and never_turns(moments):
        return IMMOVABLE_MASS, IMMOVABLE_MASS, IMMOVABLE_MASS
    return moments


def _inertial(link: LinkModel, *, is_alone: bool) -> Inertial | None:
    if link.mass == 0.0 and not any(link.moments):
        return None
    x, y, z = world_moments(link.moments, is_alone=is_alone)
    return Inertial(mass=link.mass or LEAST_MASS, origin=link.frame, inertia=(x, 0.0, 0.0, y, 0.0, z))


# --------------------------------------------------------------------------------------------------- edits


def scaled(description: RobotDescription, factor: float) -> RobotDescription:
    """Return the description with all lengths multiplied by a factor; masses stay unchanged."""
    if factor == 1.0:
        return description
    links = tuple(
        replace(
            link,
            inertial=None
            if link.inertial is None
            else replace(link.inertial, origin=_moved(link.inertial.origin, factor)),
            visuals=tuple(
                replace(v, geometry=_grown(v.geometry, factor), origin=_moved(v.origin, factor))
                for v in link.visuals
            ),
            collisions=tuple(
                replace(s, geometry=_grown(s.geometry, factor), origin=_moved(s.origin, factor))
                for s in link.collisions
            ),
        )
        for link in description.links
    )
    joints = tuple(_scaled_joint(joint, factor) for joint in description.joints)
    return replace(description, links=links, joints=joints)


def _scaled_joint(joint: Joint, factor: float) -> Joint:
    limit = joint.limit
    if joint.type == "prismatic" and limit is not None:
        limit = replace(
            limit,
            lower=None if limit.lower is None else limit.lower * factor,
            upper=None if limit.upper is None else limit.upper * factor,
        )
    return replace(joint, origin=_moved(joint.origin, factor), limit=limit)


def _moved(pose: Pose, factor: float) -> Pose:
    x, y, z = pose.position
    return replace(pose, position=(x * factor, y * factor, z * factor))


def _grown(geometry: Geometry, factor: float) -> Geometry:
    match geometry:
        case Box(size=(x, y, z)):
            return Box(size=(x * factor, y * factor, z * factor))
        case Sphere(radius=radius):
            return Sphere(radius=radius * factor)
        case Cylinder(radius=radius, length=length):
            return Cylinder(radius=radius * factor, length=length * factor)
        case Capsule(radius=radius, length=length):
            return Capsule(radius=radius * factor, length=length * factor)
        case Mesh(scale=(x, y, z)):
            return replace(geometry, scale=(x * factor, y * factor, z * factor))
        case _:
            return geometry


def _edited(description: RobotDescription, **fields: tuple[()]) -> RobotDescription:
    return replace(description, links=tuple(replace(link, **fields) for link in description.links))

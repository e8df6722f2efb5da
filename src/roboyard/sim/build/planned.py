"""Bodies that are not in the spec yet: what a description will be built as, without MuJoCo's elements.

Elements take most of the time that it takes to add a body. One that is removed before the next compile never
gets any, and a world that is compiled from the same plans as the one that it replaces takes over that one's
(`roboyard.sim.pool.kept_worlds`).
"""

from __future__ import annotations

from dataclasses import field, replace
from pathlib import Path

from roboyard._records import dataclass
from roboyard.description.model import (
    Box,
    Capsule,
    Cylinder,
    Joint,
    Link,
    Mesh,
    Plane,
    RobotDescription,
    Sphere,
)
from roboyard.errors import MeshError
from roboyard.shapes.load import load_mesh
from roboyard.shapes.mesh import TriangleMesh
from roboyard.sim.build.records import BuildOptions
from roboyard.transforms import Array

_DOFS = {"fixed": 0, "revolute": 1, "continuous": 1, "prismatic": 1, "spherical": 3}
"""Degrees of freedom of the joints that bodies can be planned with."""
Friction = tuple[int, float | None, float | None, float | None]
"""Link, sliding, spinning and rolling friction of one setting; None keeps a coefficient."""
_PRIMITIVES = (Box, Sphere, Cylinder, Capsule, Plane)
_MOST_SOUND = 64
_SOUND: dict[tuple[int, float, bool, int], tuple[RobotDescription, tuple[TriangleMesh, ...]]] = {}
"""Descriptions that were built before, with their collision meshes, by id and what hulls depend on."""


@dataclass(kw_only=True, slots=True, eq=False)
class PlannedLink:
    """One link, as `BuiltLink` but without elements."""

    name: str
    parent: int
    link: Link
    joint: Joint | None
    place: int
    joint_name: str = ""
    joint_elements: tuple[()] = ()


@dataclass(kw_only=True, slots=True, eq=False)
class PlannedBody:
    """One body, as `Built` but without elements."""

    description: RobotDescription
    prefix: str
    position: Array
    """(3,) of the root link's frame in the world frame (m)."""
    quaternion: Array
    """(4,) x, y, z, w."""
    options: BuildOptions
    links: list[PlannedLink]
    dofs: int
    """Degrees of freedom, those of a free base included."""
    meshes: tuple[TriangleMesh, ...]
    """Contents of the meshes of its collision shapes."""
    frictions: list[Friction] = field(default_factory=list)
    """Of each `Link.set_friction` so far."""
    armatures: dict[int, float] = field(default_factory=dict)
    """Inertia of motors that was set (kg m² or kg), by joint."""

    @property
    def free_dofs(self) -> int:
        """Degrees of freedom of the base: 6 where nothing holds it, else 0."""
        return 0 if self.options.fixed_base else 6

    @property
    def has_joints(self) -> bool:
        """Whether links move relative to each other."""
        return self.dofs > self.free_dofs

    def at(self, position: Array, quaternion: Array) -> PlannedBody:
        """Return the same plan with the root link's frame elsewhere, or this one where it is there.

        Args:
            position: (3,) of the frame in the world frame (m).
            quaternion: (4,) x, y, z, w.
        """
        moved = replace(self, position=position.copy(), quaternion=quaternion.copy())
        return self if self.stands_as(moved) else moved

    def stands_as(self, other: PlannedBody) -> bool:
        """Return whether the root link of both is at the same place."""
        return (
            self.position.tobytes() == other.position.tobytes()
            and self.quaternion.tobytes() == other.quaternion.tobytes()
        )

    def is_built_as(self, other: PlannedBody) -> bool:
        """Return whether both have the same names, options, inertias of motors and no other meshes."""
        return (
            self.prefix == other.prefix
            and self.options == other.options
            and self.armatures == other.armatures
            and len(self.meshes) == len(other.meshes)
            and all(mesh is known for mesh, known in zip(self.meshes, other.meshes, strict=True))
        )

    def is_alike_but_friction(self, other: PlannedBody) -> bool:
        """Return whether the elements of both are the same but for friction and where the root link is."""
        is_same = self.description is other.description or self.description == other.description
        return is_same and self.is_built_as(other)


def plan(
    description: RobotDescription, prefix: str, position: Array, quaternion: Array, options: BuildOptions
) -> PlannedBody | None:
    """Return the plan of a body that can be built later for certain; None for any other.

    Bodies of a world without visual geoms and drives are planned whose shapes are primitives or meshes that
    were built before, since a mesh may turn out to be unusable.

    Args:
        description: the robot.
        prefix: of all names.
        position: (3,) of the root link's frame in the world frame (m).
        quaternion: (4,) x, y, z, w of the root link's frame.
        options: how to build it.
    """
    if options.visual_geoms or options.drives or position.shape != (3,) or description.loops:
        return None
    has_meshes = False
    for link in description.links:
        for shape in link.collisions:
            if isinstance(shape.geometry, Mesh) and not shape.concave:
                has_meshes = True
            elif not isinstance(shape.geometry, _PRIMITIVES):
                return None
    meshes: tuple[TriangleMesh, ...] = ()
    if has_meshes:
        known = _SOUND.get(_key_of(description, options))
        meshes = collision_meshes(description)
        if known is None or list(map(id, known[1])) != list(map(id, meshes)):
            return None
    dofs = 0 if options.fixed_base else 6
    root = description.root
    links = [PlannedLink(name=root.name, parent=-1, link=root, joint=None, place=0)]
    if description.joints:
        index = {root.name: 0}
        for joint in description.depth_first_joints:
            count = _DOFS.get(joint.type)
            if count is None or joint.mimic is not None:
                return None
            dofs += count
            place = index[joint.child] = len(links)
            child = description.link_by_name[joint.child]
            links.append(
                PlannedLink(name=child.name, parent=index[joint.parent], link=child, joint=joint, place=place)
            )
        if options.keep_link_order:
            _reorder(links, description)
    return PlannedBody(
        description=description,
        prefix=prefix,
        position=position.copy(),
        quaternion=quaternion,
        options=options,
        links=links,
        dofs=dofs,
        meshes=meshes,
    )


def note_sound(description: RobotDescription, options: BuildOptions) -> None:
    """Note that a description was built: it can be planned from now on."""
    meshes = collision_meshes(description)
    if meshes:
        _SOUND[_key_of(description, options)] = description, meshes
        while len(_SOUND) > _MOST_SOUND:
            del _SOUND[next(iter(_SOUND))]


def collision_meshes(description: RobotDescription) -> tuple[TriangleMesh, ...]:
    """Return the contents of all meshes of collision shapes as they are now; none where one is missing."""
    shapes = [shape.geometry for link in description.links for shape in link.collisions]
    meshes = [shape for shape in shapes if isinstance(shape, Mesh)]
    found = [
        mesh.data if mesh.data is not None or mesh.path is None else mesh_of_file(mesh.path)
        for mesh in meshes
    ]
    there = [mesh for mesh in found if mesh is not None]
    return tuple(there) if len(there) == len(found) else ()


def mesh_of_file(path: Path) -> TriangleMesh | None:
    """Return the triangles of a mesh file (m); None where it cannot be read."""
    try:
        return load_mesh(path)
    except MeshError:
        return None


def _key_of(description: RobotDescription, options: BuildOptions) -> tuple[int, float, bool, int]:
    return id(description), options.scale, options.fixed_base, options.hull_steps


def _reorder(links: list[PlannedLink], description: RobotDescription) -> None:
    """Sort links in the description's order, the root first, as `build` does."""
    names = [link.name for link in links]
    order = [names[0], *(link.name for link in description.links if link.name != names[0])]
    new = {name: i for i, name in enumerate(order)}
    for link in links:
        if link.parent >= 0:
            link.parent = new[names[link.parent]]
    links.sort(key=lambda link: new[link.name])

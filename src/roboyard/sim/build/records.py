"""The result of building a description: the elements of all links in the spec, and the options."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from typing import Any

import numpy as np

from roboyard._records import NamedTuple, dataclass
from roboyard.description.mass_properties import MassProperties
from roboyard.description.model import Collision, Heightfield, Joint, Link
from roboyard.sim.build.triangle_windows import TriangleWindow


@dataclass(kw_only=True, slots=True)
class BuiltLink:
    """The elements of one link and of its joint."""

    name: str
    parent: int
    """Index of the parent link; -1 for the root."""
    element: Any
    link: Link | None
    joint: Joint | None = None
    joint_elements: tuple[Any, ...] = ()
    joint_name: str = ""
    """Name of the joint of a link without description (MJCF)."""
    actuator: Any = None
    motor_inertia: float = 0.0
    """Inertia that the drive adds to the joint's armature (kg m² or kg)."""
    geoms: list[Any] = field(default_factory=list)
    """Collision geoms."""
    visuals: list[Any] = field(default_factory=list)
    meshes: list[str] = field(default_factory=list)
    windows: list[TriangleWindow] = field(default_factory=list)
    """Concave meshes; their slots, and the geoms for all triangles, are collision geoms, too."""
    hidden: list[tuple[Collision, float]] = field(default_factory=list)
    """Concave meshes, and the body's scale, that have no geom with all their triangles yet."""
    terrains: dict[str, Heightfield] = field(default_factory=dict)
    """Terrain by the name of the spec's heightfield."""
    mass: MassProperties | None = None
    place: int = 0
    """Index among the links in MuJoCo's order, depth first."""
    is_static: bool = False
    """Whether nothing but fixed joints is between the link and a fixed base."""


@dataclass(kw_only=True, slots=True)
class Built:
    """All elements that a description added to a spec."""

    links: list[BuiltLink]
    free_joint: Any = None
    is_ground: bool = False
    """Whether the shapes belong to MuJoCo's world body (fixed shapes of an MJCF file)."""
    equalities: list[Any] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    dofs: int = 0

    @property
    def free_dofs(self) -> int:
        """Degrees of freedom of the base: 6 where nothing holds it, else 0."""
        return 0 if self.free_joint is None else 6

    @property
    def has_joints(self) -> bool:
        """Whether links move relative to each other."""
        return any(record.joint_elements for record in self.links)


def windows_of(bodies: Iterable[Any]) -> list[TriangleWindow]:
    """Return the concave meshes of all links of bodies, in their order."""
    return [window for body in bodies for record in body.built.links for window in record.windows]


@dataclass(frozen=True, kw_only=True, slots=True)
class BuildOptions:
    """How to build a description."""

    fixed_base: bool
    keep_link_order: bool = False
    """Number links as the description lists them instead of depth first."""
    scale: float = 1.0
    visual_geoms: bool = True
    drives: bool = True
    joint_friction: bool = True
    joint_damping: bool = True
    hard: bool = False
    """Whether joint limits are rigid, for worlds that solve contacts on the velocity level."""
    hull_steps: int = 0
    """See `PhysicsProfile.hull_steps`."""
    searches_meshes: bool = False
    """Whether the triangles of concave meshes are searched here; see `mesh_fields`."""
    contype: int = 1
    conaffinity: int = -1


class BodyRows(NamedTuple):
    """The rows of a body in the arrays of a compiled model."""

    links: np.ndarray
    """(n,) of its links among MuJoCo's bodies."""
    positions: np.ndarray
    """(n - 1,) first one of each joint in qpos; -1 without any."""
    velocities: np.ndarray
    """(n - 1,) the same in qvel."""
    free: tuple[int, int, int]
    """First ones of the free joint in qpos and qvel, and of the joints in qvel; -1 without any."""
    of_joints: tuple[slice | np.ndarray, slice | np.ndarray]
    """Those of all joints of one degree of freedom in qpos and qvel."""

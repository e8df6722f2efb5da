"""What building a description leaves behind: the spec's elements of every link, and how it was built."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from roboyard.description.mass_properties import MassProperties
from roboyard.description.model import Heightfield, Joint, Link

ALL_MASKS = 0x7FFFFFFF
"""A conaffinity that meets every contype."""


@dataclass(kw_only=True, slots=True)
class BuiltLink:
    """The spec's elements of one link and of the joint it hangs from."""

    name: str
    parent: int
    """Index of the parent link; -1 for the root."""
    element: Any
    link: Link | None
    joint: Joint | None = None
    joint_elements: tuple[Any, ...] = ()
    joint_name: str = ""
    """For links without a description (MJCF)."""
    actuator: Any = None
    motor_inertia: float = 0.0
    """That the drive gives the joint, in its element's armature beside what the user gives; kg m² or kg."""
    geoms: list[Any] = field(default_factory=list)
    """Collision geoms."""
    visuals: list[Any] = field(default_factory=list)
    meshes: list[str] = field(default_factory=list)
    terrains: dict[str, Heightfield] = field(default_factory=dict)
    """By the name of the spec's heightfield."""
    mass: MassProperties | None = None
    place: int = 0
    """Among the links as MuJoCo has them, depth first."""


@dataclass(kw_only=True, slots=True)
class Built:
    """Everything a description added to a spec."""

    links: list[BuiltLink]
    free_joint: Any = None
    is_ground: bool = False
    """The shapes belong to MuJoCo's own world body (fixed shapes of an MJCF file)."""
    equalities: list[Any] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    dofs: int = 0


@dataclass(frozen=True, kw_only=True, slots=True)
class BuildOptions:
    fixed_base: bool
    keep_link_order: bool = False
    """Number links as the description lists them instead of depth first."""
    scale: float = 1.0
    visual_geoms: bool = True
    drives: bool = True
    joint_friction: bool = True
    joint_damping: bool = True
    hard: bool = False
    """Joint limits as rigid as can be, for worlds that solve contacts on the velocity level."""
    contype: int = 1
    conaffinity: int = -1

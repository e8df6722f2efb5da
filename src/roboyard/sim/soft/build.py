"""Nodes of a soft body as MuJoCo bodies with three slides each, and its surface as a flex for contacts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._records import dataclass
from roboyard.sim.build.masks import ALL_MASKS
from roboyard.sim.build.records import Built, BuiltLink
from roboyard.sim.build.solver_options import HARD_SOLIMP
from roboyard.sim.soft.rest_shape import Ints
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard._mujoco import mujoco

NODE_INERTIA = 1e-4
"""Moments of a node over its mass (m²); it never turns."""
_QUIET = 1e-9
"""Damping of the flex's edges (N s/m): nothing, but MuJoCo warns of flexes without forces of their own."""


@dataclass(kw_only=True, slots=True)
class SoftElements:
    """The elements of one soft body in a spec."""

    nodes: list[Any]
    flex: Any


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SoftShape:
    """Nodes, elements and surface of a soft body."""

    positions: Array
    """(n, 3) nodes in the world frame (m)."""
    masses: Array
    """(n,) (kg)."""
    elements: Ints
    """(m, 3) triangles, or (m, 4) right-handed tetrahedra."""
    radius: float
    """Distance from the nodes at which surfaces are (m)."""
    friction: float
    self_collision: bool
    """Whether its parts touch each other."""
    repulsion: float | None = None
    """Stiffness (N/m) of springs that keep its parts apart, instead of contacts; None for contacts."""


def build_soft(
    spec: mujoco.MjSpec, prefix: str, link: Any, shape: SoftShape, *, hard: bool
) -> tuple[Built, SoftElements]:
    """Add a soft body to a spec: a fixed body without mass or shapes, with the nodes as children.

    Args:
        spec: the spec.
        prefix: of all names.
        link: the link of the description.
        shape: nodes and elements.
        hard: whether contacts are on the velocity level.
    """
    from roboyard._mujoco import mujoco

    centre = np.average(shape.positions, axis=0, weights=shape.masses)
    root = spec.worldbody.add_body(name=f"{prefix}{link.name}", pos=centre)
    nodes, names = [], []
    for k, (position, mass) in enumerate(zip(shape.positions, shape.masses, strict=True)):
        name = f"{prefix}node{k}"
        node = root.add_body(name=name, pos=position - centre, mass=mass, explicitinertial=True)
        node.inertia = [mass * NODE_INERTIA] * 3
        node.sleep = mujoco.mjtSleepPolicy.mjSLEEP_NEVER
        for axis in np.eye(3):
            node.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        nodes.append(node)
        names.append(name)
    flex = spec.add_flex(
        name=f"{prefix}surface",
        dim=shape.elements.shape[1] - 1,
        radius=shape.radius,
        vertbody=names,
        elem=shape.elements.ravel().tolist(),
        edgedamping=_QUIET,
        contype=1,
        conaffinity=ALL_MASKS,
        condim=3,
    )
    kinds, has_contacts = mujoco.mjtFlexSelf, shape.self_collision and shape.repulsion is None
    flex.selfcollide = kinds.mjFLEXSELF_AUTO if has_contacts else kinds.mjFLEXSELF_NONE
    flex.friction[0] = shape.friction
    if hard:
        flex.solimp = HARD_SOLIMP
    record = BuiltLink(name=link.name, parent=-1, element=root, link=link)
    return Built(links=[record]), SoftElements(nodes=nodes, flex=flex)

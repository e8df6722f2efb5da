"""A client's constraints: what scripts asked for, and the World's constraint that does it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from roboyard.pybullet.face.arguments import Quaternion, Vector3
    from roboyard.sim.stepping.constraints import Constraint

DEFAULT_MAX_FORCE = 500.0
WORLD = -1


@dataclass(kw_only=True, slots=True)
class ConstraintRecord:
    """One constraint, frames as scripts give them: in inertial frames, or in the world."""

    number: int
    parent: tuple[int, int]
    """Body and link."""
    child: tuple[int, int]
    """Body and link; body -1 is the world."""
    kind: int
    axis: Vector3
    parent_position: Vector3
    parent_orientation: Quaternion
    child_position: Vector3
    child_orientation: Quaternion
    max_force: float = DEFAULT_MAX_FORCE
    gear_ratio: float = 0.0
    """0 while none was given, which couples one to one."""
    gear_aux_link: int | None = None
    relative_position_target: float = 0.0
    erp: float = 0.0
    made: Constraint | None = None

    def concerns(self, body: int) -> bool:
        return body in (self.parent[0], self.child[0])

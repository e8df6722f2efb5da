"""The constraints of a client, as scripts created them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

from roboyard._records import dataclass
from roboyard.pybullet.face import constants as c

if TYPE_CHECKING:
    from roboyard.pybullet.face.arguments import Quaternion, Vector3
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.sim.constraints.records import Constraint
    from roboyard.sim.link import Link
    from roboyard.sim.soft.soft_body import Anchor, SoftBody
    from roboyard.sim.world import World

DEFAULT_MAX_FORCE = 500.0
WORLD = -1
IDENTITY = (0.0, 0.0, 0.0, 1.0)
ConstraintRequest = list[Any]
"""The fields of getConstraintInfo, and the largest force (N or N m) where the script has set it, or None.

The arguments are checked, and vectors are tuples of floats."""
CHILD_POSITION, CHILD_TURN, MAX_FORCE, GEAR_RATIO = 7, 9, 10, 11
GEAR_TARGET, GEAR_ERP, BOUND = 13, 14, 15
"""Places of fields in a request."""

ROWS = {c.JOINT_FIXED: 6, c.JOINT_PRISMATIC: 5, c.JOINT_POINT2POINT: 3, c.JOINT_GEAR: 1}
"""Number of forces and torques of each kind."""
NO_EFFORTS = {kind: (0.0,) * count for kind, count in ROWS.items()}
"""Answers of getConstraintState of each kind before the first step."""


@dataclass(kw_only=True, slots=True)
class ConstraintRecord:
    """One constraint; poses are relative to inertial frames, or to the world."""

    number: int
    """Constraint id."""
    parent: tuple[int, int]
    """Body and link of the parent."""
    child: tuple[int, int]
    """Body and link of the child; body -1 is the world."""
    kind: int
    """JOINT_FIXED, JOINT_POINT2POINT, JOINT_PRISMATIC or JOINT_GEAR."""
    axis: Vector3
    """Axis of a prismatic constraint, in the parent's frame."""
    parent_position: Vector3
    """Joint position in the parent (m)."""
    parent_orientation: Quaternion
    """Joint orientation in the parent (x, y, z, w), of any length."""
    child_position: Vector3
    """Joint position in the child or the world (m)."""
    child_orientation: Quaternion
    """Joint orientation in the child or the world (x, y, z, w), of any length; zeros are the identity."""
    max_force: float = DEFAULT_MAX_FORCE
    """Largest force (N) or torque (N m)."""
    bound: float | None = None
    """The largest force where the script has set it; None: it is an impulse (N s or N m s) in effect."""
    gear_ratio: float = 0.0
    """Ratio of a gear; 0: not set, which couples 1 to 1."""
    gear_aux_link: int | None = None
    """Third joint of a gear."""
    relative_position_target: float = 0.0
    """Position offset of a gear (rad or m)."""
    erp: float = 0.0
    """Share of the position error of a gear corrected in a step."""
    made: Constraint | None = None
    """The World's constraint."""
    anchor: tuple[SoftBody, Anchor] | None = None
    """The anchor of a soft body."""

    @property
    def is_bounded(self) -> bool:
        """Whether the script has set the largest force."""
        return self.bound is not None

    def involves(self, body: int) -> bool:
        """Return whether a body is the parent or child."""
        return body in (self.parent[0], self.child[0])


class ConstraintScene(Protocol):
    """The parts of a scene that constraints are built from."""

    @property
    def world(self) -> World:
        """The World."""
        ...

    @property
    def bodies(self) -> Mapping[int, BodyRecord]:
        """Bodies by id."""
        ...

    def link(self, body: int, link: int) -> Link | None:
        """Return the World's link, or None."""
        ...

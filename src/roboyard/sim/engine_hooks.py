"""Methods of a world that its engine calls, defined by the classes above it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Generic, TypeVar

import numpy as np

from roboyard.sim.protocols import EngineBody, JointDrives, LinkSurfaces, LinkWrenches
from roboyard.transforms import Array

BodyT = TypeVar("BodyT", bound=EngineBody)


class EngineHooks(Generic[BodyT]):
    """Parts of a world that its engine refers to; worlds define those that they have."""

    def ensure_compiled(self) -> None:
        """Compile if the spec was edited; all remaining bodies keep their state."""
        raise NotImplementedError

    @property
    def drives(self) -> JointDrives:
        """The drives of joints."""
        raise NotImplementedError

    @property
    def surfaces(self) -> LinkSurfaces:
        """Restitution and drag of links."""
        raise NotImplementedError

    @property
    def wrenches(self) -> LinkWrenches:
        """External forces on links."""
        raise NotImplementedError

    def flex_owners(self) -> dict[int, int]:
        """Return the body id of each row of MuJoCo's flexes."""
        return {}

    @property
    def has_soft_bodies(self) -> bool:
        """Whether any body is soft."""
        return False

    def soft_surfaces(self) -> Sequence[tuple[int, Array, np.ndarray]]:
        """Return body id, (n, 3) nodes (m) and (m, 3) surface triangles of each soft body."""
        return ()

    def refresh_stepping(self) -> None:
        """Note that a rule of the time step was added, changed or removed."""

    def contact_forces(self) -> Array:
        """Return (ncon, 3) forces (N) of the last step's contacts along the axes of their frames."""
        raise NotImplementedError

    def find_reactions(self) -> None:
        """Compute MuJoCo's `cacc`, `cfrc_ext` and `cfrc_int` of the last step."""
        raise NotImplementedError

    def _parts_in_cycles(self) -> Sequence[object]:
        """Return the parts, beside bodies, that refer to each other without passing through the world."""
        return ()

    def rows_changed(self, body: BodyT, *, is_there: bool) -> None:
        """Note that rows of MuJoCo's arrays, which stay, became a body's or are no longer one's."""

    def bodies_changed(self) -> None:
        """Note that bodies came or went in any other way."""

    def constraints_changed(self) -> None:
        """Note that a constraint came, went or has another bound or axis, without a compile."""

    def restore_active(self, active: np.ndarray, since: int) -> None:
        """Correct (neq,) which constraints were active by those that came or went since.

        Args:
            active: (neq,) of an earlier moment.
            since: first id of the constraints that came since.
        """

    @property
    def next_constraint(self) -> int:
        """The id that the next constraint gets."""
        return 0

    def _complete_spec(self) -> None:
        """Add what is not in the spec yet."""

    def _extra_key(self) -> Any:
        """Return what a compile depends on besides bodies and options; None where this cannot be compared."""

    def _extra_elements(self) -> Any:
        """Return the elements that the spec has for it."""

    def _take_extra_elements(self, elements: Any) -> None:
        """Take over what `_extra_elements` returned of a world with an equal key."""

    def _leave_extra_elements(self) -> None:
        """Note that the spec is a new one without them."""

    def _delete_inactive_rows(self) -> None:
        """Delete inactive constraints and exclusions from the spec."""

    def _before_compile(self) -> None:
        """Make the last edits of the spec."""

    def _after_compile(self) -> None:
        """Update what refers to rows of MuJoCo's arrays; they are new."""

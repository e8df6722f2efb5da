"""Records of constraints, and checks of what they are made from."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._records import dataclass
from roboyard.errors import RoboyardError
from roboyard.sim.link import Link
from roboyard.transforms import Array, normalized

Kind = Literal["weld", "slide", "point", "gear"]


Elements = tuple[Any, Any, Any]
"""The equality and the sites of a constraint in the spec."""
Ends = tuple[int, int, int, int, int, int]
"""Row among MuJoCo's equalities, two kinematic trees, degree of freedom of a gear's third joint, two sites of
the frames; -1 for none."""


@dataclass(kw_only=True, slots=True, eq=False)
class Constraint:
    """One constraint. Frames are relative to link frames; without a second link, to the world."""

    id: int
    kind: Kind
    link_a: Link
    link_b: Link | None
    element: Any = None
    """Its equality in the spec; None before it is there."""
    site_a: Any = None
    site_b: Any = None
    is_in_place: bool = False
    """Whether the spec has its frames on their links."""
    position_a: ArrayLike | None = None
    """Position of the frame in the first link (m); None for a gear."""
    orientation_a: ArrayLike = (0.0, 0.0, 0.0, 1.0)
    position_b: ArrayLike = (0.0, 0.0, 0.0)
    """Position of the frame in the second link (m)."""
    orientation_b: ArrayLike = (0.0, 0.0, 0.0, 1.0)
    rows: tuple[int, int] = (-1, -1)
    """Rows of its frames in MuJoCo's arrays; -1 for a gear."""
    first_row: int = 0
    """Where its rows were in MuJoCo's arrays when they were last read."""
    max_force: float = np.inf
    """Force bound (N or N m) of each row: three for a point, six for a weld or slide, one for a gear."""
    gear_ratio: float = 0.0
    gear_offset: float = 0.0
    """Position of the first joint of a gear where the others' are 0 (rad or m)."""
    axis: Array | None = None
    """Unit axis (3,) of a slide, in the frame of link_a."""
    tendon: Any = None
    """The tendon of a gear with a third joint."""
    ends: Ends | None = None
    """Its data for the order of solution; None where they have to be looked up."""
    tuned: float = 0.0
    """Time step (s) for which the stiffness of its rows is set; 0 where it is that without a bound."""
    share: float = 1.0
    """Share of the profile's error reduction, where rows are solved in turn; 0 holds velocities alone."""

    @property
    def has_frames(self) -> bool:
        """Whether it is no gear."""
        return self.position_a is not None


def size_of(kind: Kind) -> str:
    """Return the kind of the constraints with as many rows."""
    return "weld" if kind == "slide" else kind


def check_finite(what: str, values: ArrayLike) -> None:
    """Raise an error that names what a number or numbers (n,) are for unless all are finite."""
    # plain numbers are much faster than arrays
    if type(values) is tuple and len(values) == 3:
        x, y, z = values
        total = x + y + z
        if type(total) is float and total - total == 0.0:
            return
    if not all(map(math.isfinite, np.asarray(values, dtype=float).ravel().tolist())):
        raise RoboyardError(f"{what} of a constraint must be finite, got {values}")


def checked_position(what: str, values: ArrayLike) -> ArrayLike:
    """Return finite numbers (3,) that the caller does not change."""
    check_finite(what, values)
    if type(values) is tuple and len(values) == 3:
        return values
    made = np.array(values, dtype=float)
    if made.shape != (3,):
        raise RoboyardError(f"{what} of a constraint must be three numbers, got {values}")
    return made


def checked_orientation(values: ArrayLike) -> ArrayLike:
    """Return a quaternion (4,) that the caller does not change; raise what `normalized` does."""
    if type(values) is tuple and len(values) == 4:
        x, y, z, w = values
        square = x * x + y * y + z * z + w * w
        if type(square) is float and 0.5 < square < 2.0:
            return values
    return normalized(np.array(values, dtype=float))


def unit_quaternion(values: ArrayLike) -> tuple[float, float, float, float]:
    """Return a quaternion (4,) of length 1."""
    if type(values) is tuple and len(values) == 4:
        x, y, z, w = values
        length = math.sqrt(x * x + y * y + z * z + w * w)
        if 0.5 < length < 2.0:
            return (x / length, y / length, z / length, w / length)
    i, j, k, r = normalized(values).tolist()
    return i, j, k, r


def check_force(max_force: float) -> None:
    """Raise an error for a bound (N or N m) that is no number."""
    if max_force != max_force:
        raise RoboyardError("the largest force of a constraint must be a number, got nan; inf is no bound")

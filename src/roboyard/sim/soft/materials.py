"""Materials of soft bodies."""

from __future__ import annotations

import math

from roboyard._records import dataclass
from roboyard.errors import RoboyardError


@dataclass(frozen=True, kw_only=True, slots=True)
class Springs:
    """Springs along the edges of the elements, with dampers beside them: cloth, and soft lattices."""

    stiffness: float
    """Of an edge (N/m)."""
    damping: float = 0.0
    """Of an edge, and of a spring against bending (N s/m)."""
    damps_all_directions: bool = False
    """Whether dampers act on the whole relative velocity of their ends, instead of its part along them."""
    bending_stiffness: float | None = None
    """Of the springs between nodes two edges apart (N/m); None for no such springs."""

    def __post_init__(self) -> None:
        _check("springs", self.stiffness, self.damping, self.bending_stiffness or 0.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class NeoHookean:
    """A stable Neo-Hookean solid with viscous damping, in tetrahedra.

    Source: B. Smith, F. de Goes, T. Kim, "Stable Neo-Hookean Flesh Simulation", ACM TOG 37(2), 2018.
    """

    mu: float
    """First Lamé parameter, the shear modulus (Pa)."""
    lam: float
    """Second Lamé parameter (Pa)."""
    damping: float = 0.0
    """Time constant (s): the viscous stress is that of the elastic parameters times this, for the rate."""

    def __post_init__(self) -> None:
        _check("Neo-Hookean solids", self.mu, self.lam, self.damping)


def _check(what: str, *values: float) -> None:
    if not all(math.isfinite(value) and value >= 0.0 for value in values):
        raise RoboyardError(f"{what} need finite parameters of at least 0, got {values}")

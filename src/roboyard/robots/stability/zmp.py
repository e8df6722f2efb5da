"""Zero-moment point of a robot on wheels: how joints and driving shift it, and the margins of the support.

With centre of mass c, weight W and angular momentum L about the ground below the support, the zero-moment
point (the centre of pressure of the floor) is

    p = c_xy + (-L̇_y, L̇_x) / W

and the robot does not tip while p is inside the support polygon, the convex hull of its contacts. An
acceleration a_i of joint i shifts p by s_i a_i, and a change of its position shifts c_xy by J_i.
(Vukobratović and Borovac, "Zero-moment
point: thirty-five years of its life", 2004.)

Centrifugal and Coriolis moments of moving limbs contribute to L̇ without any acceleration; they shift p with
the square of the speeds.

A robot that drives as one rigid body, its base at o with velocity v and turning rate ω, accelerates its mass
at r by v̇ + ω ẑ×v + ω̇ ẑ×(r - o) - ω² (r - o), where v̇ is the change of v in the base's own axes. With the
first moment d = Σ m z (r - o) / W of its mass at heights z above the ground and h the height of c, so that
L̇ = Σ m z ẑ×r̈, this gives

    p = c_xy - (h / g) (v̇ + ω ẑ×v) - ω̇ ẑ×d + ω² d

so that a curve pushes outwards by (h / g) v ω even at constant speed. At s times the speed on the same curve,
v and ω both being s times as large, it is s² times as much.

A robot that is already tilting, its centre of mass moving at ċ, can recover while the capture point
c_xy + √(h / g) ċ is inside the support polygon (Pratt et al., "Capture point: a step toward humanoid push
recovery", 2006). While it tilts, the margins of the edges ahead shrink by `CAUTION` times √(h / g) ċ, so that
it returns instead of balancing on an edge. While it is tilted, all margins shrink by `CAUTION` + 1 times the
shift of its centre of mass, so that no push tips it over the other side. The upright direction follows the
robot with the time constant `UPRIGHT_TIME`, as floors slope (all in
`roboyard.robots.stability.support_polygon`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.transforms import Array

_kernels = lazy_module("roboyard.robots.stability.kernels")

CURVE = 0.7
"""Fraction of the margin that a steady curve may use; the rest is for accelerating and braking in it."""
SLOWEST = 0.1
"""Smallest fraction of a twist or of its change."""
TINY = 1e-9
"""Shifts below this count as zero."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class BalanceMargins:
    """Effect of k joints on centre of mass and zero-moment point, for each of the e edges of the support
    polygon.
    """

    com_shift: Array
    """(e, k) outward shift of the centre of mass for each joint's position (m/rad or m/m)."""
    zmp_shift: Array
    """(e, k) outward shift of the zero-moment point for each joint's acceleration (m s²/rad or s²)."""
    com_margin: Array
    """(e,) distance of the centre of mass from its limit (m); negative beyond."""
    zmp_margin: Array
    """(e,) largest shift of the zero-moment point by accelerations (m)."""
    edge: Array
    """(e,) distance from the centre of mass to the edge (m)."""
    lost: Array
    """(e,) distance by which margins shrink for a robot that is tilted or tilting (m)."""
    reserve: Array
    """(e,) distance from the edge that driving keeps (m)."""
    swing: Array
    """(e,) outward shift of the zero-moment point by the joints' present speeds (m)."""
    outwards: Array
    """(e, 2) outward normals of the edges in the base's axes."""
    height: float
    """h / g (s²)."""
    moment: Array
    """(2,) first moment d in the base's axes (m s²)."""

    def calm(self) -> float:
        """Return the fraction of their present speeds that joints may have."""
        return _kernels().share(self.zmp_margin, self.swing) ** 0.5

    def together(self, acceleration: Array) -> float:
        """Return the fraction of (k,) accelerations (rad/s² or m/s²) that joints may have at once.

        Their shifts of the zero-moment point may cancel; but joints come to rest at different times, so only
        half of the cancellation counts.
        """
        return _kernels().together(self.zmp_shift, self.zmp_margin, acceleration)

    def push(self, twist: Array, change: Array) -> Array:
        """Return the (e,) outward shifts of the zero-moment point by driving (m).

        Args:
            twist: (3,) velocity of the base in its own axes (m/s, m/s, rad/s).
            change: (3,) its rate of change (m/s², m/s², rad/s²).
        """
        (x, y, turn), (ax, ay, spin), (dx, dy) = twist, change, self.moment
        shift = (
            -self.height * (ax - turn * y) + spin * dy + turn**2 * dx,
            -self.height * (ay + turn * x) - spin * dx + turn**2 * dy,
        )
        return self.outwards @ shift

    def steady(self, twist: Array) -> float:
        """Return the fraction of a (3,) twist (see `push`) that is stable in a steady curve, at least
        `SLOWEST`.
        """
        com_margin = CURVE * np.maximum(self.edge - self.lost - self.reserve, 0.0)
        return max(SLOWEST, _kernels().share(com_margin, self.push(twist, np.zeros(3))) ** 0.5)

    def stable_change(self, twist: Array, change: Array) -> float:
        """Return the fraction of a (3,) change of a (3,) twist (see `push`) that is stable.

        At least `SLOWEST`, so that a base can always come to rest; less only for a robot that is tilting.
        """
        spare = self.edge - self.reserve - np.maximum(self.push(twist, np.zeros(3)), 0.0)
        push = self.push(np.zeros(3), change)
        return _kernels().share(np.maximum(spare, SLOWEST * push) - self.lost, push)

    def pull(self, acceleration: Array, shift: Array) -> float:
        """Return the fraction of (k,) accelerations by springs that is stable; 0 where they tip the robot
        over.

        Args:
            acceleration: (k,) of the joints (rad/s² or m/s²).
            shift: (k,) motion of the joints until they come to rest without springs (rad or m).
        """
        beyond = self.com_margin - self.com_shift @ shift < 0.0
        if np.any(beyond & (self.com_shift @ acceleration > TINY)):
            return 0.0
        return self.together(acceleration) * self.calm() ** 2

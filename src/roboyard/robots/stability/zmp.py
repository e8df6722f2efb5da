"""How joints and driving tip a robot that stands on a floor, and how much of that its footing bears.

With c its centre of mass, W its weight and L its angular momentum about the ground below the support, the
floor pushes at

    p = c_xy + (-L̇_y, L̇_x) / W

and the robot stands as long as p lies within the convex hull of its wheels. An acceleration a_i of joint i
shifts p by s_i a_i, and a change of its position shifts c_xy by J_i. (Vukobratović and Borovac, "Zero-moment
point: thirty-five years of its life", 2004.)

What is left of L̇ when nothing accelerates, the centrifugal and Coriolis moments of limbs that swing, shifts p
too, and grows with the square of their speeds.

A robot that drives as one rigid body, its base at o with velocity v and turning rate ω, accelerates its mass
at r by v̇ + ω ẑ×v + ω̇ ẑ×(r - o) - ω² (r - o), where v̇ is the change of v in the base's own axes. With the
first moment d = Σ m z (r - o) / W of its mass at heights z above the ground and h the height of c, so that
L̇ = Σ m z ẑ×r̈, this gives

    p = c_xy - (h / g) (v̇ + ω ẑ×v) - ω̇ ẑ×d + ω² d

so that a curve pushes outwards by (h / g) v ω even at constant speed. At s times the speed on the same curve,
v and ω both being s times as large, it is s² times as much.

A robot that is tilting already, its centre of mass moving at ċ over its wheels, can still be caught as long
as c_xy + √(h / g) ċ lies within them (Pratt et al., "Capture point: a step toward humanoid push recovery",
2006). While it tilts, edges ahead count as nearer by `CAUTION` times √(h / g) ċ, so that it comes back
instead of hanging in balance. While it is tilted, all edges count as nearer than those of the upright robot
by `CAUTION` + 1 times the shift of its centre of mass, so that no push makes it fall back and over the other
side. What counts as upright follows the robot within `SETTLING`, as floors slope (all in
`roboyard.robots.stability.support_polygon`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.transforms import Array

_kernels = lazy_module("roboyard.robots.stability.kernels")

CURVE = 0.7
"""Of the way from the centre of mass to where driving may push it, how far a steady curve may; the rest is
for speeding up and slowing down in it."""
SLOWEST = 0.1
TINY = 1e-9


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class BalanceMargins:
    """How k joints move the balance of their robot, edge by edge of its support (e of them)."""

    com_shift: Array
    """(e, k) m/rad or m/m: centre of mass outwards for each joint's position"""
    zmp_shift: Array
    """(e, k) m s²/rad or s²: the floor's answer outwards for each joint's acceleration"""
    com_margin: Array
    """(e,) m from the centre of mass to where it may be led; negative beyond"""
    zmp_margin: Array
    """(e,) m that accelerations may take"""
    edge: Array
    """(e,) m from the centre of mass to the edge"""
    lost: Array
    """(e,) m by which edges count as nearer, for a robot that is tilted or tilting"""
    reserve: Array
    """(e,) m of that which driving leaves"""
    swing: Array
    """(e,) m outwards that joints' present speeds shift the floor's answer"""
    outwards: Array
    """(e, 2) normals of the edges in the base's axes"""
    height: float
    """s²: h / g"""
    moment: Array
    """(2,) m s²: d in the base's axes"""

    def calm(self) -> float:
        """Share of their present speeds that joints may have, as far as they swing the robot about."""
        return _kernels().share(self.zmp_margin, self.swing) ** 0.5

    def together(self, acceleration: Array) -> float:
        """Share of (k,) accelerations that joints may take at once, 1 for any alone.

        What they do to the floor's answer may cancel; but joints come to rest at different times, so only
        half of that is counted on.
        """
        return _kernels().together(self.zmp_shift, self.zmp_margin, acceleration)

    def push(self, twist: Array, change: Array) -> Array:
        """(e,) m outwards that driving shifts the floor's answer.

        Args:
            twist: (3,) m/s, m/s, rad/s of the base in its own axes.
            change: (3,) m/s², m/s², rad/s², how fast that changes.
        """
        (x, y, turn), (ax, ay, spin), (dx, dy) = twist, change, self.moment
        shift = (
            -self.height * (ax - turn * y) + spin * dy + turn**2 * dx,
            -self.height * (ay + turn * x) - spin * dx + turn**2 * dy,
        )
        return self.outwards @ shift

    def steady(self, twist: Array) -> float:
        """Share of a twist (see `push`) that the footing bears for long, on the same curve.

        Never less than `SLOWEST`.
        """
        com_margin = CURVE * np.maximum(self.edge - self.lost - self.reserve, 0.0)
        return max(SLOWEST, _kernels().share(com_margin, self.push(twist, np.zeros(3))) ** 0.5)

    def bearable(self, twist: Array, change: Array) -> float:
        """Share of a change of twist (see `push`) that the footing bears on top of the twist itself.

        Never less than `SLOWEST`, so that a base can always come to rest; but a robot that is tilting may
        have to wait with it.
        """
        spare = self.edge - self.reserve - np.maximum(self.push(twist, np.zeros(3)), 0.0)
        push = self.push(np.zeros(3), change)
        return min(max(SLOWEST, _kernels().share(spare, push)), _kernels().share(spare - self.lost, push))

    def pull(self, acceleration: Array, shift: Array) -> float:
        """Share of (k,) accelerations that springs may give joints at once; 0 where they lead the robot over.

        Args:
            acceleration: rad/s² or m/s².
            shift: (k,) rad or m from where the joints are to where they come to rest without springs.
        """
        beyond = self.com_margin - self.com_shift @ shift < 0.0
        if np.any(beyond & (self.com_shift @ acceleration > TINY)):
            return 0.0
        return self.together(acceleration) * self.calm() ** 2

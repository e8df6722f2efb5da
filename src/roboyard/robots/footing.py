"""What keeps a robot that stands upright: the floor it stands on, and how its joints' motion tips it.

With c its centre of mass, W its weight and L its angular momentum about the ground below the support, the
floor pushes at

    p = c_xy + (-L̇_y, L̇_x) / W

and the robot stands as long as p lies within the convex hull of its wheels. An acceleration a_i of joint i
shifts p by s_i a_i, and a change of its position shifts c_xy by J_i. (Vukobratović and Borovac, "Zero-moment
point: thirty-five years of its life", 2004.)

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
side. What counts as upright follows the robot within `SETTLING`, as floors slope.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray

from roboyard.poses import Array
from roboyard.robots.hull_edges import hull_edges
from roboyard.robots.joints import Indices, JointArrays
from roboyard.sim.link import Link

if TYPE_CHECKING:
    from roboyard.robots.robot_body import RobotBody

LEAN = 0.75
"""Of the way from the middle of the support to each edge, how far the centre of mass may be led."""
SWAY = 0.25
"""Of the same way, how far accelerations of one joint may push the floor's answer."""
RESERVE = 0.08
"""Of the same way, how near to the edge driving may not push it."""
CURVE = 0.7
"""Of the way from the centre of mass to where driving may push it, how far a steady curve may; the rest is
for speeding up and slowing down in it."""
CAUTION = 2.0
"""How many times over a tilt counts."""
SETTLING = 1.0
"""s"""
SLOWEST = 0.1
TINY = 1e-9


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Balance:
    """How k joints move the balance of their robot, edge by edge of its support (e of them)."""

    lean: Array
    """(e, k) m/rad or m/m: centre of mass outwards for each joint's position"""
    sway: Array
    """(e, k) m s²/rad or s²: the floor's answer outwards for each joint's acceleration"""
    room: Array
    """(e,) m from the centre of mass to where it may be led; negative beyond"""
    slack: Array
    """(e,) m that accelerations may take"""
    edge: Array
    """(e,) m from the centre of mass to the edge"""
    lost: Array
    """(e,) m by which edges count as nearer, for a robot that is tilted or tilting"""
    reserve: Array
    """(e,) m of that which driving leaves"""
    outwards: Array
    """(e, 2) normals of the edges in the base's axes"""
    height: float
    """s²: h / g"""
    moment: Array
    """(2,) m s²: d in the base's axes"""

    def acceleration(self) -> Array:
        """(k,) rad/s² or m/s² that each joint may take alone; inf for one that tips nothing."""
        return (self.slack[:, None] / np.maximum(np.abs(self.sway), TINY)).min(axis=0)

    def together(self, acceleration: Array) -> float:
        """Share of (k,) accelerations that joints may take at once, 1 for any alone.

        What they do to the floor's answer may cancel; but joints come to rest at different times, so only
        half of that is counted on.
        """
        parts = self.sway * acceleration
        push = 0.5 * (np.abs(parts.sum(axis=1)) + np.abs(parts).sum(axis=1))
        return float(np.min(self.slack / np.maximum(push, self.slack), initial=1.0))

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
        room = CURVE * np.maximum(self.edge - self.lost - self.reserve, 0.0)
        return max(SLOWEST, _share(room, self.push(twist, np.zeros(3))) ** 0.5)

    def bearable(self, twist: Array, change: Array) -> float:
        """Share of a change of twist (see `push`) that the footing bears on top of the twist itself.

        Never less than `SLOWEST`, so that a base can always come to rest; but a robot that is tilting may
        have to wait with it.
        """
        spare = self.edge - self.reserve - np.maximum(self.push(twist, np.zeros(3)), 0.0)
        push = self.push(np.zeros(3), change)
        return min(max(SLOWEST, _share(spare, push)), _share(spare - self.lost, push))

    def allows(self, shift: Array, direction: Array) -> NDArray[np.bool_]:
        """(k,) whether joints may go on that way.

        Args:
            shift: (k,) rad or m from where the joints are to where they come to rest if they stop now.
            direction: (k,) signs.
        """
        left = self.room - self.lean @ shift
        outwards = self.lean * direction
        worse = (left[:, None] < 0.0) & (outwards > TINY)
        return np.logical_not(np.any(worse, axis=0))


def _share(room: Array, push: Array) -> float:
    """The largest share of pushes that stays within the room on every side; 0 to 1."""
    out = push > TINY
    return float(np.clip(np.min(room[out] / push[out], initial=1.0), 0.0, 1.0))


class Footing:
    """The support of one robot: the parts that touch the floor."""

    def __init__(
        self, joints: JointArrays, base: Link, links: Sequence[Link], rolling: Sequence[bool]
    ) -> None:
        """Look at a robot that stands on these links; those that roll touch the floor below their middle.

        Twists of driving count in the base's frame.
        """
        self._joints = joints
        self._base = base
        self._links = tuple(zip(links, rolling, strict=True))
        self._last: Balance | None = None
        self._upright, self._seen = np.zeros(2), -np.inf
        self._fresh = False

    def forget(self) -> None:
        """The robot has moved since."""
        self._fresh = False

    def balance(self, places: Indices) -> Balance | None:
        """Of some joints, at the last step before `forget` was called last; None while the support is no
        area, as with everything on one line.
        """
        if not self._fresh:
            self._last, self._fresh = self._balance(), True
        last = self._last
        return last and replace(last, lean=last.lean[:, places], sway=last.sway[:, places])

    def _balance(self) -> Balance | None:
        world = self._joints.world
        model, data = world.model, world.data
        points = self._points(model, data)
        edges = hull_edges(points[:, :2])
        if edges is None:
            return None
        normals, bounds, middle = edges
        root = int(self._joints.body.mujoco_ids[0])
        mass = float(model.body_subtreemass[root])
        dofs = self._joints.dofs
        shift, spin = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacSubtreeCom(model, data, shift, root)
        mujoco.mj_angmomMat(model, data, spin, root)
        shift, spin = shift[:, dofs], spin[:, dofs]
        com = data.subtree_com[root]
        floor = float(points[:, 2].min())
        height = com[2] - floor
        base = int(self._base.mujoco_id)
        axes = data.xmat[base].reshape(3, 3)[:2, :2]
        moment = spin[:2] + mass * height * np.array([-shift[1], shift[0]])
        gravity = max(float(np.linalg.norm(model.opt.gravity)), TINY)
        weight = mass * gravity
        way, edge = bounds - normals @ middle, bounds - normals @ com[:2]
        reserve, lost = RESERVE * way, self._lost(normals, base, height, gravity)
        return Balance(
            lean=normals @ shift[:2],
            sway=normals @ (np.array([-moment[1], moment[0]]) / weight),
            room=LEAN * way - normals @ (com[:2] - middle) - lost,
            slack=np.clip(edge - reserve - lost, SLOWEST * SWAY * way, SWAY * way),
            edge=edge,
            lost=lost,
            reserve=reserve,
            outwards=normals @ axes,
            height=mass * height / weight,
            moment=self._first_moment(model, data, floor, data.xpos[base]) @ axes / weight,
        )

    def _lost(self, normals: Array, base: int, height: float, gravity: float) -> Array:
        """(e,) m that edges count as nearer, for a base that is tilted or tilting."""
        data = self._joints.world.data
        height, axis = max(height, 0.0), data.xmat[base].reshape(3, 3)[:2, 2]
        kept = np.exp(min(self._seen - data.time, 0.0) / SETTLING)
        self._upright, self._seen = axis + kept * (self._upright - axis), float(data.time)
        shift = normals @ (height * (axis - self._upright))
        speed = normals @ (height * data.cvel[base, [1, 0]] * [1.0, -1.0])
        ahead = CAUTION * np.maximum(speed, 0.0) * (height / gravity) ** 0.5
        return ahead + (CAUTION + 1.0) * np.abs(shift) - shift

    def _first_moment(self, model: mujoco.MjModel, data: mujoco.MjData, floor: float, origin: Array) -> Array:
        """(2,) kg m²: sum of mass times height above the floor times way from the origin, in world axes."""
        bodies = self._joints.body.mujoco_ids
        mass, place = model.body_mass[bodies], data.xipos[bodies]
        turned = data.ximat[bodies].reshape(-1, 3, 3)
        own = -np.einsum("nij,nj,nj->i", turned[:, :2], model.body_inertia[bodies], turned[:, 2])
        return (mass * (place[:, 2] - floor)) @ (place[:, :2] - origin[:2]) + own

    def _points(self, model: mujoco.MjModel, data: mujoco.MjData) -> Array:
        """(n, 3) m, world frame: the lowest points of the links' shapes."""
        found = []
        for link, rolls in self._links:
            for i in link.geom_ids:
                if not model.geom_contype[i] and not model.geom_conaffinity[i]:
                    continue
                if rolls or model.geom_type[i] == mujoco.mjtGeom.mjGEOM_SPHERE:
                    radius = float(model.geom_aabb[i, 3:].max())
                    found.append(data.geom_xpos[i][None] - [0.0, 0.0, radius])
                    continue
                centre, half = model.geom_aabb[i, :3], model.geom_aabb[i, 3:]
                signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
                corners = data.geom_xpos[i] + (centre + signs * half) @ data.geom_xmat[i].reshape(3, 3).T
                low = corners[:, 2] <= corners[:, 2].min() + 0.5 * half.min()
                found.append(corners[low])
        return np.concatenate(found) if found else np.zeros((0, 3))


def footing_of(robot: RobotBody) -> Footing | None:
    """What a robot on wheels stands on; None for one that is fixed, walks, or does not say what else than two
    driven wheels touches the floor.
    """
    if robot.locomotion is None:
        return None
    links = robot.locomotion.floor_touching_links
    if robot.definition.holonomic_base is None:
        driven = {robot.body.joint(name).child.name for name in robot.locomotion.joint_names}
        if robot.two_wheel is None or robot.body.is_fixed or driven.issuperset(link.name for link in links):
            return None
    above = robot.description.parent_joint
    rolling = [link.name in above and above[link.name].is_moving for link in links]
    return Footing(robot.joints, robot.base_link, links, rolling) if links else None

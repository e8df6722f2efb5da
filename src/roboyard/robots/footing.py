"""What keeps a robot that stands upright: the floor it stands on, and how its joints' motion tips it.

With c its centre of mass, W its weight and L its angular momentum about the ground below the support, the
floor pushes at

    p = c_xy + (-L̇_y, L̇_x) / W

and the robot stands as long as p lies within the convex hull of its wheels. An acceleration a_i of joint i
shifts p by s_i a_i, and a change of its position shifts c_xy by J_i. (Vukobratović and Borovac, "Zero-moment
point: thirty-five years of its life", 2004.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray

from roboyard.poses import Array
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
    reserve: Array
    """(e,) m of that which driving leaves"""

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

    def bearable(self, acceleration: Array) -> float:
        """Share of an acceleration of all k joints together that the footing bears in this posture.

        Never less than `SLOWEST`, so that a base can always come to rest.
        """
        push = self.sway @ acceleration
        outwards = push > TINY
        if not outwards.any():
            return 1.0
        share = float(((self.edge - self.reserve)[outwards] / push[outwards]).min())
        return min(1.0, max(share, SLOWEST))

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


class Footing:
    """The support of one robot: the parts that touch the floor."""

    def __init__(self, joints: JointArrays, links: Sequence[Link], rolling: Sequence[bool]) -> None:
        """Look at a robot that stands on these links; those that roll touch the floor below their middle."""
        self._joints = joints
        self._links = tuple(zip(links, rolling, strict=True))
        self._last: Balance | None = None
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
        height = com[2] - float(points[:, 2].min())
        moment = spin[:2] + mass * height * np.array([-shift[1], shift[0]])
        weight = mass * max(float(np.linalg.norm(model.opt.gravity)), TINY)
        way = bounds - normals @ middle
        return Balance(
            lean=normals @ shift[:2],
            sway=normals @ (np.array([-moment[1], moment[0]]) / weight),
            room=LEAN * way - normals @ (com[:2] - middle),
            slack=SWAY * way,
            edge=bounds - normals @ com[:2],
            reserve=RESERVE * way,
        )

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
    return Footing(robot.joints, links, rolling) if links else None


def hull_edges(points: Array) -> tuple[Array, Array, Array] | None:
    """Edges of the convex hull of points in the plane (Andrew's monotone chain).

    Args:
        points: (n, 2) m.

    Returns:
        (e, 2) outward normals, (e,) m of each edge along its normal, (2,) mean of the corners; None where the
        hull has no area.
    """
    order = sorted({(float(x), float(y)) for x, y in points})
    if len(order) < 3:
        return None
    corners = np.array(_half(order)[:-1] + _half(order[::-1])[:-1])
    along = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(along, axis=1)
    area = 0.5 * abs(float(np.sum(corners[:, 0] * along[:, 1] - corners[:, 1] * along[:, 0])))
    if len(corners) < 3 or area < TINY + 1e-3 * float(length.max()) ** 2:
        return None
    normals = np.stack([along[:, 1], -along[:, 0]], axis=1) / length[:, None]
    return normals, np.sum(normals * corners, axis=1), corners.mean(axis=0)


def _half(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """One side of the hull of sorted points, counter-clockwise."""
    kept: list[tuple[float, float]] = []
    for x, y in points:
        while len(kept) > 1:
            (ax, ay), (bx, by) = kept[-2], kept[-1]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                break
            kept.pop()
        kept.append((x, y))
    return kept

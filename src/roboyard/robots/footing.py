"""What a robot that stands upright stands on: the support of its wheels, see `roboyard.robots.balance`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from roboyard.poses import Array
from roboyard.robots.balance import TINY, Balance
from roboyard.robots.definition import VIRTUAL_JOINTS
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
CAUTION = 2.0
"""How many times over a tilt counts."""
SETTLING = 1.0
"""s"""


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
        self._rolls = [i for name, i in joints.index.items() if name in VIRTUAL_JOINTS[3:5]]
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
        swing = normals @ (self._support(model, data, weight) - com[:2])
        return Balance(
            lean=normals @ shift[:2],
            sway=normals @ (np.array([-moment[1], moment[0]]) / weight),
            room=LEAN * way - normals @ (com[:2] - middle) - lost,
            slack=SWAY * way,
            edge=edge,
            lost=lost,
            reserve=reserve,
            swing=swing,
            outwards=normals @ axes,
            height=mass * height / weight,
            moment=self._first_moment(model, data, floor, data.xpos[base]) @ axes / weight,
        )

    def _support(self, model: mujoco.MjModel, data: mujoco.MjData, weight: float) -> Array:
        """(2,) m, world frame: where the floor would push if nothing accelerated.

        From the moment about the base's origin that MuJoCo's bias asks of the joints that carry it.
        """
        body = self._joints.body
        if body.free_dof >= 0:
            root = int(body.mujoco_ids[0])
            bias = data.qfrc_bias[body.free_dof : body.free_dof + 6]
            moment, origin = data.xmat[root].reshape(3, 3)[:2] @ bias[3:], data.xpos[root]
        else:
            dofs = self._joints.dofs[self._rolls]
            joints = model.dof_jntid[dofs]
            moment = data.qfrc_bias[dofs] @ data.xaxis[joints, :2]
            origin = data.xanchor[joints[0]]
        return origin[:2] + np.array([-moment[1], moment[0]]) / weight

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

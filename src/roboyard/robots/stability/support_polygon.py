"""The support of a robot that stands upright: its wheels, see `roboyard.robots.stability.zmp`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from roboyard._lazy import lazy_module
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.robots.joint_arrays import Indices, JointArrays
from roboyard.robots.stability.zmp import TINY, BalanceMargins
from roboyard.sim.link import Link
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.robots.robot_body import RobotBody

_kernels = lazy_module("roboyard.robots.stability.kernels")

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


class SupportPolygon:
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
        self._last: BalanceMargins | None = None
        self._rolls = [i for name, i in joints.index.items() if name in VIRTUAL_JOINTS[3:5]]
        self._upright, self._seen = np.zeros(2), -np.inf
        self._fresh = False
        self._revision = -1
        self._geoms = self._round = self._points = self._edges = np.zeros(0)

    def forget(self) -> None:
        """The robot has moved since."""
        self._fresh = False

    def balance(self, places: Indices) -> BalanceMargins | None:
        """Of some joints, at the last step before `forget` was called last; None while the support is no
        area, as with everything on one line.
        """
        if not self._fresh:
            self._last, self._fresh = self._balance(), True
        last = self._last
        if last is None:
            return None
        com_shift, zmp_shift = last.com_shift.take(places, axis=1), last.zmp_shift.take(places, axis=1)
        return replace(last, com_shift=com_shift, zmp_shift=zmp_shift)

    def _balance(self) -> BalanceMargins | None:
        world = self._joints.world
        model, data = world.live_model, world.live_data
        support = self._ground(model, data)
        if support is None:
            return None
        normals, bounds, middle, floor = support
        root = int(self._joints.body.mujoco_ids[0])
        mass = float(model.body_subtreemass[root])
        dofs = self._joints.dofs
        shift, spin = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacSubtreeCom(model, data, shift, root)
        mujoco.mj_angmomMat(model, data, spin, root)
        com = data.subtree_com[root]
        height = float(com[2]) - floor
        base = int(self._base.mujoco_id)
        axes = data.xmat[base].reshape(3, 3)[:2, :2]
        x, y, z = model.opt.gravity.tolist()
        gravity = max(math.sqrt(x * x + y * y + z * z), TINY)
        weight = mass * gravity
        com_shift, zmp_shift = np.empty((len(normals), len(dofs))), np.empty((len(normals), len(dofs)))
        _kernels().tipping(shift, spin, dofs, com, mass, height, weight, normals, com_shift, zmp_shift)
        way, edge = bounds - normals @ middle, bounds - normals @ com[:2]
        lost = self._lost(normals, base, height, gravity)
        swing = normals @ (self._support(model, data, weight) - com[:2])
        moment = np.empty(2)
        _kernels().first_moment(
            *(self._joints.body.mujoco_ids, model.body_mass, model.body_inertia, data.xipos, data.ximat),
            *(floor, *data.xpos[base, :2].tolist(), moment),
        )
        return BalanceMargins(
            com_shift=com_shift,
            zmp_shift=zmp_shift,
            com_margin=edge - (1.0 - LEAN) * way - lost,
            zmp_margin=SWAY * way,
            edge=edge,
            lost=lost,
            reserve=RESERVE * way,
            swing=swing,
            outwards=normals @ axes,
            height=mass * height / weight,
            moment=moment @ axes / weight,
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
        data = self._joints.world.live_data
        height, axis = max(height, 0.0), data.xmat[base].reshape(3, 3)[:2, 2]
        kept = np.exp(min(self._seen - data.time, 0.0) / SETTLING)
        self._upright, self._seen = axis + kept * (self._upright - axis), float(data.time)
        shift = normals @ (height * (axis - self._upright))
        speed = normals @ (height * data.cvel[base, [1, 0]] * [1.0, -1.0])
        ahead = CAUTION * np.maximum(speed, 0.0) * (height / gravity) ** 0.5
        return ahead + (CAUTION + 1.0) * np.abs(shift) - shift

    def _ground(self, model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Array, Array, Array, float] | None:
        """Edges of what the robot stands on as `hull_edges` gives them, and the floor's height (m)."""
        if self._revision != self._joints.world.revision:
            self._find_shapes(model)
        points, edges = self._points, self._edges
        count = _kernels().lowest_points(
            *(self._geoms, self._round, model.geom_contype, model.geom_conaffinity, model.geom_aabb),
            *(data.geom_xpos, data.geom_xmat, points),
        )
        middle = np.empty(2)
        found = _kernels().hull_edges(points, count, edges[:, :2], edges[:, 2], middle)
        if not found:
            return None
        return edges[:found, :2].copy(), edges[:found, 2].copy(), middle, float(points[:count, 2].min())

    def _find_shapes(self, model: mujoco.MjModel) -> None:
        """The shapes below the robot in a freshly compiled model."""
        ball = mujoco.mjtGeom.mjGEOM_SPHERE
        geoms = [
            (i, rolls or model.geom_type[i] == ball) for link, rolls in self._links for i in link.geom_ids
        ]
        self._geoms = np.array([i for i, _ in geoms], dtype=np.int64)
        self._round = np.array([is_round for _, is_round in geoms], dtype=bool)
        self._points = np.empty((8 * len(geoms), 3))
        self._edges = np.empty((8 * len(geoms), 3))
        self._revision = self._joints.world.revision


def support_polygon_of(robot: RobotBody) -> SupportPolygon | None:
    """What a robot on wheels stands on; None for one that is fixed, walks, or does not say what else than two
    driven wheels touches the floor.
    """
    if robot.locomotion is None:
        return None
    links = robot.locomotion.floor_touching_links
    if robot.definition.holonomic_base is None:
        driven = {robot.joint(name).child.name for name in robot.locomotion.joint_names}
        if robot.two_wheel is None or robot.body.is_fixed or driven.issuperset(link.name for link in links):
            return None
    above = robot.description.parent_joint
    rolling = [link.name in above and above[link.name].is_moving for link in links]
    return SupportPolygon(robot.joint_arrays, robot.base_link, links, rolling) if links else None

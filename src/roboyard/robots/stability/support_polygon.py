"""The support polygon of a robot on wheels, and its stability margins; see
`roboyard.robots.stability.zmp`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._mujoco import mujoco
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.robots.joint_arrays import Indices, JointArrays
from roboyard.robots.stability.zmp import TINY, BalanceMargins
from roboyard.sim.link import Link
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.robots.robot_body import RobotBody

_kernels = lazy_module("roboyard.robots.stability.kernels")

MAX_COM_SHIFT = 0.75
"""Largest shift of the centre of mass, as a fraction of the distance from the middle of the support to an
edge.
"""
MAX_ZMP_SHIFT = 0.25
"""Largest shift of the zero-moment point by joint accelerations, as a fraction of the same distance."""
RESERVE = 0.08
"""Distance from the edge that driving keeps, as a fraction of the same distance."""
CAUTION = 2.0
"""Factor on the shift of the margins by a tilt."""
UPRIGHT_TIME = 1.0
"""Time constant of the upright direction (s), as floors slope."""


class SupportPolygon:
    """The support of one robot: convex hull of the points where it touches the floor."""

    def __init__(
        self, joints: JointArrays, base: Link, links: Sequence[Link], rolling: Sequence[bool]
    ) -> None:
        """Create the support of a robot.

        Args:
            joints: of the robot.
            base: link in whose frame driving velocities are given.
            links: that touch the floor.
            rolling: whether each link rolls, and so touches the floor below its centre.
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
        """Discard the cached margins after a motion of the robot."""
        self._fresh = False

    def balance(self, indices: Indices) -> BalanceMargins | None:
        """Return the margins for the joints at (k,) `indices`; None while the support has no area.

        They are computed once after each call of `forget`.
        """
        if not self._fresh:
            self._last, self._fresh = self._balance(), True
        last = self._last
        if last is None:
            return None
        com_shift, zmp_shift = last.com_shift.take(indices, axis=1), last.zmp_shift.take(indices, axis=1)
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
            com_margin=edge - (1.0 - MAX_COM_SHIFT) * way - lost,
            zmp_margin=MAX_ZMP_SHIFT * way,
            edge=edge,
            lost=lost,
            reserve=RESERVE * way,
            swing=swing,
            outwards=normals @ axes,
            height=mass * height / weight,
            moment=moment @ axes / weight,
        )

    def _support(self, model: mujoco.MjModel, data: mujoco.MjData, weight: float) -> Array:
        """Return the (2,) zero-moment point without accelerations, in the world frame (m).

        From the moment about the base's origin in MuJoCo's bias forces of the base's joints.
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
        """Return the (e,) distances (m) by which margins shrink for a base that is tilted or tilting."""
        data = self._joints.world.live_data
        height, axis = max(height, 0.0), data.xmat[base].reshape(3, 3)[:2, 2]
        kept = np.exp(min(self._seen - data.time, 0.0) / UPRIGHT_TIME)
        self._upright, self._seen = axis + kept * (self._upright - axis), float(data.time)
        shift = normals @ (height * (axis - self._upright))
        speed = normals @ (height * data.cvel[base, [1, 0]] * [1.0, -1.0])
        ahead = CAUTION * np.maximum(speed, 0.0) * (height / gravity) ** 0.5
        return ahead + (CAUTION + 1.0) * np.abs(shift) - shift

    def _ground(self, model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Array, Array, Array, float] | None:
        """Return normals, bounds and middle of the support as `hull_edges`, and the floor's height (m)."""
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
        """Find the shapes of the floor links in a newly compiled model."""
        sphere = mujoco.mjtGeom.mjGEOM_SPHERE
        geoms = [
            (i, rolls or model.geom_type[i] == sphere) for link, rolls in self._links for i in link.geom_ids
        ]
        self._geoms = np.array([i for i, _ in geoms], dtype=np.int64)
        self._round = np.array([is_round for _, is_round in geoms], dtype=bool)
        self._points = np.empty((8 * len(geoms), 3))
        self._edges = np.empty((8 * len(geoms), 3))
        self._revision = self._joints.world.revision


def support_polygon_of(robot: RobotBody) -> SupportPolygon | None:
    """Return the support of a robot on wheels.

    None for a robot that is fixed or walks, and for one on two driven wheels whose definition lists no other
    link that touches the floor.
    """
    if robot.locomotion is None:
        return None
    links = robot.locomotion.floor_touching_links
    if robot.definition.holonomic_base is None:
        driven = {robot.joint(name).child.name for name in robot.locomotion.joint_names}
        if robot.two_wheel is None or robot.body.is_fixed:
            return None
        if len(driven) == 2 and driven.issuperset(link.name for link in links):
            return None
    above = robot.description.parent_joint
    rolling = [link.name in above and above[link.name].is_moving for link in links]
    return SupportPolygon(robot.joint_arrays, robot.base_link, links, rolling) if links else None

"""New bodies on their own: their state is read and written before the world is compiled with them.

Programs load many robots and read or set each before they load the next one. A compile of the world for each
takes time that grows with the square of their number. The third and later ones at one moment are therefore
avoided (`Engine.lone_body`): the joints and link frames of a new body are kept in a compile of it alone,
without shapes, which all bodies of its description have in common. The next compile of the world takes the
state over.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard._records import dataclass, replace
from roboyard.description.model import RobotDescription
from roboyard.sim.build.bodies import build
from roboyard.sim.build.mesh_assets import MeshAssets
from roboyard.sim.build.planned import PlannedBody
from roboyard.sim.build.solver_options import new_spec
from roboyard.transforms import Array, to_wxyz

_MOST_TREES = 64
_MEMORY = 2**16
"""Bytes of MuJoCo's arena of one body, which has no contacts."""
_NOWHERE, _UNTURNED = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(kw_only=True, slots=True, eq=False)
class LoneTree:
    """A compile of one body without shapes."""

    description: RobotDescription
    model: Any
    data: Any
    """MjData in which the states of all these bodies are computed, one after another."""
    rows: list[int]
    """MuJoCo's row of each link."""
    positions: list[int]
    """First place of each joint in qpos; -1 where it has none."""
    velocities: list[int]
    """First place of each joint in qvel; -1 where it has none."""
    is_free: bool
    """Whether the base moves: its numbers come first."""


_TREES: dict[tuple[int, float, bool, bool], LoneTree | None] = {}
"""By id of a description, which is kept with it, and options."""


class LoneBody:
    """The state of one body, with the members of a world that readers of link states use."""

    kept_frames = None
    """There was no step yet."""

    def __init__(self, tree: LoneTree) -> None:
        """Begin at rest, with all joints at 0."""
        self.tree = tree
        self.live_model, self.live_data = tree.model, tree.data
        self.qpos: Array = tree.model.qpos0.copy()
        self.qvel: Array = np.zeros(tree.model.nv)
        self.prepared: dict[str, dict[int, Any]] = {}
        """Machine code reads the states of compiled bodies only."""
        self._place: tuple[Array, Array] = _NOWHERE, np.array([1.0, 0.0, 0.0, 0.0])

    def put(self, position: Array, quaternion: Array) -> None:
        """Put the root link's frame at a position (3,) (m) and quaternion (4,) x, y, z, w in the world."""
        self._place = position, to_wxyz(quaternion)
        if self.tree.is_free:
            self.qpos[:3], self.qpos[3:7] = self._place

    def kinematics(self) -> Any:
        """Return the MjData with positions that agree with qpos, until those of another body are computed."""
        model, data = self.live_model, self.live_data
        data.qpos[:], data.qvel[:] = self.qpos, self.qvel
        if not self.tree.is_free:
            model.body_pos[1], model.body_quat[1] = self._place
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        return data

    def velocities(self) -> Any:
        """Return the MjData with positions and body velocities that agree with qpos and qvel."""
        data = self.kinematics()
        mujoco.mj_fwdVelocity(self.live_model, data)
        return data

    link_velocities = velocities
    """The same: all links are this body's."""

    def copy_to(self, data: Any, base: int, positions: int, velocities: int) -> None:
        """Copy positions of joints and all velocities into the MjData of a world that has the body.

        Args:
            data: it; the place of the base in it stays.
            base: first place of a free base in qvel.
            positions: first place of the joints in qpos.
            velocities: first place of the joints in qvel.
        """
        qpos, qvel = self.qpos, self.qvel
        if self.tree.is_free:
            data.qvel[base : base + 6] = qvel[:6]
            qpos, qvel = qpos[7:], qvel[6:]
        data.qpos[positions : positions + len(qpos)] = qpos
        data.qvel[velocities : velocities + len(qvel)] = qvel


def lone_body(plan: PlannedBody) -> LoneBody | None:
    """Return a new body alone; None where MuJoCo rejects that."""
    description, options = plan.description, plan.options
    key = id(description), options.scale, options.fixed_base, options.keep_link_order
    tree = _TREES.get(key)
    if tree is None or tree.description is not description:
        tree = _compile(plan)
        if tree is None:
            return None
        _TREES[key] = tree
        while len(_TREES) > _MOST_TREES:
            del _TREES[next(iter(_TREES))]
    return LoneBody(tree)


def _compile(plan: PlannedBody) -> LoneTree | None:
    """Compile a body without its shapes."""
    links = [replace(link, collisions=(), visuals=()) for link in plan.description.links]
    bare = replace(plan.description, links=tuple(links))
    spec = new_spec()
    built = build(spec, MeshAssets(spec, 0), bare, "body/", _NOWHERE, _UNTURNED, plan.options)
    spec.memory = _MEMORY
    try:
        model = spec.compile()
    except ValueError:
        return None
    rows = [int(record.element.id) for record in built.links]
    first = [int(model.body_jntadr[row]) for row in rows[1:]]
    return LoneTree(
        description=plan.description,
        model=model,
        data=mujoco.MjData(model),
        rows=rows,
        positions=[int(model.jnt_qposadr[joint]) if joint >= 0 else -1 for joint in first],
        velocities=[int(model.jnt_dofadr[joint]) if joint >= 0 else -1 for joint in first],
        is_free=not plan.options.fixed_base,
    )

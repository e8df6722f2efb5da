"""Names and units of all position and velocity coordinates of a world, and their indices in MuJoCo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from roboyard.sim import World

_QUATERNION = (("qx", 1), ("qy", 2), ("qz", 3), ("qw", 0))
"""Components in the public order (x, y, z, w), with their indices in MuJoCo's (w, x, y, z)."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Columns:
    """The columns of a log, n of them."""

    names: tuple[str, ...]
    """ "body/joint", with ".x", ".qw" and the like where a joint has several."""
    units: tuple[str, ...]
    """ "m", "rad", "m/s", "rad/s", or "1" for components of quaternions."""
    places: np.ndarray
    """(n,) index of each column in MuJoCo's qpos or qvel."""


def position_columns(world: World) -> Columns:
    """Return the columns of all position coordinates of a world; quaternions are (x, y, z, w)."""
    world.ensure_compiled()
    rows: list[tuple[str, str, int]] = []

    def point(name: str, start: int) -> None:
        rows.extend((f"{name}.{axis}", "m", start + k) for k, axis in enumerate("xyz"))

    def turn(name: str, start: int) -> None:
        rows.extend((f"{name}.{axis}", "1", start + k) for axis, k in _QUATERNION)

    for body in world.bodies:
        if body.free_qpos >= 0:
            point(f"{body.name}/base", body.free_qpos)
            turn(f"{body.name}/base", body.free_qpos + 3)
        for joint in body.joints:
            if joint.type == "fixed":
                continue
            name, start = f"{body.name}/{joint.name}", joint.qpos_slice.start
            if joint.type == "spherical":
                turn(name, start)
            elif joint.type == "floating":
                point(name, start)
                turn(name, start + 3)
            elif joint.type == "planar":
                rows += [(f"{name}.x", "m", start), (f"{name}.y", "m", start + 1)]
                rows.append((f"{name}.angle", "rad", start + 2))
            else:
                rows.append((name, "m" if joint.type == "prismatic" else "rad", start))
    return _columns(rows, world.model.nq, "qpos")


def velocity_columns(world: World) -> Columns:
    """Return the columns of all velocity coordinates of a world.

    Linear velocities of a free base are in the world frame, its angular velocities (wx, wy, wz) in its own.
    """
    world.ensure_compiled()
    rows: list[tuple[str, str, int]] = []

    def both(name: str, start: int) -> None:
        rows.extend((f"{name}.v{axis}", "m/s", start + k) for k, axis in enumerate("xyz"))
        rows.extend((f"{name}.w{axis}", "rad/s", start + 3 + k) for k, axis in enumerate("xyz"))

    for body in world.bodies:
        if body.free_dof >= 0:
            both(f"{body.name}/base", body.free_dof)
        for joint in body.joints:
            if joint.type == "fixed":
                continue
            name, start = f"{body.name}/{joint.name}", joint.dof_slice.start
            if joint.type == "spherical":
                rows.extend((f"{name}.w{axis}", "rad/s", start + k) for k, axis in enumerate("xyz"))
            elif joint.type == "floating":
                both(name, start)
            elif joint.type == "planar":
                rows += [(f"{name}.vx", "m/s", start), (f"{name}.vy", "m/s", start + 1)]
                rows.append((f"{name}.w", "rad/s", start + 2))
            else:
                rows.append((name, "m/s" if joint.type == "prismatic" else "rad/s", start))
    return _columns(rows, world.model.nv, "qvel")


def _columns(rows: list[tuple[str, str, int]], size: int, kind: str) -> Columns:
    known = {place for _, _, place in rows}
    rows += [(f"{kind}[{k}]", "", k) for k in range(size) if k not in known]
    return Columns(
        names=tuple(name for name, _, _ in rows),
        units=tuple(unit for _, unit, _ in rows),
        places=np.array([place for _, _, place in rows], dtype=np.int64),
    )

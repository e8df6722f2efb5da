"""Equalities of an MJCF model that close loops of bodies, as loop joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from roboyard.description.geometry import pose_from_matrix
from roboyard.description.model import LoopJoint
from roboyard.transforms import Array, from_wxyz, matrix_from_quaternion

CONNECT, WELD = 0, 1


def loops_of(
    model: Any, links: Mapping[int, str], shifts: Mapping[int, Array], notes: list[str]
) -> tuple[LoopJoint, ...]:
    """Return a spherical joint for each `<connect>` of two links, a fixed one for each `<weld>`.

    Args:
        model: the compiled model.
        links: body to the name of its link.
        shifts: body to the (3,) place of its link's frame in the body's frame (m).
        notes: gets a note for each that is omitted.
    """
    from roboyard._mujoco import mujoco

    found: list[LoopJoint] = []
    taken = {model.equality(e).name for e in range(model.neq)}
    for e in range(model.neq):
        kind = int(model.eq_type[e])
        if kind not in (CONNECT, WELD):
            continue
        free = (f"loop{e + k}" for k in range(model.neq + 1))
        name = model.equality(e).name or next(each for each in free if each not in taken)
        taken.add(name)
        by_site = int(model.eq_objtype[e]) == int(mujoco.mjtObj.mjOBJ_SITE)
        ids = [int(model.eq_obj1id[e]), int(model.eq_obj2id[e])]
        bodies = [int(model.site_bodyid[i]) for i in ids] if by_site else ids
        if any(body not in links for body in bodies) or bodies[0] == bodies[1]:
            notes.append(f"equality {name!r} is omitted: it does not join two links of the robot")
            continue
        if not model.eq_active0[e]:
            notes.append(f"equality {name!r} is omitted: it is switched off")
            continue
        frames = _site_frames(model, ids) if by_site else _body_frames(model.eq_data[e], kind)
        for frame, body in zip(frames, bodies, strict=True):
            frame[:3, 3] -= shifts[body]
        found.append(
            LoopJoint(
                name=name,
                type="spherical" if kind == CONNECT else "fixed",
                first=links[bodies[0]],
                second=links[bodies[1]],
                first_origin=pose_from_matrix(frames[0]),
                second_origin=pose_from_matrix(frames[1]),
            )
        )
    return tuple(found)


def _site_frames(model: Any, sites: list[int]) -> list[Array]:
    return [_matrix(model.site_pos[site], model.site_quat[site]) for site in sites]


def _body_frames(data: Array, kind: int) -> list[Array]:
    """Return the frames in both bodies: a connect has two anchors, a weld also the pose of the second."""
    if kind == CONNECT:
        return [_matrix(data[0:3], (1, 0, 0, 0)), _matrix(data[3:6], (1, 0, 0, 0))]
    return [_matrix(data[3:6], data[6:10]), _matrix(data[0:3], (1, 0, 0, 0))]


def _matrix(position: Any, quaternion: Any) -> Array:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = matrix_from_quaternion(from_wxyz(quaternion)), position
    return pose

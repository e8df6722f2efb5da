"""Worlds to compare with those that have inactive bodies."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from roboyard.sim import World
from roboyard.sim.pool.templates import KINDS

TRIANGLES = np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.3, 0], [0, 0, 0.4]], dtype=float)


def mesh():
    from roboyard.shapes.mesh import TriangleMesh

    return TriangleMesh(vertices=TRIANGLES, faces=np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))


def assert_same_model(live: mujoco.MjModel, real: mujoco.MjModel) -> None:
    """All rows of bodies are the same; the live model may have more of them."""
    trees = int(real.body_bvhnum.sum())  # those of meshes come after
    for name in (n for n in dir(mujoco.MjModel) if n.startswith(KINDS)):
        a, b = getattr(live, name), getattr(real, name)
        b = b[:trees] if name.startswith("bvh") else b
        if isinstance(b, np.ndarray) and name != "dof_simplenum":  # which includes inactive bodies
            assert a.dtype == b.dtype
            np.testing.assert_allclose(a[: len(b)], b, rtol=1e-12, atol=1e-13, err_msg=name)
    assert live.stat.meaninertia == pytest.approx(real.stat.meaninertia, rel=1e-12)


def twin_of(world: World) -> World:
    """A world of the same bodies, all built at once, in the same state."""
    twin = World(profile=world.profile, visual_geoms=world.visual_geoms)
    for body in world.bodies:
        assert body.description is not None
        copy = twin.add_description(body.description, *body.pose, fixed_base=body.is_fixed, name=body.name)
        for mine, theirs in zip(copy.links, body.links, strict=True):
            mine.friction = theirs.friction
            mine.restitution = theirs.restitution
    data, live = twin.data, world.live_data
    data.time = live.time
    for mine, theirs in zip(twin.bodies, world.bodies, strict=True):
        if mine.free_qpos >= 0:
            data.qpos[mine.free_qpos :][:7] = live.qpos[theirs.free_qpos :][:7]
            data.qvel[mine.free_dof :][:6] = live.qvel[theirs.free_dof :][:6]
            data.qacc_warmstart[mine.free_dof :][:6] = live.qacc_warmstart[theirs.free_dof :][:6]
    twin.mark_moved()
    return twin

"""A body on the page before its world is compiled looks as it does afterwards."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from roboyard.assets import asset_path
from roboyard.sim import World
from roboyard.sim.body import Body
from roboyard.sim.queries.default_view import extreme_points
from roboyard.viewer import Viewer
from roboyard.viewer.scene.snapshot import PoseSender, gather_links, take

pytest.importorskip("viser")


@pytest.mark.parametrize("fixed", [True, False])
@pytest.mark.parametrize("robot", ["arm7", "r1", "rover"])
def test_a_body_is_sent_before_the_world_is_compiled(robot: str, fixed: bool) -> None:
    world = World()
    world.add_plane()
    with Viewer(world, port=0, quiet=True) as viewer:
        body = world.add_urdf(asset_path(robot), fixed_base=fixed)
        limits = body.joint_limits
        rest = dict(zip(body.joint_names, np.clip(0.0, limits[:, 0], limits[:, 1]).tolist(), strict=True))
        viewer.show_uncompiled(body, rest).join()
        assert world.is_stale
        early = viewer._published
        assert early is not None
        handles = dict(viewer.nodes._shapes)
        poses = [a.copy() for a in viewer._poses or ()]
        points = viewer.first_view._points

        body.joint_positions = rest
        seen = extreme_points([body])  # of all shapes, those of collisions among them
        body.set_pose(position=(0.0, 0.0, body.position[2] - _lowest_visual(world, body)))
        viewer.sync(wait=True)
        after = viewer._published
        assert after is not None
        assert after.links.paths == early.links.paths
        assert after.links.fixed == early.links.fixed
        assert viewer.nodes._shapes == handles  # nothing is sent twice
        assert viewer._poses is not None
        for owner, row in after.links.by_owner.items():
            if owner[0] == body.id:
                before = poses[0][early.links.by_owner[owner]], poses[1][early.links.by_owner[owner]]
                np.testing.assert_allclose(before[0], viewer._poses[0][row], atol=1e-6)
                assert abs(before[1] @ viewer._poses[1][row]) == pytest.approx(1.0, abs=1e-6)
        assert (np.ptp(points, axis=0) <= 1.02 * np.ptp(seen, axis=0)).all()  # extremes in few directions
        assert points[:, 2].min() == pytest.approx(0.0, abs=1e-9)


def _lowest_visual(world: World, body: Body) -> float:
    """Return the height (m) of the lowest visible vertex of a body."""
    snapshot = take(world, world.model, gather_links(world))
    positions, quaternions = PoseSender().poses(snapshot.model, snapshot.qpos)
    heights = []
    for shape in snapshot.shapes:
        if shape.owner[0] == body.id:
            row = snapshot.links.by_owner[shape.owner]
            w, x, y, z = quaternions[row]
            up = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
            local = shape.mesh.vertices * np.asarray(shape.scale)
            local = local @ np.asarray(shape.rotation).T + np.asarray(shape.position)
            heights.append((local @ up).min() + positions[row][2])
    return float(min(heights))


def test_a_body_without_a_description_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "ball.xml"
    ball = "<body><freejoint/><geom size='0.1'/></body>"
    file.write_text(f"<mujoco><worldbody>{ball}</worldbody></mujoco>", encoding="utf-8")
    world = World()
    world.add_plane()
    with Viewer(world, port=0, quiet=True) as viewer:
        body = world.add_mjcf(file)[0]
        with pytest.raises(ValueError, match="has no description; add it from one"):
            viewer.show_uncompiled(body, {})

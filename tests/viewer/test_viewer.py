from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from roboyard.sim import World
from roboyard.transforms import from_wxyz, matrix_from_quaternion
from roboyard.viewer import Viewer

pytest.importorskip("viser")


def poses_of(viewer: Viewer) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return position and rotation matrix of each link's node."""
    nodes = viewer.nodes._frames
    return {
        path: (np.array(node.position), matrix_from_quaternion(from_wxyz(node.wxyz)))
        for path, node in nodes.items()
    }


def visuals(viewer: Viewer) -> list[str]:
    names = viewer.server.scene._handle_from_node_name
    return sorted(name for name in names if "/visual " in name)


def expect_poses(viewer: Viewer, world: World) -> None:
    positions, rotations = world.frames()
    poses = poses_of(viewer)
    assert len(poses) == sum(len(body.links) for body in world.bodies)
    for body in world.bodies:
        for link in body.links:
            place, turn = poses[f"/{body.name}/{link.name}"]
            np.testing.assert_allclose(place, positions[link.mujoco_id], atol=3e-6)
            np.testing.assert_allclose(turn, rotations[link.mujoco_id], atol=1e-5)


def test_links_have_the_poses_of_the_world(pendulum: Any) -> None:
    world = World()
    world.add_plane()
    body = world.add_urdf(pendulum, position=(0.3, 0.1, 1.0), fixed_base=True)
    body.joint_positions = [0.7]
    with Viewer(world, port=0, quiet=True) as viewer:
        expect_poses(viewer, world)
        world.step(50)
        viewer.sync(wait=True)
        expect_poses(viewer, world)
        assert len(visuals(viewer)) == len(world.render_scene().shapes)


def test_bodies_are_added_and_removed() -> None:
    world = World()
    world.add_plane()
    with Viewer(world, port=0, quiet=True) as viewer:
        assert len(visuals(viewer)) == 1
        box = world.add_box((0.2, 0.2, 0.2), position=(0, 0, 1), name="one")
        other = world.add_sphere(0.1, position=(1, 0, 1), name="two")
        world.step()
        viewer.sync(wait=True)
        assert len(visuals(viewer)) == 3
        expect_poses(viewer, world)
        world.remove(box)
        world.step()
        viewer.sync(wait=True)
        assert len(visuals(viewer)) == 2
        assert not [n for n in viewer.server.scene._handle_from_node_name if n.startswith("/one")]
        expect_poses(viewer, world)
        again = world.add_box((0.1, 0.1, 0.1), position=(0, 1, 1), name="one")
        world.step()
        viewer.sync(wait=True)
        assert len(visuals(viewer)) == 3
        expect_poses(viewer, world)
        assert again.id != box.id
        assert not other.is_removed


def test_a_new_colour_replaces_only_that_shape() -> None:
    world = World()
    box = world.add_box((0.2, 0.2, 0.2))
    world.add_sphere(0.1, position=(1, 0, 0))
    with Viewer(world, port=0, quiet=True) as viewer:
        before = set(visuals(viewer))
        world.render_shapes.change(box, 0, 0, rgba=(1.0, 0.0, 0.0, 1.0))
        viewer.sync(wait=True)
        after = set(visuals(viewer))
        assert len(after) == 2
        assert len(before & after) == 1


def test_browsers_receive_motion_while_the_world_steps(browser, wait) -> None:
    world = World()
    world.add_box((0.2, 0.2, 0.2), position=(0, 0, 5), name="falling")
    with Viewer(world, port=0, quiet=True) as viewer:
        one, two = browser(viewer), browser(viewer)
        wait(lambda: viewer.watchers == 2)

        def moved(message: dict[str, Any]) -> bool:
            return (
                message["type"] == "SetPositionMessage"
                and message["name"].startswith("/falling/")
                and message["position"][2] < 4.0
            )

        world.step(150)
        expected = world.body("falling").position[2]
        for page in (one, two):
            assert page.listen(moved)["position"][2] == pytest.approx(expected, abs=1e-4)
        one.close()
        wait(lambda: viewer.watchers == 1)
        world.step()
        two.listen(lambda m: moved(m) and m["position"][2] < expected - 1e-3)


def test_the_last_of_many_quick_steps_is_shown(browser, wait) -> None:
    world = World()
    world.add_box((0.2, 0.2, 0.2), position=(0, 0, 5), name="falling")
    with Viewer(world, port=0, quiet=True) as viewer:
        browser(viewer)
        wait(lambda: viewer.watchers == 1)
        for _ in range(100):
            world.step()
        wait(lambda: viewer._published is viewer._latest)
        expect_poses(viewer, world)


def test_a_page_opened_after_the_last_step_shows_it(browser, wait) -> None:
    world = World()
    world.add_box((0.2, 0.2, 0.2), position=(0, 0, 5))
    with Viewer(world, port=0, quiet=True) as viewer:
        world.step(100)
        assert poses_of(viewer)["/box/" + world.bodies[0].links[0].name][0][2] == pytest.approx(5.0)
        browser(viewer)
        wait(lambda: viewer.frames_sent >= 2)
        expect_poses(viewer, world)


def test_nothing_is_copied_without_an_open_page() -> None:
    world = World()
    world.add_box((0.2, 0.2, 0.2), position=(0, 0, 5))
    with Viewer(world, port=0, quiet=True) as viewer:
        before = viewer._latest
        world.step(10)
        world.step()
        assert viewer._latest is before
        assert viewer.frames_sent == 1


def test_a_page_changes_nothing_in_the_world(browser, wait, pendulum: Any) -> None:
    def run(with_page: bool) -> np.ndarray:
        world = World()
        body = world.add_urdf(pendulum, position=(0, 0, 1), fixed_base=True)
        world.add_box((0.2, 0.2, 0.2), position=(0.1, 0, 2.0), orientation=(0.1, 0.2, 0.3, 0.9))
        world.add_plane()
        body.joint_positions = [1.0]
        viewer = Viewer(world, port=0, quiet=True) if with_page else None
        if viewer is not None:
            browser(viewer)
            wait(lambda: viewer.watchers == 1)
        for _ in range(300):
            world.step()
        if viewer is not None:
            wait(lambda: viewer.frames_sent > 1)
            viewer.close()
        return np.concatenate([world.data.qpos, world.data.qvel])

    np.testing.assert_array_equal(run(True), run(False))


def test_invalid_messages_are_ignored(browser, wait) -> None:
    world = World()
    world.add_box((0.2, 0.2, 0.2), position=(0, 0, 5), name="falling")
    with Viewer(world, port=0, quiet=True) as viewer:
        for rubbish in (b"\xff\x00rubbish", b"", b"\x81\xa4type\xa4Nope"):
            page = browser(viewer)
            page.socket.send(rubbish)
        good = browser(viewer)
        world.step(10)
        wait(lambda: viewer.watchers >= 1)
        world.step(10)
        good.listen(lambda m: m["type"] == "SetPositionMessage" and m["position"][2] < 5.0)


def test_closing_keeps_the_world() -> None:
    world = World()
    world.add_box((0.2, 0.2, 0.2), position=(0, 0, 5))
    viewer = Viewer(world, port=0, quiet=True)
    viewer.close()
    viewer.close()
    assert world.after_step == []
    world.step(10)
    assert "closed" in repr(viewer)


def test_names_with_slashes_and_equal_names_get_unique_nodes() -> None:
    world = World()
    world.add_box((0.1, 0.1, 0.1), name="a/b")
    world.add_box((0.1, 0.1, 0.1), position=(1, 0, 0), name="a∕b")
    with Viewer(world, port=0, quiet=True) as viewer:
        assert len(poses_of(viewer)) == 2
        assert len(visuals(viewer)) == 2


def test_a_notebook_embeds_the_page() -> None:
    with Viewer(World(), port=0, quiet=True) as viewer:
        html = viewer._repr_html_()
    assert f'<iframe src="{viewer.url}"' in html


def test_viser_loads_only_when_a_viewer_opens() -> None:
    code = "import sys, roboyard.viewer; sys.exit('viser' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0

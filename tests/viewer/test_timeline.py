"""The recorded last minute: what is kept, what is shown, what is saved."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from roboyard import World
from roboyard.recording.state_log import load_log

pytest.importorskip("viser")
from roboyard.viewer import Viewer
from roboyard.viewer.scene.snapshot import Snapshot, gather_links, take
from roboyard.viewer.timeline.moment_log import log_of
from roboyard.viewer.timeline.moments import PERIOD, SPAN, Moments
from roboyard.viewer.timeline.playback import Playback


def falling() -> World:
    world = World(timestep=0.01)
    world.add_plane()
    world.add_box((0.2, 0.2, 0.2), position=(0.0, 0.0, 30.0), name="box")
    return world


def steps(world: World, count: int) -> None:
    for _ in range(count):
        world.step()


def picture(world: World) -> Snapshot:
    return take(world, world.model, gather_links(world))


def filled(world: World, moments: Moments, seconds: float) -> dict[float, float]:
    """Step and record; returns the height of the box at each simulated time."""
    heights = {}
    links = gather_links(world)
    for _ in range(round(seconds / world.timestep)):
        world.step()
        moments.record(world, take(world, world.model, links))
        heights[round(world.time, 6)] = world.bodies[1].position[2]
    return heights


def test_the_last_minute_is_kept() -> None:
    world, moments = falling(), Moments()
    heights = filled(world, moments, SPAN + 5.0)
    kept = moments.all()
    assert kept[-1].clock - kept[0].clock == pytest.approx(SPAN, abs=0.05)
    assert kept[-1].snapshot.time == pytest.approx(SPAN + 5.0, abs=0.02)
    gaps = np.diff([moment.clock for moment in kept])
    assert gaps.min() >= PERIOD - 1e-6
    assert gaps.max() <= PERIOD + world.timestep
    for moment in kept[:: len(kept) // 7]:
        assert moment.snapshot.qpos[2] == heights[round(moment.snapshot.time, 6)]


def test_memory_is_bounded() -> None:
    world = falling()
    whole = Moments()
    filled(world, whole, 1.0)
    each = whole.all()[-1].nbytes
    assert each >= world.data.qpos.nbytes + world.data.qvel.nbytes
    small = Moments(most_bytes=whole.all()[0].nbytes + 10 * each)
    filled(world, small, 1.0)
    assert 8 <= len(small.all()) < len(whole.all())
    assert small.nbytes <= whole.all()[0].nbytes + 10 * each
    assert small.all()[-1].snapshot.time == pytest.approx(world.time, abs=PERIOD)


def test_a_reset_keeps_what_was_before() -> None:
    world, moments = falling(), Moments()
    start = world.save_state()
    filled(world, moments, 0.5)
    world.restore_state(start)
    filled(world, moments, 0.2)
    times = [moment.snapshot.time for moment in moments.all()]
    assert max(times) == pytest.approx(0.5, abs=0.02)
    assert times[-1] < 0.21
    clocks = [moment.clock for moment in moments.all()]
    assert (np.diff(clocks) > 0).all()


def test_scrubbing_replaying_and_going_live() -> None:
    world, moments = falling(), Moments()
    wall = [100.0]
    playback = Playback(moments, clock=lambda: wall[0])
    playback.scrub(1.0)  # nothing is recorded yet
    assert playback.is_live
    assert playback.shown() is None
    filled(world, moments, 2.0)
    assert playback.shown() is None
    playback.scrub(1.5)
    shown = playback.shown()
    assert shown is not None
    assert shown.time == pytest.approx(0.5, abs=PERIOD + 0.01)
    assert playback.shown() is shown
    filled(world, moments, 1.0)  # the world goes on, the picture stays
    assert playback.shown() is shown
    playback.scrub(99.0)
    shown = playback.shown()
    assert shown is not None
    assert shown.time == moments.all()[0].snapshot.time
    playback.replay()
    assert playback.is_replaying
    wall[0] += 0.75
    shown = playback.shown()
    assert shown is not None
    assert shown.time == pytest.approx(moments.all()[0].snapshot.time + 0.75, abs=PERIOD + 0.01)
    wall[0] += 5.0
    assert playback.shown() is None
    assert playback.is_live
    playback.replay()  # while live: from the beginning
    shown = playback.shown()
    assert shown is not None
    assert shown.time == moments.all()[0].snapshot.time
    playback.go_live()
    assert playback.shown() is None


def test_fixed_bodies_are_shown_where_they_were() -> None:
    world = World()
    wall = world.add_box((1.0, 0.1, 1.0), mass=0.0, position=(0.0, 1.0, 0.5), name="wall")
    moments = Moments()
    playback = Playback(moments)
    world.step()
    moments.record(world, picture(world))
    wall.set_pose((0.0, 3.0, 0.5))
    world.step(20)
    moments.record(world, picture(world))
    playback.scrub(1.0)
    shown = playback.shown()
    assert shown is not None
    row = wall.links[0].mujoco_id
    assert shown.model.body_pos[row, 1] == pytest.approx(1.0)
    assert world.model.body_pos[row, 1] == pytest.approx(3.0)


def test_nothing_is_recorded_without_a_page(browser: Any, wait: Any) -> None:
    world = falling()
    with Viewer(world, port=0, quiet=True) as viewer:
        steps(world, 50)
        viewer.sync()
        assert viewer.moments.all() == ()
        page = browser(viewer)
        wait(lambda: viewer.watchers == 1)
        steps(world, 50)
        assert 20 <= len(viewer.moments.all()) <= 30
        viewer.playback.scrub(0.3)
        page.close()
        wait(lambda: viewer.watchers == 0)
        assert viewer.playback.is_live
        count = len(viewer.moments.all())
        steps(world, 50)
        assert len(viewer.moments.all()) == count


def test_another_world_begins_another_recording(browser: Any, wait: Any) -> None:
    world, other = falling(), falling()
    with Viewer(world, port=0, quiet=True) as viewer:
        browser(viewer)
        wait(lambda: viewer.watchers == 1)
        steps(world, 50)
        viewer.playback.scrub(0.2)
        viewer.show_world(other)
        assert viewer.playback.is_live
        assert {moment.snapshot.model for moment in viewer.moments.all()} <= {other.model}


def test_a_saved_moment_restores_exactly(tmp_path: Any) -> None:
    world, moments = falling(), Moments()
    filled(world, moments, 1.0)
    moment = moments.all()[30]
    file = log_of(moment, {}).save(tmp_path / "moment.npz")
    filled(world, moments, 1.0)
    log = load_log(file)
    log.check_fits(world)
    log.restore(world, 0)
    assert world.time == moment.snapshot.time
    np.testing.assert_array_equal(world.data.qpos, moment.snapshot.qpos)
    np.testing.assert_array_equal(world.data.qvel, moment.qvel)
    assert world.data.qvel[2] == pytest.approx(-9.81 * world.time, rel=0.03)

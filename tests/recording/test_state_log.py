"""State logs have named columns, restore states exactly, and reject worlds and files that do not fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from roboyard.errors import ConfigError
from roboyard.recording import Recorder, StateLog, load_log, set_up
from roboyard.scenes import tabletop
from roboyard.sim import World
from roboyard.transforms import quaternion_from_rpy


def _swing() -> tuple[World, StateLog, list[np.ndarray], list[np.ndarray]]:
    scene = tabletop()
    world = scene.world
    ball = world.add_sphere(0.05, (0.4, 0, 1.2), name="ball")
    ball.set_velocity(linear=(1, 0.2, 0), angular=(0, 3, 0))
    recorder = Recorder(world, setup={"scene": "tabletop"})
    states, pictures = [], []
    camera = scene.camera(width=80, height=60)
    for k in range(40):
        world.step(3)
        if k == 20:
            scene.body("table").set_pose((0.9, 0, 0))
        recorder.record()
        states.append(np.concatenate([world.data.qpos, world.data.qvel]))
        pictures.append(world.render(camera, backend="software").rgba)
    return world, recorder.log(), states, pictures


def test_a_saved_log_restores_every_state_bit_for_bit(tmp_path: Path) -> None:
    _, log, states, pictures = _swing()
    again = load_log(log.save(tmp_path / "swing.npz"))
    fresh = tabletop()
    fresh.world.add_sphere(0.05, (0.4, 0, 1.2), name="ball")
    again.check_fits(fresh.world)
    camera = fresh.camera(width=80, height=60)
    for k in (0, 7, 19, 20, 39, 3):
        again.restore(fresh.world, k)
        assert np.array_equal(np.concatenate([fresh.world.data.qpos, fresh.world.data.qvel]), states[k])
        assert fresh.world.time == log.time[k]
        assert np.array_equal(fresh.world.render(camera, backend="software").rgba, pictures[k])
    assert np.allclose(fresh.body("table").position, (0.85, 0, 0))
    again.restore(fresh.world, 39)
    assert np.allclose(fresh.body("table").position, (0.9, 0, 0))


def test_columns_have_names_units_and_the_public_quaternion_order() -> None:
    world = World()
    turn = quaternion_from_rpy((0.3, -0.2, 1.0))
    world.add_box((0.1, 0.1, 0.1), (1, 2, 3), turn, name="crate")
    recorder = Recorder(world)
    recorder.record()
    log = recorder.log()
    assert log.position_names == tuple(f"crate/base.{c}" for c in ("x", "y", "z", "qx", "qy", "qz", "qw"))
    assert log.position_units == ("m", "m", "m", "1", "1", "1", "1")
    assert np.allclose(log.positions[0], [1, 2, 3, *turn])
    assert log.velocity_names[3:] == ("crate/base.wx", "crate/base.wy", "crate/base.wz")
    assert log.velocity_units == ("m/s",) * 3 + ("rad/s",) * 3
    assert np.array_equal(log.column("crate/base.z"), [3.0])
    with pytest.raises(ConfigError, match=r"no column named 'crate/base.zz'"):
        log.column("crate/base.zz")


def test_another_world_is_rejected_by_name() -> None:
    _, log, _, _ = _swing()
    with pytest.raises(ConfigError, match=r"this world has no 'ball/base.x'"):
        log.check_fits(tabletop().world)


def test_bodies_must_not_be_added_during_a_recording() -> None:
    world = World()
    world.add_box((1, 1, 1))
    recorder = Recorder(world)
    recorder.record()
    world.add_box((1, 1, 1))
    with pytest.raises(ConfigError, match="added or removed during the recording"):
        recorder.record()


def test_an_empty_recording_is_an_error() -> None:
    with pytest.raises(ConfigError, match="no states recorded"):
        Recorder(World()).log()


@pytest.mark.parametrize("damage", ["missing", "text", "other", "shape", "version"])
def test_files_that_are_not_logs_are_errors(tmp_path: Path, damage: str) -> None:
    path = tmp_path / "x.npz"
    messages = {
        "missing": "state log .* not found",
        "text": "x.npz is not a state log: give the .npz file that",
        "other": "x.npz is not a state log: it has no array 'about'",
        "shape": "x.npz: the shapes of its arrays contradict",
        "version": "format version 99",
    }
    world = World()
    world.add_box((1, 1, 1))
    recorder = Recorder(world)
    recorder.record()
    recorder.log().save(path)
    with np.load(path) as archive:
        data = dict(archive)
    if damage == "missing":
        path.unlink()
    elif damage == "text":
        path.write_text("not an archive")
    elif damage == "other":
        np.savez(path, time=np.zeros(3))
    elif damage == "shape":
        np.savez(path, **{**data, "positions": np.zeros((2, 2))})
    else:
        np.savez(path, **{**data, "about": np.array('{"version": 99, "timestep": 1, "setup": {}}')})
    with pytest.raises(ConfigError, match=messages[damage]):
        load_log(path)


def test_unknown_keys_of_a_scene_setup_are_errors() -> None:
    with pytest.raises(ConfigError, match=r"'controllers' and 'pose', got .*weather"):
        set_up({"scene": "empty", "weather": "fine"})
    with pytest.raises(ConfigError, match="needs 'scene'"):
        set_up({})
    scene_setup = set_up({"scene": "empty", "robot": None})
    assert scene_setup.robot is None and set(scene_setup.scene.bodies) == {"floor"}

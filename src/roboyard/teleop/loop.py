"""The control loop: actions from keys or at random, simulation steps, video and log."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from roboyard.recording import Recorder, SceneSetup, VideoWriter
from roboyard.teleop.film_camera import keep_in_view
from roboyard.teleop.key_bindings import HELP, KeyBindings
from roboyard.teleop.raw_keys import KeySource, RawKeys
from roboyard.teleop.terminal_image import as_text
from roboyard.teleop.views import WIDTH, Views

if TYPE_CHECKING:
    from roboyard.robots import Robot
    from roboyard.transforms import Array

ControlMode = Literal["random", "teleop"]
SHORT = 100
"""Number of actions of a short run."""
RANDOM_SIZE, RANDOM_HOLD = 0.05, 30
"""Largest random command, and the number of actions for which it is held."""
VIDEO_FPS = 15.0
"""Pictures a second of the video."""


def drive(
    scene_setup: SceneSetup,
    mode: ControlMode,
    *,
    short: bool = False,
    record: Path | None = None,
    log: Path | None = None,
    keys: KeySource | None = None,
    seed: int | None = None,
    width: int = 480,
    height: int = 360,
    watch: Callable[[], None] | None = None,
) -> int:
    """Drive a robot until the user quits, and return the number of actions.

    Args:
        scene_setup: a scene with a robot.
        mode: "random": small random commands, each held for 30 actions. "teleop": keys of the terminal.
        short: stop after 100 actions.
        record: video to write (.gif or .mp4), by the scene's camera.
        log: state log to write (.npz), one state for each action.
        keys: returns the keys pressed since its last call; those of the terminal by default.
        seed: seed of the random commands.
        width: width of the video (pixels).
        height: height of the video (pixels).
        watch: called after every action.

    Raises:
        ValueError: the scene has no robot.
        ConfigError: "teleop" without a terminal, or a video or log that cannot be written.
    """
    if scene_setup.robot is None:
        raise ValueError(f"the scene setup must name a robot, got {scene_setup.setup}")
    if mode == "teleop" and keys is None:
        with RawKeys() as raw:
            return drive(
                scene_setup, mode, short=short, record=record, log=log, keys=raw.read, seed=seed,
                width=width, height=height, watch=watch,
            )  # fmt: skip
    robot, world = scene_setup.robot, scene_setup.scene.world
    recorder = Recorder(world, setup=scene_setup.setup) if log is not None else None
    video = VideoWriter(record, fps=VIDEO_FPS) if record is not None else None
    camera = scene_setup.scene.camera(width=width, height=height)
    source = _Random(robot, seed) if mode == "random" else _Keys(scene_setup, keys or list)
    next_picture, began, count = world.time, time.monotonic() - world.time, 0
    try:
        while not short or count < SHORT:
            action = source.action()
            if action is None:
                break
            robot.apply_action(action)
            world.step(robot.steps_per_control)
            count += 1
            if watch is not None:
                watch()
            if recorder is not None:
                recorder.record()
            if video is not None and world.time >= next_picture - 1e-9:
                camera = keep_in_view(camera, robot.body.bounds.mean(axis=0))
                video.add(world.render(camera))
                next_picture += 1.0 / VIDEO_FPS
            if not short:
                began = _keep_pace(world.time, began)
            if world.time < next_picture - 2.0 / VIDEO_FPS:  # a reset set the time back
                next_picture = world.time
    finally:
        if video is not None:
            video.close()
        if recorder is not None and log is not None and len(recorder):
            recorder.log().save(log)
    return count


def _keep_pace(simulated: float, began: float) -> float:
    """Sleep until real time reaches the simulated time; return the start time (s), shifted after a reset."""
    ahead = simulated - (time.monotonic() - began)
    if ahead > 0.5 or ahead < -0.5:
        return time.monotonic() - simulated  # after a reset, or slower than real time: restart the clock
    if ahead > 0:
        time.sleep(ahead)
    return began


class _Random:
    """Random commands, each held for a number of actions."""

    def __init__(self, robot: Robot, seed: int | None) -> None:
        self._draw = np.random.default_rng(seed)
        self._size = robot.action_dim
        self._count = 0
        self._held = np.zeros(self._size)

    def action(self) -> Array | None:
        if self._count % RANDOM_HOLD == 0:
            self._held = RANDOM_SIZE * self._draw.uniform(-1.0, 1.0, self._size)
        self._count += 1
        return self._held


class _Keys:
    """Commands from the keys of a terminal."""

    def __init__(self, scene_setup: SceneSetup, keys: KeySource) -> None:
        assert scene_setup.robot is not None
        self._scene, self._robot = scene_setup.scene, scene_setup.robot
        self._keys = keys
        self._bindings = KeyBindings(scene_setup.robot)
        self._views = Views(scene_setup)
        self._start = scene_setup.scene.world.save_state()
        print(f"\n{HELP}")
        self._show()

    def _show(self) -> None:
        print(f"\r\x1b[K{self._bindings.status()}", end="", flush=True)

    def action(self) -> Array | None:
        pressed = self._keys()
        for key in pressed:
            if key == "escape":
                print()
                return None
            if key == "r":
                self._scene.world.restore_state(self._start)
                self._robot.reset()
                self._bindings.reset()
            elif key == "m":
                name, picture = self._views.next_picture()
                print(f"\n{as_text(picture, WIDTH)}\n{name}")
            else:
                self._bindings.press(key)
        if pressed:
            self._show()
        sys.stdout.flush()
        return self._bindings.action()

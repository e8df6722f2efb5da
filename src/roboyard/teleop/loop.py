"""The loop: keys or chance in, actions out, the world on, film and log along."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from roboyard.recording import Recorder, SceneSetup, VideoWriter
from roboyard.teleop.key_bindings import HELP, KeyBindings
from roboyard.teleop.raw_keys import KeySource, RawKeys
from roboyard.teleop.terminal_image import as_text
from roboyard.teleop.views import WIDTH, Views

if TYPE_CHECKING:
    from roboyard.robots import Robot
    from roboyard.transforms import Array

ControlMode = Literal["random", "teleop"]
SHORT = 100
"""Actions of a short run."""
RANDOM_SIZE, RANDOM_HOLD = 0.05, 30
"""Largest random command, and how many actions one is held."""
FILM_FPS = 15.0


def drive(
    stage: SceneSetup,
    mode: ControlMode,
    *,
    short: bool = False,
    record: Path | None = None,
    log: Path | None = None,
    keys: KeySource | None = None,
    seed: int | None = None,
    width: int = 480,
    height: int = 360,
) -> int:
    """Drive a stage's robot until told to stop; returns how many actions it took.

    Args:
        stage: with a robot.
        mode: "random": small commands by chance, each held for 30 actions. "teleop": keys of the terminal.
        short: stop after 100 actions.
        record: film to write, .gif or .mp4, from the scene's own view.
        log: state log to write, .npz, a moment an action.
        keys: where keys come from; the terminal by default.
        seed: of the chance.
        width: pixels of the film.
        height: pixels of the film.

    Raises:
        ConfigError: teleop without a terminal, or a film or log that cannot be written.
    """
    if stage.robot is None:
        raise ValueError("the stage has no robot to drive")
    if mode == "teleop" and keys is None:
        with RawKeys() as raw:
            return drive(
                stage, mode, short=short, record=record, log=log, keys=raw.read, seed=seed,
                width=width, height=height,
            )  # fmt: skip
    robot, world = stage.robot, stage.scene.world
    recorder = Recorder(world, setup=stage.setup) if log is not None else None
    film = VideoWriter(record, fps=FILM_FPS) if record is not None else None
    camera = stage.scene.camera(width=width, height=height)
    source = _Random(robot, seed) if mode == "random" else _Keys(stage, keys or list)
    next_picture, began, taken = world.time, time.monotonic() - world.time, 0
    try:
        while not short or taken < SHORT:
            action = source.action()
            if action is None:
                break
            robot.apply_action(action)
            world.step(robot.steps_per_control)
            taken += 1
            if recorder is not None:
                recorder.take()
            if film is not None and world.time >= next_picture - 1e-9:
                film.add(world.render(camera))
                next_picture += 1.0 / FILM_FPS
            if not short:
                began = _keep_pace(world.time, began)
            if world.time < next_picture - 2.0 / FILM_FPS:  # a reset turned the clock back
                next_picture = world.time
    finally:
        if film is not None:
            film.close()
        if recorder is not None and log is not None and len(recorder):
            recorder.log().save(log)
    return taken


def _keep_pace(simulated: float, began: float) -> float:
    """Wait until real time has caught up; the (possibly shifted) beginning."""
    ahead = simulated - (time.monotonic() - began)
    if ahead > 0.5 or ahead < -0.5:
        return time.monotonic() - simulated  # reset, or too slow for real time: begin anew
    if ahead > 0:
        time.sleep(ahead)
    return began


class _Random:
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
    def __init__(self, stage: SceneSetup, keys: KeySource) -> None:
        assert stage.robot is not None
        self._stage, self._robot = stage, stage.robot
        self._keys = keys
        self._teleop = KeyBindings(stage.robot)
        self._views = Views(stage)
        self._start = stage.scene.world.save_state()
        print(f"\n{HELP}")
        self._show()

    def _show(self) -> None:
        print(f"\r\x1b[K{self._teleop.status()}", end="", flush=True)

    def action(self) -> Array | None:
        pressed = self._keys()
        for key in pressed:
            if key == "escape":
                print()
                return None
            if key == "r":
                self._stage.scene.world.restore_state(self._start)
                self._robot.reset()
                self._teleop.reset()
            elif key == "m":
                name, picture = self._views.look()
                print(f"\n{as_text(picture, WIDTH)}\n{name}")
            else:
                self._teleop.press(key)
        if pressed:
            self._show()
        sys.stdout.flush()
        return self._teleop.action()

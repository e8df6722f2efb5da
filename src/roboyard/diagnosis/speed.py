"""How long first steps take on this machine, and how fast a world is afterwards."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from roboyard.diagnosis.check import Check

SLOW_START = 3.0
"""Time of a first world or picture from which something has to be compiled each time (s)."""
STEPS, PICTURES = 500, 5
"""Number of measured steps and pictures."""


def speed_checks() -> Iterator[Check]:
    """Yield the time of the first world, step and picture of this process, and the rates after them."""
    from roboyard.assets import asset_path
    from roboyard.rendering import Camera
    from roboyard.sim import World

    world = World()
    camera = Camera.look_at(eye=(1.4, 1.4, 1.0), target=(0, 0, 0.4), width=320, height=240)

    def build() -> None:
        world.add_plane()
        world.add_urdf(asset_path("arm7"), fixed_base=True)
        world.step()

    yield _first("first step", build, "a floor and an arm, loaded and stepped once")
    yield _first("first picture", lambda: world.render(camera), "320 x 240 pixels")
    seconds = _timed(lambda: world.step(STEPS)) / STEPS
    real = world.timestep / seconds
    yield Check(
        name="steps",
        status="ok",
        detail=f"{1 / seconds:,.0f} a second for an arm of 7 joints, {real:.0f} times real time",
    )
    seconds = _timed(lambda: [world.render(camera) for _ in range(PICTURES)]) / PICTURES
    yield Check(name="pictures", status="ok", detail=f"{1 / seconds:.0f} a second of 320 x 240 pixels")


def _first(name: str, call: Callable[[], object], what: str) -> Check:
    seconds = _timed(call)
    slow = seconds > SLOW_START
    return Check(
        name=name,
        status="slow" if slow else "ok",
        detail=f"{seconds:.2f} s: {what}",
        remedy="compiled loops are stored after the first use; run this again" if slow else "",
    )


def _timed(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start

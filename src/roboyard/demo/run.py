"""The demo from one end to the other: read, settle, move, draw, write."""

from __future__ import annotations

import json
import logging
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

from roboyard.demo.output import check_target, whole_folder

Report = Callable[[str, float], None]
"""Called with the name of the act and the share of it that is over, 0 to 1."""

STILL_SIZE, STILL_SIZE_SHORT = (960, 720), (480, 360)
FILM_SIZE, FILM_SIZE_SHORT = (420, 315), (240, 180)
"""pixels"""
FRAMES, FRAMES_SHORT = 110, 24


@dataclass(frozen=True, kw_only=True, slots=True)
class DemoResult:
    """Where the files are, and what summary.json says."""

    folder: Path
    summary: Mapping[str, Any]


def run_demo(
    source: str | Path | None = None,
    *,
    out: Path = Path("demo"),
    packages: Mapping[str, Path] | None = None,
    overwrite: bool = False,
    short: bool = False,
    report: Report | None = None,
) -> DemoResult:
    """Read a robot, drop it on a floor beside an obstacle, move every joint, and write what was seen.

    Args:
        source: a robot file, or the name of a registered or bundled robot; the bundled r1 by default.
        out: folder for robot.gif, four views, joints.png and summary.json; made whole or not at all.
        packages: ROS package name to folder, for `package://`.
        overwrite: write also into a folder that holds other things (which stay).
        short: smaller pictures and fewer of them, for a test of the installation.
        report: told how far the demo is.

    Raises:
        DescriptionError: the robot cannot be read.
        ConfigError: `out` holds something else, or `source` is neither a file nor a known name.
    """
    check_target(out, overwrite=overwrite)
    tell = report or (lambda act, share: None)
    began = perf_counter()
    with _heard() as remarks, tempfile.TemporaryDirectory(prefix="roboyard-") as workshop:
        summary = _perform(source, out, packages, short, tell, began, remarks, Path(workshop))
    return DemoResult(folder=out, summary=summary)


def _perform(
    source: str | Path | None,
    out: Path,
    packages: Mapping[str, Path] | None,
    short: bool,
    tell: Report,
    began: float,
    remarks: list[str],
    workshop: Path,
) -> dict[str, Any]:
    tell("reading", 0.0)
    from roboyard.demo.demo_world import DemoWorld
    from roboyard.demo.load import find_source, load_robot
    from roboyard.demo.motion_sequence import MotionRecorder
    from roboyard.demo.pictures import FPS, DemoVideo, still_views
    from roboyard.demo.plan import make_plan
    from roboyard.demo.plots import plot_joints
    from roboyard.demo.summary import summarize, where_things_are
    from roboyard.morphology.point_model import PointModel

    file, label = find_source(source)
    intake = load_robot(file, packages=packages, folder=workshop)
    description = intake.description
    figure = PointModel(description)
    tell("reading", 0.5)
    plan = make_plan(figure)
    stage = DemoWorld(figure, plan)
    stage.world.ensure_compiled()
    notes = dict.fromkeys([*description.notes, *stage.robot.notes, *remarks])

    width, height = FILM_SIZE_SHORT if short else FILM_SIZE
    film = DemoVideo(
        stage,
        width=width,
        height=height,
        frames=FRAMES_SHORT if short else FRAMES,
        seconds=plan.duration + 1.5,
    )

    def on_tick(act: str, share: float) -> None:
        film.tick()
        tell(act, share)

    teller = MotionRecorder(stage, on_tick, short=short)
    tell("settling", 0.0)
    teller.tell()
    tell("views", 0.0)
    stills = still_views(stage, *(STILL_SIZE_SHORT if short else STILL_SIZE))
    places = where_things_are(stage)
    teller.move()
    story = teller.story

    tell("writing", 0.0)
    from roboyard.rendering import save_gif, save_png

    with whole_folder(out) as folder:
        save_gif(folder / "robot.gif", film.frames, fps=FPS)
        tell("writing", 0.5)
        for name, image in stills.items():
            save_png(folder / f"{name}.png", image)
        tell("writing", 0.7)
        plot_joints(folder / "joints.png", story.record, plan, description)
        files = ["robot.gif", *(f"{name}.png" for name in stills), "joints.png", "summary.json"]
        summary = summarize(
            stage,
            story,
            source=label,
            intake=intake,
            notes=list(notes),
            places=places,
            film={"frames": len(film.frames), "speed": film.speed},
            wall_time=perf_counter() - began,
            files=files,
        )
        text = json.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False)
        (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
    tell("writing", 1.0)
    return summary


@contextmanager
def _heard() -> Iterator[list[str]]:
    """Collect what Roboyard's modules log as warnings, instead of printing it amid the progress."""

    class Ear(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            heard.append(record.getMessage())

    heard: list[str] = []
    logger, ear = logging.getLogger("roboyard"), Ear(logging.WARNING)
    spread = logger.propagate
    logger.addHandler(ear)
    logger.propagate = False
    try:
        yield heard
    finally:
        logger.removeHandler(ear)
        logger.propagate = spread

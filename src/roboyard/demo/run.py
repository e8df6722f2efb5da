"""The demo from start to end: load, settle, move, render, write."""

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

Progress = Callable[[str, float], None]
"""Called with the phase's name and its finished share, 0 to 1."""

STILL_SIZE, STILL_SIZE_SHORT = (960, 720), (480, 360)
"""Width and height of the views, and those of a short demo (pixels)."""
VIDEO_SIZE, VIDEO_SIZE_SHORT = (420, 315), (240, 180)
"""Width and height of the video, and those of a short demo (pixels)."""
FRAMES, FRAMES_SHORT = 110, 24
"""Number of pictures of the video, about, and that of a short demo."""


@dataclass(frozen=True, kw_only=True, slots=True)
class DemoResult:
    """The result of a demo."""

    folder: Path
    """Folder of the files."""
    summary: Mapping[str, Any]
    """Content of summary.json."""


def run_demo(
    source: str | Path | None = None,
    *,
    out: Path = Path("demo"),
    packages: Mapping[str, Path] | None = None,
    xacro_args: Mapping[str, str] | None = None,
    overwrite: bool = False,
    short: bool = False,
    progress: Progress | None = None,
) -> DemoResult:
    """Load a robot, drop it on a floor beside an obstacle, move every joint and write pictures and figures.

    Args:
        source: a robot file, or the name of a registered or bundled robot; the bundled r1 by default.
        out: folder for robot.gif, four views, joints.png and summary.json; written completely or not at all.
        packages: ROS package name to its folder, for `package://`.
        xacro_args: values of `<xacro:arg>` by name, for a xacro file.
        overwrite: write also into a folder that holds other files, which stay.
        short: fewer and smaller pictures, for a test of the installation.
        progress: called with the progress of the demo.

    Raises:
        DescriptionError: the robot cannot be loaded.
        ConfigError: `out` holds other files, or `source` is neither a file nor a known name.
    """
    check_target(out, overwrite=overwrite)
    notify = progress or (lambda phase, share: None)
    began = perf_counter()
    with _collected_warnings() as warnings, tempfile.TemporaryDirectory(prefix="roboyard-") as copy:
        summary = _run(source, out, packages, xacro_args, short, notify, began, warnings, Path(copy))
    return DemoResult(folder=out, summary=summary)


def _run(
    source: str | Path | None,
    out: Path,
    packages: Mapping[str, Path] | None,
    xacro_args: Mapping[str, str] | None,
    short: bool,
    notify: Progress,
    began: float,
    warnings: list[str],
    copy: Path,
) -> dict[str, Any]:
    notify("reading", 0.0)
    from roboyard.demo.demo_world import DemoWorld
    from roboyard.demo.load import find_source, load_robot
    from roboyard.demo.motion_sequence import MotionRecorder
    from roboyard.demo.pictures import DemoVideo, still_views
    from roboyard.demo.plan import make_plan
    from roboyard.demo.plots import plot_joints
    from roboyard.demo.summary import link_positions, summarize
    from roboyard.morphology.point_model import PointModel
    from roboyard.rendering import save_png

    file, label = find_source(source)
    loaded = load_robot(file, packages=packages, folder=copy, xacro_args=xacro_args)
    model = PointModel(loaded.description)
    notify("reading", 0.5)
    plan = make_plan(model)
    scene = DemoWorld(model, plan)
    scene.world.ensure_compiled()
    notes = list(dict.fromkeys([*loaded.description.notes, *scene.robot.notes, *warnings]))

    with whole_folder(out) as folder:
        size, frames = (VIDEO_SIZE_SHORT, FRAMES_SHORT) if short else (VIDEO_SIZE, FRAMES)
        video = DemoVideo(folder / "robot.gif", scene, size=size, frames=frames, seconds=plan.duration + 1.5)

        def on_tick(phase: str, share: float) -> None:
            video.tick()
            notify(phase, share)

        recorder = MotionRecorder(scene, on_tick, short=short)
        notify("settling", 0.0)
        recorder.settle_on_support()
        notify("views", 0.0)
        stills = still_views(scene, *(STILL_SIZE_SHORT if short else STILL_SIZE))
        places = link_positions(scene)
        recorder.move()

        notify("writing", 0.0)
        video.close()
        notify("writing", 0.5)
        for name, image in stills.items():
            save_png(folder / f"{name}.png", image)
        notify("writing", 0.7)
        plot_joints(folder / "joints.png", recorder.sequence.record, plan, loaded.description)
        summary = summarize(
            scene,
            recorder.sequence,
            source=label,
            loaded=loaded,
            notes=notes,
            places=places,
            film={"frames": video.count, "speed": video.speed},
            wall_time=perf_counter() - began,
            files=["robot.gif", *(f"{name}.png" for name in stills), "joints.png", "summary.json"],
        )
        text = json.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False)
        (folder / "summary.json").write_text(text + "\n", encoding="utf-8", errors="backslashreplace")
    notify("writing", 1.0)
    return summary


@contextmanager
def _collected_warnings() -> Iterator[list[str]]:
    """Yield a list that collects the warnings logged by Roboyard's modules, instead of printing them."""

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            messages.append(record.getMessage())

    messages: list[str] = []
    logger, collector = logging.getLogger("roboyard"), Collector(logging.WARNING)
    propagate = logger.propagate
    logger.addHandler(collector)
    logger.propagate = False
    try:
        yield messages
    finally:
        logger.removeHandler(collector)
        logger.propagate = propagate

"""R1 at work in the flat: it opens a kitchen drawer, picks the mug from the table, carries it to the living
room, opens the bedroom door and places the mug on the coffee table.

Everything is done by skills, which take names; drawer and door are moved by their handles, and the mug is
held by the friction of the fingers alone.

python examples/r1_at_home.py [picture.png | video.gif] [--seed 3]
python examples/r1_at_home.py --runs 10     from ten start poses, with mug and drawer elsewhere
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from roboyard.recording import SceneSetup, VideoWriter, set_up
from roboyard.rendering import STUDIO, Camera, save_png
from roboyard.skills import SkillResult, Skills
from roboyard.transforms import quaternion_from_rpy

DRAWER, DOOR = "kitchen_east/drawer_2", "bedroom_door/hinge"
MOVED = 0.20
"""Distance by which mug and drawer are moved at most (m)."""


def rearrange(stage: SceneSetup, seed: int) -> None:
    """Move robot, mug and the cabinet with the drawer at random; seed 0 leaves them where they are."""
    if seed == 0:
        return
    random = np.random.default_rng(seed)
    assert stage.robot is not None
    x, y = np.array(stage.scene.rooms["living room"]) + random.uniform(-0.4, 0.4, 2)
    stage.robot.set_pose((x, y, 0.0), quaternion_from_rpy((0, 0, random.uniform(-np.pi, np.pi))))
    cabinet, mug = stage.scene.body("kitchen_east"), stage.scene.body("mug")
    far, angle = MOVED * np.sqrt(random.random()), random.uniform(np.pi / 2, np.pi)
    cabinet.set_pose(cabinet.position + far * np.array([np.cos(angle), np.sin(angle), 0.0]))
    others = [stage.scene.body(name).position[:2] for name in ("banana", "bowl", "plate")]
    while True:  # on the table, not on what else stands there
        far, angle = MOVED * np.sqrt(random.random()), random.uniform(-np.pi, np.pi)
        spot = mug.position + far * np.array([np.cos(angle), np.sin(angle), 0.0])
        if min(np.linalg.norm(spot[:2] - other) for other in others) > 0.16 and -0.8 < spot[1] < -0.1:
            break
    mug.set_pose(spot, quaternion_from_rpy((0, 0, random.uniform(-np.pi, np.pi))))


@dataclass(frozen=True)
class Result:
    """The result of the script."""

    steps: tuple[SkillResult, ...]
    """Results of the skills so far; the last one failed unless the script was finished."""
    finished: bool
    """Whether every skill succeeded."""


def play(stage: SceneSetup, watch: Callable[[str], None] | None = None, seed: int = 0) -> Result:
    """Run the script; `watch` is called after every control step, with the name of the skill."""
    assert stage.robot is not None
    part = ""
    skills = Skills(
        stage.robot, stage.scene, watch=lambda: watch(part) if watch is not None else None, seed=seed
    )
    script: list[tuple[str, Callable[[], SkillResult]]] = [
        ("kitchen", lambda: skills.navigate_to("kitchen")),
        ("drawer", lambda: skills.open(DRAWER)),
        ("mug", lambda: skills.grasp("mug")),
        ("mug", lambda: skills.lift("mug")),
        ("living room", lambda: skills.navigate_to("living room")),
        ("door", lambda: skills.open(DOOR)),
        ("table", lambda: skills.place("mug", on="coffee_table")),
    ]
    for part, step in script:  # noqa: B007 - `watch` sees it
        if not step():
            return Result(steps=tuple(skills.log), finished=False)
    return Result(steps=tuple(skills.log), finished=True)


VIEWS = {
    "kitchen": ((0.9, -2.6, 2.4), (2.7, -1.2, 0.6)),
    "drawer": ((2.0, -3.3, 1.7), (3.3, -1.8, 0.7)),
    "mug": ((3.0, -2.9, 2.2), (3.0, -0.6, 0.75)),
    "living room": ((-2.6, -3.2, 2.5), (-0.1, -1.1, 0.6)),
    "door": ((-3.0, -1.5, 2.2), (-1.5, 0.4, 0.8)),
    "table": ((-1.0, -3.3, 2.2), (-2.6, -1.6, 0.6)),
}
"""Camera position and target for each part (m)."""


def view(part: str, width: int, height: int) -> Camera:
    """Return the camera for one part of the script."""
    return Camera.look_at(*VIEWS[part or "kitchen"], width=width, height=height)


def run(seed: int, output: Path | None = None) -> Result:
    """Run the script in a new scene, print what the skills say, and write a picture or a video of it."""
    stage = set_up({"scene": "home", "robot": "r1"})
    rearrange(stage, seed)
    world = stage.scene.world
    video = VideoWriter(output, fps=8) if output is not None and output.suffix != ".png" else None
    due = world.time

    def watch(part: str) -> None:
        nonlocal due
        if video is not None and world.time >= due:  # four times real time
            video.add(world.render(view(part, 320, 240), samples=4, background=STUDIO))
            due += 0.5

    result = play(stage, watch, seed)
    for step in result.steps:
        print(step)
    if video is not None:
        video.close()
    elif output is not None:
        save_png(output, world.render(view("table", 640, 480), samples=4, background=STUDIO))
    return result


def main() -> None:
    """Run the script once, or from several start poses."""
    parser = argparse.ArgumentParser(description="R1 at work in the flat")
    parser.add_argument("output", nargs="?", type=Path, help="a picture or a video to write")
    parser.add_argument("--seed", type=int, default=0, help="where robot, mug and drawer are")
    parser.add_argument("--runs", type=int, default=0, help="number of seeds to run, from 1 on")
    given = parser.parse_args()
    if not given.runs:
        run(given.seed, given.output)
        return
    finished = 0
    for seed in range(1, given.runs + 1):
        print(f"seed {seed}")
        finished += run(seed).finished
    print(f"{finished} of {given.runs} finished")


if __name__ == "__main__":
    main()

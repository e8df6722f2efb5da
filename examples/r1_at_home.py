"""R1 at work in the flat: it opens a kitchen drawer, picks the mug from the table, carries it to the living
room, opens the bedroom door and places the mug on the coffee table.

Everything is done by skills, which take names; drawer and door are moved by their handles, and the mug is
held by the friction of the fingers alone.

python examples/r1_at_home.py [picture.png | video.gif]
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from roboyard.recording import SceneSetup, VideoWriter, set_up
from roboyard.rendering import STUDIO, Camera, save_png
from roboyard.skills import SkillResult, Skills

DRAWER, DOOR = "kitchen_east/drawer_2", "bedroom_door/hinge"
VIEWS = {
    "kitchen": ((0.9, -2.6, 2.4), (2.7, -1.2, 0.6)),
    "drawer": ((2.0, -3.3, 1.7), (3.3, -1.8, 0.7)),
    "mug": ((3.0, -2.9, 2.2), (3.0, -0.6, 0.75)),
    "living room": ((-2.6, -3.2, 2.5), (-0.1, -1.1, 0.6)),
    "door": ((-3.0, -1.5, 2.2), (-1.5, 0.4, 0.8)),
    "table": ((-1.0, -3.3, 2.2), (-2.6, -1.6, 0.6)),
}
"""Camera position and target for each part (m)."""


def play(stage: SceneSetup, watch: Callable[[str], None] | None = None, seed: int = 0) -> list[SkillResult]:
    """Run the script until a skill fails; `watch` is called after every control step, with its part."""
    assert stage.robot is not None
    part = ""
    skills = Skills(stage.robot, stage.scene, watch=lambda: watch(part) if watch else None, seed=seed)
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
            break
    return list(skills.log)


def main(output: Path | None = None) -> bool:
    """Run the script, print its steps, and write a picture or a video; return whether all succeeded."""
    stage = set_up({"scene": "home", "robot": "r1"})
    world = stage.scene.world
    video = VideoWriter(output, fps=8) if output is not None and output.suffix != ".png" else None
    due = world.time

    def watch(part: str) -> None:
        nonlocal due
        if video is not None and world.time >= due:  # four times real time
            camera = Camera.look_at(*VIEWS[part or "kitchen"], width=320, height=240)
            video.add(world.render(camera, samples=4, background=STUDIO))
            due += 0.5

    steps = play(stage, watch)
    print(*steps, sep="\n")
    if video is not None:
        video.close()
    elif output is not None:
        camera = Camera.look_at(*VIEWS["table"], width=640, height=480)
        save_png(output, world.render(camera, samples=4, background=STUDIO))
    return all(steps)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)

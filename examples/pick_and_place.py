"""Pick and place by name: R1 grasps a can on the table, lifts it and places it on another spot, as a film.

python examples/pick_and_place.py [FILM.gif]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from roboyard.recording import VideoWriter, set_up
from roboyard.skills import Skills


def main(film: Path | None = None) -> float:
    """Move the can and return its distance from where it was asked to be (m)."""
    stage = set_up({"scene": "tabletop", "robot": "r1"})
    assert stage.robot is not None
    camera = stage.scene.camera(width=480, height=320)
    writer = None if film is None else VideoWriter(film, fps=10)
    count = 0

    def watch() -> None:  # after each control step, at 30 Hz
        nonlocal count
        count += 1
        if writer is not None and count % 9 == 0:  # at three times real time
            writer.add(stage.scene.world.render(camera))

    skills = Skills(stage.robot, stage.scene, watch=watch)
    can = stage.scene.body("can")
    spot = can.position[:2] + np.array([0.0, 0.15])
    for result in (
        skills.navigate_to("can"),
        skills.grasp("can"),
        skills.lift("can"),
        skills.place("can", on="table", at=spot),
    ):
        print(result)
        if not result:
            break
    if writer is not None:
        writer.close()
    away = float(np.linalg.norm(can.position[:2] - spot))
    print(f"the can is {100 * away:.1f} cm from the spot")
    return away


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)

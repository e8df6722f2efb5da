"""Import a robot from its bare URDF, validate it, and drive it in the flat, as a film.

python examples/import_and_drive.py [FILM.gif] [ROBOT.urdf]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from roboyard import add_robot, import_robot, load_scene
from roboyard.assets import asset_path
from roboyard.recording import VideoWriter
from roboyard.rendering import Camera


def main(film: Path | None = None, urdf: Path | None = None) -> float:
    """Import the robot as "mine", drive a circle, and return the distance driven (m)."""
    done = import_robot(urdf or asset_path("rover"), name="mine", overwrite=True)
    print(f"report: {done.report}")
    for gate in done.validation.gates if done.validation is not None else ():
        print(gate.line())

    scene = load_scene("home")
    robot = add_robot(scene.world, "mine", scene.spawn, scene.spawn_orientation)
    print(robot, "with actions for", list(robot.controller_action_idx))
    action = robot.no_op_action()
    action[robot.controller_action_idx["base"]] = (0.3, 0.5)  # forwards and left, each of -1 to 1
    writer = None if film is None else VideoWriter(film, fps=15)
    driven, before = 0.0, np.array(robot.position[:2])
    for k in range(150):  # five seconds
        robot.apply_action(action)
        scene.world.step(robot.steps_per_control)
        driven += float(np.linalg.norm(robot.position[:2] - before))
        before = np.array(robot.position[:2])
        if writer is not None and k % 2 == 0:
            eye = robot.position + np.array([-1.6, -1.2, 1.2])
            writer.add(
                scene.world.render(Camera.look_at(eye=eye, target=robot.position, width=480, height=320))
            )
    if writer is not None:
        writer.close()
    print(f"drove {driven:.2f} m")
    return driven


if __name__ == "__main__":
    main(*(Path(word) for word in sys.argv[1:3]))

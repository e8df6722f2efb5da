"""R1 goes from the living room to the kitchen and back, pushes the bedroom door open and walks in.

python examples/r1_at_home.py [picture.png]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from roboyard.cameras import STUDIO, Camera, save_png
from roboyard.recording import Stage, set_up

SPEED, LARGEST = 0.6, 1.5
"""m/s: how fast to go, and what a base command of 1 means."""


def base_pose(stage: Stage) -> tuple[np.ndarray, float]:
    """(2,) m and heading (rad) of the robot's base."""
    position, (x, y, z, w) = stage.robot.get_position_orientation()
    return np.asarray(position)[:2], float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def go(stage: Stage, target: tuple[float, float], heading: float, seconds: float = 12.0) -> bool:
    """Drive the holonomic base to a place in the world; False where it did not get there in time."""
    robot, world = stage.robot, stage.scene.world
    start = robot.controller_action_idx["base"].start
    end = world.time + seconds
    while world.time < end:
        here, yaw = base_pose(stage)
        away = np.asarray(target) - here
        turn = np.arctan2(np.sin(heading - yaw), np.cos(heading - yaw))
        if np.hypot(*away) < 0.06 and abs(turn) < 0.05:
            return True
        # a base command is in the base's own frame
        velocity = 2.0 * np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]]) @ away
        velocity *= SPEED / max(np.hypot(*velocity), SPEED)
        action = robot.no_op_action()
        action[start : start + 2] = velocity / LARGEST
        action[start + 2] = np.clip(1.5 * turn, -1.0, 1.0) / np.pi
        robot.apply_action(action)
        world.step(robot.steps_per_control)
    return False


def main(picture: Path | None = None) -> None:
    stage = set_up({"scene": "home", "robot": "r1"})
    way = [
        ("kitchen", (2.0, -1.3), 0.0),
        ("living room", (-1.4, -1.2), np.pi),
        ("bedroom door", (-1.725, -0.35), np.pi / 2),
        ("bedroom", (-1.725, 1.75), np.pi / 2),
    ]
    for name, target, heading in way:
        arrived = go(stage, target, heading)
        (x, y), _ = base_pose(stage)
        told = "there" if arrived else "not there"
        print(f"{stage.scene.world.time:5.1f} s  {name}: {told}, at {x:.2f} {y:.2f}")
    print(
        f"the door stands open by {np.degrees(stage.scene.joints['bedroom_door/hinge'].position):.0f} degrees"
    )
    if picture is not None:
        camera = Camera.look_at((-1.7, -3.0, 3.2), (-1.7, 1.2, 0.6), width=640, height=480)
        save_png(picture, stage.scene.world.render(camera, samples=4, background=STUDIO))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)

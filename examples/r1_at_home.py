"""R1 at work in the flat: it opens a kitchen drawer, picks the mug from the table, carries it to the living
room and opens the bedroom door.

Only the robot's own controllers are used: base, trunk, arms by inverse kinematics, grippers. The drawer and
the door are moved by their handles, and the mug is held by the friction of the fingers alone. Waypoints are
constants; motions between them are straight (or, for the door, about its hinge).

python examples/r1_at_home.py [picture.png | video.gif]
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from way_points import Actor, Base, GripperPose, Target, about_z, pointing

from roboyard.recording import SceneSetup, VideoWriter, set_up
from roboyard.rendering import STUDIO, Camera, save_png
from roboyard.transforms import Array

STOOP = (-0.6, 1.6, -1.0, 0.0)
"""Bent trunk posture in which grippers reach tables and worktops (rad)."""
READY = {"left": (0.45, 0.28, 1.0), "right": (0.45, -0.28, 1.0)}
"""Gripper positions while driving, in the base frame (m)."""
EAST, NORTH, UP = np.eye(3)
BAR = np.array([3.777, -2.0, 0.7605])
"""Middle of the handle of the upper drawer at the kitchen's east (m)."""
GRASP = np.array([0.0, 0.0, 0.066])
"""Grasp point of the mug, from its bottom (m)."""
HINGE, LEVER = np.array([-2.215, 0.6, 0.0]), np.array([0.855, -0.067, 1.02])
"""Hinge of the bedroom door, and its lever relative to it while closed (m)."""
OPEN = np.radians(58.0)
"""Opening angle of the door (rad)."""


def get_ready(actor: Actor) -> None:
    """Bend the trunk, with both grippers before the chest."""
    ahead = pointing(about_z(actor.base[2]) @ EAST, -about_z(actor.base[2]) @ NORTH)
    grippers = {arm: GripperPose(actor.in_world(place), ahead) for arm, place in READY.items()}
    actor.move(Target(grippers, trunk=STOOP), 3.0)


def open_drawer(actor: Actor) -> None:
    """Pull the drawer open by its handle, with the right gripper."""
    flat = pointing(EAST, UP)
    actor.go((3.0, -1.9, 0.0))
    place: Base = (3.05, -1.85, 0.0)
    actor.move(Target({"right": GripperPose(BAR - 0.14 * EAST, flat)}, place), 2.0)
    actor.move(Target({"right": GripperPose(BAR - 0.018 * EAST, flat)}, place), 1.0)
    actor.grip("right", close=True)
    pulled = GripperPose(actor.gripper("right").position - 0.3 * EAST, flat)
    actor.move(Target({"right": pulled}, (2.75, -1.85, 0.0)), 2.5)
    actor.grip("right", close=False)
    actor.move(Target({"right": GripperPose(pulled.position - 0.12 * EAST, flat)}, (2.7, -1.85, 0.0)), 1.0)
    actor.move(Target({"right": GripperPose(actor.in_world(READY["right"]), pointing(EAST, -NORTH))}), 1.0)


def pick_mug(actor: Actor, mug: Array) -> None:
    """Grasp the mug at the (3,) position `mug` (m) with the left gripper, and lift it by 15 cm."""
    along = Rotation.from_euler("y", 25.0, degrees=True).apply(EAST)
    tilted = pointing(along, -NORTH)
    place: Base = (2.47, -0.87, 0.0)
    actor.go((2.3, -1.7, 0.0))
    actor.go((2.35, -0.87, 0.0))
    actor.move(Target({"left": GripperPose(mug + GRASP - 0.16 * along, tilted)}, place), 1.5)
    actor.move(Target({"left": GripperPose(mug + GRASP - 0.012 * along, tilted)}, place), 1.2)
    actor.grip("left", close=True)
    actor.move(Target({"left": GripperPose(actor.gripper("left").position + 0.15 * UP, tilted)}), 1.0)


def carry_to_living_room(actor: Actor) -> None:
    """Drive away from the table and through the opening between the rooms."""
    actor.move(Target(base=(1.97, -0.87, 0.0)), 1.5)
    kept = actor.gripper("left").rotation
    actor.move(Target({"left": GripperPose(actor.in_world((0.5, 0.28, 1.0)), kept)}), 1.5)
    actor.go((2.0, -1.3, np.pi))
    actor.go((0.7, -1.3, np.pi))
    actor.go((-1.3, -1.0, np.pi))


def open_door(actor: Actor) -> None:
    """Grasp the door by its lever with the right gripper, and rotate it about its hinge."""
    heading = np.pi / 2
    actor.go((-1.56, -0.55, heading))
    near = GripperPose(actor.in_world((0.36, 0.28, 0.98)), actor.gripper("left").rotation)
    actor.move(Target({"left": near}), 1.0)
    actor.move(Target({"right": at_lever(0.0, away=0.14)}, (-1.56, -0.1, heading)), 2.0)
    actor.move(Target({"right": at_lever(0.0)}, (-1.56, 0.0, heading)), 1.5)
    actor.grip("right", close=True)
    actor.follow(lambda u: Target({"right": at_lever(u * OPEN)}, (-1.56, 0.55 * u, heading)), seconds=4.0)
    actor.grip("right", close=False)
    back = actor.gripper("right")
    actor.move(Target({"right": GripperPose(back.position - 0.12 * NORTH, back.rotation)}), 1.0)


def at_lever(angle: float, away: float = 0.018) -> GripperPose:
    """Return the pose of a gripper on the lever of the door opened by `angle` (rad), `away` (m) from it."""
    along = about_z(0.6 * angle) @ NORTH
    return GripperPose(HINGE + about_z(angle) @ LEVER - away * along, pointing(along, UP))


@dataclass(frozen=True)
class Result:
    """The result of the script."""

    places: Mapping[str, tuple[float, float]]
    """Position x, y of R1 at the end of each part (m)."""
    drawer: float
    """Opening of the drawer (m)."""
    lifted: tuple[float, float]
    """Height of the mug above the table, when lifted and a second later (m)."""
    carried: float
    """Distance between the mug and its gripper at the end (m)."""
    door: float
    """Opening of the door (rad)."""


def play(stage: SceneSetup, watch: Callable[[str], None] | None = None) -> Result:
    """Run the script; `watch` is called after every control step, with the name of the part."""
    part = "kitchen"
    actor = Actor(stage, lambda: watch(part) if watch is not None else None)
    places: dict[str, tuple[float, float]] = {}
    mug = stage.scene.body("mug")
    start = np.array(mug.position)

    def height() -> float:
        return float(mug.position[2] - start[2])

    actor.go((2.1, -1.3, 0.0))
    get_ready(actor)
    places[part] = actor.base[:2]
    part = "drawer"
    open_drawer(actor)
    places[part] = actor.base[:2]
    part = "mug"
    pick_mug(actor, start)
    lifted = height()
    actor.wait(1.0)
    held = height()
    places[part] = actor.base[:2]
    part = "living room"
    carry_to_living_room(actor)
    places[part] = actor.base[:2]
    part = "door"
    open_door(actor)
    places[part] = actor.base[:2]
    joints = stage.scene.joints
    return Result(
        places=places,
        drawer=joints["kitchen_east/drawer_2"].position,
        lifted=(lifted, held),
        carried=float(np.linalg.norm(mug.position + GRASP - actor.gripper("left").position)),
        door=joints["bedroom_door/hinge"].position,
    )


VIEWS = {
    "kitchen": ((0.9, -2.6, 2.4), (2.7, -1.2, 0.6)),
    "drawer": ((2.0, -3.3, 1.7), (3.3, -1.8, 0.7)),
    "mug": ((3.5, -2.5, 2.0), (2.8, -0.7, 0.75)),
    "living room": ((-2.6, -3.2, 2.5), (-0.1, -1.1, 0.6)),
    "door": ((-3.0, -1.5, 2.2), (-1.5, 0.4, 0.8)),
}
"""Camera position and target for each part (m)."""


def view(part: str, width: int, height: int) -> Camera:
    """Return the camera for one part of the script."""
    return Camera.look_at(*VIEWS[part], width=width, height=height)


def main(output: Path | None = None) -> None:
    """Run the script, and write a picture or a video of it."""
    stage = set_up({"scene": "home", "robot": "r1"})
    world = stage.scene.world
    video = VideoWriter(output, fps=8) if output is not None and output.suffix != ".png" else None
    due = world.time

    def watch(part: str) -> None:
        nonlocal due
        if video is not None and world.time >= due:  # four times real time
            video.add(world.render(view(part, 320, 240), samples=4, background=STUDIO))
            due += 0.5

    result = play(stage, watch)
    for name, (x, y) in result.places.items():
        print(f"{name}: R1 is at {x:.2f} {y:.2f}")
    print(f"{world.time:.0f} s; the drawer is open by {100 * result.drawer:.0f} cm, the door by", end=" ")
    print(
        f"{np.degrees(result.door):.0f} degrees; the mug was lifted by {100 * result.lifted[1]:.0f} cm",
        end=" ",
    )
    print("and is still in the gripper" if result.carried < 0.05 else "and was lost on the way")
    if video is not None:
        video.close()
    elif output is not None:
        save_png(output, world.render(view("door", 640, 480), samples=4, background=STUDIO))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)

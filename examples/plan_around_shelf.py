"""Plan an arm's motion from one shelf to the next, around the board between them, as a film and a plot.

python examples/plan_around_shelf.py [FILM.gif [PLOT.png]]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from roboyard import Camera, World
from roboyard.assets import asset_path
from roboyard.description import load_description
from roboyard.description.model import Box, Pose
from roboyard.planning import Obstacle, Planner, PoseGoal, fitted_model
from roboyard.planning.hull_judge import add_obstacle
from roboyard.planning.plots import plot_trajectory
from roboyard.recording import VideoWriter

BOARDS = [
    Obstacle(name=f"board{k}", shape=Box(size=(0.35, 0.8, 0.02)), pose=Pose(position=(0.65, 0.0, height)))
    for k, height in enumerate((0.15, 0.5, 0.85))
]
LOWER, UPPER = (0.55, 0.1, 0.33), (0.55, -0.1, 0.68)


def main(film: Path | None = None, plot: Path | None = None) -> float:
    """Plan, play the motion and return how far the tool is from its goal (m)."""
    description = load_description(asset_path("arm7"))
    planner = Planner(fitted_model(description), obstacles=BOARDS)
    start = planner.ik(PoseGoal(link="tool", position=LOWER), np.zeros(7))[0]
    plan = planner.plan(start.q, PoseGoal(link="tool", position=UPPER), improve=0.2)
    if plan.trajectory is None:
        raise SystemExit(plan.reason)
    print(f"planned in {1e3 * (plan.planning_seconds + plan.timing_seconds):.0f} ms, {plan.length:.2f} rad")

    world = World()
    world.add_plane()
    arm = world.add_description(description, fixed_base=True)
    for board in BOARDS:
        add_obstacle(world, board)
    joints = [arm.joint(name) for name in planner.joint_names]
    for joint, q in zip(joints, start.q, strict=True):
        joint.position = q
    camera = Camera.look_at(eye=(1.6, -1.5, 1.1), target=(0.4, 0, 0.45), width=480, height=360)
    writer = None if film is None else VideoWriter(film, fps=20)
    for k, t in enumerate(np.arange(0.0, plan.trajectory.duration + 0.5, 1 / 240)):
        q, v, _, _ = plan.trajectory.at(t)
        for joint, position, velocity in zip(joints, q, v, strict=True):
            joint.drive_position(position, velocity=velocity)
        world.step()
        if writer is not None and k % 12 == 0:
            writer.add(world.render(camera))
    if writer is not None:
        writer.close()
    if plot is not None:
        plot_trajectory(plot, plan.trajectory, planner.named_limits, planner.bounds)
    error = float(np.linalg.norm(arm.link("tool").pose[0] - np.array(UPPER)))
    print(f"the tool is {1e3 * error:.1f} mm from its goal")
    return error


if __name__ == "__main__":
    main(*(Path(word) for word in sys.argv[1:3]))

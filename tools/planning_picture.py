"""Draw docs/images/planning.png: an arm on its way between two boards, and the motion against its limits.

python tools/planning_picture.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from roboyard.assets import asset_path
from roboyard.description import load_description
from roboyard.description.model import Box, Pose
from roboyard.planning import Obstacle, Planner, fitted_model
from roboyard.planning.hull_judge import add_obstacle
from roboyard.planning.plots import plot_trajectory
from roboyard.rendering import Camera
from roboyard.sim import World

OUT = Path(__file__).parents[1] / "docs" / "images" / "planning.png"
BOARDS = [
    Obstacle(name=f"board{k}", shape=Box(size=(0.35, 1.0, 0.03)), pose=Pose(position=(0.65, 0.0, height)))
    for k, height in enumerate((0.35, 0.8))
]
START, GOAL = (-0.35, 0.47, -0.05, 1.29, 0.0, 0.43, 0.0), (0.81, 0.04, 0.05, 1.0, 0.0, 0.38, 0.0)


def main() -> None:
    planner = Planner(fitted_model(load_description(asset_path("arm7")), progress=print), obstacles=BOARDS)
    plan = planner.plan(START, GOAL, improve=0.5)
    if plan.trajectory is None:
        raise SystemExit(f"{plan.outcome}: {plan.reason}")
    world = World()
    world.add_plane()
    for board in BOARDS:
        add_obstacle(world, board)
    arm = world.add_urdf(asset_path("arm7"), fixed_base=True)
    camera = Camera.look_at((1.75, -1.45, 1.15), (0.32, 0.0, 0.55), width=400, height=400)
    frames = []
    for time in np.linspace(0.0, plan.trajectory.duration, 4):
        arm.joint_positions = dict(zip(plan.joint_names, plan.trajectory.at(time)[0].tolist(), strict=True))
        frames.append(Image.fromarray(np.asarray(world.render(camera).rgb)))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "plot.png"
        plot_trajectory(file, plan.trajectory, planner.named_limits, planner.bounds)
        plot = Image.open(file).convert("RGB").resize((900, 810), Image.Resampling.LANCZOS)
    picture = Image.new("RGB", (900, 225 + 810), "white")
    for k, frame in enumerate(frames):
        picture.paste(frame.convert("RGB").resize((225, 225), Image.Resampling.LANCZOS), (225 * k, 0))
    picture.paste(plot, (0, 225))
    picture.quantize(128).save(OUT, optimize=True)


if __name__ == "__main__":
    main()

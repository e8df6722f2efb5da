"""A PyBullet script that plans: an arm loaded with `loadURDF` goes around a wall to the other side.

The script uses PyBullet's functions alone but for the planner, which is given the same file, the pose of the
base, and the obstacles; the motion is played by `setJointMotorControlArray`.

python examples/pybullet_planning.py [picture.png]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import roboyard.pybullet as p
from roboyard.assets import assets_root
from roboyard.description import load_description
from roboyard.description.model import Box, Pose
from roboyard.planning import Obstacle, Planner, PoseGoal, fitted_model
from roboyard.rendering import save_png
from roboyard.transforms import pose_matrix

ARM = assets_root() / "arm7" / "arm7.urdf"
WALL, AT = (0.5, 0.04, 0.5), (0.5, 0.0, 0.25)
"""Size and middle of the wall (m)."""


def main(picture: Path | None = None) -> float:
    """Play the motion; return the arm's smallest distance from the wall (m)."""
    p.connect(p.DIRECT)
    p.setGravity(0, 0, -9.81)
    base = ((0.0, 0.0, 0.05), p.getQuaternionFromEuler((0, 0, 0.2)))
    arm = p.loadURDF(str(ARM), *base, useFixedBase=True)
    half = [size / 2 for size in WALL]
    wall = p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=half), basePosition=AT)
    info = [p.getJointInfo(arm, k) for k in range(p.getNumJoints(arm))]
    joints = {row[1].decode(): row[0] for row in info if row[2] != p.JOINT_FIXED}
    tool = info[-1][12].decode()

    planner = Planner(
        fitted_model(load_description(ARM)),
        list(joints),
        [Obstacle(name="wall", shape=Box(size=WALL), pose=Pose(position=AT))],
        root=pose_matrix(*base),
    )
    start = np.zeros(len(joints))
    beside = planner.plan(start, PoseGoal(link=tool, position=(0.4, 0.3, 0.3)))
    across = planner.plan(beside.path[-1], PoseGoal(link=tool, position=(0.4, -0.3, 0.3)))
    print(f"planned in {1e3 * (beside.planning_seconds + across.planning_seconds):.0f} ms")

    least = np.inf
    for plan in (beside, across):
        assert plan.trajectory is not None, plan.reason
        for t in np.arange(0.0, plan.trajectory.duration + 0.3, 1 / 240):
            q, v, _, _ = plan.trajectory.at(t)
            p.setJointMotorControlArray(
                arm, list(joints.values()), p.POSITION_CONTROL, targetPositions=q, targetVelocities=v
            )
            p.stepSimulation()
            near = p.getClosestPoints(arm, wall, 0.2)
            least = min([least, *(row[8] for row in near)])
    reached = np.array(p.getLinkState(arm, len(info) - 1)[4])
    print(f"the tool is at {np.round(reached, 3)}; it passed the wall at {1e3 * least:.0f} mm")
    if picture is not None:
        view = p.computeViewMatrix((1.4, -1.2, 1.0), (0.2, 0.0, 0.4), (0, 0, 1))
        image = p.getCameraImage(640, 480, view, p.computeProjectionMatrixFOV(45, 4 / 3, 0.1, 5.0))
        save_png(picture, np.reshape(image[2], (480, 640, 4))[..., :3].astype(np.uint8))
    p.disconnect()
    assert np.linalg.norm(reached - (0.4, -0.3, 0.3)) < 0.01 and least > 0, (
        "it did not arrive, or touched the wall"
    )
    return float(least)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)

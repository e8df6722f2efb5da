"""Grippers that move a door hold its handle: they go around the hinge with it, and turn about the bar."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from roboyard.skills.grasps import Grasp
from roboyard.skills.joint_tracks import JointWay, _held

Z = np.array([0.0, 0.0, 1.0])


def test_held_poses_are_those_of_the_handle_turned_about_its_bar() -> None:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", (0.3, 1.2, -0.4)).as_matrix()
    pose[:3, 3] = 1.0, 0.2, 0.9
    values = np.array([0.5, 0.7, 1.1])
    way = JointWay(anchor=np.array([0.2, 0.2, 0.0]), axis=Z, is_hinge=True, values=values, geoms=frozenset())
    motions = np.array([way.motion(value) for value in values])
    grasps = [Grasp(pose=pose, cost=0.0, swivel=Z), Grasp(pose=pose, cost=0.0)]
    first, slips = np.array([0.25, 0.25]), np.array([[0.0, -0.1, -0.3]] * 2)
    held = _held(way, motions, grasps, first, slips)
    for k, value in enumerate(values):
        turn = value - values[0]
        at = [0.2 + 0.8 * np.cos(turn), 0.2 + 0.8 * np.sin(turn), 0.9]
        np.testing.assert_allclose(held[:, k, :3, 3], [at, at], atol=1e-15)
        for grasp, total in enumerate((turn + 0.25 + slips[0, k], turn)):
            wanted = Rotation.from_rotvec(total * Z).as_matrix() @ pose[:3, :3]
            np.testing.assert_allclose(held[grasp, k, :3, :3], wanted, atol=1e-15)
    np.testing.assert_array_equal(held[..., 3, :], [[[0, 0, 0, 1]] * 3] * 2)

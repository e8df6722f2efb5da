"""Kinematics of planned motions against Pinocchio, where it is installed."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.assets import assets_root
from roboyard.kinematics import forward_kinematics
from roboyard.planning import Planner, PoseGoal, SphereModel


def test_link_poses_along_a_motion_are_those_of_pinocchio(arm: SphereModel) -> None:
    pin = pytest.importorskip("pinocchio")
    planner = Planner(arm)
    link = planner.robot.chain.links[-1]
    goal = PoseGoal(link=link, position=(0.45, 0.2, 0.5), quaternion=(1.0, 0.0, 0.0, 0.0))
    plan = planner.plan(np.zeros(7), goal)
    assert plan.trajectory is not None, plan.reason
    model = pin.buildModelFromUrdf(str(assets_root() / "arm7" / "arm7.urdf"))
    data = model.createData()
    names = list(planner.joint_names)
    rows = [model.joints[model.getJointId(name)].idx_q for name in names]
    dense = plan.trajectory.dense(0.05)
    order = [names.index(name) for name in planner.robot.joint_names]
    ours = forward_kinematics(planner.robot.chain, dense[:, order], planner.robot.chain.links)
    for q, poses in zip(dense, ours, strict=True):
        full = pin.neutral(model)
        full[rows] = q
        pin.framesForwardKinematics(model, data, full)
        for name, pose in zip(planner.robot.chain.links, poses, strict=True):
            theirs = data.oMf[model.getFrameId(name)].homogeneous
            np.testing.assert_allclose(pose, theirs, atol=1e-9, err_msg=name)
    np.testing.assert_allclose(ours[-1, -1, :3, 3], (0.45, 0.2, 0.5), atol=2e-4)

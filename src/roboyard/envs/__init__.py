"""Environments for learning: tasks for any robot, one at a time or in thousands of copies.

    import gymnasium, roboyard.envs
    env = gymnasium.make("roboyard/Reach-v0", robot="r1")
    envs = roboyard.envs.make_vec("roboyard/Reach-v0", 256)

A task of your own is a `Task`: a function that fills a world, the meaning of actions, and named functions of
the state of n environments.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard._lazy import lazy_names
from roboyard.envs.registration import make_task, make_vec, register_all, register_task, task_ids

_MODULES = {
    "BaseTwist": "roboyard.envs.actions",
    "BatchEnv": "roboyard.envs.vector_env",
    "CameraPose": "roboyard.envs.randomization",
    "Color": "roboyard.envs.randomization",
    "ConfigEnv": "roboyard.envs.config_env",
    "Delay": "roboyard.envs.randomization",
    "EnvArrays": "roboyard.envs.env_arrays",
    "Friction": "roboyard.envs.randomization",
    "Gains": "roboyard.envs.randomization",
    "Gravity": "roboyard.envs.randomization",
    "GripperOpening": "roboyard.envs.actions",
    "JointDelta": "roboyard.envs.actions",
    "JointNoise": "roboyard.envs.randomization",
    "JointTarget": "roboyard.envs.actions",
    "JointVelocity": "roboyard.envs.actions",
    "Lighting": "roboyard.envs.randomization",
    "Mass": "roboyard.envs.randomization",
    "Policy": "roboyard.envs.policy",
    "Pose": "roboyard.envs.randomization",
    "RandomRows": "roboyard.envs.random_rows",
    "Reward": "roboyard.envs.task",
    "Task": "roboyard.envs.task",
    "TaskEnv": "roboyard.envs.gym_env",
    "TipDelta": "roboyard.envs.actions",
    "load_policy": "roboyard.envs.policy",
}
"""Public name to its module."""

__all__ = [
    "BaseTwist",
    "BatchEnv",
    "CameraPose",
    "Color",
    "ConfigEnv",
    "Delay",
    "EnvArrays",
    "Friction",
    "Gains",
    "Gravity",
    "GripperOpening",
    "JointDelta",
    "JointNoise",
    "JointTarget",
    "JointVelocity",
    "Lighting",
    "Mass",
    "Policy",
    "Pose",
    "RandomRows",
    "Reward",
    "Task",
    "TaskEnv",
    "TipDelta",
    "load_policy",
    "make_task",
    "make_vec",
    "register_task",
    "task_ids",
]

if TYPE_CHECKING:
    from roboyard.envs.actions import (
        BaseTwist,
        GripperOpening,
        JointDelta,
        JointTarget,
        JointVelocity,
        TipDelta,
    )
    from roboyard.envs.config_env import ConfigEnv
    from roboyard.envs.env_arrays import EnvArrays
    from roboyard.envs.gym_env import TaskEnv
    from roboyard.envs.policy import Policy, load_policy
    from roboyard.envs.random_rows import RandomRows
    from roboyard.envs.randomization import (
        CameraPose,
        Color,
        Delay,
        Friction,
        Gains,
        Gravity,
        JointNoise,
        Lighting,
        Mass,
        Pose,
    )
    from roboyard.envs.task import Reward, Task
    from roboyard.envs.vector_env import BatchEnv

__getattr__ = lazy_names(__name__, _MODULES)
register_all()

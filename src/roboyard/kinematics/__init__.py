"""Forward and inverse kinematics of trees of joints; compiled on first use.

chain = from_description(robot, "gripper_link")
result = solve_ik(chain, pose, q0)
result.q, result.position_error, result.converged
"""

from typing import TYPE_CHECKING

from roboyard._lazy import lazy_names

_HOMES = {
    "ChainArrays": "roboyard.kinematics.chain",
    "IKResult": "roboyard.kinematics.solve",
    "damped_step_ik": "roboyard.kinematics.steps",
    "differential_step": "roboyard.kinematics.steps",
    "differential_velocity": "roboyard.kinematics.steps",
    "forward_kinematics": "roboyard.kinematics.forward",
    "from_description": "roboyard.kinematics.chain",
    "jacobian": "roboyard.kinematics.forward",
    "manipulability": "roboyard.kinematics.forward",
    "sample_reachable": "roboyard.kinematics.forward",
    "solve_ik": "roboyard.kinematics.solve",
    "solve_ik_batch": "roboyard.kinematics.solve",
}

__all__ = [
    "ChainArrays",
    "IKResult",
    "damped_step_ik",
    "differential_step",
    "differential_velocity",
    "forward_kinematics",
    "from_description",
    "jacobian",
    "manipulability",
    "sample_reachable",
    "solve_ik",
    "solve_ik_batch",
]

if TYPE_CHECKING:
    from roboyard.kinematics.chain import ChainArrays, from_description
    from roboyard.kinematics.forward import forward_kinematics, jacobian, manipulability, sample_reachable
    from roboyard.kinematics.solve import IKResult, solve_ik, solve_ik_batch
    from roboyard.kinematics.steps import damped_step_ik, differential_step, differential_velocity

__getattr__ = lazy_names(__name__, _HOMES)

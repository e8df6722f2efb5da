"""Forward and inverse kinematics of trees of joints; compiled on first use.

chain = from_description(robot, "hand")
answer = solve_ik(chain, pose, q0)
answer.q, answer.position_error, answer.converged
"""

from roboyard.kinematics.chain import ChainArrays, from_description
from roboyard.kinematics.forward import forward_kinematics, jacobian, manipulability, sample_reachable
from roboyard.kinematics.solve import IKResult, solve_ik, solve_ik_batch
from roboyard.kinematics.steps import damped_step_ik, differential_step, differential_velocity

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

"""Robots as data: an imported model and one definition file make a robot that can be driven.

robot = add_robot(world, "r1", position=(0, 0, 0))
robot.apply_action(robot.no_op_action())
world.step(robot.steps_per_control)
"""

from roboyard.robots.add import add_robot
from roboyard.robots.definition import RobotDefinition
from roboyard.robots.load_definition import load_definition, parse_definition
from roboyard.robots.registry import REGISTERED_ROBOTS, RegisteredRobot, Registry
from roboyard.robots.robot import Robot

__all__ = [
    "REGISTERED_ROBOTS",
    "RegisteredRobot",
    "Registry",
    "Robot",
    "RobotDefinition",
    "add_robot",
    "load_definition",
    "parse_definition",
]

"""Robots with controllers, from a robot file or registered model and a definition.

robot = add_robot(world, "r1", position=(0, 0, 0))
robot.apply_action(robot.no_op_action())
world.step(robot.steps_per_control)
"""

from roboyard.robots.definition.load import load_definition, parse_definition
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.robots.registry import REGISTERED_ROBOTS, RegisteredRobot, Registry, list_robots
from roboyard.robots.robot import Robot
from roboyard.robots.spawn import add_robot

__all__ = [
    "REGISTERED_ROBOTS",
    "RegisteredRobot",
    "Registry",
    "Robot",
    "RobotDefinition",
    "add_robot",
    "list_robots",
    "load_definition",
    "parse_definition",
]

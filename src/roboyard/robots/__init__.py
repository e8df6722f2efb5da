"""Robots with controllers, from a robot file or registered model and a definition.

robot = add_robot(world, "r1", position=(0, 0, 0))
robot.apply_action(robot.no_op_action())
world.step(robot.steps_per_control)
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard._lazy import lazy_names

_HOMES = {
    "REGISTERED_ROBOTS": "roboyard.robots.registry",
    "RegisteredRobot": "roboyard.robots.registry",
    "Registry": "roboyard.robots.registry",
    "Robot": "roboyard.robots.robot",
    "RobotDefinition": "roboyard.robots.definition.schema",
    "add_robot": "roboyard.robots.spawn",
    "list_robots": "roboyard.robots.registry",
    "load_definition": "roboyard.robots.definition.load",
    "parse_definition": "roboyard.robots.definition.load",
}
"""Public name to the module that defines it; robots load only what is used of them."""

if TYPE_CHECKING:
    from roboyard.robots.definition.load import load_definition, parse_definition
    from roboyard.robots.definition.schema import RobotDefinition
    from roboyard.robots.registry import REGISTERED_ROBOTS, RegisteredRobot, Registry, list_robots
    from roboyard.robots.robot import Robot
    from roboyard.robots.spawn import add_robot

__getattr__ = lazy_names(__name__, _HOMES)

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

"""Motion planning for any robot on one CPU core: collision checks, paths, timing.

planner = Planner(fitted_model(load_description("arm.urdf")), obstacles=[Obstacle(name="table", shape=box)])
plan = planner.plan(start, PoseGoal(link="tool", position=(0.4, 0.2, 0.5)))
plan.outcome, plan.path, plan.trajectory.at(0.5)
planner_for(robot, "left").plan(goal)   a live robot among what is around it
"""

from typing import TYPE_CHECKING

from roboyard._lazy import lazy_names

_HOMES = {
    "Attached": "roboyard.planning.attached",
    "attached_body": "roboyard.planning.attached",
    "CollisionChecker": "roboyard.planning.checking",
    "DistanceField": "roboyard.planning.distance_fields",
    "Follower": "roboyard.planning.reactive",
    "Obstacle": "roboyard.planning.obstacles",
    "Obstacles": "roboyard.planning.obstacles",
    "PathConstraint": "roboyard.planning.constraints",
    "Plan": "roboyard.planning.trajectory",
    "Planner": "roboyard.planning.planner",
    "PoseGoal": "roboyard.planning.goals",
    "PosesGoal": "roboyard.planning.goals",
    "RobotPlanner": "roboyard.planning.robot_planner",
    "SphereModel": "roboyard.planning.spheres.sphere_model",
    "Trajectory": "roboyard.planning.trajectory",
    "cloud_field": "roboyard.planning.distance_fields",
    "covering_model": "roboyard.planning.spheres.link_fit",
    "fitted_model": "roboyard.planning.spheres.link_fit",
    "keep_upright": "roboyard.planning.constraints",
    "load_planner_file": "roboyard.planning.planner_files",
    "on_line": "roboyard.planning.constraints",
    "planner_for": "roboyard.planning.robot_planner",
    "load_problems": "roboyard.planning.problem_files",
    "solve_problems": "roboyard.planning.problem_files",
    "sphere_robot": "roboyard.planning.spheres.sphere_model",
    "turned_goals": "roboyard.planning.goals",
}

__all__ = [
    "Attached",
    "CollisionChecker",
    "DistanceField",
    "Follower",
    "Obstacle",
    "Obstacles",
    "PathConstraint",
    "Plan",
    "Planner",
    "PoseGoal",
    "PosesGoal",
    "RobotPlanner",
    "SphereModel",
    "Trajectory",
    "attached_body",
    "cloud_field",
    "covering_model",
    "fitted_model",
    "keep_upright",
    "load_planner_file",
    "load_problems",
    "on_line",
    "planner_for",
    "solve_problems",
    "sphere_robot",
    "turned_goals",
]

if TYPE_CHECKING:
    from roboyard.planning.attached import Attached, attached_body
    from roboyard.planning.checking import CollisionChecker
    from roboyard.planning.constraints import PathConstraint, keep_upright, on_line
    from roboyard.planning.distance_fields import DistanceField, cloud_field
    from roboyard.planning.goals import PoseGoal, PosesGoal, turned_goals
    from roboyard.planning.obstacles import Obstacle, Obstacles
    from roboyard.planning.planner import Planner
    from roboyard.planning.planner_files import load_planner_file
    from roboyard.planning.problem_files import load_problems, solve_problems
    from roboyard.planning.reactive import Follower
    from roboyard.planning.robot_planner import RobotPlanner, planner_for
    from roboyard.planning.spheres.link_fit import covering_model, fitted_model
    from roboyard.planning.spheres.sphere_model import SphereModel, sphere_robot
    from roboyard.planning.trajectory import Plan, Trajectory

__getattr__ = lazy_names(__name__, _HOMES)

"""Planned motions of arms: a handle is let go, and the arm takes a way around obstacles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from roboyard.robots.control.task import TaskController
from roboyard.transforms import Array, pose_matrix, quaternion_from_matrix
from roboyard.viewer.scene.drawings import Drawing, SceneLines

if TYPE_CHECKING:
    from roboyard.planning import RobotPlanner, Trajectory
    from roboyard.viewer.driving.action_source import ActionSource
    from roboyard.viewer.viewer import Viewer

SEARCH = 2.0
"""Longest search (s)."""


@dataclass
class _Motion:
    trajectory: Trajectory
    goal: Array
    """(4, 4) pose of the end effector in the base frame."""
    line: SceneLines
    """Along which the end effector moves."""
    time: float = 0.0
    """Time of the trajectory that the arm is at (s)."""


class PlannedMoves:
    """Plans motions of a robot's arms to poses of their end effectors, and lets them follow.

    Their speed is the share `ActionSource.speed` of what the joints allow.
    """

    def __init__(
        self, viewer: Viewer, action_source: ActionSource, on_end: Callable[[str], None] = lambda _: None
    ) -> None:
        """Create it without motions; `on_end` is given the group of a motion that ended or was stopped."""
        self._viewer, self._action_source, self._on_end = viewer, action_source, on_end
        self._planners: dict[str, RobotPlanner] = {}
        self._motions: dict[str, _Motion] = {}

    def moves(self, group: str) -> bool:
        """Whether an arm follows a planned motion."""
        return group in self._motions

    def start(self, group: str, pose: Array) -> str:
        """Plan from where an arm is, and begin to move; returns what was found, as plain text.

        Args:
            group: joint group of the arm.
            pose: (4, 4) goal of its end effector in the robot's base frame.

        Raises:
            RoboyardError: no motion can be planned for the robot.
        """
        from roboyard.planning import PoseGoal, planner_for  # compiled loops load with it
        from roboyard.viewer.planning.tool_way import tool_way

        self.stop(group)
        robot = self._action_source.robot
        controller = self._controller(group)
        if group not in self._planners:
            self._planners[group] = planner_for(robot, joints=robot.groups[group].joints)
        now = self._planners[group].planner()
        goal = pose_matrix(*robot.base_link.pose) @ pose
        tool = controller.chain.tip_names[0]
        turn = None if controller.command_dim < 6 else quaternion_from_matrix(goal[:3, :3])
        start = np.clip(self._planners[group].start(), *now.bounds)
        found = now.plan(start, PoseGoal(link=tool, position=goal[:3, 3], quaternion=turn), time_limit=SEARCH)
        if found.trajectory is None:
            return f"{found.outcome}: {found.reason}"
        self._motions[group] = _Motion(found.trajectory, pose, tool_way(now, found.trajectory, tool))
        self._draw()
        milliseconds = 1e3 * (found.planning_seconds + found.timing_seconds)
        seconds = found.trajectory.duration / self._action_source.speed
        return f"planned in {milliseconds:.0f} ms; the motion takes {seconds:.1f} s"

    def act(self, period: float) -> None:
        """Set the next goals, after an action was applied and before its control period (s) is simulated."""
        robot = self._action_source.robot
        for group, motion in tuple(self._motions.items()):
            pace = self._action_source.speed
            motion.time = min(motion.time + pace * period, motion.trajectory.duration)
            found = robot.groups[group]
            controller = self._controller(group)
            controller.follow_posture(motion.trajectory.at(motion.time)[0], robot.loop.state_of(found))
            if motion.time >= motion.trajectory.duration:
                self._action_source.targets[group] = motion.goal
                self.stop(group)

    def stop(self, group: str | None = None) -> None:
        """Stop the motion of one arm, or of all, where it is."""
        for one in (group,) if group is not None else tuple(self._motions):
            if self._motions.pop(one, None) is not None:
                self._draw()
                self._on_end(one)

    def _draw(self) -> None:
        self._viewer.draw(Drawing(lines=[motion.line for motion in self._motions.values()]))

    def _controller(self, group: str) -> TaskController:
        controller = self._action_source.robot.groups[group].controller
        assert isinstance(controller, TaskController)
        return controller

"""`PlanningPage`: drag a goal in the browser; the robot's way there is planned again at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.planning import Plan, PoseGoal
from roboyard.planning.checking import CollisionChecker
from roboyard.transforms import from_wxyz, to_wxyz
from roboyard.viewer.bar.bar import Controls
from roboyard.viewer.page.loop import serve
from roboyard.viewer.page.markdown import plain
from roboyard.viewer.page.requests import RequestQueue
from roboyard.viewer.page.server import DEFAULT_PORT
from roboyard.viewer.planning.clearance_layer import ClearanceLayer, nearest_links
from roboyard.viewer.planning.swept_ghost import COPIES, SweptGhost
from roboyard.viewer.planning.tool_way import tool_way
from roboyard.viewer.scene.drawings import Drawing
from roboyard.viewer.scene.texts import SceneText
from roboyard.viewer.viewer import Viewer

if TYPE_CHECKING:
    from roboyard.planning import RobotPlanner

SEARCH = 0.5
"""Longest search while the goal is dragged (s)."""
SCALE = 0.22
"""Size of the goal's handle (m)."""
RED = (0.75, 0.1, 0.1)


class PlanningPage:
    """A robot in its world, a goal that can be dragged, and the motion to it.

    All methods but `stop` run in the thread that calls `tick` or `run`.
    """

    def __init__(
        self,
        planner: RobotPlanner,
        *,
        link: str | None = None,
        goal: PoseGoal | None = None,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        quiet: bool = False,
    ) -> None:
        """Open the page.

        Args:
            planner: plans for a group of joints of a robot in a world.
            link: the link that reaches the goal; the end effector by default.
            goal: first place of the handle; where the link is now by default.
            host: address to listen on.
            port: first port to try.
            quiet: do not print the address.

        Raises:
            ConfigError: the robot has no such link, or the server cannot listen.
            MissingExtraError: viser is not installed.
        """
        self.planner, self.robot = planner, planner.robot
        self._first_posture = self.robot.joint_positions.copy()
        self.link = link or (goal.link if goal is not None else planner.tool)
        body_link = self.robot.body.link(self.link)
        self._now = planner.planner()
        self._now.warm_up()
        self.viewer = Viewer(
            self.robot.world, host, port, title="Roboyard: plan", quiet=quiet, follow_steps=False
        )
        self.requests = RequestQueue(self.show_error)
        self.plans = 0
        """Motions planned so far."""
        self.plan: Plan | None = None
        """The last one, also where it failed."""
        self._time: float | None = None
        """Time of the motion that the robot is at while it moves (s)."""
        self._is_due = True
        self._stopped = False
        scene, gui = self.viewer.server.scene, self.viewer.server.gui
        self.ghost = SweptGhost(scene, self._now)
        self.clearances = ClearanceLayer(scene)
        position, quaternion = body_link.pose
        if goal is not None:
            position = np.asarray(goal.position, dtype=float)
            quaternion = quaternion if goal.quaternion is None else np.asarray(goal.quaternion, dtype=float)
        self.handle = scene.add_transform_controls(
            "/plan/goal",
            scale=SCALE,
            line_width=3.0,
            depth_test=False,
            position=position,
            wxyz=to_wxyz(quaternion),
        )
        fixed = goal is not None and goal.quaternion is not None
        self.turn_box = gui.add_checkbox("keep the orientation", fixed, hint="off: only the place counts")
        self.ghost_box = gui.add_checkbox("swept ghost", True, hint="copies of the robot along the motion")
        self.spheres_box = gui.add_checkbox(
            "spheres", False, hint="the planner's spheres, red where their link is near an obstacle"
        )
        self.distances_box = gui.add_checkbox("distances", True, hint="of the links nearest to obstacles")
        self.along_slider = gui.add_slider(
            "along the motion",
            min=0.0,
            max=1.0,
            step=0.01,
            initial_value=1.0,
            hint="where spheres and distances are shown",
        )
        self.move_button = gui.add_button("Move", color="green", hint="the robot takes the motion")
        self.status = gui.add_markdown("")
        self._connect()

    def _connect(self) -> None:
        do = self.requests.do

        def goal_moved(_: Any) -> None:
            self._is_due = True

        self.handle.on_update(goal_moved)
        self.turn_box.on_update(goal_moved)
        for element in (self.ghost_box, self.spheres_box, self.distances_box, self.along_slider):
            element.on_update(lambda _: do(self.draw))
        self.move_button.on_click(lambda _: do(self.move))
        self.viewer.bar.controls = Controls(
            play=lambda playing: do(self.move if playing else self.rest),
            step=lambda: None,
            reset=lambda: do(self.reset),
            set_speed=lambda _: None,
            home=self.viewer.go_home,
            refresh=lambda: do(self.viewer.sync),
        )
        self.viewer.bar.show(playing=False)

    # ---------------------------------------------------------------------------------- the loop

    def run(self) -> None:
        """Serve the page until `stop` is called or the process is interrupted."""
        serve(self.tick, self.requests, lambda: self._stopped)

    def tick(self, elapsed: float) -> None:
        """Execute the page's requests, move on by `elapsed` (s), and plan where the goal was moved."""
        self.requests.execute_all()
        if self._time is not None:
            self._go_on(elapsed)
        elif self._is_due:
            self._is_due = False
            self.requests.execute(self.replan)

    def stop(self) -> None:
        """Let `run` return; may be called from any thread."""
        self._stopped = True

    def close(self) -> None:
        """Close the page."""
        self.stop()
        self.viewer.close()

    # ---------------------------------------------------------------------------------- planning

    @property
    def goal(self) -> PoseGoal:
        """Pose of the handle in the world frame; its orientation counts where the box is ticked."""
        turn = from_wxyz(self.handle.wxyz) if self.turn_box.value else None
        return PoseGoal(link=self.link, position=np.asarray(self.handle.position), quaternion=turn)

    def set_goal(self, position: ArrayLike) -> None:
        """Move the handle to a (3,) place in the world frame (m)."""
        self.handle.position = np.asarray(position, dtype=float)
        self._is_due = True

    def replan(self) -> None:
        """Plan from where the robot is to the handle, and show the motion."""
        start = np.clip(self.planner.start(), *self._now.bounds)
        self.plan = self._now.plan(start, self.goal, time_limit=SEARCH)
        self.plans += 1
        self.draw()

    def move(self) -> None:
        """Let the robot take the motion that is shown, at its speed."""
        if self.plan is not None and self.plan.trajectory is not None and self._time is None:
            self._time = 0.0
            self.viewer.bar.show(playing=True)

    def rest(self) -> None:
        """Stop a motion where it is, and plan from there."""
        self._time = None
        self.viewer.bar.show(playing=False)
        self._start_here()

    def reset(self) -> None:
        """Move the robot back to where it was when the page opened."""
        self.robot.joint_positions = self._first_posture
        self.rest()

    def _start_here(self) -> None:
        self._now = self.planner.planner()
        self._is_due = True
        self.viewer.sync()

    def _go_on(self, elapsed: float) -> None:
        trajectory = None if self.plan is None else self.plan.trajectory
        if trajectory is None or self._time is None:
            self._time = None
            return
        self._time = min(self._time + elapsed, trajectory.duration)
        rows = [self.robot.joint_names.index(name) for name in self.planner.joint_names]
        posture = self.robot.joint_positions
        posture[rows] = trajectory.at(self._time)[0]
        self.robot.joint_positions = posture
        if self._time >= trajectory.duration:
            self.rest()
        else:
            self.viewer.sync()

    # ----------------------------------------------------------------------------------- display

    def draw(self) -> None:
        """Show the last motion as the boxes of the page ask."""
        plan = self.plan
        trajectory = None if plan is None else plan.trajectory
        if plan is None or trajectory is None:
            self.ghost.clear()
            self.clearances.clear()
            self.viewer.draw(Drawing())
            if plan is not None:
                self.status.content = f"**{plain(plan.outcome)}**: {plain(plan.reason)}"
            return
        now, root = self._now, self._now.obstacles.root
        times = np.linspace(0.0, trajectory.duration, COPIES)
        rows = np.array([now.vector(q) for q in trajectory.at(times)[0]])
        if self.ghost_box.value:
            self.ghost.show(rows, root)
        else:
            self.ghost.clear()
        at = now.vector(trajectory.at(float(self.along_slider.value) * trajectory.duration)[0])
        found = CollisionChecker(now.robot, now.obstacles).clearance(at)
        if self.spheres_box.value:
            self.clearances.show(found, root)
        else:
            self.clearances.clear()
        near = nearest_links(found) if self.distances_box.value else ()
        texts = []
        for link, gap in near:
            middle = found.centers[found.of_link == found.links.index(link)].mean(axis=0)
            x, y, z = (float(value) for value in root[:3, :3] @ middle + root[:3, 3])
            texts.append(SceneText(text=f"{1e3 * gap:.0f} mm", position=(x, y, z), rgb=RED))
        self.viewer.draw(Drawing(lines=[tool_way(now, trajectory, self.link)], texts=texts))
        milliseconds = 1e3 * (plan.planning_seconds + plan.timing_seconds)
        said = [
            f"planned in {milliseconds:.1f} ms",
            f"{len(plan.path)} way points, {plan.length:.2f} rad, {trajectory.duration:.2f} s",
            *(f"{plain(link)}: {1e3 * gap:.0f} mm from obstacles" for link, gap in near),
        ]
        self.status.content = "  \n".join(said)

    def show_error(self, message: str) -> None:
        """Show an error message (plain text)."""
        self.status.content = f"**{plain(message)}**"

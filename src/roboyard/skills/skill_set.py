"""The skills of one robot: each acts, checks its outcome, tries again, backs out, and says what happened."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.errors import RoboyardError, unknown_name
from roboyard.planning.goals import PoseGoal
from roboyard.robots.robot import Robot
from roboyard.scenes.scene import Scene
from roboyard.skills import driving, grasping, line_following, opening, placing
from roboyard.skills.motion import go
from roboyard.skills.outcome import SkillError, SkillResult
from roboyard.skills.places import Names
from roboyard.skills.worker import Worker
from roboyard.transforms import inverse_pose, pose_matrix, quaternion_from_matrix

ATTEMPTS = 3
"""How often a skill is tried."""
ENOUGH = (0.85, 0.65, 0.5)
"""Shares of a joint's range that `open` tries without an amount, one after the other."""


class Skills:
    """Actions of one robot on objects, joints and rooms by name.

    Skills use the robot's own controllers; those of arms and trunk become `JointController`s of positions.
    Joints of furniture are named "body/joint".
    """

    def __init__(
        self,
        robot: Robot,
        scene: Scene | None = None,
        *,
        watch: Callable[[], None] | None = None,
        seed: int = 0,
    ) -> None:
        """Create the skills of a robot.

        Args:
            robot: the robot.
            scene: names rooms; without one only bodies and joints of the robot's world have names.
            watch: called after every control step.
            seed: seed of what is drawn at random.
        """
        self.worker = Worker(robot, watch)
        self.names = Names(robot.world, scene, robot.body)
        self.log: list[SkillResult] = []
        """Results of all skills so far."""
        self._random = np.random.default_rng(seed)

    # ------------------------------------------------------------------------------------------- motion

    def navigate_to(self, place: str | Sequence[float]) -> SkillResult:
        """Drive to a room, before a body, or to x, y (m) and perhaps yaw (rad) in the world frame.

        Raises:
            RoboyardError: nothing has that name, or the numbers are not two or three.
        """
        worker = self.worker
        if isinstance(place, str):
            label = place
            known = {*self.names.rooms, *self.names.bodies}
            if place not in known:
                raise RoboyardError(unknown_name("room or body", place, known))
        else:
            label = " ".join(f"{value:.2f}" for value in place)
            if len(place) not in (2, 3):
                raise RoboyardError(f"navigate_to: {place} must be x, y or x, y, yaw")

        def act() -> str:
            if not worker.base_joints:
                raise SkillError("the robot has no holonomic base; place it there with set_pose")
            if not isinstance(place, str):
                spots = driving.spots_in(worker, (place[0], place[1]), self._random)[:2]
                if len(place) == 3:
                    spots = [worker.base_at(place[0], place[1], place[2])]
            elif place in self.names.rooms:
                spots = driving.spots_in(worker, self.names.rooms[place], self._random)
            else:
                spots = driving.spots_before(worker, self.names.body(place), self._random)
            spots = driving.free_bases(worker, spots, 4)
            driving.drive(worker, spots)
            x, y, _ = driving.world_base(worker)
            return f"it stands at {x:.2f}, {y:.2f} m"

        return self._try("navigate_to", label, act)

    def move_to(
        self, position: ArrayLike, quaternion: ArrayLike | None = None, *, arm: str | None = None
    ) -> SkillResult:
        """Move a gripper to a (3,) position (m) and perhaps a (4,) quaternion x, y, z, w in the world frame.

        The arm moves, and the trunk where there is one; the base stays.

        Raises:
            ConfigError: the robot has no such arm, or a value is not finite.
        """
        worker = self.worker
        at = np.asarray(position, dtype=float)

        def act() -> str:
            chosen = arm or worker.free_arms()[0]
            gripper = worker.gripper(chosen)
            offset = gripper.offset
            if quaternion is None:  # the end effector is near enough where the orientation is free
                goal = PoseGoal(link=gripper.tool, position=at)
            else:
                tool = pose_matrix(at, quaternion) @ inverse_pose(offset)
                turn = quaternion_from_matrix(tool[:3, :3])
                goal = PoseGoal(link=gripper.tool, position=tool[:3, 3], quaternion=turn)
            go(worker, goal, chosen, torso=True)
            here = (
                worker.grip_pose(chosen)[:3, 3]
                if quaternion is not None
                else worker.robot.arms[chosen].pose[0]
            )
            gap = float(np.linalg.norm(here - at))
            if gap > 0.02:
                raise SkillError(f"the gripper is {100 * gap:.0f} cm away from its goal{_by(worker)}")
            return f"the gripper is {1e3 * gap:.0f} mm from its goal"

        return self._try("move_to", " ".join(f"{value:.2f}" for value in at), act)

    def ready(self) -> SkillResult:
        """Move the arms that hold nothing to the reset posture."""
        worker = self.worker

        def act() -> str:
            driving.to_ready(worker, [arm for arm in worker.arm_names if arm not in worker.held])
            return "the arms are in the reset posture"

        return self._try("ready", "", act)

    def follow_line(
        self, points: ArrayLike, *, along: ArrayLike = (0.0, 0.0, -1.0), arm: str | None = None
    ) -> SkillResult:
        """Move a gripper along (k, 3) points (m) in the world frame, as for wiping, pointing `along` (3,)."""
        line = np.asarray(points, dtype=float)
        if line.ndim != 2 or line.shape[1] != 3 or len(line) < 2 or not np.isfinite(line).all():
            raise RoboyardError(
                f"follow_line: points have shape {line.shape}; give at least two of 3 numbers"
            )
        direction = np.asarray(along, dtype=float)
        worker = self.worker

        def act() -> str:
            arms = [arm] if arm is not None else worker.free_arms()
            worst = line_following.follow_line(worker, line, direction, arms, self._random)
            if worst > 0.02:
                raise SkillError(f"the gripper left the line by {100 * worst:.0f} cm{_by(worker)}")
            return f"within {1e3 * worst:.0f} mm"

        return self._try("follow_line", f"{len(line)} points", act)

    # ------------------------------------------------------------------------------------------ objects

    def grasp(self, body: str, *, arm: str | None = None) -> SkillResult:
        """Grasp a body, with any arm that is free; the robot drives to where it reaches it.

        Raises:
            RoboyardError: there is no such body.
        """
        worker, target = self.worker, self.names.body(body)

        def act() -> str:
            arms = [arm] if arm is not None else worker.free_arms()
            try:
                chosen = grasping.grasp(worker, target, arms, self._random)
            except SkillError:
                driving.withdraw(worker, self._random)
                raise
            return f'it is in the gripper of arm "{chosen}"'

        return self._try("grasp", body, act)

    def lift(self, body: str, height: float = 0.12) -> SkillResult:
        """Lift a grasped body by a height (m)."""
        worker = self.worker

        def act() -> str:
            arm = self._arm_with(body)
            grasping.lift(worker, arm, height)
            near = " and brought near the body" if grasping.carry(worker, arm) else ""
            return f"it was lifted by {100 * height:.0f} cm{near}"

        return self._try("lift", body, act, attempts=1)

    def place(self, body: str, on: str, at: ArrayLike | None = None) -> SkillResult:
        """Place a grasped body on top of another, near (2,) x, y (m) in the world frame where given.

        Raises:
            RoboyardError: there is no such body.
        """
        worker, support = self.worker, self.names.body(on)
        spot = None if at is None else np.asarray(at, dtype=float)

        def act() -> str:
            arm = self._arm_with(body)
            x, y, _ = placing.place(worker, arm, support, self._random, spot)
            driving.withdraw(worker, self._random)
            return f"it stands on {on} at {x:.2f}, {y:.2f} m"

        return self._try("place", f"{body} on {on}", act)

    def holds(self, body: str) -> bool:
        """Return whether a gripper holds a body: it was grasped, and fingers still touch it."""
        target = self.names.body(body)
        return any(
            one.body is target and grasping.is_between_fingers(self.worker, arm, target)
            for arm, one in self.worker.held.items()
        )

    def _arm_with(self, body: str) -> str:
        target = self.names.body(body)
        for arm, one in self.worker.held.items():
            if one.body is target:
                return arm
        raise SkillError("it is in no gripper; grasp it first")

    # ------------------------------------------------------------------------------------------- joints

    def open(self, joint: str, amount: float | None = None, *, arm: str | None = None) -> SkillResult:
        """Open a drawer or a door by its handle.

        Args:
            joint: "body/joint".
            amount: share of its range, 0 to 1; as far as the robot reaches by default, at least half.
            arm: any arm that is free by default.

        Raises:
            RoboyardError: there is no such joint, or it has no limits.
        """
        return self._move_joint("open", joint, ENOUGH if amount is None else (amount,), arm)

    def close(self, joint: str, *, arm: str | None = None) -> SkillResult:
        """Close a drawer or a door by its handle; errors as `open`."""
        return self._move_joint("close", joint, (0.0,), arm)

    def _move_joint(self, skill: str, name: str, shares: Sequence[float], arm: str | None) -> SkillResult:
        joint, worker = self.names.joint(name), self.worker
        if joint.limits is None:
            raise RoboyardError(f"joint {name!r} has no limits; give it some with set_limits")
        low, high = joint.limits
        closed, opened = (low, high) if abs(low) <= abs(high) else (high, low)

        def act() -> str:
            arms = [arm] if arm is not None else worker.free_arms()
            last = SkillError("")
            for share in shares:
                goal = closed + share * (opened - closed)
                if abs(goal - float(joint.position)) < 0.02 * abs(opened - closed):
                    return "it is there already"
                try:
                    reached = opening.move_joint(worker, joint, goal, arms, self._random)
                except SkillError as error:
                    last = error
                    if "reaches" in str(error):
                        continue
                    driving.withdraw(worker, self._random)
                    raise
                driving.withdraw(worker, self._random)
                percent = 100 * (reached - closed) / (opened - closed)
                return f"it is open by {percent:.0f} %"
            raise last

        return self._try(skill, name, act)

    # ------------------------------------------------------------------------------------------ trying

    def _try(self, skill: str, target: str, act: Callable[[], str], attempts: int = ATTEMPTS) -> SkillResult:
        """Run a skill until it succeeds, at most `attempts` times, and note the result."""
        begin = self.worker.world.time
        self._forget_lost()
        text, done = "", 0
        succeeded = False
        while not succeeded and done < attempts:
            done += 1
            try:
                text, succeeded = act(), True
            except SkillError as error:
                text = str(error)
                self.worker.wait(0.2)
                if error.is_final:
                    break
        lost = self._forget_lost()
        if lost and succeeded:
            succeeded, text = False, f"{text}, but {' and '.join(lost)} slipped out of the gripper on the way"
        result = SkillResult(
            skill=skill,
            target=target,
            succeeded=succeeded,
            text=text,
            seconds=self.worker.world.time - begin,
            attempts=done,
        )
        self.log.append(result)
        return result

    def _forget_lost(self) -> list[str]:
        """Note that bodies which no finger touches any more are not held; return their names."""
        worker = self.worker
        lost = [
            arm for arm, one in worker.held.items() if not grasping.is_between_fingers(worker, arm, one.body)
        ]
        names = [worker.held[arm].body.name for arm in lost]
        for arm in lost:
            worker.release(arm)
        return names


def _by(worker: Worker) -> str:
    touched = worker.touched()
    return f"; it touches {', '.join(touched)}" if touched else ""

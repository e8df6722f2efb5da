"""The world of the demo: a floor, the robot on it (or on a stand), and an obstacle beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roboyard.demo.plan import Plan
from roboyard.description.model import Cylinder, Link, Material, RobotDescription, Visual
from roboyard.morphology.point_model import PointModel
from roboyard.transforms import Array, rotate

if TYPE_CHECKING:
    from roboyard.sim import Body, World

STAND_COLOUR = (0.45, 0.47, 0.5, 1.0)
OBSTACLE_COLOUR = (0.93, 0.45, 0.16, 1.0)
OBSTACLE_DENSITY = 150.0
"""kg/m³: a crate."""
MOST_DROP = 0.05
"""m"""
FREE_FREQUENCY, FIXED_FREQUENCY = 4.0, 8.0
"""Hz: how stiff the drives are. On a robot that stands free stiffer ones make its contacts tremble."""

MOTOR_FREQUENCY = 2.0 * np.pi * 8.0
"""rad/s of light joints with their motors."""
MOTOR_SHARE = 0.1
"""Of the inertia that a joint which carries the robot moves with it: what its geared motor adds, as it turns.

Files leave it out. A bare knee weighs next to nothing beside the robot on it, and contacts and drives would
take turns in throwing it about.
"""
FULL_EFFORT_HINGE, FULL_EFFORT_SLIDE = 0.15, 0.02
"""rad or m: error at which a light joint uses its whole effort."""


class DemoWorld:
    """World, robot and obstacle; `place` puts the robot in, and again when it has to be held up."""

    def __init__(self, figure: PointModel, plan: Plan) -> None:
        from roboyard.sim import World

        self.figure, self.plan = figure, plan
        self.world: World = World()
        self.world.add_plane(rgba=(0.86, 0.88, 0.9, 1.0), name="floor")
        width, depth = np.ptp(plan.size[:, 0]), np.ptp(plan.size[:, 1])
        height = float(np.ptp(plan.size[:, 2]))
        self.edge = float(np.clip(0.2 * max(width, depth, height), 0.03, 0.3))
        """Of the obstacle; m."""
        beside = plan.size[0, 1] - 1.1 * self.edge
        self.obstacle: Body = self.world.add_box(
            (self.edge, self.edge, self.edge),
            (float(plan.size[:, 0].mean()), float(beside), 0.5 * self.edge),
            mass=OBSTACLE_DENSITY * self.edge**3,
            rgba=OBSTACLE_COLOUR,
            name="obstacle",
        )
        self.robot: Body = self.place(free=plan.stance.kind != "mounted")

    def place(self, *, free: bool) -> Body:
        """Put the robot into the world in its home posture, its drives holding it, a little above the floor
        when it is free, else on its stand; a robot placed before is taken out.
        """
        plan = self.plan
        if hasattr(self, "robot"):
            self.world.remove(self.robot)
        height = float(np.ptp(plan.size[:, 2]))
        lift = min(MOST_DROP, 0.1 * height) if free else plan.stand
        position = (0.0, 0.0, lift - plan.stance.lowest)
        self.robot = self.world.add_urdf(
            self.figure.description, position, fixed_base=not free, name=self.figure.description.name
        )
        if not free and plan.stand > 0:
            self._add_stand(position[2])
        if free:
            self._add_motor_inertia()
        self.robot.joint_positions = {
            name: value
            for name, value in self.figure.posture_with_followers().items()
            if self.robot.joint(name).is_scalar
        }
        self._gains = self._find_gains(FREE_FREQUENCY if free else FIXED_FREQUENCY)
        for name, value in plan.home.items():
            self.drive(name, value)
        return self.robot

    def drive(self, joint: str, target: float, velocity: float = 0.0) -> None:
        """Pull a joint of the robot towards a target; rad or m, and per second."""
        stiffness, damping = self._gains[joint]
        self.robot.joint(joint).drive_position(
            target, velocity=velocity, stiffness=stiffness, damping=damping
        )

    def _find_gains(self, frequency: float) -> dict[str, tuple[float, float]]:
        """Stiffness and damping of every driven joint, critically damped at a frequency (Hz).

        The inertia is the largest that the joint may have to move; for joints that carry the robot, such as
        wheels, also a share of the whole robot at the lever of the floor's push, which is far more than the
        wheel's own. Light joints are made stiffer than that, so that a small error calls up their effort
        against friction, as far as the time step allows; they get the inertia of a motor that strong, or
        fingers would chatter on each other and on the floor.
        """
        plan, world = self.plan, self.world
        share = self._share()
        omega = 2.0 * np.pi * frequency
        found = {}
        for name, inertia in plan.inertias.items():
            joint = self.robot.joint(name)
            own = float(world.model.dof_M0[joint.dof_slice.start])
            total = max(inertia, own)
            if not self.robot.is_fixed:
                total += share * plan.stance.levers.get(name, 0.0) ** 2
            stiffness = total * omega**2
            effort = joint.limit.effort if joint.limit is not None else None
            if effort is not None and 0.0 < effort < np.inf:
                wanted = effort / (FULL_EFFORT_SLIDE if joint.type == "prismatic" else FULL_EFFORT_HINGE)
                stiffness = max(stiffness, min(wanted, own / world.timestep**2))
            if joint.armature == 0.0:  # joints that carry the robot have a motor already
                joint.armature = max(stiffness / MOTOR_FREQUENCY**2 - own, 0.0)
                own += joint.armature
            damping = max(2.0 * total * omega, 2.0 * np.sqrt(stiffness * own))
            found[name] = (stiffness, damping)
        return found

    def _share(self) -> float:
        """Of the robot's mass on each of its feet; kg."""
        return self.robot.mass / max(len(self.plan.stance.feet), 1)

    def _add_motor_inertia(self) -> None:
        """Of the joints that carry the robot, where its file gives none."""
        for name, lever in self.plan.stance.levers.items():
            joint = self.robot.joint(name)
            if joint.armature == 0.0:
                joint.armature = MOTOR_SHARE * self._share() * lever**2

    def robot_points(self) -> Array:
        """(k, 3) outline points of the robot in the world, as it is now; its base where it has no shapes."""
        placed = [self.robot.position[None]]
        for name, outline in self.figure.outlines.items():
            position, quaternion = self.robot.link(name).pose
            placed.append(rotate(quaternion, outline) + position)
        return np.concatenate(placed if len(placed) == 1 else placed[1:])

    def _add_stand(self, root_height: float) -> None:
        """A column from the floor to the bottom of the robot's base; to look at, it touches nothing."""
        points = self.figure.points(self.figure.poses({}), self.figure.base_links)
        if points.size == 0:
            return
        top = root_height + float(points[:, 2].min())
        if top <= 0.01:
            return
        spread = np.ptp(points[:, :2], axis=0)
        radius = float(np.clip(0.25 * spread.min(), 0.01, 0.08))
        centre = points[:, :2].mean(axis=0)
        column = Visual(geometry=Cylinder(radius=radius, length=top), material=Material(rgba=STAND_COLOUR))
        description = RobotDescription(name="stand", links=(Link(name="stand", visuals=(column,)),))
        self.world.add_urdf(description, (*centre, 0.5 * top), fixed_base=True)

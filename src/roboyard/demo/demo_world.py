"""The world of the demo: a floor, the robot on it or on a stand, and an obstacle beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roboyard.demo.plan import Plan
from roboyard.description.model import Cylinder, Link, Material, RobotDescription, Visual
from roboyard.morphology.point_model import PointModel
from roboyard.sim.actuation.gains import carrying_motor_inertia
from roboyard.transforms import Array, rotate

if TYPE_CHECKING:
    from roboyard.sim import Body, World

STAND_COLOUR = (0.45, 0.47, 0.5, 1.0)
OBSTACLE_COLOUR = (0.93, 0.45, 0.16, 1.0)
OBSTACLE_DENSITY = 150.0
"""Density of the obstacle (kg/m³), that of a wooden crate."""
MOST_DROP = 0.05
"""Height from which a free robot is dropped, at most (m)."""


class DemoWorld:
    """The simulated world with the robot and the obstacle."""

    def __init__(self, model: PointModel, plan: Plan) -> None:
        """Build the world and place the robot in it, free unless the plan mounts it.

        Args:
            model: the robot.
            plan: how it is supported and what it will do.
        """
        from roboyard.sim import World

        self.model, self.plan = model, plan
        self.world: World = World()
        self.world.add_plane(rgba=(0.86, 0.88, 0.9, 1.0), name="floor")
        width, depth, self.height = (float(side) for side in np.ptp(plan.size, axis=0))
        self.edge = float(np.clip(0.2 * max(width, depth, self.height), 0.03, 0.3))
        """Length of the obstacle's edges (m)."""
        beside = plan.size[0, 1] - 1.1 * self.edge
        self.obstacle: Body = self.world.add_box(
            (self.edge, self.edge, self.edge),
            (float(plan.size[:, 0].mean()), float(beside), 0.5 * self.edge),
            mass=OBSTACLE_DENSITY * self.edge**3,
            rgba=OBSTACLE_COLOUR,
            name="obstacle",
        )
        self.robot: Body = self.place(free=plan.support.kind != "mounted")

    def place(self, *, free: bool) -> Body:
        """Place the robot in its home posture, with its drives holding it, and remove an earlier placement.

        Args:
            free: drop it from a small height; otherwise fix its base, on a stand where the plan has one.

        Returns:
            The robot's body.
        """
        plan = self.plan
        if hasattr(self, "robot"):
            self.world.remove(self.robot)
        lift = min(MOST_DROP, 0.1 * self.height) if free else plan.stand
        position = (0.0, 0.0, lift - plan.support.lowest)
        self.robot = self.world.add_urdf(
            self.model.description, position, fixed_base=not free, name=self.model.description.name
        )
        if not free and plan.stand > 0:
            self._add_stand(position[2])
        if free:
            self._add_motor_inertia()
        self.robot.joint_positions = {
            name: value
            for name, value in self.model.posture_with_followers().items()
            if self.robot.joint(name).is_scalar
        }
        for name, value in plan.home.items():
            self.drive(name, value)
        return self.robot

    def drive(self, joint: str, target: float, velocity: float = 0.0) -> None:
        """Set a drive's target position (rad or m) and target velocity (rad/s or m/s)."""
        self.robot.joint(joint).drive_position(target, velocity=velocity)

    def _add_motor_inertia(self) -> None:
        """Add motor inertia to the joints that carry the robot, where its file gives none."""
        carried = self.robot.mass / max(len(self.plan.support.feet), 1)
        for name, lever in self.plan.support.levers.items():
            joint = self.robot.joint(name)
            if joint.armature == 0.0:
                joint.armature = carrying_motor_inertia(carried, lever)

    def robot_points(self) -> Array:
        """Return (k, 3) outline points of the robot in the world frame (m), or its base without shapes."""
        placed = [self.robot.position[None]]
        for name, outline in self.model.outlines.items():
            position, quaternion = self.robot.link(name).pose
            placed.append(rotate(quaternion, outline) + position)
        return np.concatenate(placed if len(placed) == 1 else placed[1:])

    def _add_stand(self, root_height: float) -> None:
        """Add a column from the floor to the bottom of the robot's base; it is visual only."""
        points = self.model.points(self.model.poses({}), self.model.base_links)
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

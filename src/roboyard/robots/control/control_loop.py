"""Run the controllers of one robot: drive targets at the control rate, efforts at every time step.

The world calls the loop before each time step. Positions and velocities are sent to the drives once per
control step and held between; efforts are computed at every time step. Joints without a group are held at the
reset posture if they have position limits; continuous ones (casters) and the virtual base joints stay free.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import partial

import numpy as np

from roboyard.kinematics import forward_kinematics
from roboyard.robots.control.controller import EYE4, GroupLimits, GroupState
from roboyard.robots.control.setup import Group
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.robots.joint_arrays import JointArrays
from roboyard.robots.stability.stance import Stance
from roboyard.robots.stability.support_polygon import SupportPolygon
from roboyard.sim.actuation.gains import (
    CONTROLLER,
    GRIPPER_FREQUENCY,
    SATURATED_SPEED,
    effort_per_error,
    position_damping,
    position_stiffness,
    velocity_damping,
)
from roboyard.transforms import Array, conjugate, rotate

POSITION, VELOCITY, EFFORT, FREE = range(4)
OFFSET_TIME = 0.5
"""Time constant of the mean position error (s)."""
CREEP_SPEED = 0.01
"""Below this speed drives do not compensate dry friction, so that it holds joints at rest (rad/s or m/s)."""
KINDS = {"position": POSITION, "velocity": VELOCITY, "effort": EFFORT}


class ControlLoop:
    """Applies the controllers of one robot."""

    def __init__(
        self,
        joints: JointArrays,
        limits: GroupLimits,
        groups: Mapping[str, Group],
        *,
        rest: Array,
        steps_per_control: int,
        free: Collection[str] = (),
        support_polygon: SupportPolygon | None = None,
        stance: Stance | None = None,
    ) -> None:
        """Create a loop without goals.

        Args:
            joints: of the whole robot.
            limits: of all joints.
            groups: with their controllers.
            rest: (n,) positions of joints without a group (rad or m).
            steps_per_control: time steps in each control step.
            free: names of joints without a group that move freely although they have limits.
            support_polygon: of a robot that may tip over.
            stance: of a robot that stands on legs.
        """
        self.joints = joints
        self.limits = limits
        self.groups = dict(groups)
        self.steps_per_control = steps_per_control
        self._support_polygon = support_polygon
        self._stance = stance
        self._free = frozenset((*VIRTUAL_JOINTS, *free))
        count = len(joints.names)
        self._countdown = 0
        self._stale = True
        self._kinds = np.full(count, FREE)
        self._slides = slides = np.array([joint.type == "prismatic" for joint in joints.joints], dtype=bool)
        self._effort_per_error = effort_per_error(CONTROLLER, limits.effort, slides)
        self._given_kp, self._given_kd = np.full(count, np.nan), np.full(count, np.nan)
        self._damping_frequency = np.full(count, CONTROLLER.frequency)
        for group in self.groups.values():
            settings = group.controller.settings
            if group.kind == "gripper":
                self._damping_frequency[group.indices] = GRIPPER_FREQUENCY
            if settings.isaac_kp is not None:
                self._given_kp[group.indices] = settings.isaac_kp
            if settings.isaac_kd is not None:
                self._given_kd[group.indices] = settings.isaac_kd
        self._position = rest.copy()
        self._velocity, self._effort = np.zeros(count), np.zeros(count)
        self._led = np.zeros(count)
        """(n,) velocities at which drives compensate friction and damping (rad/s or m/s)."""
        self._compensated = np.ones(count)
        self._offset = np.zeros(count)
        """(n,) mean position errors of the joints (rad or m)."""
        self._claim()
        self._effort_groups = [g for g in self.groups.values() if g.controller.control_type == "effort"]
        self._other_groups = [g for g in self.groups.values() if g.controller.control_type != "effort"]

    def _claim(self) -> None:
        claimed: set[int] = set()
        for group in self.groups.values():
            claimed |= {int(i) for i in group.indices}
            self._kinds[group.indices] = KINDS[group.controller.control_type]
            setting = group.controller.settings.use_gravity_compensation
            compensates = True if setting is None else setting
            if group.controller.control_type == "effort":
                compensates = False  # the controller adds it itself
            self._compensated[group.indices] = float(compensates)
        for i, joint in enumerate(self.joints.joints):
            if i not in claimed:
                held = joint.limits is not None and joint.name not in self._free
                self._kinds[i] = POSITION if held else FREE
                self._compensated[i] = float(held)

    @property
    def dt(self) -> float:
        """Time between control steps (s)."""
        return self.steps_per_control * self.joints.world.timestep

    @property
    def commands(self) -> Array:
        """(n,) commands of the joints' drives, as the controllers of their groups have them; 0 without one.

        A position (rad or m), a velocity (rad/s or m/s) or an effort (N m or N).
        """
        found = np.zeros(len(self._kinds))
        for kind, values in ((POSITION, self._position), (VELOCITY, self._velocity), (EFFORT, self._effort)):
            found = np.where(self._kinds == kind, values, found)
        return found

    def before_step(self) -> None:
        """Apply the controllers; the world calls this before each time step."""
        self._refresh()
        due = self._countdown <= 0
        if due:
            self._countdown = self.steps_per_control
            self._control()
        elif self._effort_groups:
            self._apply_efforts(self.joints.q, self.joints.v)
        self._countdown -= 1

    def make_due(self) -> None:
        """Start a control step at the next time step."""
        self._countdown = 0

    def invalidate(self) -> None:
        """Reset goals and cached state, after joints were moved at once."""
        for group in self.groups.values():
            group.controller.reset()
        self._countdown = 0
        self._stale = True

    def _refresh(self) -> None:
        if self.joints.bind() or self._stale:
            self._countdown = 0
            self.joints.refresh()
            if self._stale:
                self._position[:] = np.where(self._kinds == FREE, self._position, self.joints.q)
                self._offset[:] = 0.0
            self._stale = False

    def state_of(self, group: Group, q: Array | None = None, v: Array | None = None) -> GroupState:
        """Return the present state of a group.

        Args:
            group: of this robot.
            q: (n,) joint positions of the robot, if already read (rad or m).
            v: (n,) joint velocities of the robot, if already read (rad/s or m/s).
        """
        if q is None or v is None:
            self._refresh()
            q, v = self.joints.q, self.joints.v
        controller = group.controller
        dt = self.joints.world.timestep if controller.control_type == "effort" else self.dt
        state = GroupState(q=q[group.indices], v=v[group.indices], dt=dt, mount=self._mount(group, q))
        state.inertia = self.joints.inertia[group.indices]
        if self._support_polygon is not None and controller.keeps_balance:
            state.balance = partial(self._support_polygon.balance, group.indices)
        if controller.needs_yaw_rate:
            root = self.joints.body.links[0]
            quaternion = root.pose[1]
            state.yaw_rate = float(rotate(conjugate(quaternion), root.velocity[1])[2])
        if controller.control_type == "effort":
            if controller.needs_mass_matrix:
                state.mass_matrix = self.joints.mass_matrix(group.indices)
            if controller.settings.use_gravity_compensation is not False:
                state.bias = self.joints.bias[group.indices]
        elif controller.control_type == "position":
            state.bias = self.joints.bias[group.indices]
        return state

    def _mount(self, group: Group, q: Array) -> Array:
        """Return the (4, 4) pose of a group's parent frame.

        Reference positions are used for the joints below it, not measured ones: an arm that reacts to every
        deflection of the torso would excite it.
        """
        if group.mount is None or group.mount_indices is None:
            return EYE4
        places = group.mount_indices
        here = q[places]
        if group.kind != "base":
            led = self._kinds[places] == POSITION
            here = np.where(led, self._position[places] + self._offset[places], here)
        return forward_kinematics(group.mount, here)

    def _control(self) -> None:
        q, v = self.joints.q, self.joints.v
        kinds = self._kinds
        self._offset += min(1.0, self.dt / OFFSET_TIME) * (q - self._position - self._offset)
        if self._support_polygon is not None:
            self._support_polygon.forget()
        for group in self._other_groups:
            control = group.controller.step(self.state_of(group, q, v))
            kind = KINDS[control.kind]
            kinds[group.indices] = kind
            if kind == POSITION:
                self._position[group.indices] = control.value
                self._velocity[group.indices] = self._led[group.indices] = 0.0
            else:
                self._velocity[group.indices] = control.value
                self._led[group.indices] = control.value if control.led is None else control.led
        self._effort = self.joints.bias * self._compensated
        self._effort += self.joints.damping * self._led + self.joints.friction * np.tanh(
            self._led / CREEP_SPEED
        )
        for group in self._effort_groups:
            self._effort[group.indices] = group.controller.step(self.state_of(group, q, v)).value
        self._write_gains()
        driven = self.joints.driven
        self.joints.drives.write(self._position[driven], self._velocity[driven], self._effort[driven])

    def _apply_efforts(self, q: Array, v: Array) -> None:
        for group in self._effort_groups:
            self._effort[group.indices] = group.controller.step(self.state_of(group, q, v)).value
        self.joints.drives.write_effort(self._effort[self.joints.driven], np.arange(len(self.joints.driven)))

    def _resistance(self) -> Array:
        """Return the (n,) damping of the joints with their friction at a tenth of full speed (N m s/rad or N
        s/m).
        """
        return self.joints.damping + self.joints.friction / (SATURATED_SPEED * self.limits.velocity)

    def gains(self, is_position: np.ndarray) -> tuple[Array, Array]:
        """Return stiffness and damping of the drives at the present inertia of the joints.

        Args:
            is_position: (n,) whether joints follow positions; others follow velocities.

        Returns:
            (n,) kp (N m/rad or N/m; also that of joints that follow velocities, where it has no use), (n,) kd
            (N m s/rad or N s/m).
        """
        inertia = self.joints.inertia
        kp = position_stiffness(CONTROLLER, inertia, self._effort_per_error, self._slides)
        at_least = np.zeros(len(kp))
        if self._stance is not None:
            weak = kp < self._stance.stiffness
            kp = np.where(weak, self._stance.stiffness, kp)
            at_least = np.where(weak, self._stance.damping, 0.0)
        kp = np.where(np.isnan(self._given_kp), kp, self._given_kp)
        kd = np.where(
            is_position,
            np.maximum(position_damping(inertia, kp, self._damping_frequency), at_least),
            velocity_damping(
                CONTROLLER,
                inertia,
                resistance=self._resistance(),
                effort=self.limits.effort,
                largest_velocity=self.limits.velocity,
            ),
        )
        return kp, np.where(np.isnan(self._given_kd), kd, self._given_kd)

    def _write_gains(self) -> None:
        is_position = self._kinds == POSITION
        kp, kd = self.gains(is_position)
        kd[self._kinds >= EFFORT] = 0.0
        driven = self.joints.driven
        self.joints.drives.write_gains(np.where(is_position, kp, 0.0)[driven], kd[driven])

"""Semantics of a robot, as SRDF holds them beside a URDF: kind, base, limbs, sensors, postures.

`roboyard.morphology` infers it from the description, a source configuration overrides it, and
`roboyard.export` translates it into other programs' files. `understanding` gives it as plain data.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from roboyard.description.model import Pose, Vector3

RobotKind = Literal[
    "fixed_arm",
    "dual_arm",
    "mobile_manipulator",
    "mobile_base",
    "quadruped",
    "biped",
    "humanoid",
    "hand",
    "gripper",
    "drone",
    "vehicle",
    "object",
    "other",
]
"""Kind of the robot as a whole; a hexapod is `other` on a legged base."""
BaseKind = Literal["none", "fixed", "wheeled", "differential", "holonomic", "ackermann", "legged", "floating"]
"""How the base moves: nothing is known or it has none; mounted; on wheels of which nothing more is known; by
wheels on two sides (two wheels, or skid steering); along x and y and about z (omni, mecanum or swerve wheels,
or virtual joints); as a car steers; on legs; free in the air.
"""
DriveKind = Literal["plain", "skid", "omni", "mecanum", "swerve", "ackermann"]
"""How the wheels move the base."""
GripperKind = Literal["single_jaw", "two_jaw", "fingers", "suction", "hand"]
MountedKind = Literal["camera", "lidar", "imu"]
Opening = Literal["increasing", "decreasing"]
"""The direction of a joint's position that opens the gripper."""
REST = "rest"
"""Name of the rest posture: no contact, inside the limits, arms usable, legs standing."""
TUCK = "tuck"
"""Name of the posture for driving: arms close to the body."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Gripper:
    """Fingers, jaws or suction of an end effector."""

    kind: GripperKind
    palm: str
    """Link from which the fingers move."""
    joints: tuple[str, ...]
    """Joints that are driven; empty for suction."""
    mimic_joints: tuple[str, ...] = ()
    """Joints that follow, as `<mimic>` states or in fact."""
    links: tuple[str, ...] = ()
    """Links that move relative to the palm, depth first."""
    fingertips: tuple[str, ...] = ()
    """The last link of each finger that has a shape."""
    opening: Opening | None = None
    """Of all driven joints together; None where they differ or nothing shows it."""
    opening_of: Mapping[str, Opening] = field(default_factory=dict)
    """Driven joint to the direction that opens."""
    width: float | None = None
    """Largest distance between the fingertips (m)."""
    start_points: tuple[tuple[str, Vector3], ...] = ()
    """Links with a point each, in their frames, on the inner faces of the fingertips of one side (m)."""
    end_points: tuple[tuple[str, Vector3], ...] = ()
    """The same on the other side, or on the fixed jaw; what is between the two is grasped."""


@dataclass(frozen=True, kw_only=True, slots=True)
class EndEffector:
    """An end-effector link and the gripper that belongs to it."""

    link: str
    """Name of the link whose frame is moved to a target."""
    gripper_links: tuple[str, ...] = ()
    """Links that touch a grasped object."""
    gripper_joints: tuple[str, ...] = ()
    """Joints that open and close the gripper."""
    frame: Pose | None = None
    """Grasp frame in the link's frame: z out of the fingertips, y from the left to the right finger; None
    where the link's own frame is used.
    """
    gripper: Gripper | None = None


@dataclass(frozen=True, kw_only=True, slots=True)
class Arm:
    """A chain of joints that moves one end effector."""

    name: str
    """`left` or `right` where position or names say so, else a number."""
    joints: tuple[str, ...]
    """From the base outwards, without those of the trunk and of the gripper."""
    end_effector: EndEffector


@dataclass(frozen=True, kw_only=True, slots=True)
class Leg:
    """A chain of joints that carries the robot."""

    name: str
    """For example `left`, `front_right`, `middle_left`."""
    joints: tuple[str, ...]
    """From the body outwards, without a wheel's."""
    foot: str
    """Link that stands on the floor."""
    wheel_joint: str | None = None
    """Joint of the wheel at its end."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Wheel:
    """A wheel that reaches the floor; all joints at zero, in the base link's frame."""

    joint: str
    """Joint that turns it about its axle."""
    link: str
    radius: float
    """m"""
    centre: Vector3
    """Middle of the wheel on its axle (m)."""
    axis: Vector3
    """Unit vector of the joint's axis."""
    is_driven: bool = True
    is_caster: bool = False
    """Whether the wheel swivels freely about an upright axis."""
    is_omni: bool = False
    """Whether it has rollers about its rim (omni or mecanum)."""
    steer_joint: str | None = None
    """Joint that turns its axle about an upright axis by a motor."""
    caster_joint: str | None = None
    """Joint about whose upright axis it swivels."""
    suspension_joints: tuple[str, ...] = ()
    """Other joints between the base and the wheel, base first."""
    forward_sign: int = 1
    """1 where a positive velocity of the joint rolls the robot along `SemanticDescription.forward`, else -1;
    0 where the wheel rolls sideways.
    """


@dataclass(frozen=True, kw_only=True, slots=True)
class WheelPair:
    """Two equal wheels side by side; both roll the robot along +x when their joints turn forwards."""

    left: str
    """Joint name."""
    right: str
    """Joint name."""
    radius: float
    """m"""
    length: float
    """Distance between the two wheels (m)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class MountedSensor:
    """A sensor that the description implies, on a link of its own."""

    kind: MountedKind
    name: str
    """Short and unique among the sensors."""
    link: str
    """Link that is the sensor's body, or carries it."""
    optical_link: str | None = None
    """Link whose frame looks along z with y down, where there is one (cameras)."""
    frame: Pose | None = None
    """Of the measuring frame in the link's frame, where it differs."""
    view: Pose | None = None
    """Of a camera, which looks along -z with +y up, in the frame of the optical link or, without one, of the
    link: in front of its own housing.
    """


@dataclass(frozen=True, kw_only=True, slots=True)
class Conclusion:
    """A field that was inferred, and why."""

    field: str
    """Field of the semantic description, with the name of the part where it has several: `arms.left`."""
    value: Any
    """Plain data: names, numbers, lists, mappings."""
    confidence: float
    """0 to 1; below 0.5 it is a question rather than an answer."""
    evidence: tuple[str, ...] = ()
    """Each one reason, for people."""
    setting: str = ""
    """The one line of configuration that changes it; empty where none does."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SemanticDescription:
    """Kind, base, parts and postures of a robot; every name is a link's or a joint's of its description."""

    base_link: str
    """The link that counts as the base: the root, or the first link below the virtual joints."""
    kind: RobotKind = "other"
    base: BaseKind = "none"
    drive: DriveKind | None = None
    """None for a base without wheels, or where nothing shows it."""
    forward: Vector3 = (1.0, 0.0, 0.0)
    """Unit vector in the base link's frame, level: the way that is forwards."""
    up: Vector3 = (0.0, 0.0, 1.0)
    """Unit vector in the base link's frame; some files are drawn with y up."""
    base_joints: tuple[str, ...] = ()
    """Joints that move the base: driven virtual joints, or those of the wheels."""
    virtual_joints: tuple[str, ...] = ()
    """Joints that represent the motion of the base, root first; they move no mechanical part."""
    wheels: tuple[Wheel, ...] = ()
    """All wheels that reach the floor, depth first."""
    wheel_links: tuple[str, ...] = ()
    """Links that roll on the floor and are driven."""
    caster_links: tuple[str, ...] = ()
    """Links that roll on the floor and swivel about an upright axis; nothing drives them."""
    caster_joints: tuple[str, ...] = ()
    """Joints of casters: those they swivel about and those they roll about."""
    steer_joints: tuple[str, ...] = ()
    """Joints that turn wheels about upright axes by motors."""
    wheel_pair: WheelPair | None = None
    """The two wheels of a differential drive."""
    trunk_joints: tuple[str, ...] = ()
    """Joints below the base that move all arms."""
    head_joints: tuple[str, ...] = ()
    """Joints that turn the head, base first."""
    head_link: str | None = None
    """Last link of the head."""
    legs: tuple[Leg, ...] = ()
    end_effectors: tuple[EndEffector, ...] = ()
    """In the configuration's order, else depth first."""
    arms: tuple[Arm, ...] = ()
    """In order of their names."""
    grippers: tuple[Gripper, ...] = ()
    """Of arms, and those that belong to no arm (a hand on its own)."""
    sensors: tuple[MountedSensor, ...] = ()
    disabled_collision_pairs: tuple[tuple[str, str], ...] = ()
    """Links whose collision shapes overlap at rest though no joint connects them."""
    postures: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Name to joint positions by joint name (rad or m); see `REST` and `TUCK`."""
    conclusions: tuple[Conclusion, ...] = ()
    """Of everything that was inferred, in order of the fields."""

    @property
    def rest(self) -> Mapping[str, float]:
        """Joint name to its position in the rest posture (rad or m); empty where none is known."""
        return self.postures.get(REST, {})

    @property
    def tuck(self) -> Mapping[str, float]:
        """Joint name to its position in the tucked posture (rad or m); empty where none is known."""
        return self.postures.get(TUCK, {})

    @property
    def driven_wheels(self) -> tuple[Wheel, ...]:
        """The wheels that a motor turns."""
        return tuple(wheel for wheel in self.wheels if wheel.is_driven)

    def confidence(self, field: str) -> float | None:
        """Return the confidence of the conclusion about a field; None without one."""
        return next((c.confidence for c in self.conclusions if c.field == field), None)

    def mounted(self, kind: MountedKind) -> tuple[MountedSensor, ...]:
        """Return the sensors of one kind."""
        return tuple(sensor for sensor in self.sensors if sensor.kind == kind)

    @property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """Group name to its joints: base, trunk, then each arm (also one without joints) and its gripper."""
        groups = {"base": self.base_joints, "trunk": self.trunk_joints}
        groups = {name: joints for name, joints in groups.items() if joints}
        for arm in self.arms:
            groups[f"arm_{arm.name}"] = arm.joints
            if arm.end_effector.gripper_joints:
                groups[f"gripper_{arm.name}"] = arm.end_effector.gripper_joints
        return groups

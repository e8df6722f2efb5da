"""A robot as data: what a definition file may say.

The file is OmniGibson's RobotDefinition. `raw_controller_order` and `default_controllers` are required; every
block that is there gives the robot a capability. Joint vectors hold one value a degree of freedom, level by
level from the root (the order of `Robot.joint_names`); values are numbers or texts such as "pi/8". Unlike
there, contradictions are found when the file is read, not when the robot is built.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from roboyard.robots.definition.expressions import read_number

ControllerName = Literal[
    "JointController",
    "InverseKinematicsController",
    "OperationalSpaceController",
    "HolonomicBaseJointController",
    "DifferentialDriveController",
    "MultiFingerGripperController",
    "NullJointController",
]

ARM = ("InverseKinematicsController", "OperationalSpaceController", "JointController", "NullJointController")
GRIPPER = ("MultiFingerGripperController", "JointController", "NullJointController")
BASE = ("JointController", "NullJointController")
TWO_WHEEL_BASE = ("DifferentialDriveController", *BASE)
HOLONOMIC_BASE = ("HolonomicBaseJointController", "NullJointController")
TRUNK = (
    "JointController",
    "NullJointController",
    "InverseKinematicsController",
    "OperationalSpaceController",
)
CAMERA = ("JointController", "NullJointController")
NEED_RESET_POSE = ("InverseKinematicsController", "OperationalSpaceController")

VIRTUAL_JOINTS = tuple(f"base_footprint_{axis}_joint" for axis in ("x", "y", "z", "rx", "ry", "rz"))
"""Joints that a holonomic base moves by; x, y and rz are driven."""


def _of_length(*lengths: int) -> Any:
    def check(value: Any) -> Any:
        if isinstance(value, Sequence) and not isinstance(value, str) and len(value) not in lengths:
            wanted = " or ".join(str(length) for length in lengths)
            raise ValueError(f"must have {wanted} entries; it has {len(value)}")
        return value

    return BeforeValidator(check)


Number = Annotated[float, BeforeValidator(read_number)]
Vector = tuple[Number, ...]
Name = Annotated[str, Field(min_length=1)]
Names = tuple[Name, ...]
Pair = Annotated[tuple[Name, Name], _of_length(2)]
Point = Annotated[tuple[Number, Number, Number], _of_length(3)]
LinkPoint = Annotated[tuple[Name, Point], _of_length(2)]
Rotation = Annotated[tuple[Number, ...], _of_length(3, 4)]
ByArm = dict[str, Names]


class Section(BaseModel):
    """Strict and unchangeable."""

    model_config = ConfigDict(extra="forbid", frozen=True, hide_input_in_errors=True)


class EndEffectorVariant(Section):
    """One of several hands that the same arm can carry."""

    model: Name
    """Name of the robot with this hand."""
    eef_link_names: dict[str, Name]
    finger_link_names: ByArm
    finger_joint_names: ByArm
    default_joint_pos: Vector
    teleop_rotation_offset: dict[str, Rotation] | None = None
    usd_path: str | None = None
    urdf_path: str | None = None
    curobo_path: str | dict[str, str] | None = None
    disabled_collision_pairs: tuple[Pair, ...] | None = None
    ag_start_points: dict[str, tuple[LinkPoint, ...]] | None = None
    ag_end_points: dict[str, tuple[LinkPoint, ...]] | None = None
    gripper_control_idx: dict[str, tuple[int, ...]] | None = None
    """Places of the fingers in joint vectors; `finger_joint_names` says the same by name and is what is
    read.
    """
    not_support_urdf: bool = False


class Manipulation(Section):
    """Arms and grippers: groups `arm_<name>` and `gripper_<name>`."""

    n_arms: Annotated[int, Field(ge=1, le=64, strict=True)] = 1
    arm_names: Names = ()
    """"0", "1", ... where not given."""
    arm_link_names: ByArm = {}
    arm_joint_names: ByArm = {}
    eef_link_names: dict[str, Name] = {}
    finger_link_names: ByArm = {}
    finger_joint_names: ByArm = {}
    gripper_link_names: ByArm | None = None
    arm_workspace_range: dict[str, Annotated[tuple[Number, Number], _of_length(2)]] | None = None
    """Degrees, seen from the base, right to left."""
    teleop_rotation_offset: dict[str, Rotation] | None = None
    """Three Euler angles (rad) or a quaternion (x, y, z, w) an arm."""
    assisted_grasp_start_points: dict[str, tuple[LinkPoint, ...]] | None = None
    assisted_grasp_end_points: dict[str, tuple[LinkPoint, ...]] | None = None
    supported_end_effector: Names | None = None
    end_effectors: dict[str, EndEffectorVariant] | None = None
    eef_support_curobo_attached_object_link_names: Names | None = None
    add_combined_arm_control_idx: bool = False
    """Also offer all arm joints together, as `Robot.control_idx["combined"]`."""
    manipulation_link_names: Names | None = None

    @model_validator(mode="before")
    @classmethod
    def _name_arms(cls, data: Any) -> Any:
        if isinstance(data, Mapping) and not data.get("arm_names"):
            count = data.get("n_arms", 1)
            if isinstance(count, int) and not isinstance(count, bool) and 1 <= count <= 64:
                return {**data, "arm_names": [str(k) for k in range(count)]}
        return data


class HolonomicBase(Section):
    """A base that moves along x and y and turns, by virtual joints."""

    force_sphere_wheel_approximation: bool = False
    """Collide the links that touch the floor as their bounding spheres."""


class TwoWheel(Section):
    """Two driven wheels on one axle."""

    wheel_radius: Number = 0.0
    """m"""
    wheel_axle_length: Number = 0.0
    """m, between the wheels"""


class Locomotion(Section):
    """Joints that carry the robot: group `base`."""

    base_joint_names: Names = ()
    floor_touching_base_link_names: Names = ()


class ArticulatedTrunk(Section):
    """A torso that moves: group `trunk`."""

    trunk_joint_names: Names
    trunk_link_names: Names = ()


class ActiveCamera(Section):
    """A head that moves: group `camera`."""

    camera_joint_names: Names


class MobileManipulation(Section):
    """Two postures, one for driving and one for working."""

    untucked_default_joint_pos: Vector
    tucked_default_joint_pos: Vector
    default_arm_pose_key: str | None = None
    default_arm_poses: dict[str, Vector] | None = None
    """Named postures of the arms' joints."""
    joint_names: Names | None = None
    """Joint of each entry of the two postures, where they do not come in the robot's own order."""


class RobotDefinition(Section):
    """Everything a definition file says; unchangeable."""

    raw_controller_order: Names
    """Order of the groups in an action."""
    default_controllers: dict[str, ControllerName]
    """Group to controller, where it is not the usual one of the capability."""
    default_joint_pos: Vector | None = None
    """Rest posture."""
    disabled_collision_pairs: tuple[Pair, ...] | None = None
    disabled_collision_link_names: Names | None = None
    usd_path: str | None = None
    urdf_path: str | None = None
    """Relative to the robot's dataset folder; `models/<name>/urdf/<name>.urdf` where not given."""
    curobo_path: str | dict[str, str] | None = None
    base_footprint_link_name: Name | None = None
    visual_only_eef_links: bool = False
    self_collisions: bool | None = None
    linear_velocity_gain_for_primitives: Number | None = None
    angular_velocity_gain_for_primitives: Number | None = None
    manipulation: Manipulation | None = None
    holonomic_base: HolonomicBase | None = None
    two_wheel: TwoWheel | None = None
    locomotion: Locomotion | None = None
    articulated_trunk: ArticulatedTrunk | None = None
    active_camera: ActiveCamera | None = None
    mobile_manipulation: MobileManipulation | None = None

    @property
    def is_manipulation(self) -> bool:
        return any((self.manipulation, self.mobile_manipulation, self.articulated_trunk))

    @property
    def is_locomotion(self) -> bool:
        return any(block is not None for block in (self.holonomic_base, self.two_wheel, self.locomotion))

    @property
    def may_float(self) -> bool:
        """Whether the root link moves freely: locomotion that does not go through virtual joints."""
        return self.is_locomotion and self.holonomic_base is None

    @property
    def capabilities(self) -> tuple[str, ...]:
        """Names of the blocks that are there."""
        blocks = (
            "manipulation",
            "holonomic_base",
            "two_wheel",
            "locomotion",
            "articulated_trunk",
            "active_camera",
            "mobile_manipulation",
        )
        return tuple(name for name in blocks if getattr(self, name) is not None)

    @property
    def arm_names(self) -> tuple[str, ...]:
        return self.manipulation.arm_names if self.manipulation is not None else ()

    def allowed_controllers(self) -> dict[str, tuple[str, ...]]:
        """Group to the controllers it may have, the usual one first (or as the capability says)."""
        found: dict[str, tuple[str, ...]] = {}
        if self.is_locomotion:
            if self.holonomic_base is not None:
                found["base"] = HOLONOMIC_BASE
            else:
                found["base"] = TWO_WHEEL_BASE if self.two_wheel is not None else BASE
        if self.articulated_trunk is not None:
            found["trunk"] = TRUNK
        if self.active_camera is not None:
            found["camera"] = CAMERA
        for arm in self.arm_names:
            found[f"arm_{arm}"] = ARM
            found[f"gripper_{arm}"] = GRIPPER
        return found

    def controller_names(self) -> dict[str, str]:
        """Group to controller: the file's, else the usual one of the capability; in action order."""
        usual = dict.fromkeys(self.allowed_controllers(), "JointController")
        if self.holonomic_base is not None:
            usual["base"] = "HolonomicBaseJointController"
        elif self.two_wheel is not None:
            usual["base"] = "DifferentialDriveController"
        chosen = {**usual, **self.default_controllers}
        return {group: chosen[group] for group in self.raw_controller_order}

"""The schema of a definition file.

The file is OmniGibson's RobotDefinition. `raw_controller_order` and `default_controllers` are required; every
block that is present gives the robot a capability. Joint vectors have one value for each degree of freedom,
breadth first from the root (PhysX's order; `Robot` has its own); values are numbers or texts such as "pi/8".
Unlike in OmniGibson, contradictions are reported when the file is loaded, not when the robot is spawned.
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
ADDED_CONTROLLERS: list[str] = []
"""Names of controllers that were registered at run time; every group may have them."""
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
"""Joints of a holonomic base; x, y and rz are driven."""


def _of_length(*lengths: int) -> Any:
    def check(value: Any) -> Any:
        if isinstance(value, Sequence) and not isinstance(value, str) and len(value) not in lengths:
            lengths_text = " or ".join(str(length) for length in lengths)
            raise ValueError(f"must have {lengths_text} entries, got {len(value)}")
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
Direction = Literal["increasing", "decreasing"]


def _by_joint(data: Any) -> Any:
    """Return lists of joints by direction as directions by joint; anything else unchanged."""
    if not isinstance(data, Mapping) or not data or not set(data) <= {"increasing", "decreasing"}:
        return data
    if not all(isinstance(names, (list, tuple)) for names in data.values()):
        return data
    return {name: way for way, names in data.items() for name in names}


Opening = Direction | Annotated[dict[Name, Direction], BeforeValidator(_by_joint)]


class Section(BaseModel):
    """A block of the file: unknown keys are errors, values are immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, hide_input_in_errors=True)


class EndEffectorVariant(Section):
    """One of several grippers of the same arm."""

    model: Name
    """Name of the robot with this gripper."""
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
    """Indices of the fingers in joint vectors; ignored in favour of `finger_joint_names`."""
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
    opening_direction: dict[str, Opening] | None = None
    """Arm to the direction of its finger joints that opens the gripper, for all of them, or `{increasing:
    [...], decreasing: [...]}` with the joints of each direction; increasing where not given. Joints that no
    list names neither open nor close it. OmniGibson has no such key.
    """
    arm_workspace_range: dict[str, Annotated[tuple[Number, Number], _of_length(2)]] | None = None
    """Yaw range seen from the base, right to left (degrees)."""
    teleop_rotation_offset: dict[str, Rotation] | None = None
    """Three Euler angles (rad) or a quaternion (x, y, z, w) for each arm."""
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
    """A base that translates along x and y and rotates about z, by virtual joints."""

    force_sphere_wheel_approximation: bool = False
    """Use bounding spheres as collision shapes of the links that touch the floor."""


class TwoWheel(Section):
    """Two driven wheels on one axle; or several on each side, listed left then right (skid steering)."""

    wheel_radius: Number = 0.0
    """Radius of the wheels (m)."""
    wheel_axle_length: Number = 0.0
    """Distance between the wheels (m)."""


class Locomotion(Section):
    """Joints of the base, wheels or legs: group `base`."""

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
    """Joint of each entry of the two postures; breadth first by default."""


class RobotDefinition(Section):
    """The contents of a definition file; immutable."""

    raw_controller_order: Names
    """Order of the groups in an action."""
    default_controllers: dict[str, ControllerName]
    """Group to controller, where it is not the default of the capability."""
    default_joint_pos: Vector | None = None
    """Rest posture, breadth first (rad or m)."""
    disabled_collision_pairs: tuple[Pair, ...] | None = None
    disabled_collision_link_names: Names | None = None
    usd_path: str | None = None
    urdf_path: str | None = None
    """Relative to the robot's dataset folder; `models/<name>/urdf/<name>.urdf` by default."""
    curobo_path: str | dict[str, str] | None = None
    base_footprint_link_name: Name | None = None
    standing_orientation: Annotated[tuple[Number, Number, Number, Number], _of_length(4)] | None = None
    """Quaternion (x, y, z, w) of the root link's frame in which the robot stands upright and faces +x, where
    its file is drawn with another axis up. OmniGibson has no such key."""
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
        """Whether the robot has arms or a torso."""
        return any((self.manipulation, self.mobile_manipulation, self.articulated_trunk))

    @property
    def is_locomotion(self) -> bool:
        """Whether the robot has a base that moves."""
        return any(block is not None for block in (self.holonomic_base, self.two_wheel, self.locomotion))

    @property
    def may_float(self) -> bool:
        """Whether the root link floats by default: for a base that moves without virtual joints."""
        return self.is_locomotion and self.holonomic_base is None

    @property
    def capabilities(self) -> tuple[str, ...]:
        """Names of the capability blocks that are present."""
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
        """Names of the arms."""
        return self.manipulation.arm_names if self.manipulation is not None else ()

    def allowed_controllers(self) -> dict[str, tuple[str, ...]]:
        """Return the controllers that each group may have."""
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
        return {group: (*names, *ADDED_CONTROLLERS) for group, names in found.items()}

    def controller_names(self) -> dict[str, str]:
        """Return the controller of each group in action order: the file's, else the capability's default."""
        default = dict.fromkeys(self.allowed_controllers(), "JointController")
        if self.holonomic_base is not None:
            default["base"] = "HolonomicBaseJointController"
        elif self.two_wheel is not None:
            default["base"] = "DifferentialDriveController"
        chosen = {**default, **self.default_controllers}
        return {group: chosen[group] for group in self.raw_controller_order}

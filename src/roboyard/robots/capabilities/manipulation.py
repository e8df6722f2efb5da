"""Arms and grippers of a robot."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard.errors import RoboyardError, unknown_name
from roboyard.robots.capabilities.assisted_grasp import AssistedGrasp, GraspingMode
from roboyard.robots.capabilities.robot_parts import RobotParts
from roboyard.robots.control import MultiFingerGripperController
from roboyard.robots.definition.schema import Manipulation as Block
from roboyard.robots.joint_arrays import Indices
from roboyard.sim.link import Link
from roboyard.transforms import Array, conjugate, multiply, quaternion_from_rpy, rotate


class Arm:
    """One arm with its gripper."""

    def __init__(self, manipulation: Manipulation, name: str) -> None:
        """Create the arm `name` of a robot's manipulation capability."""
        self._manipulation = manipulation
        self.name = name
        self.joint_names: tuple[str, ...] = manipulation.block.arm_joint_names[name]
        """Joints from the shoulder to the end effector."""
        self.finger_joint_names: tuple[str, ...] = manipulation.block.finger_joint_names.get(name, ())
        """Joints of the gripper."""
        self.end_effector: Link = manipulation.eef_links[name]
        """Link whose frame is the pose of the end effector."""

    def __repr__(self) -> str:
        return f"<Arm {self.name!r}: {len(self.joint_names)} joints, end effector {self.end_effector.name!r}>"

    @property
    def pose(self) -> tuple[Array, Array]:
        """Position (3,) (m) and quaternion (4,) x, y, z, w of the end effector in the world frame."""
        return self._manipulation.eef_pose(self.name)

    @property
    def pose_in_base(self) -> tuple[Array, Array]:
        """Position (3,) (m) and quaternion (4,) x, y, z, w of the end effector in the robot's base frame."""
        return self._manipulation.eef_pose(self.name, frame="base")

    @property
    def is_grasping(self) -> bool | None:
        """Whether the gripper holds an object; None where its controller cannot detect that."""
        return self._manipulation.is_grasping(self.name)


class Arms(dict[str, Arm]):
    """Arms by name."""

    def __missing__(self, name: str) -> Arm:
        """Raise a RoboyardError that lists the arms there are."""
        raise RoboyardError(unknown_name("arm", str(name), self))


class Manipulation:
    """Arms by name; the name may be omitted where a robot has one arm."""

    def __init__(self, robot: RobotParts, block: Block) -> None:
        """Create the capability of a robot from its definition's `manipulation` block."""
        self._robot = robot
        self.block = block
        self.arm_names = block.arm_names
        arrays = robot.joint_arrays
        self.arm_control_idx: dict[str, Indices] = {
            arm: arrays.indices_of(block.arm_joint_names[arm]) for arm in self.arm_names
        }
        """Arm to the indices of its joints in the robot's joint vectors."""
        self.gripper_control_idx: dict[str, Indices] = {
            arm: arrays.indices_of(block.finger_joint_names.get(arm, ())) for arm in self.arm_names
        }
        """Arm to the indices of its finger joints in the robot's joint vectors."""
        if block.add_combined_arm_control_idx:
            self.arm_control_idx["combined"] = np.concatenate(
                [self.arm_control_idx[arm] for arm in self.arm_names]
            )
        self.eef_links: dict[str, Link] = {
            arm: robot.body.link(block.eef_link_names[arm]) for arm in self.arm_names
        }
        """Arm to the link of its end effector."""
        self.assisted_grasp: AssistedGrasp | None = None
        """Takes objects by constraints; None where friction alone holds them."""
        self.arms = Arms({arm: Arm(self, arm) for arm in self.arm_names})
        """Name to arm."""

    @property
    def default_arm(self) -> str:
        """Name of the first arm."""
        return self.arm_names[0]

    def arm(self, name: str = "default") -> str:
        """Return the name of an existing arm; "default" is the first.

        Raises:
            RoboyardError: there is no arm of this name.
        """
        if name == "default":
            return self.default_arm
        if name not in self.arm_names:
            raise RoboyardError(f"robot {self._robot.name!r}: {unknown_name('arm', name, self.arm_names)}")
        return name

    def eef_pose(self, arm: str = "default", *, frame: str = "world") -> tuple[Array, Array]:
        """Return position (3,) (m) and quaternion (4,) x, y, z, w of an end effector.

        Args:
            arm: name.
            frame: "world", or "base" for the robot's base frame.

        Raises:
            RoboyardError: there is no such arm or frame.
        """
        if frame not in ("world", "base"):
            raise RoboyardError(
                f"robot {self._robot.name!r}: {unknown_name('frame', frame, ('world', 'base'))}"
            )
        position, quaternion = self.eef_links[self.arm(arm)].pose
        if frame == "world":
            return position, quaternion
        base_position, base_quaternion = self._robot.base_link.pose
        quaternion_base_world = conjugate(base_quaternion)
        return (
            rotate(quaternion_base_world, position - base_position),
            multiply(quaternion_base_world, quaternion),
        )

    def finger_links(self, arm: str = "default") -> tuple[Link, ...]:
        """Return the finger links of a gripper."""
        names = self.block.finger_link_names.get(self.arm(arm), ())
        return tuple(self._robot.body.link(name) for name in names)

    def gripper_links(self, arm: str = "default") -> tuple[Link, ...]:
        """Return all links of a gripper.

        Raises:
            RoboyardError: the definition names none.
        """
        names = self._of_arm("gripper_link_names", self.block.gripper_link_names, arm)
        return tuple(self._robot.body.link(name) for name in names)

    def is_grasping(self, arm: str = "default") -> bool | None:
        """Return whether the gripper holds an object; None where its controller cannot detect that."""
        if self.assisted_grasp is not None:
            return self.assisted_grasp.held(self.arm(arm)) is not None
        group = self._robot.groups.get(f"gripper_{self.arm(arm)}")
        if group is None or not isinstance(group.controller, MultiFingerGripperController):
            return None
        return group.controller.is_grasping()

    def set_grasping_mode(self, mode: GraspingMode) -> None:
        """Set how objects are held: by friction, or also by constraints (see `assisted_grasp`)."""
        if self.assisted_grasp is not None:
            self.assisted_grasp.release()
        self.assisted_grasp = (
            None if mode == "physical" else AssistedGrasp(self._robot.body, self.block, mode)
        )

    def update_grasps(self) -> None:
        """Take and release objects as the grippers' goals say, where a grasping mode does so."""
        if self.assisted_grasp is None:
            return
        for arm in self.arm_names:
            group = self._robot.groups.get(f"gripper_{arm}")
            if group is not None and isinstance(group.controller, MultiFingerGripperController):
                q = self._robot.joint_arrays.q[group.indices]
                self.assisted_grasp.update(arm, group.controller, q)

    def workspace_range(self, arm: str = "default") -> tuple[float, float]:
        """Return the yaw range that an arm reaches, about the base's z axis from its x axis (rad).

        Raises:
            RoboyardError: the definition has none.
        """
        low, high = self._of_arm("arm_workspace_range", self.block.arm_workspace_range, arm)
        return float(np.deg2rad(low)), float(np.deg2rad(high))

    def _of_arm(self, key: str, by_arm: dict[str, Any] | None, arm: str) -> Any:
        """Return an arm's entry of an optional key of the block."""
        found = (by_arm or {}).get(self.arm(arm))
        if found is None:
            raise RoboyardError(
                f"the definition of {self._robot.name!r} has no manipulation.{key} for {arm!r}; add it"
            )
        return found

    def teleop_rotation_offset(self, arm: str = "default") -> Array:
        """Return the rotation between teleoperation device and end effector as (4,) x, y, z, w."""
        given = (self.block.teleop_rotation_offset or {}).get(self.arm(arm))
        if given is None:
            return np.array([0.0, 0.0, 0.0, 1.0])
        return quaternion_from_rpy(given) if len(given) == 3 else np.array(given)

    def proprioception(self, q: Array, v: Array) -> dict[str, Any]:
        """Return joint positions and velocities, end-effector pose in the base frame and grasp of each arm.

        Args:
            q: (n,) joint positions of the robot (rad or m).
            v: (n,) joint velocities of the robot (rad/s or m/s).

        Returns:
            Arrays by key; "grasp_<arm>" is (1,): 1 for an object, -1 for none, 0 for unknown.
        """
        found: dict[str, Any] = {}
        for arm in self.arm_names:
            own, fingers = self.arm_control_idx[arm], self.gripper_control_idx[arm]
            position, quaternion = self.eef_pose(arm, frame="base")
            grasp = self.is_grasping(arm)
            found |= {
                f"arm_{arm}_qpos": q[own],
                f"arm_{arm}_qpos_sin": np.sin(q[own]),
                f"arm_{arm}_qpos_cos": np.cos(q[own]),
                f"arm_{arm}_qvel": v[own],
                f"eef_{arm}_pos": position,
                f"eef_{arm}_quat": quaternion,
                f"grasp_{arm}": np.array([0.0 if grasp is None else 1.0 if grasp else -1.0]),
                f"gripper_{arm}_qpos": q[fingers],
                f"gripper_{arm}_qvel": v[fingers],
            }
        return found

    @property
    def default_proprioception(self) -> tuple[str, ...]:
        """Keys of `proprioception` that are observed by default."""
        keys = (
            "arm_{}_qpos_sin",
            "arm_{}_qpos_cos",
            "eef_{}_pos",
            "eef_{}_quat",
            "gripper_{}_qpos",
            "grasp_{}",
        )
        return tuple(key.format(arm) for arm in self.arm_names for key in keys)

"""Arms and grippers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.errors import RoboyardError, unknown_name
from roboyard.robots.control import MultiFingerGripperController
from roboyard.robots.definition.schema import Manipulation as Block
from roboyard.robots.joint_arrays import Indices
from roboyard.sim.link import Link
from roboyard.transforms import Array, conjugate, multiply, quaternion_from_rpy, rotate

if TYPE_CHECKING:
    from roboyard.robots.robot_body import RobotBody


class Manipulation:
    """Arms by name; where a robot has one arm, its name need not be given."""

    def __init__(self, robot: RobotBody, block: Block) -> None:
        self._robot = robot
        self.block = block
        self.arm_names = block.arm_names
        self.arm_control_idx: dict[str, Indices] = {
            arm: robot.joints.places(block.arm_joint_names[arm]) for arm in self.arm_names
        }
        """Arm to the places of its joints in the robot's vectors."""
        self.gripper_control_idx: dict[str, Indices] = {
            arm: robot.joints.places(block.finger_joint_names.get(arm, ())) for arm in self.arm_names
        }
        if block.add_combined_arm_control_idx:
            self.arm_control_idx["combined"] = np.concatenate(
                [self.arm_control_idx[arm] for arm in self.arm_names]
            )
        self.eef_links: dict[str, Link] = {
            arm: robot.body.link(block.eef_link_names[arm]) for arm in self.arm_names
        }

    @property
    def default_arm(self) -> str:
        """The first arm."""
        return self.arm_names[0]

    def arm(self, name: str = "default") -> str:
        """The name of an arm that exists; "default" is the first.

        Raises:
            RoboyardError: there is none of this name.
        """
        if name == "default":
            return self.default_arm
        if name not in self.arm_names:
            raise RoboyardError(f"robot {self._robot.name!r}: {unknown_name('arm', name, self.arm_names)}")
        return name

    def eef_pose(self, arm: str = "default", *, frame: str = "world") -> tuple[Array, Array]:
        """Position (3,) m and quaternion (4,) x, y, z, w of an end effector.

        Args:
            arm: name.
            frame: "world", or "base" for the robot's base frame.
        """
        position, quaternion = self.eef_links[self.arm(arm)].pose
        if frame == "world":
            return position, quaternion
        base, turn = self._robot.base_link.pose
        back = conjugate(turn)
        return rotate(back, position - base), multiply(back, quaternion)

    def finger_links(self, arm: str = "default") -> tuple[Link, ...]:
        names = self.block.finger_link_names.get(self.arm(arm), ())
        return tuple(self._robot.body.link(name) for name in names)

    def gripper_links(self, arm: str = "default") -> tuple[Link, ...]:
        """Links of a gripper.

        Raises:
            RoboyardError: the definition names none.
        """
        names = (self.block.gripper_link_names or {}).get(self.arm(arm))
        if names is None:
            raise RoboyardError(
                f"the definition of {self._robot.name!r} has no manipulation.gripper_link_names for "
                f"{arm!r}; add it"
            )
        return tuple(self._robot.body.link(name) for name in names)

    def is_grasping(self, arm: str = "default") -> bool | None:
        """Whether the gripper holds something; None where that cannot be told."""
        group = self._robot.groups.get(f"gripper_{self.arm(arm)}")
        if group is None or not isinstance(group.controller, MultiFingerGripperController):
            return None
        return group.controller.is_grasping()

    def workspace_range(self, arm: str = "default") -> tuple[float, float]:
        """Directions that an arm reaches, about the base's z axis from its x axis; rad.

        Raises:
            RoboyardError: the definition gives none.
        """
        found = (self.block.arm_workspace_range or {}).get(self.arm(arm))
        if found is None:
            raise RoboyardError(
                f"the definition of {self._robot.name!r} has no manipulation.arm_workspace_range for "
                f"{arm!r}; add it"
            )
        return float(np.deg2rad(found[0])), float(np.deg2rad(found[1]))

    def teleop_rotation_offset(self, arm: str = "default") -> Array:
        """(4,) x, y, z, w."""
        given = (self.block.teleop_rotation_offset or {}).get(self.arm(arm))
        if given is None:
            return np.array([0.0, 0.0, 0.0, 1.0])
        return quaternion_from_rpy(given) if len(given) == 3 else np.array(given)

    def proprioception(self, q: Array, v: Array) -> dict[str, Any]:
        """Joint angles and speeds, end-effector pose in the base frame and grasp of each arm."""
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
        """What is observed where nobody asks for anything else."""
        keys = (
            "arm_{}_qpos_sin",
            "arm_{}_qpos_cos",
            "eef_{}_pos",
            "eef_{}_quat",
            "gripper_{}_qpos",
            "grasp_{}",
        )
        return tuple(key.format(arm) for arm in self.arm_names for key in keys)

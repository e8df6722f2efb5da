"""Joints that are read together, with one compiled call."""

from __future__ import annotations

from collections.abc import Sequence
from struct import Struct
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.pybullet.state.bodies.joint_tables import POSITION_COUNT

if TYPE_CHECKING:
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.transforms import Array

NO_REACTION = (0.0,) * 6
_CACHE_SIZE = 64
_singles = Struct("d").iter_unpack


class JointGroup:
    """Some joints of one body; valid until MuJoCo's model is recompiled.

    Attributes:
        joints: joint indices.
        is_scalar: whether every joint has at most one degree of freedom.
        is_free: whether every joint has exactly one.
    """

    __slots__ = (
        "_given",
        "_kernels",
        "_out",
        "_pack",
        "_positions",
        "_reactions",
        "_rows",
        "_velocities",
        "_words",
        "is_free",
        "is_scalar",
        "joints",
    )

    def __init__(self, record: BodyRecord, joints: list[int]) -> None:
        """Prepare reading of `joints` of a body."""
        from roboyard.pybullet.state import state_kernels

        self.joints = tuple(joints)
        self.is_scalar = all(POSITION_COUNT[record.joint_type(joint)] <= 1 for joint in joints)
        self.is_free = all(record.is_scalar[joint] for joint in joints)
        self._positions = np.array([record.position_addresses[joint] for joint in joints], dtype=np.int64)
        self._velocities = np.array([record.velocity_addresses[joint] for joint in joints], dtype=np.int64)
        self._reactions = (NO_REACTION,) * len(joints)
        self._out = np.zeros((3, len(joints)))
        self._rows = tuple(row.data for row in self._out)
        self._kernels = state_kernels  # whose loops become built-ins when they are loaded
        self._given, self._pack = np.zeros(len(joints)), Struct(f"{len(joints)}d").pack_into
        self._words = self._given.data

    def read(self, record: BodyRecord, forces: Array) -> tuple[tuple[Any, ...], ...]:
        """Return the fields of getJointState of each joint; `forces`: (nv,) motor efforts (N m or N)."""
        positions, velocities, applied = self._numbers(record, forces)
        return tuple(zip(positions, velocities, self._reactions, applied, strict=True))

    def read_tuples(self, record: BodyRecord, forces: Array) -> tuple[tuple[Any, ...], ...]:
        """Return the fields of getJointStateMultiDof of each joint, all of one degree of freedom.

        `forces`: (nv,) motor efforts (N m or N).
        """
        if not record.motors_off:
            places = self._positions, self._velocities
            self._kernels.joint_states(record.qpos, record.qvel, forces, *places, self._out)
            a, b, c = self._rows
            return tuple(zip(_singles(a), _singles(b), self._reactions, _singles(c), strict=True))
        positions, velocities, applied = map(zip, self._numbers(record, forces))
        return tuple(zip(positions, velocities, self._reactions, applied, strict=True))

    def write(
        self, record: BodyRecord, positions: Sequence[float], velocities: Sequence[float] | None = None
    ) -> None:
        """Put joints of one degree of freedom at (n,) positions (rad or m), at rest or with (n,) speeds."""
        self._pack(self._words, 0, *positions)
        places = self._positions, self._velocities
        self._kernels.rest_joints(record.qpos, record.qvel, *places, self._given)
        if velocities is not None:
            record.qvel[self._velocities] = velocities

    def _numbers(self, record: BodyRecord, forces: Array) -> list[list[Any]]:
        """Return positions, velocities and efforts of the motors."""
        places = self._positions, self._velocities
        self._kernels.joint_states(record.qpos, record.qvel, forces, *places, self._out)
        numbers = self._out.tolist()
        if record.motors_off:
            applied = numbers[2]
            for place, joint in enumerate(self.joints):
                if joint in record.motors_off:
                    applied[place] = record.applied[joint]
        return numbers


def joint_group(record: BodyRecord, joints: list[int]) -> JointGroup:
    """Return the group of these joints, cached with the body."""
    if len(record.joint_groups) > _CACHE_SIZE:
        record.joint_groups.clear()
    found = record.joint_groups[tuple(joints)] = JointGroup(record, joints)
    return found

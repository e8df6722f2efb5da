"""Binary logs of robots and contacts: a line of names, a line of types, then records.

Types are those of `struct`, little-endian without padding; each record starts with 0xaa 0xbb.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.api.math.rotations import getEulerFromQuaternion
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.contacts import ANY_LINK, touching

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene

START = b"\xaa\xbb"
_MINITAUR_NAMES = ("t", "r", "p", "y", *(f"q{i}" for i in range(8)), *(f"u{i}" for i in range(8)), "dx", "mo")
_MINITAUR_MODE = 6
_MINITAUR_LEGS = (
    *(("front", "left", "R"), ("front", "left", "L"), ("back", "left", "R"), ("back", "left", "L")),
    *(("front", "right", "L"), ("front", "right", "R"), ("back", "right", "L"), ("back", "right", "R")),
)
_ROBOT_NAMES = (
    *("stepCount", "timeStamp", "objectId", "posX", "posY", "posZ", "oriX", "oriY", "oriZ", "oriW"),
    *("velX", "velY", "velZ", "omegaX", "omegaY", "omegaZ", "qNum"),
)
_CONTACT_NAMES = (
    *("stepCount", "timeStamp", "contactFlag", "bodyUniqueIdA", "bodyUniqueIdB", "linkIndexA", "linkIndexB"),
    *("positionOnAX", "positionOnAY", "positionOnAZ", "positionOnBX", "positionOnBY", "positionOnBZ"),
    *("contactNormalOnBX", "contactNormalOnBY", "contactNormalOnBZ", "contactDistance", "normalForce"),
)
_CONTROLLER_NAMES = (
    *("stepCount", "timeStamp", "controllerId", "numMoveEvents", "m_numButtonEvents", "posX", "posY", "posZ"),
    *("oriX", "oriY", "oriZ", "oriW", "analogAxis", *(f"buttons{i}" for i in range(7)), "deviceType"),
)


class _RecordFile:
    """A binary log that is being written."""

    def __init__(self, client: Client, name: str, names: Sequence[str], types: str) -> None:
        """Open the file and write its two header lines.

        Raises:
            error: the file cannot be written.
        """
        try:
            self._file = client.output_files.open(name)
        except OSError as problem:
            raise failure("startStateLogging failed.", str(problem)) from None
        self._client = client
        header, self._pack = _form_of(tuple(names), types)
        self._file.write(header)
        self.steps = 0

    def write(self, values: Sequence[Any]) -> None:
        """Write one record."""
        self._file.write(START + self._pack(*values))

    def close(self) -> None:
        """Finish the file."""
        self._file.close()


@lru_cache(16)
def _form_of(names: tuple[str, ...], types: str) -> tuple[bytes, Callable[..., bytes]]:
    """Return the header of a log with fields of these names and types, and what packs a record."""
    return f"{','.join(names)}\n{types}\n".encode(), struct.Struct(f"<{types}").pack


@lru_cache(16)
def _robot_names(dofs: int, has_torques: bool) -> tuple[str, ...]:
    """Return the names of the fields of a generic robot's record."""
    letters = "qut" if has_torques else "qu"
    return (*_ROBOT_NAMES, *(f"{letter}{i}" for letter in letters for i in range(dofs)))


class ControllerLog(_RecordFile):
    """Log of virtual reality controllers, which are not supported: a file without records."""

    def __init__(self, client: Client, name: str) -> None:
        """Open the file."""
        super().__init__(client, name, _CONTROLLER_NAMES, "IfIIIffffffffIIIIIIII")

    def record(self) -> None:
        """Do nothing: there are no controllers."""


class RobotLog(_RecordFile):
    """Base pose, base velocity, joint positions and velocities of bodies, once per step."""

    def __init__(self, client: Client, name: str, bodies: Sequence[int], dofs: int, torques: int) -> None:
        """Open the file.

        Args:
            client: client to log.
            name: file to write.
            bodies: bodies to log; empty for all.
            dofs: number of joints in a record.
            torques: bits of STATE_LOG_JOINT_TORQUES.
        """
        names = _robot_names(dofs, bool(torques))
        super().__init__(client, name, names, "IfifffffffffffffI" + "f" * (len(names) - len(_ROBOT_NAMES)))
        self._bodies, self._dofs, self._torques = frozenset(bodies), dofs, torques
        self.records_user_torques = bool(torques & c.STATE_LOG_JOINT_USER_TORQUES)

    def record(self) -> None:
        """Write one record for each body."""
        client = self._client
        scene = client.scene
        head = (self.steps, self.steps * scene.time_step)
        for number in scene.order:
            if self._bodies and number not in self._bodies:
                continue
            record = scene.bodies[number]
            joints = [info[0] for info in record.infos if info[2] in (0, 1)][: self._dofs]
            states = client.getJointStates(number, joints) if joints else ()
            position, orientation = client.getBasePositionAndOrientation(number)
            linear, angular = client.getBaseVelocity(number)
            columns = [[state[0] for state in states], [state[1] for state in states]]
            if self._torques:
                columns.append(self._torques_of(scene, record, joints, states))
            padding = [0.0] * (self._dofs - len(joints))
            values = [value for column in columns for value in (*column, *padding)]
            self.write((*head, number, *position, *orientation, *linear, *angular, len(joints), *values))
        self.steps += 1

    def _torques_of(
        self, scene: PhysicsScene, record: BodyRecord, joints: Sequence[int], states: Sequence[Any]
    ) -> list[float]:
        """Return the motor and script torques (N m) or forces (N) of the last step, as the flags select."""
        torques = [0.0] * len(joints)
        if self._torques & c.STATE_LOG_JOINT_MOTOR_TORQUES:
            torques = [state[3] for state in states]
        given = scene.user_torques
        if self.records_user_torques and given is not None:
            for place, joint in enumerate(joints):
                torques[place] += float(given[record.velocity_addresses[joint]])
        return torques


class MinitaurLog(_RecordFile):
    """Attitude, motor angles, motor torques and forward speed of a robot with the Minitaur's eight motors."""

    def __init__(self, client: Client, name: str, body: int, motors: Sequence[int]) -> None:
        """Open the file.

        Args:
            client: client to log.
            name: file to write.
            body: the robot.
            motors: joints of its eight motors.
        """
        super().__init__(client, name, _MINITAUR_NAMES, "I" + "f" * 20 + "B")
        self._body, self._motors = body, tuple(motors)

    def record(self) -> None:
        """Write one record, until the robot is removed."""
        client = self._client
        if self._body not in client.scene.bodies:
            return
        states = client.getJointStates(self._body, self._motors)
        orientation = client.getBasePositionAndOrientation(self._body)[1]
        forward = client.getBaseVelocity(self._body)[0][0]
        angles = getEulerFromQuaternion(orientation)
        columns = ([state[0] for state in states], [state[3] for state in states])
        self.write((self.steps, *angles, *columns[0], *columns[1], forward, _MINITAUR_MODE))
        self.steps += 1


def minitaur_motors(record: BodyRecord) -> list[int] | None:
    """Return the joints of a Minitaur's eight motors in log order; None for another robot."""
    by_name = {info[1].decode(): info[0] for info in record.infos}
    names = [f"motor_{end}_{side}{leg}_joint" for end, side, leg in _MINITAUR_LEGS]
    return [by_name[name] for name in names] if all(name in by_name for name in names) else None


class ContactLog(_RecordFile):
    """The contacts that a filter selects, once per step, each pair in Bullet's order."""

    def __init__(self, client: Client, name: str, wanted: tuple[int, int, int, int]) -> None:
        """Open the file.

        Args:
            client: client to log.
            name: file to write.
            wanted: body A, body B, link A, link B of getContactPoints.
        """
        super().__init__(client, name, _CONTACT_NAMES, "IfIiiiifffffffffff")
        self._wanted = wanted

    def record(self) -> None:
        """Write one record for each contact."""
        scene = self._client.scene
        head = (self.steps, self.steps * scene.time_step)
        body_a, body_b, link_a, link_b = self._wanted
        for pair, point in touching(scene):
            (a, a_link), (b, b_link) = pair
            if (body_a >= 0 and body_a not in (a, b)) or (body_b >= 0 and body_b not in (a, b)):
                continue
            if link_a not in (ANY_LINK, a_link) or link_b not in (ANY_LINK, b_link):
                continue
            on_a, on_b, normal, distance, force = point[:5]
            self.write((*head, 0, a, b, a_link, b_link, *on_a, *on_b, *normal, distance, force))
        self.steps += 1

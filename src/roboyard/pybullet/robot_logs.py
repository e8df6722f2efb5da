"""Binary logs of robots and contacts: a line of names, a line of types, then records.

Types are those of `struct`, little-endian without padding; each record starts with 0xaa 0xbb.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.errors import failure

if TYPE_CHECKING:
    from roboyard.pybullet.clients import Client

START = b"\xaa\xbb"
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
    """A log that is being written."""

    def __init__(self, name: str, names: Sequence[str], types: str) -> None:
        try:
            self._file = Path(name).open("wb")  # noqa: SIM115 - open from start to stop of the log
        except OSError as problem:
            raise failure("startStateLogging failed.", str(problem)) from None
        self._file.write(f"{','.join(names)}\n{types}\n".encode())
        self._pack = struct.Struct(f"<{types}").pack
        self.steps = 0

    def write(self, values: Sequence[Any]) -> None:
        self._file.write(START + self._pack(*values))

    def close(self) -> None:
        """Finish the file."""
        self._file.close()


class ControllerLog(_RecordFile):
    """Virtual reality controllers, of which there are none: a file without records."""

    def __init__(self, name: str) -> None:
        super().__init__(name, _CONTROLLER_NAMES, "IfIIIffffffffIIIIIIII")

    def record(self, client: Client) -> None:
        """Nothing to write."""


class RobotLog(_RecordFile):
    """Base pose, base velocity, joint positions and velocities of bodies, once a step."""

    def __init__(self, name: str, bodies: Sequence[int], dofs: int, *, torques: bool) -> None:
        names = [*_ROBOT_NAMES, *(f"q{i}" for i in range(dofs)), *(f"u{i}" for i in range(dofs))]
        if torques:
            names += [f"t{i}" for i in range(dofs)]
        super().__init__(name, names, "IfifffffffffffffI" + "f" * (len(names) - len(_ROBOT_NAMES)))
        self._bodies, self._dofs, self._torques = frozenset(bodies), dofs, torques

    def record(self, client: Client) -> None:
        """Write one record for each body."""
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
                columns.append([state[3] for state in states])
            padding = [0.0] * (self._dofs - len(joints))
            values = [value for column in columns for value in (*column, *padding)]
            self.write((*head, number, *position, *orientation, *linear, *angular, len(joints), *values))
        self.steps += 1


class ContactLog(_RecordFile):
    """All contacts that a filter lets through, once a step."""

    def __init__(self, name: str, wanted: tuple[int, int, int, int]) -> None:
        super().__init__(name, _CONTACT_NAMES, "IfIiiiifffffffffff")
        self._wanted = wanted

    def record(self, client: Client) -> None:
        """Write one record for each contact."""
        head = (self.steps, self.steps * client.scene.time_step)
        for point in client.getContactPoints(*self._wanted):
            flag, a, b, link_a, link_b, on_a, on_b, normal, distance, force = point[:10]
            self.write((*head, flag, a, b, link_a, link_b, *on_a, *on_b, *normal, distance, force))
        self.steps += 1

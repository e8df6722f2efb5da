"""setJointMotorControl as machine code: its arguments go to the places of those of setJointMotorControl2."""

from __future__ import annotations

from typing import Any

from roboyard._records import NamedTuple
from roboyard.native.entry_parts import FOUND, WHOLE, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.face import constants as c


class OldMotorState(NamedTuple):
    """State of the command; the machine code has the same order."""

    command: Any
    """`command(client, *arguments)`."""
    replaced: dict[str, Any]
    """Functions that are called for commands, by name."""
    kp: float
    name: str = "setJointMotorControl2"
    zero: float = 0.0
    whole: int = 0


_SOURCE = f"""
KIND = 1  # of any object, in words
COMMAND, REPLACED, KP, NAME, ZERO, WHOLE = range(3, 9)
{parts(FOUND, WHOLE)}
@part
def place(state, given, count, passed):
    total, mode, zero = count, whole(given[3]), word(state, ZERO)
    if count == 9:
        for k in range(4, 9):
            passed[k] = given[k]
    elif mode == {c.POSITION_CONTROL}:
        passed[4], passed[5], total = given[4], zero, count + 1
        for k in range(5, count):
            passed[k + 1] = given[k]
    elif mode == {c.VELOCITY_CONTROL}:
        passed[4], passed[5], total = zero, given[4], count + 1
        if count > 5:
            passed[6] = given[5]
        if count > 6:
            passed[7], passed[8], total = word(state, KP), given[6], 9
    elif mode == {c.TORQUE_CONTROL} and count == 5:
        passed[4], passed[5], passed[6], total = zero, zero, given[4], 7
    else:
        total = 0
    return total

def entry(state, given, count, keywords):
    fits = keywords == 0 and 5 <= count <= 9 and count != 8
    motors = total = 0
    passed = words()
    if fits and word(given[3], KIND) == word(word(state, WHOLE), KIND):
        total = place(state, given, count, passed)
        motors = found(word(state, REPLACED), word(state, NAME))
    if motors == 0 or total == 0:
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    for k in range(4):
        passed[k] = given[k]
    Py_IncRef(motors)  # the command may replace it
    result = PyObject_Vectorcall(motors, passed, total, 0)
    Py_DecRef(motors)
    return result
"""


def old_motor_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


OLD = Front(old_motor_call, EntrySignature(_SOURCE))
"""setJointMotorControl."""
vars(OLD.core)["front"] = OLD

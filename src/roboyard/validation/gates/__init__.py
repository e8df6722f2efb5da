"""The gates, one a file, in the order they run."""

from __future__ import annotations

from collections.abc import Callable

from roboyard.validation.gates.drive import drive
from roboyard.validation.gates.ik_reach import ik_reach
from roboyard.validation.gates.limits import limits
from roboyard.validation.gates.response import response
from roboyard.validation.gates.rest import drift, self_collision, settle
from roboyard.validation.gates.sensors import sensors
from roboyard.validation.gates.tuck import tuck
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld

GATES: dict[str, Callable[[TestWorld], tuple[Gate, ...]]] = {
    "limits": limits,
    "self_collision": self_collision,
    "settle": settle,
    "drift": drift,
    "response": response,
    "drive": drive,
    "ik_reach": ik_reach,
    "tuck": tuck,
    "sensors": sensors,
}
"""Name to the function that answers; one function may answer several questions."""

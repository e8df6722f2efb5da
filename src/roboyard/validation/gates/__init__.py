"""The gates in the order in which they run, one test a file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from roboyard.validation.gates.complete import complete_gates
from roboyard.validation.gates.drive import drive_gates
from roboyard.validation.gates.free_joints import free_joint_gates
from roboyard.validation.gates.ik_reach import ik_reach_gates, reach_poses, summarize, task_arms
from roboyard.validation.gates.limits import limits_gates
from roboyard.validation.gates.response import response_gates
from roboyard.validation.gates.rest import drift_gates, self_collision_gates, settle_gates
from roboyard.validation.gates.rest_contact import rest_contact_gates
from roboyard.validation.gates.sensors import sensors_gates
from roboyard.validation.gates.spheres import sphere_gates
from roboyard.validation.gates.stand import stand_gates
from roboyard.validation.gates.tracking import tracking_gates
from roboyard.validation.gates.tuck import tuck_gates
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld

GATES: dict[str, Callable[[TestWorld], tuple[Gate, ...]]] = {
    "complete": complete_gates,
    "limits": limits_gates,
    "stand": stand_gates,
    "self_collision": self_collision_gates,
    "rest_contact": rest_contact_gates,
    "settle": settle_gates,
    "drift": drift_gates,
    "response": response_gates,
    "tracking": tracking_gates,
    "drive": drive_gates,
    "ik_reach": ik_reach_gates,
    "tuck": tuck_gates,
    "sensors": sensors_gates,
    "free_joints": free_joint_gates,
    "spheres": sphere_gates,
}
"""Name to the function that runs it; one function may return several gates."""

Parts = tuple[
    Callable[[TestWorld], Sequence[str]],
    Callable[[TestWorld, str], Any],
    Callable[[list[Any]], tuple[Gate, ...]],
]
PARTS: dict[str, Parts] = {"ik_reach": (task_arms, reach_poses, summarize)}
"""Gates whose test may run in parts side by side: the names of the parts, the test of one, and the gates of
all results in order."""

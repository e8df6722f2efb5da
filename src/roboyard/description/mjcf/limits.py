"""Effort limits and coupled joints of an MJCF model."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard.description.mjcf.loops import CONNECT, WELD
from roboyard.description.model import Mimic

_JOINT_EQUALITY = 2
_JOINT_TRANSMISSIONS = (0, 1)


def effort_of(model: Any, joint: int) -> float | None:
    """Return the largest effort on a joint (N m or N): its own bound, else its actuators'; None without.

    A motor of gear g gives at most g times its largest control.
    """
    if model.jnt_actfrclimited[joint]:
        return float(np.abs(model.jnt_actfrcrange[joint]).max())
    total = None
    for a in range(model.nu):
        if model.actuator_trntype[a] not in _JOINT_TRANSMISSIONS or model.actuator_trnid[a, 0] != joint:
            continue
        gear = abs(float(model.actuator_gear[a, 0]))
        if model.actuator_forcelimited[a]:
            bound = gear * float(np.abs(model.actuator_forcerange[a]).max())
        elif model.actuator_ctrllimited[a] and model.actuator_biastype[a] == 0:
            bound = gear * float(model.actuator_gainprm[a, 0] * np.abs(model.actuator_ctrlrange[a]).max())
        else:
            continue
        total = bound if total is None else total + bound
    return total


def mimics_of(model: Any, notes: list[str]) -> dict[str, Mimic]:
    """Return the joints that follow another one in a straight line, by name; those that close loops
    are loop joints (`mjcf.loops`); note all others.

    Args:
        model: the compiled model.
        notes: gets a note for each equality that is omitted.
    """
    found = {}
    for e in range(model.neq):
        kind = int(model.eq_type[e])
        if kind in (CONNECT, WELD):
            continue
        follower, leader = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
        if kind != _JOINT_EQUALITY or leader < 0:
            notes.append("an equality that does not couple two joints is omitted")
            continue
        offset, slope, *higher = map(float, model.eq_data[e, :5])
        if any(higher):
            notes.append(f"joint {model.joint(follower).name!r} follows another one in a straight line only")
        zero = [float(model.qpos0[model.jnt_qposadr[j]]) for j in (follower, leader)]
        found[model.joint(follower).name] = Mimic(
            joint=model.joint(leader).name,
            multiplier=slope,
            offset=offset + zero[0] - slope * zero[1],
        )
    return found

"""A recorded state as a state log, which `roboyard replay` and the page of `roboyard drive` load."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from roboyard.recording.state_log import StateLog
from roboyard.transforms import from_wxyz
from roboyard.viewer.timeline.moments import Moment


def log_of(moment: Moment, setup: Mapping[str, Any]) -> StateLog:
    """Return a log of one state.

    Args:
        moment: the state.
        setup: data to build the scene again; empty for a world built otherwise.
    """
    frames = moment.frames
    return StateLog(
        time=np.array([moment.snapshot.time]),
        positions=moment.snapshot.qpos[None, frames.position_columns.places],
        position_names=frames.position_columns.names,
        position_units=frames.position_columns.units,
        velocities=moment.qvel[None, frames.velocity_columns.places],
        velocity_names=frames.velocity_columns.names,
        velocity_units=frames.velocity_columns.units,
        fixed_positions=frames.positions[None],
        fixed_quaternions=from_wxyz(frames.wxyz[None]),
        fixed_index=np.zeros(1, dtype=np.int32),
        timestep=moment.timestep,
        setup=dict(setup),
    )

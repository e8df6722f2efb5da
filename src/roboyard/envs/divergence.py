"""States of simulations that diverged, kept in files for replay."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from uuid import uuid4

import mujoco
import numpy as np

from roboyard.envs.batch_physics import LARGEST_SPEED
from roboyard.errors import ConfigError
from roboyard.sim.stepping.solver_warning import solver_warning
from roboyard.sim.world import World
from roboyard.transforms import Array
from roboyard.untrusted.json_reading import read_json

LARGEST_SUBSTEPS = 10_000
"""Most steps of physics in a step of a task."""
LARGEST_FILE = 64 << 20
"""Bytes of a file of a state."""


def write_divergence(state: Array, inputs: Array, action: Array, substeps: int, folder: Path | None) -> str:
    """Write the state before a step in which a simulation diverged, and return the file's path.

    Args:
        state: (k,) MuJoCo's integration state before the step.
        inputs: (nu,) inputs of the drives during the step.
        action: (a,) of the step.
        substeps: time steps of the step.
        folder: for the file; a temporary folder by default.
    """
    place = Path(tempfile.gettempdir()) / "roboyard-diverged" if folder is None else folder
    place.mkdir(parents=True, exist_ok=True)
    file = place / f"diverged-{uuid4().hex[:12]}.json"
    content = {
        "state": state.tolist(),
        "inputs": inputs.tolist(),
        "action": action.tolist(),
        "substeps": substeps,
    }
    with file.open("x", encoding="utf-8") as out:
        json.dump(content, out)
    return str(file)


def replay(world: World, file: str | Path) -> Array:
    """Repeat a step that diverged, in the world of the same task, and return the (nv,) velocities after it.

    Args:
        world: of the task, such as `TaskEnv.world` or `Runner.world`.
        file: written when the simulation diverged.

    Raises:
        ConfigError: the file is of another task.
    """
    data = world.data
    try:
        saved = read_json(file, LARGEST_FILE)
        state, inputs = (np.array(saved[key], dtype=float) for key in ("state", "inputs"))
        substeps = int(saved["substeps"])
    except (OSError, ValueError, TypeError, KeyError, OverflowError) as error:
        raise ConfigError(f"{Path(file).name}: no step that diverged: {error}; give such a file") from None
    if state.shape != (mujoco.mj_stateSize(world.model, int(mujoco.mjtState.mjSTATE_INTEGRATION)),):
        raise ConfigError(f"{Path(file).name}: it has {state.size} numbers; it is of another task")
    if inputs.shape != data.ctrl.shape:
        raise ConfigError(f"{Path(file).name}: it has {inputs.size} inputs; it is of another task")
    if not 0 <= substeps <= LARGEST_SUBSTEPS:
        raise ConfigError(f"{Path(file).name}: substeps is {substeps}; give 0 to {LARGEST_SUBSTEPS}")
    mujoco.mj_setState(world.model, data, state, int(mujoco.mjtState.mjSTATE_INTEGRATION))
    data.ctrl[:] = inputs
    for _ in range(substeps):
        mujoco.mj_step(world.model, data)
        if not np.abs(data.qvel).max(initial=0.0) < LARGEST_SPEED:
            break
    solver_warning.is_raised, solver_warning.message = False, None
    world.mark_moved()
    return data.qvel.copy()

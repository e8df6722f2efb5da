"""`Readings`: efforts, targets, contact forces and sensors of a recorded state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.sensors import Sensor
    from roboyard.sim import World
    from roboyard.viewer.scene.snapshot import Links

MOST_VALUES = 16
"""Most numbers of a modality that is recorded; pictures, scans and lists of points are not."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Readings:
    """Numbers of the last step before a recorded state."""

    effort: Array
    """(nu,) efforts of the actuators (N m or N)."""
    inputs: Array
    """(nctrl,) inputs of the actuators."""
    gains: Array
    """(nu, 2) stiffness kp (N m/rad or N/m) and damping kd (N m s/rad or N s/m) of the actuators."""
    touched: np.ndarray
    """(k,) rows of the links with contacts, as in MuJoCo's arrays."""
    contact_force: Array
    """(k, 3) sum of the contact forces on each of them, world frame (N)."""
    sensors: Mapping[str, Array]
    """Name of a sensor and modality, "imu/acceleration", to its (n,) values."""

    @property
    def nbytes(self) -> int:
        """Memory of the numbers (bytes)."""
        arrays = (
            self.effort,
            self.inputs,
            self.gains,
            self.touched,
            self.contact_force,
            *self.sensors.values(),
        )
        return sum(array.nbytes for array in arrays)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Drives:
    """Joints with a drive: n of them."""

    names: tuple[str, ...]
    """ "body/joint"."""
    units: tuple[str, ...]
    """ "rad" or "m" of the joint positions."""
    rows: np.ndarray
    """(n,) actuators."""
    inputs: np.ndarray
    """(n,) first input of each actuator: target position, then target velocity."""


def read(world: World, links: Links, sensors: Mapping[str, Sensor]) -> Readings:
    """Return the numbers of a compiled world; call it in the simulation thread.

    Args:
        world: the world.
        links: its links.
        sensors: sensors to observe, by name.
    """
    touched, force = link_forces(world, links)
    return Readings(
        effort=np.array(world.data.actuator_force),
        inputs=np.array(world.data.ctrl),
        gains=-world.model.actuator_biasprm[:, 1:3],
        touched=touched,
        contact_force=force,
        sensors=_observe(sensors),
    )


def link_forces(world: World, links: Links) -> tuple[np.ndarray, Array]:
    """Return (k,) rows of the links in contact and (k, 3) the sum of forces on each, world frame (N)."""
    arrays = world.contact_arrays()
    if not len(arrays.force):
        return np.zeros(0, dtype=np.intp), np.zeros((0, 3))
    on_b = np.einsum("ki,kij->kj", arrays.force, arrays.frame)
    total: dict[int, Array] = {}
    for owners, force in zip(arrays.owners.tolist(), on_b, strict=True):
        for owner, share in ((tuple(owners[:2]), -force), (tuple(owners[2:]), force)):
            row = links.by_owner.get(owner)
            if row is not None:
                total[row] = total.get(row, 0.0) + share
    return np.array(list(total), dtype=np.intp), np.array(list(total.values())).reshape(-1, 3)


def drives_of(world: World) -> Drives:
    """Return all joints with a drive of a compiled world."""
    names, units, rows = [], [], []
    for body in world.bodies:
        for joint in body.joints:
            actuator = joint._built.actuator
            if joint.is_scalar and actuator is not None:
                names.append(f"{body.name}/{joint.name}")
                units.append("m" if joint.type == "prismatic" else "rad")
                rows.append(actuator.id)
    at = np.array(rows, dtype=np.intp)
    inputs = world.model.actuator_ctrladr[at].astype(np.intp)
    return Drives(names=tuple(names), units=tuple(units), rows=at, inputs=inputs)


def _observe(sensors: Mapping[str, Sensor]) -> dict[str, Array]:
    found: dict[str, Array] = {}
    for name, sensor in sensors.items():
        for modality, value in sensor.observe().items():
            if isinstance(value, np.ndarray) and value.ndim == 1 and 0 < len(value) <= MOST_VALUES:
                found[f"{name}/{modality}"] = value.astype(float)
    return found

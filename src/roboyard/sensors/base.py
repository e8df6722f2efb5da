"""Base class of sensors: a pose on a link, a rate, and an observation as a dictionary of arrays."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.errors import RoboyardError
from roboyard.transforms import IDENTITY_QUATERNION, Array, matrix_from_quaternion, normalized

if TYPE_CHECKING:
    from roboyard.sim import Link, World

Observation = dict[str, Any]
"""Modality ("rgb", "scan", ...) to array."""


class SensorPose:
    """A frame fixed to a link."""

    def __init__(
        self, link: Link, position: ArrayLike = (0, 0, 0), orientation: ArrayLike = IDENTITY_QUATERNION
    ) -> None:
        """Fix a frame to a link.

        Args:
            link: the link.
            position: (3,) position in the link's frame (m).
            orientation: (4,) quaternion x, y, z, w in the link's frame.

        Raises:
            RoboyardError: the position is not three finite numbers.
            ValueError: the quaternion has zero length.
        """
        self.link = link
        self.position = np.array(position, dtype=float)
        if self.position.shape != (3,) or not np.isfinite(self.position).all():
            raise RoboyardError(
                f"sensor on {link.name!r}: position must be three finite numbers, got {position}"
            )
        self.rotation = matrix_from_quaternion(normalized(orientation))

    def in_world(self) -> tuple[Array, Array]:
        """Return the (3,) position (m) and (3, 3) rotation of the frame in the world."""
        data = self.link.body.world.kinematics()
        row = self.link.body.mujoco_ids[self.link.index]
        turn = data.xmat[row].reshape(3, 3)
        return data.xpos[row] + turn @ self.position, turn @ self.rotation


class Sensor(ABC):
    """One sensor on one link."""

    kind: ClassVar[str]
    """Kind of the sensor, part of its default name."""
    modalities: ClassVar[tuple[str, ...]]
    """Keys that an observation may have."""

    def __init__(
        self,
        link: Link,
        *,
        position: ArrayLike = (0, 0, 0),
        orientation: ArrayLike = IDENTITY_QUATERNION,
        rate: float | None = None,
    ) -> None:
        """Put the sensor on a link.

        Args:
            link: the link that the sensor is fixed to.
            position: (3,) position in the link's frame (m).
            orientation: (4,) quaternion x, y, z, w in the link's frame.
            rate: observations per second of simulated time (Hz); None: one at every call.

        Raises:
            RoboyardError: the rate is not above 0, or the position is not finite.
        """
        if rate is not None and not (np.isfinite(rate) and rate > 0):
            raise RoboyardError(f"{self.kind} on {link.name!r}: rate must be above 0 Hz, got {rate}")
        self.mount = SensorPose(link, position, orientation)
        self.rate = rate

    @property
    def link(self) -> Link:
        """The link that the sensor is fixed to."""
        return self.mount.link

    @property
    def world(self) -> World:
        """The world of that link."""
        from roboyard.sim.world import World

        return World.of(self.link.body)

    @abstractmethod
    def observe(self) -> Observation:
        """Return the present measurements by modality; shapes and units as in the subclass."""

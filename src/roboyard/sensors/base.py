"""What all sensors share: a link, a place on it, a rate, and an observation as a dictionary of arrays."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from roboyard.errors import RoboyardError
from roboyard.transforms import IDENTITY_QUATERNION, Array, matrix_from_quaternion, normalized

if TYPE_CHECKING:
    from roboyard.sim import Link, World

Observation = dict[str, Any]
"""Modality ("rgb", "scan", ...) to array."""


class Mount:
    """A frame fixed to a link."""

    def __init__(
        self, link: Link, position: ArrayLike = (0, 0, 0), orientation: ArrayLike = IDENTITY_QUATERNION
    ) -> None:
        """Put a frame at `position` (3,) m and `orientation` (4,) x, y, z, w in the link's frame."""
        self.link = link
        self.position = np.array(position, dtype=float)
        if self.position.shape != (3,) or not np.isfinite(self.position).all():
            raise RoboyardError(f"a sensor's position has three finite numbers; got {position}")
        self.rotation = matrix_from_quaternion(normalized(orientation))

    def in_world(self) -> tuple[Array, Array]:
        """Position (3,) m and rotation (3, 3) of the frame in the world."""
        data = self.link.body.world.kinematics()
        row = self.link.body.mujoco_ids[self.link.index]
        turn = data.xmat[row].reshape(3, 3)
        return data.xpos[row] + turn @ self.position, turn @ self.rotation


class Sensor(ABC):
    """One sensor on one link."""

    kind: ClassVar[str]
    """As in its name."""
    modalities: ClassVar[tuple[str, ...]]
    """Keys of its observations."""

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
            link: what it is fixed to.
            position: (3,) in the link's frame; m.
            orientation: (4,) x, y, z, w in the link's frame.
            rate: observations a second of simulated time; None: a new one whenever asked.

        Raises:
            RoboyardError: a rate that is not above 0, or a place that is not finite.
        """
        if rate is not None and not (np.isfinite(rate) and rate > 0):
            raise RoboyardError(f"{self.kind} on {link.name!r}: a rate is above 0 Hz; got {rate}")
        self.mount = Mount(link, position, orientation)
        self.rate = rate

    @property
    def link(self) -> Link:
        return self.mount.link

    @property
    def world(self) -> World:
        from roboyard.sim.world import World

        return World.of(self.link.body)

    @abstractmethod
    def observe(self) -> Observation:
        """What it senses now, by modality."""

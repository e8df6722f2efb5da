"""Contact sensor: the bodies that touch a link and the total force."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from roboyard.sensors.base import Observation, Sensor


class ContactSensor(Sensor):
    """Contacts of one link in the last step."""

    kind: ClassVar[str] = "Contact"
    modalities: ClassVar[tuple[str, ...]] = ("force", "touching", "positions")

    def observe(self) -> Observation:
        """Return the contact forces on the link.

        "force" (3,) their sum in the sensor's frame (N); "touching" (k, 2) int32 body id and link index of
        the other body of each contact; "positions" (k, 3) contact points in the world frame (m).
        """
        arrays = self.world.contact_arrays()
        me = (self.link.body.id, self.link.index)
        is_a = (arrays.owners[:, :2] == me).all(axis=1)
        is_b = (arrays.owners[:, 2:] == me).all(axis=1)
        on_b = np.einsum("ki,kij->kj", arrays.force, arrays.frame)
        total = on_b[is_b].sum(axis=0) - on_b[is_a].sum(axis=0)
        others = np.concatenate([arrays.owners[is_a, 2:], arrays.owners[is_b, :2]])
        return {
            "force": self.mount.in_world()[1].T @ total,
            "touching": others.astype(np.int32),
            "positions": np.concatenate([arrays.position[is_a], arrays.position[is_b]]),
        }

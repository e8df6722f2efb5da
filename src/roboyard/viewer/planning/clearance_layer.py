"""The planner's spheres at one posture, coloured by their links' distances, and the nearest pairs as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from roboyard.planning.checking import Clearance
from roboyard.transforms import Array

FAR = 0.10
"""Distance from which spheres are all green (m)."""
NEAR_RGB, FAR_RGB = np.array([220, 40, 30]), np.array([60, 170, 80])
OPACITY = 0.35


class ClearanceLayer:
    """One scene node with all spheres of the robot."""

    def __init__(self, scene: Any, name: str = "/plan/spheres") -> None:
        """Start without spheres; `scene` is viser's."""
        self._scene, self._name = scene, name
        self.node: Any = None

    def show(self, found: Clearance, root: Array) -> None:
        """Show spheres whose centres are given in the frame of the robot's root, at (4, 4) `root` (m)."""
        from roboyard.shapes import primitives

        self.clear()
        if not len(found.radii):
            return
        unit = primitives.sphere(1.0, 12)
        share = np.clip(found.gaps[found.of_link] / FAR, 0.0, 1.0)[:, None]
        self.node = self._scene.add_batched_meshes_simple(
            self._name,
            unit.vertices,
            unit.faces,
            np.tile([1.0, 0.0, 0.0, 0.0], (len(found.radii), 1)),
            found.centers @ root[:3, :3].T + root[:3, 3],
            batched_scales=np.maximum(found.radii, 1e-4),
            batched_colors=np.round(NEAR_RGB + share * (FAR_RGB - NEAR_RGB)).astype(np.uint8),
            opacity=OPACITY,
            cast_shadow=False,
            receive_shadow=False,
        )

    def clear(self) -> None:
        """Remove the spheres."""
        if self.node is not None:
            self.node.remove()
            self.node = None


def nearest_links(found: Clearance, count: int = 3) -> Sequence[tuple[str, float]]:
    """Return the links nearest to an obstacle, with their distances (m); those out of reach are omitted."""
    order = np.argsort(found.gaps)[:count]
    return [(found.links[k], float(found.gaps[k])) for k in order if found.gaps[k] < found.reach]

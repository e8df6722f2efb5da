"""A lidar: all rays of one revolution cast at once from one point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.sensors.base import Observation, Sensor
from roboyard.sensors.scan_pattern import ScanPattern
from roboyard.sensors.scan_rays import cast_scan
from roboyard.transforms import IDENTITY_QUATERNION, Array

if TYPE_CHECKING:
    from roboyard.sim import Link

SOLID_GROUPS = (0, 1, 3, 4)
"""MuJoCo geom groups of collision shapes."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Scan:
    """One revolution of a lidar."""

    ranges: Array
    """(rows, columns) distance along each ray (m); inf without a hit."""
    owners: np.ndarray
    """(rows, columns, 2) int32 body id and link index; -1 without a hit."""
    position: Array
    """(3,) position of the lidar in the world (m)."""
    rotation: Array
    """(3, 3) rotation of the lidar in the world."""
    pattern: ScanPattern
    """Directions and range of the rays."""

    @property
    def hit(self) -> np.ndarray:
        """(rows, columns) bool: whether the ray hit a shape in range."""
        return np.isfinite(self.ranges)

    def normalized(self) -> Array:
        """Return (rows, columns) ranges scaled to 0..1; rays without a hit give 1."""
        low, high = self.pattern.min_range, self.pattern.max_range
        return np.where(self.hit, (self.ranges - low) / (high - low), 1.0)

    def points(self, *, world: bool = True) -> Array:
        """Return the (k, 3) points that rays hit (m), in the world or the lidar's frame."""
        seen = self.hit
        local = self.pattern.directions[seen] * self.ranges[seen][:, None]
        return self.position + local @ self.rotation.T if world else local


class Lidar(Sensor):
    """A lidar that detects collision shapes; z of its frame is up, azimuth 0 is x."""

    kind: ClassVar[str] = "Lidar"
    modalities: ClassVar[tuple[str, ...]] = ("scan", "seg", "points")

    def __init__(
        self,
        link: Link,
        *,
        position: ArrayLike = (0, 0, 0),
        orientation: ArrayLike = IDENTITY_QUATERNION,
        pattern: ScanPattern | None = None,
        sees_itself: bool = False,
        rate: float | None = None,
    ) -> None:
        """Fix a lidar to a link.

        Args:
            link: the link that the sensor is fixed to.
            position: (3,) position in the link's frame (m).
            orientation: (4,) quaternion x, y, z, w in the link's frame.
            pattern: directions and range of the rays.
            sees_itself: whether rays hit its own robot (except the link that it is fixed to).
            rate: revolutions per second of simulated time (Hz); None: one at every call.
        """
        super().__init__(link, position=position, orientation=orientation, rate=rate)
        self.pattern = ScanPattern() if pattern is None else pattern
        self.sees_itself = sees_itself
        self._own: tuple[int, np.ndarray] = (-1, np.zeros(0, dtype=bool))

    def scan(self) -> Scan:
        """Cast all rays and return the scan."""
        world, pattern = self.world, self.pattern
        position, rotation = self.mount.in_world()
        geoms, distances = cast_scan(
            world.model, world.kinematics(), pattern, position, rotation, self._targets()
        )
        seen = (geoms >= 0) & (distances >= pattern.min_range) & (distances <= pattern.max_range)
        owners = np.full((*geoms.shape, 2), -1, dtype=np.int32)
        owners[seen] = world.geom_owners[geoms[seen]]
        return Scan(
            ranges=np.where(seen, distances, np.inf),
            owners=owners,
            position=position,
            rotation=rotation,
            pattern=pattern,
        )

    def observe(self) -> Observation:
        """Return one revolution.

        "scan" (rows, columns) m, inf without a hit; "seg" (rows, columns, 2) body id and link index, -1
        without a hit; "points" (k, 3) hit points in the world frame (m).
        """
        scan = self.scan()
        return {"scan": scan.ranges, "seg": scan.owners, "points": scan.points()}

    def _targets(self) -> np.ndarray:
        """Return (ngeom,) bool: whether rays can hit the geom."""
        world = self.world
        if self._own[0] != world.revision:
            body, model = self.link.body, world.model
            is_target = np.isin(model.geom_group, SOLID_GROUPS)
            is_target &= model.geom_bodyid != body.mujoco_ids[self.link.index]
            if not self.sees_itself:
                is_target &= world.geom_owners[:, 0] != body.id
            self._own = (world.revision, is_target)
        return self._own[1]

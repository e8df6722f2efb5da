"""A lidar: all rays of a turn cast at once from one point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike

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
    """One turn of a lidar."""

    ranges: Array
    """(rows, columns) m along each ray; inf where nothing was seen"""
    owners: np.ndarray
    """(rows, columns, 2) int32 body id and link index; -1 for nothing"""
    position: Array
    """(3,) m of the lidar in the world"""
    rotation: Array
    """(3, 3) of the lidar in the world"""
    pattern: ScanPattern

    @property
    def hit(self) -> np.ndarray:
        """(rows, columns) bool"""
        return np.isfinite(self.ranges)

    def normalized(self) -> Array:
        """(rows, columns) 0 at the nearest range, 1 at the farthest and for nothing."""
        low, high = self.pattern.min_range, self.pattern.max_range
        return np.where(self.hit, (self.ranges - low) / (high - low), 1.0)

    def points(self, *, world: bool = True) -> Array:
        """(k, 3) m: where the rays that hit something ended, in the world or in the lidar's frame."""
        seen = self.hit
        local = self.pattern.directions[seen] * self.ranges[seen][:, None]
        return self.position + local @ self.rotation.T if world else local


class Lidar(Sensor):
    """A lidar that sees collision shapes; z of its frame is up, azimuth 0 its x."""

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
        """Mount a lidar.

        Args:
            link: what it is fixed to.
            position: (3,) in the link's frame; m.
            orientation: (4,) x, y, z, w in the link's frame.
            pattern: which way its rays go and how far.
            sees_itself: whether the robot it is on (all but the link it is fixed to) is in its way.
            rate: turns a second; None: one whenever asked.
        """
        super().__init__(link, position=position, orientation=orientation, rate=rate)
        self.pattern = ScanPattern() if pattern is None else pattern
        self.sees_itself = sees_itself
        self._own: tuple[int, np.ndarray] = (-1, np.zeros(0, dtype=bool))

    def scan(self) -> Scan:
        """What it sees now."""
        world, pattern = self.world, self.pattern
        position, rotation = self.mount.in_world()
        geoms, distances = cast_scan(
            world.model, world.kinematics(), pattern, position, rotation, self._in_the_way()
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
        """One turn.

        "scan" (rows, columns) m, inf for nothing; "seg" (rows, columns, 2) body id and link index, -1 for
        nothing; "points" (k, 3) m in the world, of the rays that hit something.
        """
        scan = self.scan()
        return {"scan": scan.ranges, "seg": scan.owners, "points": scan.points()}

    def _in_the_way(self) -> np.ndarray:
        """(ngeom,) bool: what it does not look through."""
        world = self.world
        if self._own[0] != world.revision:
            body, model = self.link.body, world.model
            looked_at = np.isin(model.geom_group, SOLID_GROUPS)
            looked_at &= model.geom_bodyid != body.mujoco_ids[self.link.index]
            if not self.sees_itself:
                looked_at &= world.geom_owners[:, 0] != body.id
            self._own = (world.revision, looked_at)
        return self._own[1]

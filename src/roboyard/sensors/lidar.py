"""A lidar: all rays of a turn cast at once from one point."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from roboyard.errors import RoboyardError
from roboyard.poses import IDENTITY_QUATERNION, Array
from roboyard.sensors.base import Observation, Sensor

if TYPE_CHECKING:
    from roboyard.sim import Link

_OWN_GROUP = 5
"""MuJoCo geom group that the robot's own shapes are in while they are not to be seen."""


@dataclass(frozen=True, kw_only=True)
class LidarPattern:
    """Which way the rays go. Defaults are OmniGibson's for a lidar that is loaded."""

    horizontal_fov_deg: float = 360.0
    vertical_fov_deg: float = 1.0
    horizontal_resolution_deg: float = 1.0
    vertical_resolution_deg: float = 1.0
    yaw_offset_deg: float = 0.0
    min_range: float = 0.05
    """m; nearer things are not seen, nor what is behind them"""
    max_range: float = 10.0
    """m"""

    def __post_init__(self) -> None:
        values = [getattr(self, name) for name in self.__dataclass_fields__]
        ok = (
            np.isfinite(values).all()
            and 0 < self.horizontal_fov_deg <= 360
            and 0 < self.vertical_fov_deg <= 180
            and self.horizontal_resolution_deg > 0
            and self.vertical_resolution_deg > 0
            and 0 <= self.min_range < self.max_range
        )
        if not ok:
            raise RoboyardError(
                "a lidar sees 0 to 360 degrees across and 0 to 180 up and down, has resolutions above 0 and "
                f"0 <= min_range < max_range; got {self}"
            )
        if self.rows * self.columns > 4_000_000:
            raise RoboyardError(
                f"a scan of {self.rows} x {self.columns} rays is too large (4 million at most)"
            )

    @property
    def rows(self) -> int:
        """Rays one above the other."""
        return max(1, math.ceil(self.vertical_fov_deg / self.vertical_resolution_deg - 1e-9))

    @property
    def columns(self) -> int:
        """Rays side by side."""
        return max(1, math.ceil(self.horizontal_fov_deg / self.horizontal_resolution_deg - 1e-9))

    @cached_property
    def azimuths(self) -> Array:
        """(columns,) rad from the frame's x towards its y, growing; a full turn begins at -180 degrees."""
        step, n = self.horizontal_resolution_deg, self.columns
        k = np.arange(n)
        turn = self.horizontal_fov_deg == 360.0
        degrees = 360.0 * k / n - 180.0 if turn else (k - (n - 1) / 2.0) * step
        return np.radians(degrees + self.yaw_offset_deg)

    @cached_property
    def elevations(self) -> Array:
        """(rows,) rad above the frame's x-y plane, the highest first, as in a picture."""
        n = self.rows
        return np.radians(((n - 1) / 2.0 - np.arange(n)) * self.vertical_resolution_deg)

    @cached_property
    def directions(self) -> Array:
        """(rows, columns, 3) unit, in the lidar's frame."""
        up, side = self.elevations[:, None], self.azimuths[None, :]
        flat = np.cos(up)
        return np.stack(
            [
                flat * np.cos(side),
                flat * np.sin(side),
                np.broadcast_to(np.sin(up), (self.rows, self.columns)),
            ],
            axis=-1,
        )


IMPORTED_PATTERN = LidarPattern(
    vertical_fov_deg=30.0,
    horizontal_resolution_deg=0.4,
    vertical_resolution_deg=4.0,
    min_range=0.4,
    max_range=100.0,
)
"""What OmniGibson's importer writes into a robot's file."""


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
    pattern: LidarPattern

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
        pattern: LidarPattern | None = None,
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
        self.pattern = LidarPattern() if pattern is None else pattern
        self.sees_itself = sees_itself
        count = self.pattern.rows * self.pattern.columns
        self._geoms = np.empty(count, dtype=np.int32)
        self._distances = np.empty(count)
        self._own: tuple[int, np.ndarray] = (-1, np.zeros(0, dtype=int))

    def scan(self) -> Scan:
        """What it sees now."""
        import mujoco

        world, pattern = self.world, self.pattern
        data = world.kinematics()
        model = world.model
        position, rotation = self.mount.in_world()
        vectors = pattern.directions.reshape(-1, 3) @ rotation.T
        own = self._own_geoms()
        groups = model.geom_group[own].copy()
        model.geom_group[own] = _OWN_GROUP
        try:
            mujoco.mj_multiRay(
                model,
                data,
                position,
                vectors.ravel(),
                np.array([1, 1, 0, 1, 1, 0], dtype=np.uint8),
                True,
                int(self.link.body.mujoco_ids[self.link.index]),
                self._geoms,
                self._distances,
                None,
                len(vectors),
                pattern.max_range,
            )
        finally:
            model.geom_group[own] = groups
        seen = (
            (self._geoms >= 0)
            & (self._distances >= pattern.min_range)
            & (self._distances <= pattern.max_range)
        )
        owners = np.full((len(vectors), 2), -1, dtype=np.int32)
        owners[seen] = world.geom_owners[self._geoms[seen]]
        shape = (pattern.rows, pattern.columns)
        return Scan(
            ranges=np.where(seen, self._distances, np.inf).reshape(shape),
            owners=owners.reshape(*shape, 2),
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

    def _own_geoms(self) -> np.ndarray:
        """Geoms that it looks through."""
        world = self.world
        if self._own[0] != world.revision:
            body = self.link.body
            rows = np.zeros(0, dtype=int)
            if not self.sees_itself:
                rows = np.flatnonzero(world.geom_owners[:, 0] == body.id)
            self._own = (world.revision, rows)
        return self._own[1]

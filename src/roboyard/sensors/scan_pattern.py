"""Directions and range of a lidar's rays."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True)
class ScanPattern:
    """Directions and range of the rays. Defaults are OmniGibson's for a lidar loaded from a file."""

    horizontal_fov_deg: float = 360.0
    vertical_fov_deg: float = 1.0
    horizontal_resolution_deg: float = 1.0
    vertical_resolution_deg: float = 1.0
    yaw_offset_deg: float = 0.0
    min_range: float = 0.05
    """Smallest range (m); a nearer surface gives no hit and hides those behind it."""
    max_range: float = 10.0
    """Largest range (m)."""

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
                "horizontal_fov_deg must be in (0, 360], vertical_fov_deg in (0, 180], resolutions above 0 "
                f"and 0 <= min_range < max_range; got {self}"
            )
        if self.rows * self.columns > 4_000_000:
            raise RoboyardError(
                f"a scan of {self.rows} x {self.columns} rays is too large (at most 4 million); "
                "use coarser resolutions"
            )

    @property
    def rows(self) -> int:
        """Number of rays one above the other."""
        return max(1, math.ceil(self.vertical_fov_deg / self.vertical_resolution_deg - 1e-9))

    @property
    def columns(self) -> int:
        """Number of rays side by side."""
        return max(1, math.ceil(self.horizontal_fov_deg / self.horizontal_resolution_deg - 1e-9))

    @property
    def is_full_turn(self) -> bool:
        """Whether the rays cover 360 degrees."""
        return self.horizontal_fov_deg == 360.0

    @cached_property
    def azimuths(self) -> Array:
        """(columns,) azimuth (rad) from the frame's x towards its y, ascending.

        A full turn starts at -180 degrees.
        """
        step, n = self.horizontal_resolution_deg, self.columns
        k = np.arange(n)
        degrees = 360.0 * k / n - 180.0 if self.is_full_turn else (k - (n - 1) / 2.0) * step
        return np.radians(degrees + self.yaw_offset_deg)

    @cached_property
    def elevations(self) -> Array:
        """(rows,) elevation (rad) above the frame's x-y plane, highest first, as in an image."""
        n = self.rows
        return np.radians(((n - 1) / 2.0 - np.arange(n)) * self.vertical_resolution_deg)

    @property
    def grid(self) -> tuple[float, float, float, float]:
        """First azimuth, step to the next, highest elevation, step down to the next (rad)."""
        across = 360.0 / self.columns if self.is_full_turn else self.horizontal_resolution_deg
        first, highest = float(self.azimuths[0]), float(self.elevations[0])
        return first, math.radians(across), highest, math.radians(self.vertical_resolution_deg)

    @cached_property
    def directions(self) -> Array:
        """(rows, columns, 3) unit vectors in the lidar's frame."""
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


IMPORTED_PATTERN = ScanPattern(
    vertical_fov_deg=30.0,
    horizontal_resolution_deg=0.4,
    vertical_resolution_deg=4.0,
    min_range=0.4,
    max_range=100.0,
)
"""The pattern that OmniGibson's importer writes into a robot's file."""

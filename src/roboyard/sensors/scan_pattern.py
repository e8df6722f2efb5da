"""Which way the rays of a lidar go."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True)
class ScanPattern:
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

    @property
    def is_full_turn(self) -> bool:
        return self.horizontal_fov_deg == 360.0

    @cached_property
    def azimuths(self) -> Array:
        """(columns,) rad from the frame's x towards its y, growing; a full turn begins at -180 degrees."""
        step, n = self.horizontal_resolution_deg, self.columns
        k = np.arange(n)
        degrees = 360.0 * k / n - 180.0 if self.is_full_turn else (k - (n - 1) / 2.0) * step
        return np.radians(degrees + self.yaw_offset_deg)

    @cached_property
    def elevations(self) -> Array:
        """(rows,) rad above the frame's x-y plane, the highest first, as in a picture."""
        n = self.rows
        return np.radians(((n - 1) / 2.0 - np.arange(n)) * self.vertical_resolution_deg)

    @property
    def grid(self) -> tuple[float, float, float, float]:
        """First azimuth, step to the next, highest elevation, step down to the next; rad."""
        across = 360.0 / self.columns if self.is_full_turn else self.horizontal_resolution_deg
        first, highest = float(self.azimuths[0]), float(self.elevations[0])
        return first, math.radians(across), highest, math.radians(self.vertical_resolution_deg)

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


IMPORTED_PATTERN = ScanPattern(
    vertical_fov_deg=30.0,
    horizontal_resolution_deg=0.4,
    vertical_resolution_deg=4.0,
    min_range=0.4,
    max_range=100.0,
)
"""What OmniGibson's importer writes into a robot's file."""

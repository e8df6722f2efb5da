"""Read planning spheres from a planner's YAML (cuRobo's robot configuration)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard.errors import ConfigError
from roboyard.untrusted.yaml_reading import read_yaml


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Spheres:
    """The spheres of one link."""

    centers: NDArray[np.float64]
    """(k, 3) in the link frame (m)."""
    radii: NDArray[np.float64]
    """(k,) (m)."""


def read_spheres(file: Path) -> dict[str, Spheres]:
    """Read link name to spheres, from `collision_spheres` under `robot_cfg` or `robot_cfg.kinematics`.

    Spheres of radius zero, which planners reserve for a grasped object, are skipped.

    Raises:
        ConfigError: the file cannot be read, has no spheres, or a sphere is not a center and a radius.
    """
    try:
        data = read_yaml(file, 64 << 20)
    except (OSError, ValueError) as error:
        raise ConfigError(f"{file.name}: cannot be read: {' '.join(str(error).split())}") from error
    found = _find(data)
    if not isinstance(found, Mapping):
        raise ConfigError(
            f"{file.name}: has no collision_spheres by link under robot_cfg; name a planner file"
        )
    out: dict[str, Spheres] = {}
    for link, spheres in found.items():
        rows = [
            _row(file, str(link), sphere) for sphere in (spheres if isinstance(spheres, list) else [spheres])
        ]
        kept = np.array([row for row in rows if row[3] > 0], dtype=float).reshape(-1, 4)
        if len(kept):
            out[str(link)] = Spheres(centers=kept[:, :3], radii=kept[:, 3])
    return out


def _find(data: Any) -> Any:
    place = data
    for key in ("robot_cfg", "kinematics"):
        if isinstance(place, Mapping) and "collision_spheres" in place:
            break
        if isinstance(place, Mapping) and key in place:
            place = place[key]
    return place.get("collision_spheres") if isinstance(place, Mapping) else None


def _row(file: Path, link: str, sphere: Any) -> tuple[float, float, float, float]:
    try:
        x, y, z = (float(v) for v in sphere["center"])
        radius = float(sphere["radius"])
    except (KeyError, TypeError, ValueError) as error:
        raise ConfigError(
            f"{file.name}: collision_spheres of {link!r}: each has a center of three numbers and a radius; "
            f"got {sphere!r}"
        ) from error
    if not np.isfinite([x, y, z, radius]).all():
        raise ConfigError(f"{file.name}: collision_spheres of {link!r}: {sphere!r} is not finite")
    return x, y, z, radius

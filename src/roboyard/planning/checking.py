"""Collision checks of one configuration and of thousands, with distance, gradient and the pair concerned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roboyard._arrays import ArrayLike, NDArray
from roboyard._lazy import lazy_module
from roboyard.planning.kernels.arrays import work_for
from roboyard.planning.obstacles import Obstacles
from roboyard.planning.spheres.sphere_model import SphereRobot
from roboyard.transforms import Array

_checker = lazy_module("roboyard.planning.kernels.checker")


@dataclass(frozen=True, kw_only=True, slots=True)
class Nearest:
    """The two surfaces nearest to each other at one configuration."""

    distance: float
    """Signed distance of the padded spheres (m); negative for overlap."""
    link: str
    """Link of the robot."""
    other: str
    """Obstacle or other link; "" where nothing is within reach."""
    gradient: Array
    """(n,) derivative of the distance by the joint positions (m/rad or 1)."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Clearance:
    """All spheres at one configuration, and the distance of each link from the obstacles."""

    links: tuple[str, ...]
    """(l) links with spheres."""
    gaps: Array
    """(l,) signed distance of each link's padded spheres from obstacles (m), at most `reach`.

    It is `reach` for links that no joint moves.
    """
    reach: float
    """m"""
    centers: Array
    """(s, 3) centres of the spheres in the frame of the root link (m)."""
    radii: Array
    """(s,) radii with padding (m)."""
    of_link: NDArray[np.int64]
    """(s,) entry of `links` that each sphere belongs to."""


class CollisionChecker:
    """Checks configurations of a group of joints against obstacles and the robot itself."""

    def __init__(self, robot: SphereRobot, obstacles: Obstacles | None = None) -> None:
        """Create a checker; obstacles that `Obstacles.move` moves are seen at once."""
        self.robot = robot
        self.obstacles = Obstacles() if obstacles is None else obstacles
        self.work = work_for(robot.arrays, self.obstacles.arrays)

    def free(self, q: ArrayLike, margin: float = 0.0) -> NDArray[np.bool_]:
        """Return whether configurations touch nothing; links that no joint moves are not checked.

        Args:
            q: (..., n) joint positions (rad or m), in the order of `robot.joint_names`.
            margin: additional padding of all spheres (m).

        Returns:
            (...) booleans.

        Raises:
            ValueError: q does not have n entries.
        """
        values = self._rows(q)
        out = np.empty(len(values), dtype=np.bool_)
        robot, world = self.robot.arrays, self.obstacles.arrays
        _checker().free_batch(robot, world, values, float(margin), self.work, out.view(np.uint8))
        return out.reshape(np.shape(q)[:-1])

    def distance(self, q: ArrayLike, reach: float = 1.0) -> tuple[Array, Array]:
        """Return signed distances of the nearest surfaces, and their derivatives.

        Args:
            q: (..., n) joint positions (rad or m).
            reach: distances above it (m) are given as it, with derivative zero.

        Returns:
            (...) distances (m), negative for overlap; (..., n) derivatives by q (m/rad or 1).

        Raises:
            ValueError: q does not have n entries.
        """
        out, slopes, _ = self._nearest(q, reach)
        shape = np.shape(q)
        return out.reshape(shape[:-1]), slopes.reshape(shape)

    def nearest(self, q: ArrayLike, reach: float = 1.0) -> Nearest:
        """Return the nearest two surfaces at (n,) q (rad or m) within `reach` (m).

        Raises:
            ValueError: q does not have n entries.
        """
        out, slopes, found = self._nearest(q, reach)
        sphere, other, hit = (int(value) for value in found[0])
        if not hit:
            return Nearest(distance=float(out[0]), link="", other="", gradient=slopes[0])
        name = self.obstacles.name(other) if other >= 0 else self.robot.sphere_link(-1 - other)
        link = self.robot.sphere_link(sphere)
        return Nearest(distance=float(out[0]), link=link, other=name, gradient=slopes[0])

    def clearance(self, q: ArrayLike, reach: float = 1.0) -> Clearance:
        """Return all spheres at (n,) q (rad or m) and the distance of each link, at most `reach` (m).

        Raises:
            ValueError: q does not have n entries.
        """
        robot, world = self.robot.arrays, self.obstacles.arrays
        gaps, pairs = np.empty(len(robot.node)), np.empty(len(robot.pairs))
        values = self._rows(q)[0]
        _checker().all_gaps(robot, world, values, 0.0, float(reach), self.work, gaps, pairs)
        gaps[robot.node < 0] = reach
        of_link = np.repeat(np.arange(len(robot.node)), np.diff(robot.start))
        return Clearance(
            links=self.robot.links,
            gaps=gaps,
            reach=float(reach),
            centers=self.work.placed.copy(),
            radii=robot.spheres[:, 3] + robot.pad[of_link],
            of_link=of_link,
        )

    def blocking(self, start: ArrayLike, goals: ArrayLike, most: int = 4) -> list[str]:
        """Return the obstacles on the straight ways from start (n,) to goals (g, n), most touched first."""
        counts: dict[str, int] = {}
        for goal in np.atleast_2d(goals)[:4]:
            line = np.asarray(start) + np.linspace(0, 1, 60)[:, None] * (goal - np.asarray(start))
            for q in line[~self.free(line)]:
                found = self.nearest(q)
                if found.other and found.other not in self.robot.links:
                    counts[found.other] = counts.get(found.other, 0) + 1
        return sorted(counts, key=lambda name: -counts[name])[:most]

    def _nearest(self, q: ArrayLike, reach: float) -> tuple[Array, Array, NDArray[np.int64]]:
        values = self._rows(q)
        out, slopes = np.empty(len(values)), np.empty(values.shape)
        found = np.empty((len(values), 3), dtype=np.int64)
        robot, world = self.robot.arrays, self.obstacles.arrays
        _checker().nearest_batch(robot, world, values, float(reach), self.work, out, slopes, found)
        return out, slopes, found

    def _rows(self, q: ArrayLike) -> Array:
        values = np.ascontiguousarray(q, dtype=float)
        n = self.robot.chain.size
        if values.ndim == 0 or values.shape[-1] != n:
            raise ValueError(f"q has shape {values.shape}; the robot's joints are {self.robot.joint_names}")
        return values.reshape(-1, n)

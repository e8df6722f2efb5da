"""Decisions by exact shapes where spheres leave it open."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.description.model import Mesh
from roboyard.planning.checking import CollisionChecker
from roboyard.planning.distance_fields import DistanceField
from roboyard.planning.hull_judge import Clash, HullJudge, is_judged, judge_of
from roboyard.planning.kernels.arrays import RobotArrays
from roboyard.planning.obstacles import Obstacles
from roboyard.planning.spheres.sphere_model import SphereRobot
from roboyard.planning.trajectory import Trajectory
from roboyard.transforms import Array

_checker = lazy_module("roboyard.planning.kernels.checker")

JUDGED_STEP = 0.01
"""Distance between configurations that are checked (rad)."""


class ExactChecker:
    """Checks a group of joints by spheres, and by exact shapes where those overlap or do not suffice.

    All vectors are in depth-first order of joints.
    """

    def __init__(self, robot: SphereRobot, obstacles: Obstacles, judge: HullJudge | None = None) -> None:
        """Create a checker.

        Args:
            robot: the group's arrays.
            obstacles: the surroundings.
            judge: exact shapes; by default those of the description and the obstacles.
        """
        self.robot, self.obstacles = robot, obstacles
        self._judge = judge
        self._judge_is_ours = judge is None
        self._judged_moves = 0

    @property
    def judge(self) -> HullJudge:
        """Exact shapes in MuJoCo, made at the first use and again where obstacles were moved."""
        moved = self._judge_is_ours and self._judged_moves != self.obstacles.moves
        if self._judge is None or moved:
            self._judge = judge_of(self.robot, self.obstacles.items)
            self._judged_moves = self.obstacles.moves
        return self._judge

    def use_judge(self, judge: HullJudge) -> None:
        """Judge by other exact shapes than those of the description and the obstacles."""
        self._judge, self._judge_is_ours = judge, False

    @property
    def covers(self) -> bool:
        """Whether spheres contain the exact shapes: what is free of spheres is free, but for rough pairs."""
        return bool(self.robot.model.gaps) and not self.robot.model.is_loose

    @property
    def spheres_suffice(self) -> bool:
        """Whether what is free of spheres is free."""
        return self.covers and not self.robot.rough

    def clash(self, q: Array) -> str:
        """Return the overlap at q, (n,) joint positions (rad or m), as text; "" for none.

        Exact shapes decide where spheres overlap.
        """
        arrays, world = self.robot.arrays, self.obstacles.arrays
        free = np.empty(1, dtype=np.uint8)
        checker = CollisionChecker(self.robot, self.obstacles)
        _checker().free_batch(arrays, world, q[None].copy(), 0.0, checker.work, free)
        if free[0] and self.spheres_suffice:
            return ""
        found = self.judge.clashes(q)
        if not found:
            return self._unjudged_clash(q)
        worst = max(found, key=lambda clash: clash.depth)
        kind = "link" if worst.is_self else "obstacle"
        return f'link "{worst.link}" overlaps {kind} "{worst.other}" by {1e3 * worst.depth:.1f} mm'

    @cached_property
    def _unknown(self) -> tuple[int, ...]:
        """Rows of the obstacles that the judge does not know."""
        items = self.obstacles.items if self._judge_is_ours else ()
        fields = [(k, o) for k, o in enumerate(items) if isinstance(o.shape, Mesh | DistanceField)]
        return tuple(k for k, o in fields if not is_judged(o))

    @property
    def _unjudged(self) -> CollisionChecker | None:
        """The robot without its pairs among the obstacles that the judge does not know; None without any."""
        if not self._unknown:
            return None
        robot = self.robot.arrays
        none = {"pairs": robot.pairs[:0], "pair_pad": robot.pair_pad[:0], "pair_reach": robot.pair_reach[:0]}
        unknown = Obstacles([self.obstacles.items[k] for k in self._unknown], self.obstacles.root)
        return CollisionChecker(replace(self.robot, arrays=robot._replace(**none)), unknown)

    def _unjudged_clash(self, q: Array) -> str:
        checker = self._unjudged
        if checker is None or checker.free(q):
            return ""
        nearest = checker.nearest(q)
        depth = -1e3 * nearest.distance
        return f'link "{nearest.link}" overlaps obstacle "{nearest.other}" by {depth:.1f} mm, as spheres'

    def first_clash(
        self, trajectory: Trajectory, arrays: RobotArrays | None
    ) -> tuple[int, list[Clash]] | None:
        """Return the first configuration that exact shapes refuse; those free of spheres need no look.

        `arrays` are those with whose paddings the trajectory is free, None for none.
        """
        dense = trajectory.dense(JUDGED_STEP)
        unjudged = self._unjudged
        if unjudged is not None and not (free := unjudged.free(dense)).all():
            k = int(np.argmin(free))
            nearest = unjudged.nearest(dense[k])
            clash = Clash(link=nearest.link, other=nearest.other, depth=-nearest.distance, is_self=False)
            return k, [clash]
        if not self.covers:
            return self.judge.first_clash(dense)
        free = self._with_smaller_paddings(arrays).free(dense)
        return self.judge.first_clash(dense[~free]) or self.judge.first_pair_clash(dense[free])

    def _with_smaller_paddings(self, arrays: RobotArrays | None) -> CollisionChecker:
        """Return a checker of those links and pairs only whose paddings are smaller in `arrays`."""
        whole = self.robot.arrays
        if arrays is None:
            return CollisionChecker(self.robot, self.obstacles)
        pairs = arrays.pair_pad < whole.pair_pad
        links = arrays.pad < whole.pad
        links[whole.pairs[pairs]] = True
        reduced = whole._replace(
            node=np.where(links, whole.node, -1),  # links that do not move are not checked
            pairs=whole.pairs[pairs],
            pair_pad=whole.pair_pad[pairs],
            pair_reach=whole.pair_reach[pairs],
        )
        return CollisionChecker(replace(self.robot, arrays=reduced), self.obstacles)

"""Shorter paths: straight motions between points of a path, and way points pulled onto their chords."""

from __future__ import annotations

import math

from roboyard.kinematics._lm import next_random
from roboyard.planning.kernels.arrays import ROBOT, WORK, WORLD, kernel
from roboyard.planning.kernels.checker import is_free
from roboyard.planning.kernels.motion import SWEEP, motion_free


def apart(a, b):
    """Distance between two configurations."""
    total = 0.0
    for j in range(a.shape[0]):
        total += (a[j] - b[j]) ** 2
    return math.sqrt(total)


def path_length(path, count):
    """Length of a path of `count` way points (rad)."""
    total = 0.0
    for i in range(count - 1):
        total += apart(path[i], path[i + 1])
    return total


@kernel(ROBOT, WORLD, "f8[:,::1] i8 f8", WORK, SWEEP, "-> i8")
def prune(robot, world, path, count, margin, work, sweep):
    """Connect each way point to the last one that a straight motion reaches; return the number left."""
    kept, i = 1, 0
    while i < count - 1:
        k = count - 1
        while k > i + 1 and not motion_free(robot, world, path[i], path[k], margin, work, sweep):
            k -= 1
        for j in range(path.shape[1]):
            path[kept, j] = path[k, j]
        kept += 1
        i = k
        # way points before i are no longer needed; path[kept - 1] equals path[i]
    return kept


def point_at(path, count, s, out):
    """Write the point at length s to out (n,); return the index of its segment."""
    for i in range(count - 1):
        d = apart(path[i], path[i + 1])
        if s <= d or i == count - 2:
            share = min(max(s / d, 0.0), 1.0) if d > 0.0 else 0.0
            for j in range(out.shape[0]):
                out[j] = path[i, j] + share * (path[i + 1, j] - path[i, j])
            return i
        s -= d
    return count - 2


@kernel(ROBOT, WORLD, "f8[:,::1] i8 i8 f8 u8[::1] f8[:,::1]", WORK, SWEEP, "-> i8")
def cut(robot, world, path, count, rounds, margin, random, points, work, sweep):
    """Random shortcuts (Geraerts and Overmars, 2007); return the number of way points.

    Args:
        robot: the robot.
        world: obstacles.
        path: (k, n) way points, changed in place.
        count: number of way points.
        rounds: attempts.
        margin: additional padding (m).
        random: state of the random numbers.
        points: (2, n) work space.
        work: work space.
        sweep: work space.
    """
    total = path_length(path, count)
    failed = 0
    for _ in range(rounds):
        if count < 3 or failed > 30:
            break
        failed += 1
        s, t = next_random(random) * total, next_random(random) * total
        if t < s:
            s, t = t, s
        i = point_at(path, count, s, points[0])
        k = point_at(path, count, t, points[1])
        if k <= i or count + 2 - (k - i) > path.shape[0]:
            continue
        old = apart(points[0], path[i + 1]) + apart(path[k], points[1])
        for m in range(i + 1, k):
            old += apart(path[m], path[m + 1])
        gain = old - apart(points[0], points[1])
        if gain < 1e-3 * total:
            continue
        if not motion_free(robot, world, points[0], points[1], margin, work, sweep):
            continue
        if not (
            is_free(robot, world, points[0], margin, work) and is_free(robot, world, points[1], margin, work)
        ):
            continue
        shift = i + 3 - (k + 1)  # way points i+1..k are replaced by two
        if shift > 0:
            for m in range(count - 1, k, -1):
                for j in range(path.shape[1]):
                    path[m + shift, j] = path[m, j]
        elif shift < 0:
            for m in range(k + 1, count):
                for j in range(path.shape[1]):
                    path[m + shift, j] = path[m, j]
        count += shift
        for j in range(path.shape[1]):
            path[i + 1, j], path[i + 2, j] = points[0, j], points[1, j]
        total -= gain
        failed = 0
    return count


@kernel(ROBOT, WORLD, "f8[:,::1] i8 i8 f8 f8[:,::1]", WORK, SWEEP, "-> i8")
def pull(robot, world, path, count, rounds, margin, points, work, sweep):
    """Move each way point towards the chord of its neighbours while that is free; return the number left."""
    new = points[0]
    for _ in range(rounds):
        gained = 0.0
        i = 1
        while i < count - 1:
            a, b = apart(path[i - 1], path[i]), apart(path[i], path[i + 1])
            whole = apart(path[i - 1], path[i + 1])
            if (
                a < 1e-6
                or b < 1e-6
                or (
                    a + b - whole < 1e-7
                    or motion_free(robot, world, path[i - 1], path[i + 1], margin, work, sweep)
                )
            ):
                for m in range(i, count - 1):
                    for j in range(path.shape[1]):
                        path[m, j] = path[m + 1, j]
                count -= 1
                gained += a + b - whole
                continue
            share = a / (a + b)
            pace = 0.5
            for _ in range(4):
                for j in range(path.shape[1]):
                    chord = path[i - 1, j] + share * (path[i + 1, j] - path[i - 1, j])
                    new[j] = path[i, j] + pace * (chord - path[i, j])
                gain = a + b - apart(path[i - 1], new) - apart(new, path[i + 1])
                if gain < 1e-5:
                    break
                if (
                    is_free(robot, world, new, margin, work)
                    and motion_free(robot, world, path[i - 1], new, margin, work, sweep)
                    and motion_free(robot, world, new, path[i + 1], margin, work, sweep)
                ):
                    for j in range(path.shape[1]):
                        path[i, j] = new[j]
                    gained += gain
                    break
                pace *= 0.4
            i += 1
        if gained < 1e-3:
            break
    return count

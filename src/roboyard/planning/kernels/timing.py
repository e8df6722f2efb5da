"""Jerk-limited timing of a polygon of way points: overlapping rest-to-rest motions, exact in every limit.

Each straight segment d is a motion q += d σ(t) with σ from 0 to 1 and a piecewise constant third derivative.
The next segment starts before the one before it has ended: their sum leaves the polygon at the corner, inside
the hull of the way points. Sums of such motions are piecewise cubic, so that velocity, acceleration and jerk
are checked at knots and extrema, without sampling.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from roboyard.native import record
from roboyard.planning.kernels.arrays import ROBOT, WORK, WORLD, Array, kernel
from roboyard.planning.kernels.motion import SWEEP, motion_free

PHASES = 7
STARTS, REFINEMENTS = 24, 6
LONGEST_STEP = 0.01
"""Time between points of a corner that are checked for collisions (s)."""


class Segments(NamedTuple):
    """The segments of a path of up to k way points, and their timing."""

    limits: Array
    """(3, n) limits of velocity, acceleration and jerk."""
    shares: Array
    """(k,) how far each start may move from the end to the start of the segment before it, 0 to 1."""
    steps: Array
    """(k, n) segments."""
    phases: Array
    """(k, 7) durations of the phases of their unit motions (s)."""
    jerks: Array
    """(k,) third derivatives of their unit motions (1/s³)."""
    begin: Array
    """(k,) start times (s)."""
    knots: Array
    """(8 k + 2,) times, work space."""
    rows: Array
    """(4, n) work space."""


SEGMENTS = record(Segments, "f8[:,::1] f8[::1] f8[:,::1] f8[:,::1] f8[::1] f8[::1] f8[::1] f8[:,::1]")


def segments_for(count: int, limits: Array, shares: Array) -> Segments:
    """Return space for `count` way points, (3, n) limits and (count,) shares as in `Segments`."""
    n = limits.shape[1]
    return Segments(
        limits=np.ascontiguousarray(limits),
        shares=shares,
        steps=np.zeros((count, n)),
        phases=np.zeros((count, 7)),
        jerks=np.zeros(count),
        begin=np.zeros(count),
        knots=np.zeros(8 * count + 2),
        rows=np.zeros((4, n)),
    )


def rest_to_rest(velocity, acceleration, jerk, out):
    """Durations of the 7 phases of the fastest unit motion between rests: out (7,) (s)."""
    if velocity * jerk >= acceleration * acceleration:
        rise = acceleration / jerk
        hold = velocity / acceleration - rise
    else:
        rise, hold = math.sqrt(velocity / jerk), 0.0
    cruise = 1.0 / velocity - (2.0 * rise + hold)
    if cruise < 0.0:
        cruise = 0.0
        square = acceleration * acceleration / jerk
        peak = 0.5 * (math.sqrt(square * square + 4.0 * acceleration) - square)
        rise = acceleration / jerk
        hold = peak / acceleration - rise
        if hold < 0.0:
            rise, hold = (0.5 / jerk) ** (1.0 / 3.0), 0.0
    out[0], out[1], out[2], out[3] = rise, hold, rise, cruise
    out[4], out[5], out[6] = rise, hold, rise


def unit_motion(phase, jerk, t):
    """σ and its first two derivatives at time t of a unit motion with phases (7,)."""
    if t <= 0.0:
        return 0.0, 0.0, 0.0
    s, v, a = 0.0, 0.0, 0.0
    for k in range(PHASES):
        j = jerk * phase_sign(k)
        dt = min(t, phase[k])
        s += dt * (v + dt * (0.5 * a + dt * j / 6.0))
        v += dt * (a + 0.5 * dt * j)
        a += dt * j
        t -= dt
        if t <= 0.0:
            return s, v, a
    return 1.0, 0.0, 0.0


def phase_sign(k):
    """Sign of the third derivative in phase k."""
    if k == 0 or k == 6:
        return 1.0
    if k == 2 or k == 4:
        return -1.0
    return 0.0


def unit_jerk(phase, jerk, t):
    """Third derivative of a unit motion just after time t."""
    if t < 0.0:
        return 0.0
    for k in range(PHASES):
        if t < phase[k]:
            return jerk * phase_sign(k)
        t -= phase[k]
    return 0.0


def sum_at(segments, first, last, t, q, v, a):
    """Add segments first..last - 1 at time t to q, v, a (n,)."""
    for i in range(first, last):
        s, ds, dds = unit_motion(segments.phases[i], segments.jerks[i], t - segments.begin[i])
        for j in range(q.shape[0]):
            q[j] += segments.steps[i, j] * s
            v[j] += segments.steps[i, j] * ds
            a[j] += segments.steps[i, j] * dds


def knots_between(segments, first, last, low, high):
    """Write the sorted times of phase changes from low to high to `knots`; return the number."""
    out = segments.knots
    count = 2
    out[0], out[1] = low, high
    for i in range(first, last):
        t = segments.begin[i]
        for k in range(PHASES + 1):
            if low < t < high and count < out.shape[0]:
                out[count] = t
                count += 1
            if k < PHASES:
                t += segments.phases[i, k]
    for i in range(1, count):  # few, and almost sorted
        value = out[i]
        k = i - 1
        while k >= 0 and out[k] > value:
            out[k + 1] = out[k]
            k -= 1
        out[k + 1] = value
    return count


def within_limits(segments, first, last, low, high):
    """Whether the sum of segments first..last - 1 keeps the limits from time low to high."""
    limits, rows, knots = segments.limits, segments.rows, segments.knots
    n = limits.shape[1]
    count = knots_between(segments, first, last, low, high)
    for k in range(count - 1):
        t, dt = knots[k], knots[k + 1] - knots[k]
        if dt <= 1e-12:
            continue
        for j in range(n):
            rows[0, j], rows[1, j], rows[2, j] = 0.0, 0.0, 0.0
        sum_at(segments, first, last, t, rows[0], rows[1], rows[2])
        for j in range(n):
            third = 0.0
            for i in range(first, last):
                time = t + 0.5 * dt - segments.begin[i]
                third += segments.steps[i, j] * unit_jerk(segments.phases[i], segments.jerks[i], time)
            v, a = rows[1, j], rows[2, j]
            end = a + third * dt
            top = 1.0 + 1e-9
            if abs(third) > limits[2, j] * top or max(abs(a), abs(end)) > limits[1, j] * top:
                return False
            if abs(v) > limits[0, j] * top or abs(v + dt * (a + 0.5 * dt * third)) > limits[0, j] * top:
                return False
            if a * end < 0.0 and abs(v - 0.5 * a * a / third) > limits[0, j] * top:
                return False
    return True


def corner_free(robot, world, path, segments, first, last, low, high, margin, work, sweep):
    """Whether the sum of segments first..last - 1 is free from time low to high."""
    rows = segments.rows
    n = path.shape[1]
    pieces = max(1, math.ceil((high - low) / LONGEST_STEP))
    dt = (high - low) / pieces
    bulge = 0.0
    for l in range(robot.reach.shape[0]):
        bound = 0.0
        for j in range(n):
            bound += robot.reach[l, j] * segments.limits[1, j]
        bulge = max(bulge, bound)
    margin = margin + bulge * dt * dt / 8.0  # of the curve between two points
    for k in range(pieces + 1):
        row = rows[k % 2]
        for j in range(n):
            row[j] = path[first, j]
            rows[2, j], rows[3, j] = 0.0, 0.0
        sum_at(segments, first, last, low + k * dt, row, rows[2], rows[3])
        if k > 0 and not motion_free(robot, world, rows[(k - 1) % 2], row, margin, work, sweep):
            return False
    return True


def total(values):
    """Sum of values (k,)."""
    out = 0.0
    for value in values:
        out += value
    return out


def may_start(robot, world, path, segments, first, i, done, margin, work, sweep):
    """Whether segment i may start at its time in `begin`, while segments from `first` on may still move.

    It is checked until they all have ended: where segment i ends sooner, they move on beside the polygon.
    """
    begin = segments.begin
    if done <= begin[i]:
        return True
    while first < i - 1 and begin[first] + total(segments.phases[first]) <= begin[i]:
        first += 1
    return within_limits(segments, first, i + 1, begin[i], done) and corner_free(
        robot, world, path, segments, first, i + 1, begin[i], done, margin, work, sweep
    )


@kernel(ROBOT, WORLD, "f8[:,::1]", SEGMENTS, "f8", WORK, SWEEP, "-> f8")
def time_path(robot, world, path, segments, margin, work, sweep):
    """Start each segment of a path as early as limits and obstacles allow; return the duration (s).

    Args:
        robot: the robot.
        world: obstacles.
        path: (k, n) way points, at least 2, no two in a row equal.
        segments: limits and shares in, all others out.
        margin: additional padding at corners (m).
        work: work space.
        sweep: work space.
    """
    begin, phases, steps = segments.begin, segments.phases, segments.steps
    done, first = 0.0, 0
    for i in range(path.shape[0] - 1):
        velocity, acceleration, jerk = 1e300, 1e300, 1e300
        for j in range(path.shape[1]):
            steps[i, j] = path[i + 1, j] - path[i, j]
            size = abs(steps[i, j])
            if size > 1e-12:
                velocity = min(velocity, segments.limits[0, j] / size)
                acceleration = min(acceleration, segments.limits[1, j] / size)
                jerk = min(jerk, segments.limits[2, j] / size)
        rest_to_rest(velocity, acceleration, jerk, phases[i])
        segments.jerks[i] = jerk
        begin[i] = done
        if i > 0 and segments.shares[i] > 0.0:
            while first < i - 1 and begin[first] + total(phases[first]) <= begin[i - 1]:
                first += 1
            early, late = done - segments.shares[i] * (done - begin[i - 1]), done
            low, high = early, late
            for k in range(STARTS):
                begin[i] = early + (late - early) * k / STARTS
                if may_start(robot, world, path, segments, first, i, done, margin, work, sweep):
                    high = begin[i]
                    break
                low = begin[i]
            for _ in range(REFINEMENTS):
                if high - low < 1e-4 or high == early:
                    break
                begin[i] = 0.5 * (low + high)
                if may_start(robot, world, path, segments, first, i, done, margin, work, sweep):
                    high = begin[i]
                else:
                    low = begin[i]
            begin[i] = high
        done = max(done, begin[i] + total(phases[i]))
    return done


@kernel("f8[:,::1]", SEGMENTS, "f8 f8[:,:,::1] -> i8")
def integrate(path, segments, done, out):
    """Write position, velocity, acceleration and jerk at all knots to out (4, k, n); return the number."""
    n, count = path.shape[1], path.shape[0]
    knots = segments.knots
    number = knots_between(segments, 0, count - 1, 0.0, done)
    for k in range(number):
        for j in range(n):
            out[0, k, j] = path[0, j]
            out[1, k, j], out[2, k, j], out[3, k, j] = 0.0, 0.0, 0.0
        sum_at(segments, 0, count - 1, knots[k], out[0, k], out[1, k], out[2, k])
        if k + 1 < number:
            middle = 0.5 * (knots[k] + knots[k + 1])
            for i in range(count - 1):
                third = unit_jerk(segments.phases[i], segments.jerks[i], middle - segments.begin[i])
                for j in range(n):
                    out[3, k, j] += segments.steps[i, j] * third
    return number

"""Compiled loops of end effectors' actions: one step of inverse kinematics in each of n environments.

Each environment is computed alone, in one order, so that its numbers do not depend on how many there are.
"""

from __future__ import annotations

import math

from roboyard.kinematics._linear import solve_free
from roboyard.native import compiled


def _turned(w, x, y, z, a, b, c):
    """Vector (a, b, c) turned by a unit quaternion."""
    u, v, t = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * u + y * t - z * v, b + w * v + z * u - x * t, c + w * t + x * v - y * u


def _product(w, x, y, z, o, a, b, c):
    """Product w, x, y, z of two quaternions."""
    return (
        w * o - x * a - y * b - z * c,
        w * a + x * o + y * c - z * b,
        w * b - x * c + y * o + z * a,
        w * c + x * b - y * a + z * o,
    )


@compiled(
    "f8[:,:] f8[:,::1] f8[:,::1] f8[:,:] f8[:,:] f8[:,:] f8[:,:] f8[:,:,:] f8[:,:] i8[::1] i8[::1] i8[::1] "
    "i8[::1] f8 f8 i8 f8 f8[::1] f8 f8[::1] f8[::1] f8[::1] f8[::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[::1] "
    "f8[::1] i8[::1] f8[::1] f8[:,::1]"
)
def move_tips(command, goal, turn, position, quaternion, base, centre, axes, qpos, places, moving, dofs,
              columns, move, angle, holds, gain, damping, rest_share, low, high, reach, rest,
              jac, square, factor, right, solution, order, step, target):  # fmt: skip  # pragma: no cover
    """Move the goals of the tips as commanded and write joint positions a step towards them.

    command: (n, 3) or (n, 6) within -1 to 1. goal: (n, 3) and turn: (n, 4) w, x, y, z, the tips' goals in
    world axes, written. position, quaternion: of the tips, (n, 3) (m) and (n, 4) w, x, y, z. base: (n, 4).
    centre: (n, 3) point about which `axes` (n, nv, 6) are the motions of the degrees of freedom.
    places: (k,) joints in qpos (n, nq). moving: (m,) those of the k with which the tip moves; dofs: (m,).
    columns: (k,) joints in target (n, j), written. move (m), angle (rad): scale of the command.
    holds: whether the orientation counts. damping: (6,) λ². low, high, reach, rest: (k,) limits, largest
    step, start posture.
    jac: (6, m), square, factor: (6, 6), right, solution: (6,), order: (6,) 0 to 5, step: (k,): work space.
    """
    k, m = columns.shape[0], moving.shape[0]
    rows = 6 if holds else 3
    turns = command.shape[1] == 6
    for i in range(command.shape[0]):
        w, x, y, z = base[i, 0], base[i, 1], base[i, 2], base[i, 3]
        px, py, pz = position[i, 0], position[i, 1], position[i, 2]
        ex, ey, ez = _turned(w, -x, -y, -z, goal[i, 0] - px, goal[i, 1] - py, goal[i, 2] - pz)
        if command[i, 0] != 0.0:
            ex = command[i, 0] * move
        if command[i, 1] != 0.0:
            ey = command[i, 1] * move
        if command[i, 2] != 0.0:
            ez = command[i, 2] * move
        ex, ey, ez = _turned(w, x, y, z, ex, ey, ez)
        goal[i, 0], goal[i, 1], goal[i, 2] = px + ex, py + ey, pz + ez
        right[0], right[1], right[2] = ex, ey, ez
        if turns and (command[i, 3] != 0.0 or command[i, 4] != 0.0 or command[i, 5] != 0.0):
            ax, ay, az = _turned(
                w, x, y, z, command[i, 3] * angle, command[i, 4] * angle, command[i, 5] * angle
            )
            size = math.sqrt(ax * ax + ay * ay + az * az)
            share = math.sin(0.5 * size) / size if size > 1e-12 else 0.5
            turn[i, 0], turn[i, 1], turn[i, 2], turn[i, 3] = _product(
                math.cos(0.5 * size), ax * share, ay * share, az * share,
                quaternion[i, 0], quaternion[i, 1], quaternion[i, 2], quaternion[i, 3],
            )  # fmt: skip
        if holds:
            o, a, b, c = _product(
                turn[i, 0], turn[i, 1], turn[i, 2], turn[i, 3],
                quaternion[i, 0], -quaternion[i, 1], -quaternion[i, 2], -quaternion[i, 3],
            )  # fmt: skip
            if o < 0.0:
                o, a, b, c = -o, -a, -b, -c
            sine = math.sqrt(a * a + b * b + c * c)
            share = 2.0 * math.atan2(sine, o) / sine if sine > 1e-12 else 2.0
            right[3], right[4], right[5] = a * share, b * share, c * share
        lx, ly, lz = px - centre[i, 0], py - centre[i, 1], pz - centre[i, 2]
        for j in range(m):
            d = dofs[j]
            ax, ay, az = axes[i, d, 0], axes[i, d, 1], axes[i, d, 2]
            jac[0, j] = axes[i, d, 3] + ay * lz - az * ly
            jac[1, j] = axes[i, d, 4] + az * lx - ax * lz
            jac[2, j] = axes[i, d, 5] + ax * ly - ay * lx
            if holds:
                jac[3, j], jac[4, j], jac[5, j] = ax, ay, az
        for j in range(k):
            step[j] = rest_share * (rest[j] - qpos[i, places[j]])
        for r in range(rows):
            total = gain * right[r]
            for j in range(m):
                total -= jac[r, j] * step[moving[j]]
            right[r] = total
            for s in range(r + 1):
                total = 0.0
                for j in range(m):
                    total += jac[r, j] * jac[s, j]
                square[r, s] = total
        solve_free(square, damping, right, order, rows, factor, solution)
        for j in range(m):
            total = 0.0
            for r in range(rows):
                total += jac[r, j] * solution[r]
            step[moving[j]] += total
        # all joints slower by the same factor, so that the tip moves in the same direction
        excess = 1.0
        for j in range(k):
            excess = max(excess, abs(step[j]) / reach[j])
        for j in range(k):
            wanted = qpos[i, places[j]] + step[j] / excess
            target[i, columns[j]] = min(max(wanted, low[j]), high[j])

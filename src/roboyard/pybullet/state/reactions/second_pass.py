"""What Bullet adds to the forces in joints when it passes through the links of a body a second time.

After its solver it passes through all links again, for the forces of contacts, motors and constraints, and
adds what it finds to the forces that it has found before. The second pass has drag, gyroscopic torques and
Coriolis accelerations, too, of the velocities that forces alone lead to; so these are in twice. The motor of
a prismatic joint pushes both links at their centres of mass there, whatever is between these.

Source:
    Bullet, btMultiBody::computeAccelerationsArticulatedBodyAlgorithmMultiDof with `isConstraintPass`.
"""

from __future__ import annotations

import math

import numpy as np

from roboyard._records import NamedTuple
from roboyard.native import Bundle, compiled, record

SPEED, TURN, RATE, SPIN, MOVES = 0, 3, 6, 9, 12
"""Places in a row of `motions`: velocity (m/s) and angular velocity (rad/s) of a link's centre of mass, then
the rates of both (m/s², rad/s²)."""


class Links(NamedTuple):
    """The links of a world in MuJoCo's arrays of the last step."""

    parent: np.ndarray
    root: np.ndarray
    first_dof: np.ndarray
    dofs: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    damping: np.ndarray
    """(nbody, 4) of `Surfaces.damping`."""
    axes: np.ndarray
    """(nv, 6) of each degree of freedom; MuJoCo's `cdof`."""
    velocity: np.ndarray
    """(nbody, 6) before the step, MuJoCo's `cvel`."""
    middle: np.ndarray
    """(nbody, 3) centres of mass (m)."""
    turned: np.ndarray
    """(nbody, 9) of the principal axes."""
    tree_middle: np.ndarray
    """(nbody, 3) centres of mass of trees (m), where `axes` and `velocity` are."""
    smooth: np.ndarray
    """(nv,) accelerations by forces alone."""


LINKS = Bundle(
    (
        record(
            Links,
            "i4[::1] i4[::1] i4[::1] i4[::1] f8[::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1]"
            " f8[:,::1] f8[:,::1] f8[::1]",
        ),
    )
)


@compiled(LINKS, "f8 f8[::1] f8[::1] f8[:,::1] f8[:,::1] f8[::1]")
def second_pass(links, timestep, pushes, acceleration, motions, wrenches, efforts):  # pragma: no cover
    """Write the forces in the joints above all links in the second pass, at given accelerations.

    pushes: (nv,) forces of the motors of prismatic joints (N), 0 of others. acceleration: (nv,) of all. motions: (nbody, `MOVES`), work array. wrenches: (nbody, 6)
    forces (N) and torques (N m) at the links' centres of mass, written. efforts: (nv,) what they do along the
    degrees of freedom (N or N m), written: the accelerations of the pass are those for which it is 0.
    """
    for b in range(links.parent.shape[0]):
        for k in range(MOVES):
            motions[b, k] = 0.0
        for k in range(6):
            wrenches[b, k] = 0.0
    for b in range(1, links.parent.shape[0]):
        if links.parent[b] > 0 or links.dofs[b] > 0:
            move(links, timestep, acceleration, motions, b)
            push(links, motions, wrenches, b)
    for b in range(1, links.parent.shape[0]):
        above = links.parent[b]
        for d in range(links.first_dof[b], links.first_dof[b] + links.dofs[b]):
            if pushes[d] != 0.0 and above > 0:
                x, y, z = (
                    pushes[d] * links.axes[d, 3],
                    pushes[d] * links.axes[d, 4],
                    pushes[d] * links.axes[d, 5],
                )
                i = links.middle[b, 0] - links.middle[above, 0]
                j = links.middle[b, 1] - links.middle[above, 1]
                k = links.middle[b, 2] - links.middle[above, 2]
                wrenches[above, 3] -= j * z - k * y
                wrenches[above, 4] -= k * x - i * z
                wrenches[above, 5] -= i * y - j * x
    hand_up(links, wrenches)
    for b in range(1, links.parent.shape[0]):
        x, y, z = wrenches[b, 0], wrenches[b, 1], wrenches[b, 2]
        for d in range(links.first_dof[b], links.first_dof[b] + links.dofs[b]):
            u, v, w = at_middle(links, b, links.axes[d])
            turn = links.axes[d, 0] * wrenches[b, 3] + links.axes[d, 1] * wrenches[b, 4]
            efforts[d] = turn + links.axes[d, 2] * wrenches[b, 5] + u * x + v * y + w * z


@compiled(LINKS, "f8[:,::1] f8[:,::1]")
def add_drag(links, forces, wrenches):  # pragma: no cover
    """Add what holds links against their drag before the step, which MuJoCo does not know of.

    forces: (nbody, 6), work array. wrenches: (nbody, 6) of `second_pass`.
    """
    for b in range(links.parent.shape[0]):
        for k in range(6):
            forces[b, k] = 0.0
    for b in range(1, links.parent.shape[0]):
        if links.parent[b] == 0 and links.dofs[b] == 0:
            continue
        own = links.velocity[b]
        x, y, z = at_middle(links, b, own)
        drag = links.damping[b, 0] + links.damping[b, 1] * math.sqrt(x * x + y * y + z * z)
        drag *= links.mass[b]
        forces[b, 0], forces[b, 1], forces[b, 2] = drag * x, drag * y, drag * z
        x, y, z = momentum(links, b, own[0], own[1], own[2])
        drag = math.sqrt(own[0] * own[0] + own[1] * own[1] + own[2] * own[2])
        drag = links.damping[b, 2] + links.damping[b, 3] * drag
        forces[b, 3], forces[b, 4], forces[b, 5] = drag * x, drag * y, drag * z
    hand_up(links, forces)
    for b in range(links.parent.shape[0]):
        for k in range(6):
            wrenches[b, k] += forces[b, k]


def hand_up(links, wrenches):
    """Add forces and torques at links' centres of mass to those of the links that carry them."""
    for b in range(links.parent.shape[0] - 1, 0, -1):
        above = links.parent[b]
        if above == 0:
            continue
        x, y, z = wrenches[b, 0], wrenches[b, 1], wrenches[b, 2]
        i = links.middle[b, 0] - links.middle[above, 0]
        j = links.middle[b, 1] - links.middle[above, 1]
        k = links.middle[b, 2] - links.middle[above, 2]
        wrenches[above, 0] += x
        wrenches[above, 1] += y
        wrenches[above, 2] += z
        wrenches[above, 3] += wrenches[b, 3] + j * z - k * y
        wrenches[above, 4] += wrenches[b, 4] + k * x - i * z
        wrenches[above, 5] += wrenches[b, 5] + i * y - j * x


def at_middle(links, b, motion):
    """Return the velocity of a link's centre of mass in a motion that is about the centre of its tree."""
    root = links.root[b]
    x = links.middle[b, 0] - links.tree_middle[root, 0]
    y = links.middle[b, 1] - links.tree_middle[root, 1]
    z = links.middle[b, 2] - links.tree_middle[root, 2]
    a, b_, c = motion[0], motion[1], motion[2]
    return motion[3] + b_ * z - c * y, motion[4] + c * x - a * z, motion[5] + a * y - b_ * x


def move(links, timestep, acceleration, motions, b):
    """Write the velocity of a link, that of its joint, and the rates of its velocity as it has them itself."""
    above = links.parent[b]
    a = c = d = e = f = g = 0.0
    p = q = r = s = t = u = 0.0
    for n in range(links.first_dof[b], links.first_dof[b] + links.dofs[b]):
        x, y, z = at_middle(links, b, links.axes[n])
        gained, rate = timestep * links.smooth[n], acceleration[n]
        a, c, d = a + gained * links.axes[n, 0], c + gained * links.axes[n, 1], d + gained * links.axes[n, 2]
        e, f, g = e + gained * x, f + gained * y, g + gained * z
        p, q, r = p + rate * links.axes[n, 0], q + rate * links.axes[n, 1], r + rate * links.axes[n, 2]
        s, t, u = s + rate * x, t + rate * y, u + rate * z
    own = links.velocity[b]
    x, y, z = at_middle(links, b, own)
    if above > 0:
        before = links.velocity[above]
        i, j, k = at_middle(links, b, before)
        a, c, d = a + own[0] - before[0], c + own[1] - before[1], d + own[2] - before[2]
        e, f, g = e + x - i, f + y - j, g + z - k
        i = links.middle[b, 0] - links.middle[above, 0]
        j = links.middle[b, 1] - links.middle[above, 1]
        k = links.middle[b, 2] - links.middle[above, 2]
        wx, wy, wz = motions[above, TURN], motions[above, TURN + 1], motions[above, TURN + 2]
        x = motions[above, SPEED] + wy * k - wz * j + e
        y = motions[above, SPEED + 1] + wz * i - wx * k + f
        z = motions[above, SPEED + 2] + wx * j - wy * i + g
        wx, wy, wz = wx + a, wy + c, wz + d
        ax, ay, az = motions[above, SPIN], motions[above, SPIN + 1], motions[above, SPIN + 2]
        s += motions[above, RATE] + ay * k - az * j + wy * g - wz * f + y * d - z * c
        t += motions[above, RATE + 1] + az * i - ax * k + wz * e - wx * g + z * a - x * d
        u += motions[above, RATE + 2] + ax * j - ay * i + wx * f - wy * e + x * c - y * a
        p, q, r = p + ax + wy * d - wz * c, q + ay + wz * a - wx * d, r + az + wx * c - wy * a
    else:
        wx, wy, wz = own[0] + a, own[1] + c, own[2] + d
        x, y, z = x + e, y + f, z + g
    motions[b, SPEED], motions[b, SPEED + 1], motions[b, SPEED + 2] = x, y, z
    motions[b, TURN], motions[b, TURN + 1], motions[b, TURN + 2] = wx, wy, wz
    motions[b, RATE], motions[b, RATE + 1], motions[b, RATE + 2] = s, t, u
    motions[b, SPIN], motions[b, SPIN + 1], motions[b, SPIN + 2] = p, q, r


def push(links, motions, wrenches, b):
    """Write the force and the torque that accelerate a link, and those that are against its drag."""
    x, y, z = motions[b, SPEED], motions[b, SPEED + 1], motions[b, SPEED + 2]
    wx, wy, wz = motions[b, TURN], motions[b, TURN + 1], motions[b, TURN + 2]
    mass = links.mass[b]
    drag = links.damping[b, 0] + links.damping[b, 1] * math.sqrt(x * x + y * y + z * z)
    wrenches[b, 0] = mass * (motions[b, RATE] + drag * x)
    wrenches[b, 1] = mass * (motions[b, RATE + 1] + drag * y)
    wrenches[b, 2] = mass * (motions[b, RATE + 2] + drag * z)
    if links.parent[b] == 0:
        wrenches[b, 0] += mass * (wy * z - wz * y)
        wrenches[b, 1] += mass * (wz * x - wx * z)
        wrenches[b, 2] += mass * (wx * y - wy * x)
    drag = links.damping[b, 2] + links.damping[b, 3] * math.sqrt(wx * wx + wy * wy + wz * wz)
    tx, ty, tz = momentum(links, b, wx, wy, wz)
    ax, ay, az = momentum(links, b, motions[b, SPIN], motions[b, SPIN + 1], motions[b, SPIN + 2])
    wrenches[b, 3] = ax + drag * tx + wy * tz - wz * ty
    wrenches[b, 4] = ay + drag * ty + wz * tx - wx * tz
    wrenches[b, 5] = az + drag * tz + wx * ty - wy * tx


def momentum(links, b, x, y, z):
    """Return the inertia of a link times a vector."""
    turned = links.turned[b]
    a = links.inertia[b, 0] * (turned[0] * x + turned[3] * y + turned[6] * z)
    c = links.inertia[b, 1] * (turned[1] * x + turned[4] * y + turned[7] * z)
    d = links.inertia[b, 2] * (turned[2] * x + turned[5] * y + turned[8] * z)
    return (
        turned[0] * a + turned[1] * c + turned[2] * d,
        turned[3] * a + turned[4] * c + turned[5] * d,
        turned[6] * a + turned[7] * c + turned[8] * d,
    )

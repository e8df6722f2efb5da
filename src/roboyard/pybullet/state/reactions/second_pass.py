"""Forces in joints that Bullet adds when it passes through the links of a body a second time.

After its solver it passes through all links again, for the forces of contacts, motors and constraints, and
adds what it finds to the forces that it has found before. The second pass has drag, gyroscopic torques and
Coriolis accelerations, too, of the velocities that forces alone lead to; so these are in twice. The motor of
a prismatic joint pushes both links at their centres of mass there, not along one line.

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

    pushes: (nv,) forces of the motors of prismatic joints (N), 0 of others. acceleration: (nv,) of all.
    motions: (nbody, `MOVES`), work array. wrenches: (nbody, 6) forces (N) and torques (N m) at the links'
    centres of mass, written. efforts: (nv,) what they do along the degrees of freedom (N or N m), written:
    the accelerations of the pass are those for which it is 0.
    """
    wrenches[:] = 0.0
    motions[:] = 0.0
    for b in range(1, links.parent.shape[0]):
        if links.parent[b] > 0 or links.dofs[b] > 0:
            move(links, timestep, acceleration, motions, b)
            push(links, motions, wrenches, b)
    for b in range(1, links.parent.shape[0]):
        above = links.parent[b]
        for d in range(links.first_dof[b], links.first_dof[b] + (links.dofs[b] if above > 0 else 0)):
            force = times(pushes[d], vector(links.axes, d, 3))
            apart = minus(vector(links.middle, b, 0), vector(links.middle, above, 0))
            put(wrenches, above, 3, minus(vector(wrenches, above, 3), cross(apart, force)))
    hand_up(links, wrenches)
    for b in range(1, links.parent.shape[0]):
        for d in range(links.first_dof[b], links.first_dof[b] + links.dofs[b]):
            effort = dot(at_middle(links, b, links.axes, d), vector(wrenches, b, 0))
            efforts[d] = effort + dot(vector(links.axes, d, 0), vector(wrenches, b, 3))


@compiled(LINKS, "f8[:,::1] f8[:,::1]")
def add_drag(links, forces, wrenches):  # pragma: no cover
    """Add what holds links against their drag before the step, which MuJoCo does not know of.

    forces: (nbody, 6), work array. wrenches: (nbody, 6) of `second_pass`.
    """
    forces[:] = 0.0
    for b in range(1, links.parent.shape[0]):
        if links.parent[b] > 0 or links.dofs[b] > 0:
            turn = vector(links.velocity, b, 0)
            force, torque = drag(links, b, at_middle(links, b, links.velocity, b), turn)
            put(forces, b, 0, force)
            put(forces, b, 3, torque)
    hand_up(links, forces)
    for b in range(links.parent.shape[0]):
        for k in range(6):
            wrenches[b, k] += forces[b, k]


def hand_up(links, wrenches):
    """Add forces and torques at links' centres of mass to those of the links that carry them."""
    for b in range(links.parent.shape[0] - 1, 0, -1):
        above = links.parent[b]
        if above > 0:
            apart = minus(vector(links.middle, b, 0), vector(links.middle, above, 0))
            force = vector(wrenches, b, 0)
            torque = plus(vector(wrenches, b, 3), cross(apart, force))
            put(wrenches, above, 0, plus(vector(wrenches, above, 0), force))
            put(wrenches, above, 3, plus(vector(wrenches, above, 3), torque))


def at_middle(links, b, motions, row):
    """Return the velocity of a link's centre of mass in one of the motions about the centre of its tree."""
    apart = minus(vector(links.middle, b, 0), vector(links.tree_middle, links.root[b], 0))
    return plus(vector(motions, row, 3), cross(vector(motions, row, 0), apart))


def move(links, timestep, acceleration, motions, b):
    """Write the velocity of a link and its rate, in axes that turn with the link.

    The joint's own velocity v_j adds v x v_j to the rate, with v that of the link (the spatial product).
    """
    above = links.parent[b]
    turn, speed = vector(links.velocity, b, 0), at_middle(links, b, links.velocity, b)
    own_turn, own_speed, spin, rate = turn, speed, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if above > 0:
        own_turn = minus(turn, vector(links.velocity, above, 0))
        own_speed = minus(speed, at_middle(links, b, links.velocity, above))
    for d in range(links.first_dof[b], links.first_dof[b] + links.dofs[b]):
        axis, way, gained = vector(links.axes, d, 0), at_middle(links, b, links.axes, d), links.smooth[d]
        own_turn = plus(own_turn, times(timestep * gained, axis))
        own_speed = plus(own_speed, times(timestep * gained, way))
        spin, rate = plus(spin, times(acceleration[d], axis)), plus(rate, times(acceleration[d], way))
    turn, speed = own_turn, own_speed
    if above > 0:
        apart = minus(vector(links.middle, b, 0), vector(links.middle, above, 0))
        carried, its_spin = vector(motions, above, TURN), vector(motions, above, SPIN)
        turn = plus(carried, own_turn)
        speed = plus(plus(vector(motions, above, SPEED), cross(carried, apart)), own_speed)
        spin = plus(plus(its_spin, spin), cross(turn, own_turn))
        rate = plus(plus(vector(motions, above, RATE), cross(its_spin, apart)), rate)
        rate = plus(rate, plus(cross(turn, own_speed), cross(speed, own_turn)))
    put(motions, b, SPEED, speed)
    put(motions, b, TURN, turn)
    put(motions, b, RATE, rate)
    put(motions, b, SPIN, spin)


def push(links, motions, wrenches, b):
    """Write the force and the torque that accelerate a link, and those that are against its drag."""
    speed, turn = vector(motions, b, SPEED), vector(motions, b, TURN)
    force, torque = drag(links, b, speed, turn)
    force = plus(force, times(links.mass[b], vector(motions, b, RATE)))
    if links.parent[b] == 0:
        force = plus(force, times(links.mass[b], cross(turn, speed)))
    torque = plus(torque, momentum(links, b, vector(motions, b, SPIN)))
    put(wrenches, b, 0, force)
    put(wrenches, b, 3, plus(torque, cross(turn, momentum(links, b, turn))))


def drag(links, b, speed, turn):
    """Return the force and the torque against a link's drag, at its velocity and angular velocity."""
    linear = links.damping[b, 0] + links.damping[b, 1] * math.sqrt(dot(speed, speed))
    angular = links.damping[b, 2] + links.damping[b, 3] * math.sqrt(dot(turn, turn))
    return times(links.mass[b] * linear, speed), times(angular, momentum(links, b, turn))


def momentum(links, b, turn):
    """Return the inertia of a link times a vector."""
    found = (0.0, 0.0, 0.0)
    for k in range(3):
        axis = links.turned[b, k], links.turned[b, 3 + k], links.turned[b, 6 + k]
        found = plus(found, times(links.inertia[b, k] * dot(axis, turn), axis))
    return found


def vector(rows, row, start):
    """Return three numbers of a row."""
    return rows[row, start], rows[row, start + 1], rows[row, start + 2]


def put(rows, row, start, a):
    """Write three numbers into a row."""
    rows[row, start], rows[row, start + 1], rows[row, start + 2] = a


def plus(a, b):
    """Return the sum of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def minus(a, b):
    """Return the difference of two vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def times(factor, a):
    """Return a multiple of a vector."""
    return factor * a[0], factor * a[1], factor * a[2]


def dot(a, b):
    """Return the product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    """Return the cross product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]

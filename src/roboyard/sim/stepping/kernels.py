"""Compiled loops over MuJoCo's arrays, run between the two halves of a step."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled

RIGIDITY = 0.1
"""Factor on the regularisation of rigid contacts."""
NO_PUSH = -1e3
"""Normal velocity (m/s) that contacts which are ignored ask for."""
RIGID_DAMPING = 0.1
"""Bullet's contact damping of a surface without a stiffness (N s/m)."""


@compiled("f8[:,:] f8[:] f8[:,:] i4[:] f8[:,:] f8[:,:] f8[:,:] f8[:,:] f8[:,:]")
def add_damping(damping, mass, inertia, rootid, cvel, xipos, ximat, subtree_com, xfrc):  # pragma: no cover
    """Add drag to xfrc: force -m v (k + q |v|) at the centre of mass, torque -I w (k + q |w|).

    damping: (nbody, 4) linear k (1/s), linear q (1/m), angular k (1/s), angular q (-).
    cvel: (nbody, 6) angular, then linear velocity at the tree's centre of mass, world axes.
    """
    for b in range(1, mass.shape[0]):
        fx, fy, fz, tx, ty, tz = drag_on(
            b, rootid[b], damping, mass, inertia, cvel, xipos, ximat, subtree_com
        )
        xfrc[b, 0] += fx
        xfrc[b, 1] += fy
        xfrc[b, 2] += fz
        xfrc[b, 3] += tx
        xfrc[b, 4] += ty
        xfrc[b, 5] += tz


def drag_on(b, c, damping, mass, inertia, cvel, xipos, ximat, subtree_com):
    """Return force and torque of the drag on a body; c is the root of its tree. See `add_damping`."""
    kl, ql, ka, qa = damping[b, 0], damping[b, 1], damping[b, 2], damping[b, 3]
    if kl == 0.0 and ql == 0.0 and ka == 0.0 and qa == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    wx, wy, wz = cvel[b, 0], cvel[b, 1], cvel[b, 2]
    rx = xipos[b, 0] - subtree_com[c, 0]
    ry = xipos[b, 1] - subtree_com[c, 1]
    rz = xipos[b, 2] - subtree_com[c, 2]
    vx = cvel[b, 3] + wy * rz - wz * ry
    vy = cvel[b, 4] + wz * rx - wx * rz
    vz = cvel[b, 5] + wx * ry - wy * rx
    f = -mass[b] * (kl + ql * np.sqrt(vx * vx + vy * vy + vz * vz))
    t = -(ka + qa * np.sqrt(wx * wx + wy * wy + wz * wz))
    m = ximat[b]
    x = t * inertia[b, 0] * (m[0] * wx + m[3] * wy + m[6] * wz)
    y = t * inertia[b, 1] * (m[1] * wx + m[4] * wy + m[7] * wz)
    z = t * inertia[b, 2] * (m[2] * wx + m[5] * wy + m[8] * wz)
    tx = x * m[0] + y * m[1] + z * m[2]
    ty = x * m[3] + y * m[4] + z * m[5]
    tz = x * m[6] + y * m[7] + z * m[8]
    return f * vx, f * vy, f * vz, tx, ty, tz


@compiled("f8[:] i4[:,:] i4[:] f8[:] f8[:,:] f8 f8 f8[:]")
def add_bounce(restitution, geom, address, velocity, impedance, timestep, slow, aref):  # pragma: no cover
    """Raise the reference acceleration of closing contacts so that they separate at e times their speed.

    restitution: (ngeom,); a pair's coefficient is the product. geom: (ncon, 2). address: (ncon,) row of the
    contact's normal in the constraint arrays, -1 for none. impedance: (nefc, 4), third column the share of a
    reference acceleration that a soft contact reaches. slow: speed below which contacts do not bounce (m/s).
    """
    for i in range(geom.shape[0]):
        a, b, row = geom[i, 0], geom[i, 1], address[i]
        if a < 0 or b < 0 or row < 0:
            continue
        e = restitution[a] * restitution[b]
        if e > 0.0 and velocity[row] < -slow:
            wanted = -(1.0 + e) * velocity[row] / (timestep * impedance[row, 2])
            aref[row] = max(aref[row], wanted)


@compiled("f8[:,:] i4[:,:] i4[:] i4[:] f8[:,:] f8[:] f8[:] f8[:]")
def product_friction(coefficients, geom, dim, address, friction, mu, R, D):  # pragma: no cover
    """Replace each contact's friction by Bullet's mixture of its geoms' coefficients and regularise it.

    Sliding: the product. Spinning and rolling: each geom's own coefficient times the other's sliding one,
    summed.

    coefficients: (ngeom, 3) sliding, spinning and rolling. MuJoCo mixes by maximum when it makes the
    constraints; its elliptic cone keeps the ratio of the rows' regularisers equal to the squared ratio of
    their coefficients, which this restores.
    """
    for i in range(geom.shape[0]):
        a, b, row = geom[i, 0], geom[i, 1], address[i]
        if a < 0 or b < 0 or row < 0 or dim[i] < 3:
            continue
        slide = max(coefficients[a, 0] * coefficients[b, 0], 1e-5)
        mu[i] *= slide / friction[i, 0]
        friction[i, 0] = friction[i, 1] = slide
        if dim[i] > 3:
            spin = coefficients[a, 1] * coefficients[b, 0] + coefficients[b, 1] * coefficients[a, 0]
            friction[i, 2] = max(spin, 1e-5)
        if dim[i] > 4:
            roll = coefficients[a, 2] * coefficients[b, 0] + coefficients[b, 2] * coefficients[a, 0]
            friction[i, 3] = friction[i, 4] = max(roll, 1e-5)
        for k in range(3, dim[i]):
            ratio = slide / friction[i, k - 1]
            R[row + k] = R[row + 1] * ratio * ratio
            D[row + k] = 1.0 / R[row + k]


@compiled(
    "f8[:] i4[:,:] i4[:] i4[:] f8[:] f8[:,:] f8[:] f8 f8 f8 f8 f8[:] f8[:] f8[:] f8[:] f8[:] f8[:] f8[:,:]"
    " f8[:,:]"
)
def hard_contacts(  # pragma: no cover
    restitution, geom, dim, address, dist, friction, velocity, timestep, erp, slop, slow, base, aref, R, D,
    margins, reaches, position, frame,
):  # fmt: skip
    """Write reference accelerations of rigid contacts, solved for the velocity after the step.

    The normal velocity after the step is at least -gap / dt for a gap, -erp gap / dt for a penetration, with
    gap = dist + slop, and -e v more for a bounce; sliding stops completely, as far as friction can. `base`
    receives the normal rows' references before the correction for sliding (see `correct_sliding`), whose
    first estimate is made here.
    Regularisers R (and their inverses D) shrink, so that a body at rest has exactly its weight as normal
    force within three steps; MuJoCo bounds the impedance, and with it R, for time steps much larger than
    needed here.
    margins: (ngeom,) widths (m) by which surfaces lie outside MuJoCo's shapes; distances and positions of
    contacts are corrected for them in place. reaches: (ngeom,) gaps (m) from which on the geom's contacts do
    not push, the pair's is the smaller. frame: (ncon, 9), the normal first.
    """
    for i in range(geom.shape[0]):
        a, b, row = geom[i, 0], geom[i, 1], address[i]
        if a < 0 or b < 0:
            continue
        dist[i] -= margins[a] + margins[b]
        shift = 0.5 * (margins[a] - margins[b])
        for k in range(3):
            position[i, k] += shift * frame[i, k]
        if row < 0:
            continue
        if dist[i] > min(reaches[a], reaches[b]):
            base[row] = aref[row] = NO_PUSH / timestep
            continue
        v = velocity[row]
        gap = dist[i] + slop
        wanted = -gap / timestep if gap > 0.0 else -erp * gap / timestep
        if v < -slow:
            wanted -= restitution[a] * restitution[b] * v
        base[row] = aref[row] = (wanted - v) / timestep
        for k in range(dim[i]):
            R[row + k] *= RIGIDITY
            D[row + k] /= RIGIDITY
        if dim[i] > 1:
            for k in range(1, dim[i]):
                aref[row + k] = -velocity[row + k] / timestep
            slip = np.sqrt(velocity[row + 1] ** 2 + velocity[row + 2] ** 2)
            slip -= friction[i, 0] * max(wanted - v, 0.0)
            if slip > 0.0:
                aref[row] -= friction[i, 0] * slip / timestep


@compiled("f8[:,:] i4[:,:] i4[:] i4[:] f8[:] f8[:,:] f8[:] f8 f8 f8 f8[:] f8[:] f8[:] f8[:]")
def compliant_contacts(  # pragma: no cover
    compliance, geom, dim, address, dist, friction, mu, timestep, erp, slop, base, aref, R, D
):
    """Make rigid contacts of surfaces with a stiffness k and damping d implicit springs, as Bullet does.

    Their normal velocity after the step is -gap k / (dt k + d) - f / (dt k + d) for a force f, in place of
    -erp gap / dt, with gap = dist + slop. compliance: (ngeom, 2) stiffness (N/m) and damping (N s/m),
    stiffness 0 for a rigid surface; the springs of a pair act in series, their damping adds. The cone's
    `mu` follows the ratio of its regularisers.
    """
    for i in range(geom.shape[0]):
        a, b, row = geom[i, 0], geom[i, 1], address[i]
        if a < 0 or b < 0 or row < 0:
            continue
        first, second = compliance[a, 0], compliance[b, 0]
        if first == 0.0 and second == 0.0:
            continue
        stiffness = first * second / (first + second) if first > 0.0 and second > 0.0 else first + second
        total = timestep * stiffness
        total += compliance[a, 1] if first > 0.0 else RIGID_DAMPING
        total += compliance[b, 1] if second > 0.0 else RIGID_DAMPING
        R[row] = 1.0 / (timestep * total)
        D[row] = 1.0 / R[row]
        if dim[i] > 1:
            mu[i] = friction[i, 0] * np.sqrt(R[row + 1] / R[row])
        gap = dist[i] + slop
        if gap < 0.0:
            change = (erp - timestep * stiffness / total) * gap / (timestep * timestep)
            base[row] += change
            aref[row] += change


@compiled("i4[:] f8[:] f8[:] f8[:] f8[:]")
def copy_to_islands(source, R, D, island_R, island_D):  # pragma: no cover
    """Copy regularisers and their inverses to MuJoCo's arrays that are sorted by island, which it solves.

    source: (nefc,) row of each row of the sorted arrays. MuJoCo itself copies reference accelerations only.
    """
    for i in range(source.shape[0]):
        island_R[i] = R[source[i]]
        island_D[i] = D[source[i]]


@compiled("i4[:] i4[:] f8[:,:] f8[:] f8 f8[:] f8[:]")
def estimate_sliding(dim, address, friction, velocity, timestep, base, aref):  # pragma: no cover
    """Lower the normal references of sliding contacts as if they slid on at their present speed.

    The first solution is then near the one that `correct_sliding` looks for.
    """
    for i in range(address.shape[0]):
        row = address[i]
        if row >= 0 and dim[i] >= 3:
            slip = np.sqrt(velocity[row + 1] ** 2 + velocity[row + 2] ** 2)
            aref[row] = base[row] - friction[i, 0] * slip / timestep


@compiled("i4[:] i4[:] f8[:,:] f8[:] f8[:] f8[:] f8 f8[:] f8[:] -> f8")
def correct_sliding(  # pragma: no cover
    dim, address, friction, velocity, acceleration, force, timestep, base, aref
):
    """Remove the lift that a convex friction cone gives to sliding contacts; return the largest change (m/s).

    The solver requires a_n - aref_n >= mu |a_t - aref_t|, so that a contact that slides at speed s after the
    step would separate at mu s. Lowering aref_n by mu s / dt (de Saxce's correction) prevents that. Solve
    again while the change is large.
    """
    largest = 0.0
    for i in range(address.shape[0]):
        row = address[i]
        if row < 0 or dim[i] < 3:
            continue
        x = velocity[row + 1] + timestep * acceleration[row + 1]
        y = velocity[row + 2] + timestep * acceleration[row + 2]
        wanted = base[row] - friction[i, 0] * np.sqrt(x * x + y * y) / timestep
        if force[row] > 0.0 or wanted > aref[row]:
            largest = max(largest, abs(wanted - aref[row]) * timestep)
        aref[row] = wanted
    return largest


@compiled(
    "f8[:,:] f8[:,:] i4[:] i4[:] i4[:] i4[:] f8[:] f8[:] i4[:] i4[:] i8 i8"
    " f8 f8 f8[:] f8[:] f8[:] i4[:] f8[:] f8[:]"
)
def drive_motors(  # pragma: no cover
    motors,
    targets,
    dof_joint,
    joint_type,
    joint_qpos,
    joint_dof,
    qpos,
    qvel,
    kind,
    index,
    first,
    count,
    timestep,
    softness,
    aref,
    R,
    D,
    place,
    island_R,
    island_D,
):
    """Write the reference accelerations of motor rows: v' = kp (q* - q) / dt + v + kd (v* - v).

    motors: (nv, 5) mode (0 none, 1 velocity, 2 position, 3 position of a ball joint by roll, pitch and yaw of
    the remaining rotation), kp, velocity target, kd, largest velocity.
    targets: (nv, 4) position target; of a ball joint (w, x, y, z) at its first dof.
    kind, index: type and dof of each constraint row; rows first ... first + count are dof friction.
    softness: factor on the regularisers R = 1 / D of these rows. MuJoCo bounds the impedance at 0.9999, with
    which a loaded motor misses its velocity by as much as its load moves one joint in 1e-4 of a step.
    place: row of each constraint in island_R and island_D, the copies that a solver by islands reads; empty
    where it solves all rows together.
    """
    for row in range(first, first + count):
        if kind[row] != 1:
            continue
        dof = index[row]
        mode = motors[dof, 0]
        if mode == 0.0:
            continue
        v = qvel[dof]
        wanted = v + motors[dof, 3] * (motors[dof, 2] - v)
        if mode >= 2.0:
            joint = dof_joint[dof]
            at = joint_qpos[joint]
            if joint_type[joint] == 1:
                start = joint_dof[joint]
                tw, tx, ty, tz = targets[start, 0], targets[start, 1], targets[start, 2], targets[start, 3]
                w, x, y, z = qpos[at], -qpos[at + 1], -qpos[at + 2], -qpos[at + 3]
                ew = w * tw - x * tx - y * ty - z * tz
                ex = w * tx + x * tw + y * tz - z * ty
                ey = w * ty - x * tz + y * tw + z * tx
                ez = w * tz + x * ty - y * tx + z * tw
                if ew < 0.0:
                    ew, ex, ey, ez = -ew, -ex, -ey, -ez
                length = np.sqrt(ex * ex + ey * ey + ez * ez)
                factor = 2.0 if length < 1e-9 else 2.0 * np.arctan2(length, ew) / length
                k = dof - start
                if mode == 2.0:
                    error = factor * (ex if k == 0 else ey if k == 1 else ez)
                elif k == 0:
                    error = np.arctan2(2.0 * (ey * ez + ew * ex), 1.0 - 2.0 * (ex * ex + ey * ey))
                elif k == 1:
                    error = np.arcsin(min(max(2.0 * (ew * ey - ex * ez), -1.0), 1.0))
                else:
                    error = np.arctan2(2.0 * (ex * ey + ew * ez), 1.0 - 2.0 * (ey * ey + ez * ez))
            else:
                error = targets[dof, 0] - qpos[at]
            wanted += motors[dof, 1] * error / timestep
        largest = motors[dof, 4]
        if largest > 0.0:
            wanted = min(max(wanted, -largest), largest)
        aref[row] = (wanted - v) / timestep
        R[row] *= softness
        D[row] = 1.0 / R[row]
        if place.shape[0]:
            island_R[place[row]] = R[row]
            island_D[place[row]] = D[row]


@compiled("f8[:] f8[:] f8 f8[:] i4[:] i4[:] i4[:] f8[:] i4[:] f8[:,:] f8[:,:]")
def bound_velocity(
    velocity, acceleration, timestep, largest, joint_type, joint_dof, joint_qpos, qpos, dof_body, centre, xmat
):  # pragma: no cover
    """Bound accelerations so that no velocity component after the step exceeds its limit.

    Of a free body these are the components in the world frame, of its centre of mass: MuJoCo has angular
    velocities in the body's frame, and the velocity of that frame. centre: (nbody, 3) in bodies' frames (m).
    """
    for joint in range(joint_type.shape[0]):
        kind, dof = joint_type[joint], joint_dof[joint]
        if kind == 0:
            if is_slow(velocity, acceleration, timestep, largest, dof, dof_body[dof], centre):
                continue
            add_turning(velocity, acceleration, timestep, dof, dof_body[dof], centre, xmat, 1.0)
            bound_turn(velocity, acceleration, timestep, largest, dof + 3, qpos, joint_qpos[joint] + 3)
        for i in range(dof, dof + (3 if kind < 2 else 1)):
            after = velocity[i] + timestep * acceleration[i]
            if abs(after) > largest[i]:
                acceleration[i] = (min(max(after, -largest[i]), largest[i]) - velocity[i]) / timestep
        if kind == 0:
            add_turning(velocity, acceleration, timestep, dof, dof_body[dof], centre, xmat, -1.0)


def is_slow(velocity, acceleration, timestep, largest, dof, body, centre):
    """Return whether no bound of a free body matters."""
    squared = turned = away = 0.0
    least = largest[dof]
    for k in range(3):
        squared += (velocity[dof + k] + timestep * acceleration[dof + k]) ** 2
        turned += (velocity[dof + 3 + k] + timestep * acceleration[dof + 3 + k]) ** 2
        away += centre[body, k] ** 2
        least = min(least, min(largest[dof + k], largest[dof + 3 + k]))
    return turned <= least * least and np.sqrt(squared) + np.sqrt(turned * away) <= least


def add_turning(velocity, acceleration, timestep, dof, body, centre, xmat, sign):
    """Add what a body's turning gives its centre of mass, times a sign, to the frame's acceleration."""
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        one = turning(velocity, acceleration, timestep, dof + 3, xmat, body, i)
        two = turning(velocity, acceleration, timestep, dof + 3, xmat, body, j)
        acceleration[dof + k] += (
            sign * (one * arm(centre, xmat, body, j) - two * arm(centre, xmat, body, i)) / timestep
        )


def turning(velocity, acceleration, timestep, dof, xmat, body, axis):
    """Return the component along an axis of the world of an angular velocity in a body's frame."""
    total = 0.0
    for k in range(3):
        total += xmat[body, 3 * axis + k] * (velocity[dof + k] + timestep * acceleration[dof + k])
    return total


def arm(centre, xmat, body, axis):
    """Return the coordinate along an axis of the world of a body's centre of mass from its frame (m)."""
    total = 0.0
    for k in range(3):
        total += xmat[body, 3 * axis + k] * centre[body, k]
    return total


def bound_turn(velocity, acceleration, timestep, largest, dof, qpos, place):
    """Bound the angular acceleration of a free body, whose quaternion (w, x, y, z) begins at `place`."""
    x, y, z = (
        velocity[dof] + timestep * acceleration[dof],
        velocity[dof + 1] + timestep * acceleration[dof + 1],
        velocity[dof + 2] + timestep * acceleration[dof + 2],
    )
    if x * x + y * y + z * z <= largest[dof] * largest[dof]:
        return
    a, b, c, d = qpos[place], qpos[place + 1], qpos[place + 2], qpos[place + 3]
    e, f, g = 1.0 - 2.0 * (c * c + d * d), 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)
    h, i, j = 2.0 * (b * c + a * d), 1.0 - 2.0 * (b * b + d * d), 2.0 * (c * d - a * b)
    k, m, n = 2.0 * (b * d - a * c), 2.0 * (c * d + a * b), 1.0 - 2.0 * (b * b + c * c)
    p = min(max(e * x + f * y + g * z, -largest[dof]), largest[dof])
    q = min(max(h * x + i * y + j * z, -largest[dof + 1]), largest[dof + 1])
    r = min(max(k * x + m * y + n * z, -largest[dof + 2]), largest[dof + 2])
    acceleration[dof] = (e * p + h * q + k * r - velocity[dof]) / timestep
    acceleration[dof + 1] = (f * p + i * q + m * r - velocity[dof + 1]) / timestep
    acceleration[dof + 2] = (g * p + j * q + n * r - velocity[dof + 2]) / timestep


@compiled("f8[:] f8[:] i8 f8 f8 f8[:]")
def hard_equalities(position, velocity, count, timestep, erp, aref):  # pragma: no cover
    """Write the reference accelerations of equalities on the velocity level: v' = -erp position / dt."""
    for row in range(count):
        aref[row] = (-erp * position[row] / timestep - velocity[row]) / timestep


@compiled("i4[:] f8[:] f8[:] i8 i8 f8 f8 f8 f8[:]")
def hard_limits(kind, position, velocity, first, count, timestep, erp, deep, aref):  # pragma: no cover
    """Write reference accelerations of exceeded joint limits: v' >= -erp position / dt, or 0 beyond `deep`.

    kind: type of each constraint row; rows first ... first + count are limits, 3 for those of hinges and
    sliders. position: distance to the limit (rad or m), negative beyond it.
    """
    for row in range(first, first + count):
        if kind[row] == 3:
            wanted = -erp * position[row] / timestep if position[row] > -deep else 0.0
            aref[row] = (wanted - velocity[row]) / timestep


@compiled("i4[:] i4[:] f8[:] i8 i8 f8[:]")
def motor_forces(efc_type, efc_id, efc_force, ne, nf, out):  # pragma: no cover
    """Write the forces of the dry friction rows (the motors) into `out` (nv,) by dof (N m or N)."""
    for row in range(ne, ne + nf):
        if efc_type[row] == 1:
            out[efc_id[row]] = efc_force[row]

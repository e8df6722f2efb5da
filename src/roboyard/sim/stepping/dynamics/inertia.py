"""Dividing efforts by the inertia of kinematic trees, and the accelerations by forces alone."""

from __future__ import annotations

import numpy as np

from roboyard.sim.stepping.impulses.blocks import add_block
from roboyard.sim.stepping.impulses.records import BLOCK
from roboyard.sim.stepping.kernels import drag_on

FREE = 0
"""MuJoCo's type of this joint."""


def accelerate(mechanism, state, surface, solver):  # pragma: no cover
    """Write the forces on degrees of freedom but those of constraints, drag among them, and what they do.

    Does what MuJoCo's `mj_fwdAcceleration` does after `add_damping`, with the forces on links summed up
    along the trees.
    """
    force, wrenches, parent = state.smooth_force, solver.wrenches, mechanism.body_parent
    for d in range(force.shape[0]):
        force[d] = state.passive[d] - state.bias[d] + state.applied[d] + state.actuated[d]
    for b in range(1, parent.shape[0]):
        c = mechanism.body_root[b]
        fx, fy, fz, tx, ty, tz = drag_on(
            b, c, surface.damping, mechanism.mass, mechanism.inertia, state.cvel, state.xipos, state.ximat,
            state.subtree_com,
        )  # fmt: skip
        fx, fy, fz = fx + state.wrench[b, 0], fy + state.wrench[b, 1], fz + state.wrench[b, 2]
        rx = state.xipos[b, 0] - state.subtree_com[c, 0]
        ry = state.xipos[b, 1] - state.subtree_com[c, 1]
        rz = state.xipos[b, 2] - state.subtree_com[c, 2]
        wrenches[b, 0] = tx + state.wrench[b, 3] + ry * fz - rz * fy
        wrenches[b, 1] = ty + state.wrench[b, 4] + rz * fx - rx * fz
        wrenches[b, 2] = tz + state.wrench[b, 5] + rx * fy - ry * fx
        wrenches[b, 3], wrenches[b, 4], wrenches[b, 5] = fx, fy, fz
    for i in range(1, parent.shape[0]):
        b = parent.shape[0] - i
        if parent[b] > 0:
            for k in range(6):
                wrenches[parent[b], k] += wrenches[b, k]
    for d in range(force.shape[0]):
        b = mechanism.dof_body[d]
        for k in range(6):
            force[d] += state.cdof[d, k] * wrenches[b, k]
        state.smooth[d] = force[d]
    solve_inertia(mechanism, state, state.smooth, 0, force.shape[0], 0)


def solve_inertia(mechanism, state, x, start, stop, place):  # pragma: no cover
    """Divide efforts of whole trees, dofs start ... stop, by the inertia: accelerations, in place.

    place: of the effort of dof `start` in x; those of the others follow.
    """
    shift = place - start
    for i in range(stop - 1, start - 1, -1):
        if x[shift + i] != 0.0:
            first = mechanism.factor_start[i]
            for a in range(first, first + mechanism.factor_count[i] - 1):
                x[shift + mechanism.factor_column[a]] -= state.factor[a] * x[shift + i]
    for i in range(start, stop):
        x[shift + i] *= state.factor_inverse[i]
        first = mechanism.factor_start[i]
        for a in range(first, first + mechanism.factor_count[i] - 1):
            x[shift + i] -= state.factor[a] * x[shift + mechanism.factor_column[a]]


def find_roots(mechanism, state, roots, trees):  # pragma: no cover
    """Write the roots of 1 / D of all degrees of freedom, and 1 into `trees` (ntree,) where L is 1, else 0.

    MuJoCo factors the inertia of each tree into L' D L. That of a free body is diagonal where its frame is
    that of its principal axes at its centre of mass. Trees of more than `BLOCK` degrees of freedom get 0,
    too. Returns the number of zeros.
    """
    for d in range(roots.shape[0]):
        roots[d] = np.sqrt(state.factor_inverse[d])
    others = 0
    for tree in range(trees.shape[0]):
        is_diagonal = 1 if mechanism.tree_dofs[tree] <= BLOCK else 0
        first = mechanism.tree_dof[tree]
        for i in range(first, first + mechanism.tree_dofs[tree]):
            start = mechanism.factor_start[i]
            for a in range(start, start + mechanism.factor_count[i] - 1):
                if state.factor[a] != 0.0:
                    is_diagonal = 0
        trees[tree] = is_diagonal
        others += 1 - is_diagonal
    return others


def scale(mechanism, state, roots, jacobian, scaled, first, size, place):  # pragma: no cover
    """Write a row's entries for a tree, dofs first ... first + size, divided by the root of the inertia.

    With J for the entries, these are J / (sqrt(D) L): their product with those of another row is what a
    unit of impulse of one row changes in the velocity of the other, J M^-1 J'. A body's entries lead to those
    of its ancestors alone, where a response M^-1 J' has entries of the whole tree.

    jacobian, scaled: the row's entries, those of the tree from `place` on.
    """
    for k in range(size):
        scaled[place + k] = jacobian[place + k]
    shift = place - first
    for i in range(first + size - 1, first - 1, -1):
        if scaled[shift + i] != 0.0:
            start = mechanism.factor_start[i]
            for a in range(start, start + mechanism.factor_count[i] - 1):
                scaled[shift + mechanism.factor_column[a]] -= state.factor[a] * scaled[shift + i]
            scaled[shift + i] *= roots[i]


def scale_across(mechanism, state, roots, across, width):  # pragma: no cover
    """Do what `scale` does for many rows at once: across is (nv * width,), of whole blocks of rows."""
    for i in range(roots.shape[0] - 1, -1, -1):
        first = mechanism.factor_start[i]
        for a in range(first, first + mechanism.factor_count[i] - 1):
            column, factor = mechanism.factor_column[a], -state.factor[a]
            for k in range(0, width, BLOCK):
                add_block(across, column * width + k, factor, across, i * width + k)
        for k in range(i * width, i * width + width):
            across[k] *= roots[i]


def change_velocities(mechanism, state, roots, change):  # pragma: no cover
    """Turn sums of scaled entries by impulses into changes of velocity (nv,), in place."""
    for i in range(roots.shape[0]):
        change[i] *= roots[i]
        first = mechanism.factor_start[i]
        for a in range(first, first + mechanism.factor_count[i] - 1):
            change[i] -= state.factor[a] * change[mechanism.factor_column[a]]


def follow_centres(mechanism, state):  # pragma: no cover
    """Add what turns frames about the centres of free bodies to the frames' accelerations by forces alone.

    So rows are solved for the velocities of the centres, which change by forces alone; see `move_centres`.
    """
    for joint in range(mechanism.joint_type.shape[0]):
        dof = mechanism.joint_dof[joint]
        body = mechanism.dof_body[dof]
        if mechanism.joint_type[joint] != FREE or is_centred(mechanism, body):
            continue
        m = state.xmat[body]
        x, y, z = offset(m, mechanism.centre, body)
        ax, ay, az = turned(m, state.qvel, dof + 3, state.qacc, 0.0)
        ux, uy, uz = ay * z - az * y, az * x - ax * z, ax * y - ay * x
        state.smooth[dof] += ay * uz - az * uy
        state.smooth[dof + 1] += az * ux - ax * uz
        state.smooth[dof + 2] += ax * uy - ay * ux


def move_centres(mechanism, state, timestep):  # pragma: no cover
    """Let the bases of free bodies move by their centres of mass, which MuJoCo moves by their frames.

    Corrects accelerations and positions before they are integrated, after `follow_centres`. Bullet adds a
    step of the centre's velocity to its position. MuJoCo does so with the frame's, whose velocity changes
    with each turn: the centre of a body that tumbles would drift.
    """
    for joint in range(mechanism.joint_type.shape[0]):
        dof = mechanism.joint_dof[joint]
        body = mechanism.dof_body[dof]
        if mechanism.joint_type[joint] != FREE or is_centred(mechanism, body):
            continue
        m, q = state.xmat[body], mechanism.joint_qpos[joint]
        x, y, z = offset(m, mechanism.centre, body)
        wx, wy, wz = turned(m, state.qvel, dof + 3, state.qacc, timestep)
        vx, vy, vz = wy * z - wz * y, wz * x - wx * z, wx * y - wy * x  # of the centre, less the frame's
        nx, ny, nz = rotated(x, y, z, timestep * wx, timestep * wy, timestep * wz)
        px, py, pz = x + timestep * vx - nx, y + timestep * vy - ny, z + timestep * vz - nz
        vx, vy, vz = vx - wy * nz + wz * ny, vy - wz * nx + wx * nz, vz - wx * ny + wy * nx
        state.qacc[dof] += vx / timestep
        state.qacc[dof + 1] += vy / timestep
        state.qacc[dof + 2] += vz / timestep
        state.qpos[q] += px - timestep * vx
        state.qpos[q + 1] += py - timestep * vy
        state.qpos[q + 2] += pz - timestep * vz


def is_centred(mechanism, body):
    """Return whether a body's centre of mass is the origin of its frame."""
    centre = mechanism.centre
    return centre[body, 0] == 0.0 and centre[body, 1] == 0.0 and centre[body, 2] == 0.0


def offset(m, centre, body):
    """Return the way (m) from the origin of a body's frame to its centre of mass, along the world's axes."""
    x, y, z = centre[body, 0], centre[body, 1], centre[body, 2]
    return m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z, m[6] * x + m[7] * y + m[8] * z


def turned(m, velocity, first, acceleration, timestep):
    """Return the world components of three velocities in a frame, after a time step."""
    x = velocity[first] + timestep * acceleration[first]
    y = velocity[first + 1] + timestep * acceleration[first + 1]
    z = velocity[first + 2] + timestep * acceleration[first + 2]
    return m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z, m[6] * x + m[7] * y + m[8] * z


def rotated(x, y, z, rx, ry, rz):
    """Return a vector rotated by a rotation vector, after Rodrigues."""
    square = rx * rx + ry * ry + rz * rz
    if square < 1e-16:
        return x + ry * z - rz * y, y + rz * x - rx * z, z + rx * y - ry * x
    angle = np.sqrt(square)
    sine, rest = np.sin(angle) / angle, (1.0 - np.cos(angle)) / square
    ux, uy, uz = ry * z - rz * y, rz * x - rx * z, rx * y - ry * x
    return (
        x + sine * ux + rest * (ry * uz - rz * uy),
        y + sine * uy + rest * (rz * ux - rx * uz),
        z + sine * uz + rest * (rx * uy - ry * ux),
    )

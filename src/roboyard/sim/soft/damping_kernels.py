"""Compiled loops for the damping of soft bodies as the velocities after a step cause it."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled

MOST_ROUNDS = 60
"""Most rounds of conjugate gradients."""
ENOUGH = 1e-10
"""Square of the share of the first residual at which they end."""
HELD_SHARE = 0.999
"""Share of the largest friction below which a contact does not slide."""
ALIKE = 0.999
"""Cosine of the angle between two normals that count as one."""
FREE, ON_A_PLANE, FIXED = 0, 1, 2
"""A node may change its velocity in all directions, in those of a plane, or in none."""


@compiled("i4[:,:] i4[:,:] i4[:] i4[:,:] i4[:,:] i4[:] f8[:,:] f8[:,:] f8[:] i4[:] i8 i4[:,:] i4[:] f8[:,:]")
def mark_fixed(  # pragma: no cover
    geom, flex, address, element, vertex, dim, frame, friction, force, dims, body, elements, kind, normal
):
    """Write which velocities of nodes contacts decide: along the normal, or all where they do not slide.

    geom, flex, element, vertex: (ncon, 2) of contacts, -1 for none. address: (ncon,) of their rows in
    `force`, -1 for none; dim: numbers of them. frame: (ncon, 9), the normal first. friction: (ncon, 5).
    dims: of all flexes. body: the flex of the nodes. elements: (m, 3 or 4) its nodes. kind: (n,) FREE before;
    normal: (n, 3).
    """
    for i in range(address.shape[0]):
        row = address[i]
        if row < 0 or force[row] <= 0.0:
            continue
        slides = True
        if dim[i] >= 3:
            pull = np.sqrt(force[row + 1] ** 2 + force[row + 2] ** 2)
            slides = pull >= HELD_SHARE * friction[i, 0] * force[row]
        for side in range(2):
            if flex[i, side] != body:
                continue
            if vertex[i, side] >= 0:
                fix(kind, normal, vertex[i, side], frame, i, slides)
            elif element[i, side] >= 0:
                for k in range(dims[body] + 1):
                    fix(kind, normal, elements[element[i, side], k], frame, i, slides)


def fix(kind, normal, node, frame, contact, slides):
    """Note that a contact decides the velocity of a node, in part if it slides."""
    if not slides:
        kind[node] = FIXED
    elif kind[node] == FREE:
        kind[node] = ON_A_PLANE
        for c in range(3):
            normal[node, c] = frame[contact, c]
    elif kind[node] == ON_A_PLANE:
        along = 0.0
        for c in range(3):
            along += normal[node, c] * frame[contact, c]
        if abs(along) < ALIKE:
            kind[node] = FIXED


@compiled(
    "i4[:,:] f8 i8 i4[:,:] f8[:,:,:] f8[:] f8 f8 f8[:,:] i8 f8[:] i4[:] f8[:,:] f8 f8[:,:,:] f8[:,:] -> i8"
)
def damp(  # pragma: no cover
    ends, damping, all_directions, nodes, inverse, volume, mu, lam, position, row, mass, kind, normal,
    timestep, work, speed,
):  # fmt: skip
    """Change the velocities of nodes, without damping, into those with it; return the number of rounds.

    Solves (M + h D) v = M u by conjugate gradients for the velocities v, with the masses M, the damping D
    and the velocities u without it, in the directions in which nodes are free. The rest keeps its velocity.

    ends: (k, 2) of springs, with their damping (N s/m), along them or of the whole relative velocity. nodes:
    (k, 4) of tetrahedra, inverse: (k, 3, 3), volume: (k,), with mu and lam of viscosity (Pa s). position:
    (nbody, 3) (m), of the nodes from `row` on. mass: (n,) (kg). kind: (n,), normal: (n, 3); of
    `mark_fixed`. timestep (s). work: (5, n, 3). speed: (n, 3) (m/s).
    """
    rest, step, product, scale, diagonal = work[0], work[1], work[2], work[3], work[4]
    count = mass.shape[0]
    law = (damping, all_directions, mu, lam)
    add_damping(ends, nodes, inverse, volume, law, position, row, speed, rest)
    add_diagonal(ends, nodes, inverse, volume, law, position, row, diagonal)
    for k in range(count):
        for c in range(3):
            rest[k, c] *= -timestep
            diagonal[k, c] = mass[k] + timestep * diagonal[k, c]
    project(kind, normal, rest)
    error = 0.0
    for k in range(count):
        for c in range(3):
            scale[k, c] = rest[k, c] / diagonal[k, c]
    project(kind, normal, scale)
    for k in range(count):
        for c in range(3):
            step[k, c] = scale[k, c]
            error += rest[k, c] * scale[k, c]
    first, rounds = error, 0
    while rounds < MOST_ROUNDS and error > ENOUGH * first and error > 1e-300:
        rounds += 1
        add_damping(ends, nodes, inverse, volume, law, position, row, step, product)
        curvature = 0.0
        for k in range(count):
            for c in range(3):
                product[k, c] = mass[k] * step[k, c] + timestep * product[k, c]
                curvature += product[k, c] * step[k, c]
        if curvature <= 0.0:
            break
        length = error / curvature
        for k in range(count):
            for c in range(3):
                speed[k, c] += length * step[k, c]
                rest[k, c] -= length * product[k, c]
        project(kind, normal, rest)
        for k in range(count):
            for c in range(3):
                scale[k, c] = rest[k, c] / diagonal[k, c]
        project(kind, normal, scale)
        before, error = error, 0.0
        for k in range(count):
            for c in range(3):
                error += rest[k, c] * scale[k, c]
        for k in range(count):
            for c in range(3):
                step[k, c] = scale[k, c] + error / before * step[k, c]
    return rounds


def project(kind, normal, vectors):
    """Remove what nodes are not free to do from (n, 3) vectors."""
    for k in range(kind.shape[0]):
        if kind[k] == FIXED:
            for c in range(3):
                vectors[k, c] = 0.0
        elif kind[k] == ON_A_PLANE:
            along = 0.0
            for c in range(3):
                along += vectors[k, c] * normal[k, c]
            for c in range(3):
                vectors[k, c] -= along * normal[k, c]


def add_damping(ends, nodes, inverse, volume, law, position, row, speed, product):
    """Write D times (n, 3) velocities: minus the forces of dampers."""
    damping, all_directions, mu, lam = law
    for k in range(product.shape[0]):
        for c in range(3):
            product[k, c] = 0.0
    for k in range(ends.shape[0]):
        a, b = ends[k, 0], ends[k, 1]
        vx, vy, vz = speed[b, 0] - speed[a, 0], speed[b, 1] - speed[a, 1], speed[b, 2] - speed[a, 2]
        if all_directions == 0:
            dx = position[row + b, 0] - position[row + a, 0]
            dy = position[row + b, 1] - position[row + a, 1]
            dz = position[row + b, 2] - position[row + a, 2]
            squared = dx * dx + dy * dy + dz * dz
            along = (dx * vx + dy * vy + dz * vz) / squared if squared > 1e-24 else 0.0
            vx, vy, vz = along * dx, along * dy, along * dz
        product[a, 0] -= damping * vx
        product[a, 1] -= damping * vy
        product[a, 2] -= damping * vz
        product[b, 0] += damping * vx
        product[b, 1] += damping * vy
        product[b, 2] += damping * vz
    for k in range(nodes.shape[0]):
        a = nodes[k, 0]
        trace = 0.0
        for r in range(3):
            for j in range(3):
                trace += (speed[nodes[k, j + 1], r] - speed[a, r]) * inverse[k, j, r]
        for r in range(3):
            for c in range(3):
                # stress in row r and column c, and what it does to the nodes
                stress = lam * trace if r == c else 0.0
                for j in range(3):
                    b = nodes[k, j + 1]
                    stress += mu * (speed[b, r] - speed[a, r]) * inverse[k, j, c]
                    stress += mu * (speed[b, c] - speed[a, c]) * inverse[k, j, r]
                for j in range(3):
                    share = volume[k] * stress * inverse[k, j, c]
                    product[nodes[k, j + 1], r] += share
                    product[a, r] -= share


def add_diagonal(ends, nodes, inverse, volume, law, position, row, diagonal):
    """Write the diagonal of D as (n, 3)."""
    damping, all_directions, mu, lam = law
    for k in range(diagonal.shape[0]):
        for c in range(3):
            diagonal[k, c] = 0.0
    for k in range(ends.shape[0]):
        a, b = ends[k, 0], ends[k, 1]
        squared = 0.0
        for c in range(3):
            squared += (position[row + b, c] - position[row + a, c]) ** 2
        for c in range(3):
            share = damping
            if all_directions == 0:
                way = position[row + b, c] - position[row + a, c]
                share = damping * way * way / squared if squared > 1e-24 else 0.0
            diagonal[a, c] += share
            diagonal[b, c] += share
    for k in range(nodes.shape[0]):
        for i in range(4):
            length = 0.0
            for c in range(3):
                length += slope(inverse, k, i, c) ** 2
            for c in range(3):
                along = slope(inverse, k, i, c)
                share = mu * (length + along * along) + lam * along * along
                diagonal[nodes[k, i], c] += volume[k] * share


def slope(inverse, k, i, c):
    """Return the derivative along an axis (1/m) of the weight of node i in tetrahedron k."""
    if i > 0:
        return inverse[k, i - 1, c]
    return -(inverse[k, 0, c] + inverse[k, 1, c] + inverse[k, 2, c])

"""Compiled loops over the springs and tetrahedra of soft bodies."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled


@compiled("i4[:,:] f8[:] f8[:] f8 i8 i8 i8 f8[:,:] f8[:] f8[:]")
def add_spring_forces(  # pragma: no cover
    ends, length, stiffness, damping, all_directions, row, dof, position, velocity, force
):
    """Add the forces (N) of springs to generalised forces.

    ends: (k, 2). length, stiffness: (k,). damping: of each spring (N s/m), along it or, with
    `all_directions`, of the whole relative velocity. row, dof: of the first node in `position`, (nbody, 3),
    and in `velocity` and `force`, (nv,); each node has three degrees of freedom, along the world's axes.
    """
    for k in range(ends.shape[0]):
        a, b = ends[k, 0], ends[k, 1]
        i, j = dof + 3 * a, dof + 3 * b
        dx = position[row + b, 0] - position[row + a, 0]
        dy = position[row + b, 1] - position[row + a, 1]
        dz = position[row + b, 2] - position[row + a, 2]
        vx = velocity[j] - velocity[i]
        vy = velocity[j + 1] - velocity[i + 1]
        vz = velocity[j + 2] - velocity[i + 2]
        distance = np.sqrt(dx * dx + dy * dy + dz * dz)
        along = 0.0
        if distance > 1e-12:
            along = stiffness[k] * (distance - length[k]) / distance
            if all_directions == 0:
                along += damping * (dx * vx + dy * vy + dz * vz) / (distance * distance)
        fx, fy, fz = along * dx, along * dy, along * dz
        if all_directions != 0:
            fx += damping * vx
            fy += damping * vy
            fz += damping * vz
        force[i] += fx
        force[i + 1] += fy
        force[i + 2] += fz
        force[j] -= fx
        force[j + 1] -= fy
        force[j + 2] -= fz


@compiled("i4[:,:] f8[:,:,:] f8[:] f8 f8 f8 i8 i8 f8[:,:] f8[:] f8[:,:] f8[:]")
def add_solid_forces(  # pragma: no cover
    nodes, inverse, volume, mu, lam, damping, row, dof, position, velocity, work, force
):
    """Add the forces (N) of stable Neo-Hookean tetrahedra to generalised forces.

    With F the deformation gradient, J its determinant, C its cofactors and D = dF/dt, the stress is
    P = mu (1 - 1 / (|F|² + 1)) F + (lam (J - 1) - 3/4 mu) C + damping (mu (D + D') + lam tr(D) 1)
    (Smith, de Goes, Kim 2018, without damping). nodes: (k, 4), inverse: (k, 3, 3), volume: (k,), at rest;
    mu, lam (Pa), damping (s). work: (12, 3). The rest as in `add_spring_forces`.
    """
    s, w, f, p = work[0:3], work[3:6], work[6:9], work[9:12]
    for k in range(nodes.shape[0]):
        a = nodes[k, 0]
        for c in range(3):
            b = nodes[k, c + 1]
            for r in range(3):
                s[r, c] = position[row + b, r] - position[row + a, r]
                w[r, c] = velocity[dof + 3 * b + r] - velocity[dof + 3 * a + r]
        square, rate = 0.0, 0.0
        for r in range(3):
            for c in range(3):
                f[r, c] = s[r, 0] * inverse[k, 0, c] + s[r, 1] * inverse[k, 1, c] + s[r, 2] * inverse[k, 2, c]
                square += f[r, c] * f[r, c]
            rate += w[r, 0] * inverse[k, 0, r] + w[r, 1] * inverse[k, 1, r] + w[r, 2] * inverse[k, 2, r]
        shear = mu * (1.0 - 1.0 / (square + 1.0))
        for r in range(3):
            r1, r2 = (r + 1) % 3, (r + 2) % 3
            for c in range(3):
                c1, c2 = (c + 1) % 3, (c + 2) % 3
                p[r, c] = f[r1, c1] * f[r2, c2] - f[r1, c2] * f[r2, c1]
        volumetric = f[0, 0] * p[0, 0] + f[0, 1] * p[0, 1] + f[0, 2] * p[0, 2] - 1.0
        pressure = lam * volumetric - 0.75 * mu
        for r in range(3):
            for c in range(3):
                p[r, c] = shear * f[r, c] + pressure * p[r, c]
        if damping > 0.0:
            for r in range(3):
                for c in range(3):
                    p[r, c] += (
                        damping
                        * mu
                        * (
                            w[r, 0] * inverse[k, 0, c]
                            + w[r, 1] * inverse[k, 1, c]
                            + w[r, 2] * inverse[k, 2, c]
                            + w[c, 0] * inverse[k, 0, r]
                            + w[c, 1] * inverse[k, 1, r]
                            + w[c, 2] * inverse[k, 2, r]
                        )
                    )
                p[r, r] += damping * lam * rate
        for r in range(3):
            total = 0.0
            for c in range(3):
                part = -volume[k] * (
                    p[r, 0] * inverse[k, c, 0] + p[r, 1] * inverse[k, c, 1] + p[r, 2] * inverse[k, c, 2]
                )
                force[dof + 3 * nodes[k, c + 1] + r] += part
                total += part
            force[dof + 3 * a + r] -= total


@compiled(
    "i4[:,:] i4[:,:] i4[:,:] i4[:,:] f8[:] f8[:,:] f8[:,:] i4[:] i4[:] i4[:] i4[:] i4[:] f8[:,:] f8 -> i8"
)
def merge_contacts(  # pragma: no cover
    geom, flex, element, vertex, dist, position, frame, exclude, elements, first_element, dims, first_vertex,
    vertices, near,
):  # fmt: skip
    """Give contacts of elements with shapes at a node to the node, once.

    Returns how many contacts are of two shapes.
    MuJoCo finds one for each element of which the node is a part, and shares its forces out to all nodes of
    the element by their distances.
    geom, flex, element, vertex: (ncon, 2), -1 for none. frame: (ncon, 9), the normal first. exclude: (ncon,),
    1 where a contact gets no rows. elements: nodes of all elements, those of each flex from `first_element`
    on, of each one more than `dims`. vertices: (n, 3) all nodes (m), those of each flex from `first_vertex`
    on. near: how far (m) points, and as a share of 1 m normals, of one contact are apart at most.
    """
    rigid = 0
    for i in range(dist.shape[0]):
        if geom[i, 0] >= 0 and geom[i, 1] >= 0:
            rigid += 1
            continue
        side = 1 if flex[i, 1] >= 0 else 0
        if exclude[i] != 0 or geom[i, 1 - side] < 0 or flex[i, side] < 0:
            continue
        if element[i, side] >= 0:
            body = flex[i, side]
            count = dims[body] + 1
            start = first_element[body] + element[i, side] * count
            for k in range(start, start + count):
                v = first_vertex[body] + elements[k]
                x, y, z = (
                    position[i, 0] - vertices[v, 0],
                    position[i, 1] - vertices[v, 1],
                    position[i, 2] - vertices[v, 2],
                )
                along = x * frame[i, 0] + y * frame[i, 1] + z * frame[i, 2]
                x -= along * frame[i, 0]
                y -= along * frame[i, 1]
                z -= along * frame[i, 2]
                if max(abs(x), abs(y), abs(z)) < near:
                    element[i, side] = -1
                    vertex[i, side] = elements[k]
                    break
        if vertex[i, side] < 0:
            continue
        for j in range(i):
            if exclude[j] != 0 or vertex[j, side] != vertex[i, side] or flex[j, side] != flex[i, side]:
                continue
            if geom[j, 1 - side] != geom[i, 1 - side]:
                continue
            apart = 0.0
            for k in range(3):
                apart = max(apart, abs(frame[i, k] - frame[j, k]))
            if apart < near:
                exclude[i] = 1
                break
    return rigid


@compiled("i4[:,:] i4[:,:] i8 i4[:,:]")
def name_surfaces(geom, flex, geoms, surface):  # pragma: no cover
    """Write the (ncon, 2) surfaces of contacts: rows of geoms, then of flexes from `geoms` on."""
    for i in range(geom.shape[0]):
        for k in range(2):
            surface[i, k] = geom[i, k] if geom[i, k] >= 0 else flex[i, k] + geoms


@compiled("i4[:] i4[:,:] f8[:] f8 f8 f8[:] f8[:]")
def limit_push(address, flex, velocity, timestep, largest, base, reference):  # pragma: no cover
    """Bound the speed (m/s) with which contacts push nodes out of what these are in.

    address: (ncon,) rows of the normals, -1 for none. flex: (ncon, 2), -1 for none. velocity: (nefc,) (m/s).
    timestep (s). base, reference: (nefc,) accelerations (m/s²) as of `hard_contacts`.
    """
    for i in range(address.shape[0]):
        row = address[i]
        if row < 0 or (flex[i, 0] < 0 and flex[i, 1] < 0):
            continue
        excess = base[row] + (velocity[row] - largest) / timestep
        if excess > 0.0:
            base[row] -= excess
            reference[row] -= excess


@compiled("i4[:] i4[:,:] f8[:] f8[:] f8[:] -> f8")
def rigid_change(address, flex, force, before, reference):  # pragma: no cover
    """Return the largest change of the normal references of rigid contacts that push, or begin to (m/s²).

    address: (ncon,) rows of the normals, -1 for none. flex: (ncon, 2), -1 for none. force, before, reference:
    (nefc,).
    """
    largest = 0.0
    for i in range(address.shape[0]):
        row = address[i]
        if row < 0 or flex[i, 0] >= 0 or flex[i, 1] >= 0:
            continue
        change = reference[row] - before[row]
        if force[row] > 0.0 or change > 0.0:
            largest = max(largest, abs(change))
    return largest

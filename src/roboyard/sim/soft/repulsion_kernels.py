"""Compiled loops that keep the parts of a soft body from passing through each other, by Bullet's rule."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled
from roboyard.sim.soft.face_tree import ADDEND, BITS, FACTOR, SEED

OVERLAP_SHARE = 0.1
"""Share of the overlap that is corrected in a step at most."""
ROUNDING = 2.2e-14
"""Distance (m) by which boxes are larger where nothing else is added."""
ON_A_FACE = 1e-6
"""How far from a face (m) a node counts as on it, where their ways cross."""
CROSSING_ROUNDS = 5
"""Most rounds in a step in which ways that cross are looked for."""
PARALLEL = 4.9e-32
"""Square of a sum of normals below which it has no direction."""


@compiled("i4[:,:] i4[:,:] i4[:] i4[:,:] i4[:,:] i4[:] i8 i4[:,:] i4[:]")
def mark_held(geom, flex, address, element, vertex, dims, body, elements, held):  # pragma: no cover
    """Write 1 into `held`, (n,), of nodes that touch shapes.

    geom, flex, element, vertex: (ncon, 2) of contacts, -1 for none. address: (ncon,) of their rows, -1 for
    none. dims: of all flexes. body: the flex of the nodes. elements: (m, 3 or 4) its nodes.
    """
    for i in range(address.shape[0]):
        if address[i] < 0:
            continue
        for side in range(2):
            if flex[i, side] != body or geom[i, 1 - side] < 0:
                continue
            if vertex[i, side] >= 0:
                held[vertex[i, side]] = 1
            elif element[i, side] >= 0:
                for k in range(dims[body] + 1):
                    held[elements[element[i, side], k]] = 1


@compiled(
    "i4[:,:] i4[:,:] f8[:,:] i8 f8[:] i4[:] f8 f8 f8 i8 f8 i4[:,:] f8[:,:] f8[:,:] f8[:] i4[:,:] f8[:,:]"
    " i4[:] f8[:,:] -> i8"
)
def repel(  # pragma: no cover
    faces, children, position, row, mass, held, margin, stiffness, friction, one_sided, timestep, stack,
    boxes, normals, angles, pairs, places, order, speed,
):  # fmt: skip
    """Change velocities so that nodes and faces of a soft body stay apart; return the number of contacts.

    Each node that is less than twice the margin from a face without it is a contact, once for each face of
    which it is a part. An impulse takes half of the speed at which they approach and pushes them apart as a
    spring does; where ways still cross within the step, half of the remaining speed is taken, up to five
    times. Parts of the surface whose normals lie within a half space of each other are not looked at.

    Source: Bullet 3.2, `btSoftBody::applyRepulsionForce`, `btDeformableMultiBodyDynamicsWorld`.

    faces: (m, 3). children: of a `FaceTree`. position: (nbody, 3) (m), of the nodes from `row` on. mass: (n,)
    (kg), 0 for nodes that nothing moves. held: (n,) 1 for those that touch shapes. margin: of the surface
    (m). stiffness (N/m). friction: coefficient. one_sided: 1 for the surface of a solid. timestep (s).
    stack: (s, 2), boxes: (2 m - 1, 6), normals: (2 m - 1, 3), angles: (2 m - 1,), pairs, places, order:
    (c, 2), (c, 6), (c,) for the contacts; to work in. speed: (n, 3) velocities (m/s).
    """
    measure(faces, children, position, row, speed, timestep, margin, boxes, normals, angles)
    found = near_nodes(
        faces, children, position, row, 2.0 * margin, one_sided, stack, boxes, normals, angles, pairs, places
    )
    if found == 0:
        return 0
    law = (2.0 * margin, friction, timestep)
    seed = push(faces, position, row, mass, held, law, stiffness, found, pairs, places, order, speed, SEED)
    measure(faces, children, position, row, speed, timestep, ROUNDING, boxes, normals, angles)
    for _ in range(CROSSING_ROUNDS):
        if crosses(faces, children, position, row, speed, timestep, stack, boxes, angles) == 0:
            break
        seed = push(faces, position, row, mass, held, law, -1.0, found, pairs, places, order, speed, seed)
    return found


def measure(faces, children, position, row, speed, timestep, pad, boxes, normals, angles):
    """Write boxes around faces on their ways through the step, their normals, and the angles of these."""
    count = faces.shape[0]
    for f in range(count):
        for c in range(3):
            low, high = np.inf, -np.inf
            for k in range(3):
                at = position[row + faces[f, k], c]
                then = at + timestep * speed[faces[f, k], c]
                low = min(low, at, then)
                high = max(high, at, then)
            boxes[f, c], boxes[f, 3 + c] = low - pad, high + pad
        a, b, d = row + faces[f, 0], row + faces[f, 1], row + faces[f, 2]
        squared = 0.0
        for c in range(3):
            c1, c2 = (c + 1) % 3, (c + 2) % 3
            normals[f, c] = (position[b, c1] - position[a, c1]) * (position[d, c2] - position[a, c2]) - (
                position[b, c2] - position[a, c2]
            ) * (position[d, c1] - position[a, c1])
            squared += normals[f, c] * normals[f, c]
        make_unit(normals, f, squared)
        angles[f] = 0.0
    for k in range(children.shape[0]):
        node, one, two = count + k, children[k, 0], children[k, 1]
        squared, along = 0.0, 0.0
        for c in range(3):
            boxes[node, c] = min(boxes[one, c], boxes[two, c])
            boxes[node, 3 + c] = max(boxes[one, 3 + c], boxes[two, 3 + c])
            normals[node, c] = normals[one, c] + normals[two, c]
            squared += normals[node, c] * normals[node, c]
            along += normals[one, c] * normals[two, c]
        make_unit(normals, node, squared)
        angles[node] = max(angles[one], angles[two]) + 0.5 * np.arccos(min(1.0, max(-1.0, along)))


def make_unit(normals, row, squared):
    """Make a vector of this square of its length a unit vector."""
    if squared >= PARALLEL:
        length = np.sqrt(squared)
        for c in range(3):
            normals[row, c] /= length
    else:
        normals[row, 0], normals[row, 1], normals[row, 2] = 1.0, 0.0, 0.0


def next_pair(children, count, stack, depth, boxes, angles):
    """Return the new depth of the stack, and two faces whose boxes overlap; -1 for none yet."""
    one, two = stack[depth - 1, 0], stack[depth - 1, 1]
    depth -= 1
    if one == two:
        if one >= count and angles[one] > np.pi:
            first, second = children[one - count, 0], children[one - count, 1]
            stack[depth, 0], stack[depth, 1] = first, first
            stack[depth + 1, 0], stack[depth + 1, 1] = second, second
            stack[depth + 2, 0], stack[depth + 2, 1] = first, second
            depth += 3
        return depth, -1, -1
    for c in range(3):
        if boxes[one, c] > boxes[two, 3 + c] or boxes[two, c] > boxes[one, 3 + c]:
            return depth, -1, -1
    if one < count and two < count:
        return depth, one, two
    for i in range(2):
        for j in range(2):
            if (one < count and j == 1) or (two < count and i == 1):
                continue
            stack[depth, 0] = one if one < count else children[one - count, j]
            stack[depth, 1] = two if two < count else children[two - count, i]
            depth += 1
    return depth, -1, -1


def share_a_node(faces, one, two):
    """Return whether two faces have a node in common."""
    for i in range(3):
        for j in range(3):
            if faces[one, i] == faces[two, j]:
                return True
    return False


def near_nodes(
    faces, children, position, row, reach, one_sided, stack, boxes, normals, angles, pairs, places
):
    """Write nodes and faces that are near each other, weights and normals; return how many."""
    found, count = 0, faces.shape[0]
    depth = 1
    stack[0, 0] = stack[0, 1] = 2 * count - 2
    while depth > 0:
        depth, one, two = next_pair(children, count, stack, depth, boxes, angles)
        if one < 0 or share_a_node(faces, one, two):
            continue
        for turn in range(2):
            of, face = (one, two) if turn == 0 else (two, one)
            for k in range(3):
                if found >= order_room(pairs):
                    return found
                node = faces[of, k]
                normal = normals[face, 0], normals[face, 1], normals[face, 2]
                corner = faces[face, 2]
                height = 0.0
                for c in range(3):
                    height += (position[row + node, c] - position[row + corner, c]) * normals[face, c]
                near, u, v, w = weights_of(faces, face, position, row, node, 0.0, position, height, reach)
                if not near:
                    continue
                sign = 1.0 if one_sided != 0 or height >= 0.0 else -1.0
                pairs[found, 0], pairs[found, 1] = node, face
                places[found, 0], places[found, 1], places[found, 2] = u, v, w
                for c in range(3):
                    places[found, 3 + c] = sign * normal[c]
                found += 1
    return found


def order_room(pairs):
    """Return how many contacts there is room for."""
    return pairs.shape[0]


def weights_of(faces, face, position, row, node, time, speed, height, reach):
    """Return whether a node is within reach of a face after a time, and its weights there.

    height: of the node over the plane of the face (m).
    """
    if abs(height) > reach:
        return False, 0.0, 0.0, 0.0
    a, b, d = faces[face, 0], faces[face, 1], faces[face, 2]
    a11, a22, a12, b1, b2 = 0.0, 0.0, 0.0, 0.0, 0.0
    for c in range(3):
        last = position[row + d, c]
        x, y, z = position[row + a, c] - last, position[row + b, c] - last, position[row + node, c] - last
        if time > 0.0:
            x += time * (speed[a, c] - speed[d, c])
            y += time * (speed[b, c] - speed[d, c])
            z += time * (speed[node, c] - speed[d, c])
        a11 += x * x
        a22 += y * y
        a12 += x * y
        b1 += x * z
        b2 += y * z
    determinant = a11 * a22 - a12 * a12
    if determinant < 2.2e-16:
        return False, 0.0, 0.0, 0.0
    u, v = (b1 * a22 - b2 * a12) / determinant, (b2 * a11 - b1 * a12) / determinant
    w = 1.0 - u - v
    beyond = reach / np.sqrt(0.5 * np.sqrt(determinant))
    inside = min(u, v, w) >= -beyond and max(u, v, w) <= 1.0 + beyond
    return inside, u, v, w


def push(faces, position, row, mass, held, law, stiffness, found, pairs, places, order, speed, seed):
    """Apply the impulses of all contacts in turn; a stiffness below 0: without springs. Return the seed."""
    reach, friction, timestep = law
    for i in range(found):
        order[i] = i
    for i in range(found):
        seed = (FACTOR * seed + ADDEND) & BITS
        other = seed % found
        order[i], order[other] = order[other], order[i]
    for i in range(found):
        k = order[i]
        node, face = pairs[k, 0], pairs[k, 1]
        if mass[node] == 0.0:
            continue
        overlap, closing, squared = reach, 0.0, 1.0
        for c in range(3):
            gap, way = position[row + node, c], speed[node, c]
            for j in range(3):
                gap -= places[k, j] * position[row + faces[face, j], c]
                way -= places[k, j] * speed[faces[face, j], c]
            overlap -= places[k, 3 + c] * gap
            closing += places[k, 3 + c] * way
            squared += places[k, c] * places[k, c]
        overlap = max(0.0, overlap)
        if closing > OVERLAP_SHARE * overlap / timestep:
            continue
        impulse = 0.0
        if stiffness >= 0.0:
            corrected = mass[node] * (OVERLAP_SHARE * overlap / timestep - closing)
            impulse = -min(stiffness * timestep * overlap, corrected)
        if closing < 0.0:
            impulse += 0.5 * mass[node] * closing
        node_is_held, face_is_held = held[node] != 0, False
        for j in range(3):
            face_is_held = face_is_held or held[faces[face, j]] != 0
        share = (4.0 if node_is_held or face_is_held else 2.0) / squared / mass[node]
        sliding = 0.0
        for c in range(3):
            way = speed[node, c]
            for j in range(3):
                way -= places[k, j] * speed[faces[face, j], c]
            way -= closing * places[k, 3 + c]
            sliding += way * way
        sliding = np.sqrt(sliding)
        lost = 0.0
        if sliding > 2.2e-16:
            lost = 0.5 * min(1.0, max(0.0, -2.0 * friction * impulse / mass[node] / sliding)) * mass[node]
        for c in range(3):
            way = speed[node, c]
            for j in range(3):
                way -= places[k, j] * speed[faces[face, j], c]
            way -= closing * places[k, 3 + c]
            change = share * (impulse * places[k, 3 + c] + lost * way)
            if not face_is_held:
                for j in range(3):
                    speed[faces[face, j], c] += places[k, j] * change
            if not node_is_held:
                speed[node, c] -= change
    return seed


def crosses(faces, children, position, row, speed, timestep, stack, boxes, angles):
    """Return 1 if any node passes through a face within the step, else 0."""
    count = faces.shape[0]
    depth = 1
    stack[0, 0] = stack[0, 1] = 2 * count - 2
    while depth > 0:
        depth, one, two = next_pair(children, count, stack, depth, boxes, angles)
        if one < 0 or share_a_node(faces, one, two):
            continue
        for k in range(3):
            if passes(faces, two, position, row, faces[one, k], speed, timestep):
                return 1
            if passes(faces, one, position, row, faces[two, k], speed, timestep):
                return 1
    return 0


def passes(faces, face, position, row, node, speed, timestep):
    """Return whether a node passes through a face within the step.

    Its height over the moving plane is a polynomial of degree 3; of its Bernstein coefficients, all of one
    sign exclude it.
    """
    a0, a1, a2, a3 = height_of(faces, face, position, row, node, speed)
    h = timestep
    k0, k1 = a0, a0 + a1 * h / 3.0
    k2, k3 = a0 + (2.0 * a1 + a2 * h) * h / 3.0, a0 + (a1 + (a2 + a3 * h) * h) * h
    if min(k0, k1, k2, k3) > 0.0 or max(k0, k1, k2, k3) < 0.0:
        return False
    # between the extrema there is one root at most
    first, second = h, h
    if abs(a3) > 1e-300:
        square = a2 * a2 - 3.0 * a3 * a1
        if square > 0.0:
            root = np.sqrt(square)
            first, second = (-a2 - root) / (3.0 * a3), (-a2 + root) / (3.0 * a3)
            if first > second:
                first, second = second, first
    elif abs(a2) > 1e-300:
        first = -0.5 * a1 / a2
    first, second = min(h, max(0.0, first)), min(h, max(0.0, second))
    for piece in range(3):
        low = 0.0 if piece == 0 else (first if piece == 1 else second)
        high = first if piece == 0 else (second if piece == 1 else h)
        if high <= low:
            continue
        at_low = a0 + low * (a1 + low * (a2 + low * a3))
        at_high = a0 + high * (a1 + high * (a2 + high * a3))
        if at_low * at_high > 0.0 or (at_low == 0.0 and at_high == 0.0):
            continue
        for _ in range(60):
            middle = 0.5 * (low + high)
            value = a0 + middle * (a1 + middle * (a2 + middle * a3))
            if value * at_low > 0.0:
                low = middle
            else:
                high = middle
        if high > 0.0:
            inside, _, _, _ = weights_of(faces, face, position, row, node, high, speed, 0.0, ON_A_FACE)
            if inside:
                return True
    return False


def height_of(faces, face, position, row, node, speed):
    """Return the polynomial in time of six times the volume between a face and a node (m³, m³/s, ...)."""
    a, b, d = faces[face, 0], faces[face, 1], faces[face, 2]
    a0, a1, a2, a3 = 0.0, 0.0, 0.0, 0.0
    for c in range(3):
        c1, c2 = (c + 1) % 3, (c + 2) % 3
        x1, x2 = position[row + b, c1] - position[row + a, c1], position[row + b, c2] - position[row + a, c2]
        y1, y2 = position[row + d, c1] - position[row + a, c1], position[row + d, c2] - position[row + a, c2]
        v1, v2 = speed[b, c1] - speed[a, c1], speed[b, c2] - speed[a, c2]
        w1, w2 = speed[d, c1] - speed[a, c1], speed[d, c2] - speed[a, c2]
        z, u = position[row + node, c] - position[row + a, c], speed[node, c] - speed[a, c]
        still = x1 * y2 - x2 * y1
        mixed = x1 * w2 - x2 * w1 + v1 * y2 - v2 * y1
        moved = v1 * w2 - v2 * w1
        a0 += still * z
        a1 += still * u + mixed * z
        a2 += mixed * u + moved * z
        a3 += moved * u
    return a0, a1, a2, a3

"""Compiled reading of the states of links and joints, and of contacts."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._records import NamedTuple
from roboyard.native import Bundle, compiled, record
from roboyard.pybullet.bullet_rules.single_precision import matrix_signed
from roboyard.sim.stepping.impulses.contact_row_kernels import NUMBERED
from roboyard.sim.stepping.impulses.records import ORDERED
from roboyard.transforms import Array

NUMBER, LINK, KIND, ID, PLACES = range(5)
"""Columns of what is known of a geom: its body's number, its link, -1 for the base, the link's kind of
shapes, and the body's id in the World."""
ON_A, ON_B, NORMAL, DISTANCE, PUSHING = 0, 3, 6, 9, 10
ACROSS, FIRST, ALONG, SECOND, NUMBERS = 11, 12, 15, 16, 19
"""Numbers of a contact: points on A and B (m), normal on B, distance (m), normal force (N), and friction (N)
and its direction, twice."""
ANY_LINK = -2
FORCE = 9
"""Place of the forces of rows among the arrays of `Rows`."""
_NEARLY_FLAT = float(np.sqrt(0.5))


def link_pose(xpos, xquat, frames, row, link):  # pragma: no cover
    """Return the world pose of a link's inertial frame, then of its link frame in 32-bit precision.

    xpos, xquat: MuJoCo's body poses (w first). frames: (n, 7) m and x, y, z, w of each link's inertial frame
    in its link frame. row: the link's row in xpos; link: in frames.
    """
    x, y, z = xpos[row, 0], xpos[row, 1], xpos[row, 2]
    w, i, j, k = xquat[row, 0], xquat[row, 1], xquat[row, 2], xquat[row, 3]
    fx, fy, fz = frames[link, 0], frames[link, 1], frames[link, 2]
    fi, fj, fk, fw = frames[link, 3], frames[link, 4], frames[link, 5], frames[link, 6]
    # q v q* = v + w t + q x t, with t = 2 q x v
    tx, ty, tz = 2.0 * (j * fz - k * fy), 2.0 * (k * fx - i * fz), 2.0 * (i * fy - j * fx)
    position = (
        x + fx + w * tx + j * tz - k * ty,
        y + fy + w * ty + k * tx - i * tz,
        z + fz + w * tz + i * ty - j * tx,
    )
    orientation = matrix_signed(
        w * fi + i * fw + j * fk - k * fj,
        w * fj - i * fk + j * fw + k * fi,
        w * fk + i * fj - j * fi + k * fw,
        w * fw - i * fi - j * fj - k * fk,
    )
    frame_position = (float(np.float32(x)), float(np.float32(y)), float(np.float32(z)))
    frame_orientation = matrix_signed(
        float(np.float32(i)),
        float(np.float32(j)),
        float(np.float32(k)),
        float(np.float32(w)),
    )
    return position, orientation, frame_position, frame_orientation


def _rotated(q, v):  # pragma: no cover
    """Return a vector rotated by a quaternion w, x, y, z."""
    tx, ty, tz = (
        2.0 * (q[2] * v[2] - q[3] * v[1]),
        2.0 * (q[3] * v[0] - q[1] * v[2]),
        2.0 * (q[1] * v[1] - q[2] * v[0]),
    )
    return (
        v[0] + q[0] * tx + q[2] * tz - q[3] * ty,
        v[1] + q[0] * ty + q[3] * tx - q[1] * tz,
        v[2] + q[0] * tz + q[1] * ty - q[2] * tx,
    )


def link_state(xpos, xquat, frames, row, link, turned, cvel, xipos, subtree_com, rootid):  # pragma: no cover
    """Return `link_pose`, then velocity of the centre of mass (m/s) and angular velocity (rad/s), world axes.

    turned: the quaternions with which `cvel` agrees. Where xquat are those before the last position update,
    velocities turn with them, as in Bullet, which keeps them in link axes.
    cvel: angular, then linear velocity at the centre of mass of the body's tree (`subtree_com` of its root).
    """
    position, orientation, frame_position, frame_orientation = link_pose(xpos, xquat, frames, row, link)
    root = rootid[row]
    rx = xipos[row, 0] - subtree_com[root, 0]
    ry = xipos[row, 1] - subtree_com[root, 1]
    rz = xipos[row, 2] - subtree_com[root, 2]
    wx, wy, wz = cvel[row, 0], cvel[row, 1], cvel[row, 2]
    linear = (
        cvel[row, 3] + wy * rz - wz * ry,
        cvel[row, 4] + wz * rx - wx * rz,
        cvel[row, 5] + wx * ry - wy * rx,
    )
    w, x, y, z = xquat[row, 0], xquat[row, 1], xquat[row, 2], xquat[row, 3]
    tw, tx, ty, tz = turned[row, 0], turned[row, 1], turned[row, 2], turned[row, 3]
    back = (
        w * tw + x * tx + y * ty + z * tz,
        -w * tx + x * tw - y * tz + z * ty,
        -w * ty + y * tw - z * tx + x * tz,
        -w * tz + z * tw - x * ty + y * tx,
    )
    linear, angular = _rotated(back, linear), _rotated(back, (wx, wy, wz))
    return position, orientation, frame_position, frame_orientation, linear, angular


@compiled("f8[:,:] f8[:,:] f8[:,:] i8 i8 f8[:]")
def write_link_pose(xpos, xquat, frames, row, link, out):  # pragma: no cover
    """Write `link_pose` to `out` (14,)."""
    position, orientation, frame_position, frame_orientation = link_pose(xpos, xquat, frames, row, link)
    for k in range(3):
        out[k], out[7 + k] = position[k], frame_position[k]
    for k in range(4):
        out[3 + k], out[10 + k] = orientation[k], frame_orientation[k]


@compiled("f8[:,:] f8[:,:] f8[:,:] i8 i8 f8[:,:] f8[:,:] f8[:,:] f8[:,:] i4[:] f8[:]")
def write_link_state(  # pragma: no cover
    xpos, xquat, frames, row, link, turned, cvel, xipos, subtree_com, rootid, out
):
    """Write `link_state` to `out` (20,)."""
    position, orientation, frame_position, frame_orientation, linear, angular = link_state(
        xpos, xquat, frames, row, link, turned, cvel, xipos, subtree_com, rootid
    )
    for k in range(3):
        out[k], out[7 + k], out[14 + k], out[17 + k] = position[k], frame_position[k], linear[k], angular[k]
    for k in range(4):
        out[3 + k], out[10 + k] = orientation[k], frame_orientation[k]


@compiled("f8[:,:] f8[:,:] f8[:,:] i8[:] i8[:] f8[:,:,:] f8[:,:,:]")
def link_poses(xpos, xquat, frames, rows, links, positions, orientations):  # pragma: no cover
    """Write `link_pose` of several links: inertial frames to the first half of the outputs, then link frames.

    rows, links: (n,). positions: (2, n, 3) m. orientations: (2, n, 4) x, y, z, w.
    """
    for n in range(len(links)):
        a, b, c, d = link_pose(xpos, xquat, frames, rows[n], links[n])
        for k in range(3):
            positions[0, n, k], positions[1, n, k] = a[k], c[k]
        for k in range(4):
            orientations[0, n, k], orientations[1, n, k] = b[k], d[k]


@compiled(
    "f8[:,:] f8[:,:] f8[:,:] i8[:] i8[:] f8[:,:] f8[:,:] f8[:,:] f8[:,:] i4[:] f8[:,:,:] f8[:,:,:] f8[:,:,:]"
)
def link_states(  # pragma: no cover
    xpos, xquat, frames, rows, links, turned, cvel, xipos, subtree_com, rootid,
    positions, orientations, velocities,
):  # fmt: skip
    """Write `link_state` of several links as `link_poses` does, and to velocities (2, n, 3) m/s and rad/s."""
    for n in range(len(links)):
        a, b, c, d, e, f = link_state(
            xpos, xquat, frames, rows[n], links[n], turned, cvel, xipos, subtree_com, rootid
        )
        for k in range(3):
            positions[0, n, k], positions[1, n, k] = a[k], c[k]
            velocities[0, n, k], velocities[1, n, k] = e[k], f[k]
        for k in range(4):
            orientations[0, n, k], orientations[1, n, k] = b[k], d[k]


def write_box(xpos, xquat, frames, boxes, row, link, out):  # pragma: no cover
    """Write the corners of the box around a link's shapes in the world to `out` (6,); see `link_box`."""
    (x, y, z), (i, j, k, w), _, _ = link_pose(xpos, xquat, frames, row, link)
    box = boxes[link]
    if box[6] == 2.0:
        for n in range(6):
            out[n] = box[n]
        return
    u, v, t = 0.5 * (box[3] - box[0]), 0.5 * (box[4] - box[1]), 0.5 * (box[5] - box[2])
    a, b, c = 0.5 * (box[3] + box[0]), 0.5 * (box[4] + box[1]), 0.5 * (box[5] + box[2])
    if box[6] == 0.0:
        xx, xy, xz = 1.0 - 2.0 * (j * j + k * k), 2.0 * (i * j - k * w), 2.0 * (i * k + j * w)
        yx, yy, yz = 2.0 * (i * j + k * w), 1.0 - 2.0 * (i * i + k * k), 2.0 * (j * k - i * w)
        zx, zy, zz = 2.0 * (i * k - j * w), 2.0 * (j * k + i * w), 1.0 - 2.0 * (i * i + j * j)
        a, b, c = xx * a + xy * b + xz * c, yx * a + yy * b + yz * c, zx * a + zy * b + zz * c
        u, v, t = (
            abs(xx) * u + abs(xy) * v + abs(xz) * t,
            abs(yx) * u + abs(yy) * v + abs(yz) * t,
            abs(zx) * u + abs(zy) * v + abs(zz) * t,
        )
    out[0], out[1], out[2] = x + a - u, y + b - v, z + c - t
    out[3], out[4], out[5] = x + a + u, y + b + v, z + c + t


def link_box_of(xpos, xquat, frames, boxes, row, link, out):  # pragma: no cover
    """`link_box` as a part of machine code."""
    write_box(xpos, xquat, frames, boxes, row, link, out)


@compiled("f8[:,:] f8[:,:] f8[:,:] f8[:,:] i8 i8 f8[:]")
def link_box(xpos, xquat, frames, boxes, row, link, out):  # pragma: no cover
    """Write the lower and the upper corner of the box around a link's shapes in the world to `out` (6,).

    frames: (n, 7) inertial frames in link frames. boxes: (n, 8) lower and upper corner in the inertial frame,
    margins included, then 0 for a box that turns with the link, 1 for a ball's, 2 for a plane's, which is in
    the world; then whether there are shapes. row: the link's row in xpos; link: in frames.
    """
    write_box(xpos, xquat, frames, boxes, row, link, out)


class Boxes(NamedTuple):
    """Boxes around the links of all bodies, one body after another; see `link_box`."""

    xpos: Any
    xquat: Any
    frames: Any
    boxes: Any
    rows: Any
    """(n,) rows of the links in xpos."""
    reaches: Any
    """(n,) lengths (m) from the origin of a link's frame to the farthest point of its box, infinite for a
    plane, and -1 for a link without shapes."""
    first: Any
    """(n, 6) least and largest coordinates (m) in the world of links of bodies that were not placed since
    they were added; not numbers for others."""


BOXES = Bundle((record(Boxes, "f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] i8[::1] f8[::1] f8[:,::1]"),))


def reaches_of(frames: Array, boxes: Array) -> Array:
    """Return `Boxes.reaches` of (n, 7) inertial frames and (n, 8) boxes, a little larger."""
    corners = np.maximum(np.abs(boxes[:, :3]), np.abs(boxes[:, 3:6]))
    found = np.linalg.norm(frames[:, :3], axis=1) + np.linalg.norm(corners, axis=1)
    found = np.where(boxes[:, 6] == 2.0, np.inf, found * (1.0 + 1e-9) + 1e-9)
    return np.where(boxes[:, 7] == 0.0, -1.0, found)


@compiled(BOXES, "f8 f8 f8 f8 f8 f8 f8 f8[::1] i8[::1] -> i8")
def links_in_box(arrays, ax, ay, az, bx, by, bz, margin, box, found):  # pragma: no cover
    """Write the links with shapes whose boxes overlap a box to `found` (n,), the last first; return how many.

    ax to bz: lower and upper corner (m). margin: added to the boxes of links, but for `first`. box: (6,)
    scratch.
    """
    return write_links_in_box(
        *(arrays.xpos, arrays.xquat, arrays.frames, arrays.boxes, arrays.rows, arrays.reaches, arrays.first),
        *(ax, ay, az, bx, by, bz, margin, box, found),
    )


def write_links_in_box(
    xpos, xquat, frames, boxes, rows, reaches, first, ax, ay, az, bx, by, bz, margin, box, found
):  # pragma: no cover
    """`links_in_box` as a part of machine code."""
    px, py, pz, qx, qy, qz = ax - margin, ay - margin, az - margin, bx + margin, by + margin, bz + margin
    count = 0
    for link in range(len(rows) - 1, -1, -1):
        if first[link, 0] == first[link, 0]:
            is_below = first[link, 0] <= bx and first[link, 1] <= by and first[link, 2] <= bz
            if is_below and first[link, 3] >= ax and first[link, 4] >= ay and first[link, 5] >= az:
                found[count] = link
                count += 1
            continue
        row, reach = rows[link], reaches[link]
        x, y, z = xpos[row, 0], xpos[row, 1], xpos[row, 2]
        if x - reach > qx or y - reach > qy or z - reach > qz:
            continue
        if reach < 0.0 or x + reach < px or y + reach < py or z + reach < pz:
            continue
        write_box(xpos, xquat, frames, boxes, row, link, box)
        is_below = box[0] <= qx and box[1] <= qy and box[2] <= qz
        if is_below and box[3] >= px and box[4] >= py and box[5] >= pz:
            found[count] = link
            count += 1
    return count


@compiled("f8[:] f8[:] f8[:] i8[:] i8[:] f8[:,:]")
def joint_states(qpos, qvel, forces, positions, velocities, out):  # pragma: no cover
    """Gather position, velocity and motor force of joints into the rows of `out`, (3, n).

    positions, velocities: (n,) places in qpos and qvel; -1 for a fixed joint, which gives 0.
    """
    for n in range(len(positions)):
        if positions[n] < 0:
            out[0, n] = out[1, n] = out[2, n] = 0.0
        else:
            out[0, n] = qpos[positions[n]]
            out[1, n] = qvel[velocities[n]]
            out[2, n] = forces[velocities[n]]


@compiled("f8[:] f8[:] i8[:] i8[:] f8[:]")
def rest_joints(qpos, qvel, positions, velocities, values):  # pragma: no cover
    """Put joints of one degree of freedom at the values (n,), at rest.

    positions, velocities: (n,) places in qpos and qvel.
    """
    for n in range(len(values)):
        qpos[positions[n]] = values[n]
        qvel[velocities[n]] = 0.0


class Pushed(NamedTuple):
    """MuJoCo's arrays for pushing the links of a body."""

    xpos: Any
    xquat: Any
    xipos: Any
    qpos: Any
    frames: Any
    """(n, 7) inertial frames in link frames."""
    applied: Any
    """Forces and torques, xfrc_applied."""
    centres: Any
    """(nbody, 3) MuJoCo's centres of mass in body frames, body_ipos (m)."""


_PUSHED = record(Pushed, "f8[:,:] f8[:,:] f8[:,:] f8[:] f8[:,:] f8[:,:] f8[:,:]")


@compiled(_PUSHED, "f8[:,:] f8[:,:] i8 i8 i8 i8 f8 f8 f8 f8 f8 f8 f8 f8 f8 -> i8")
def push_link(  # pragma: no cover
    arrays, shown, turns, row, link, free, local, fx, fy, fz, tx, ty, tz, px, py, pz
):
    """Add a force at a point and a torque to MuJoCo's forces; return 1.

    Return 0 where they are not finite, -1 where they depend on frames that are not up to date.

    shown, turns: body poses that scripts see (w first). row: the link's row in them; link: in frames. free:
    the free joint's place in qpos, -1 for a link. local: 0 world axes, 1 axes and origin of the inertial
    frame; 2 more: at its centre; 4 more: frames are not up to date, but as scripts see them.
    """
    xpos, xquat, xipos, qpos, frames, out, centres = arrays
    x, y, z = shown[row, 0], shown[row, 1], shown[row, 2]
    w, i, j, k = turns[row, 0], turns[row, 1], turns[row, 2], turns[row, 3]
    vx, vy, vz = frames[link, 0], frames[link, 1], frames[link, 2]
    ox = oy = oz = 0.0
    if free >= 0:
        x, y, z = qpos[free], qpos[free + 1], qpos[free + 2]
        w, i, j, k = qpos[free + 3], qpos[free + 4], qpos[free + 5], qpos[free + 6]
    elif (
        abs(centres[row, 0] - vx) + abs(centres[row, 1] - vy) + abs(centres[row, 2] - vz) > 1e-12
    ):  # MuJoCo has the centre of mass of a massless link in the origin of its frame
        if local & 4:
            return -1
        cx, cy, cz = _rotated((xquat[row, 0], xquat[row, 1], xquat[row, 2], xquat[row, 3]), (vx, vy, vz))
        ox, oy, oz = (
            xpos[row, 0] + cx - xipos[row, 0],
            xpos[row, 1] + cy - xipos[row, 1],
            xpos[row, 2] + cz - xipos[row, 2],
        )
    turn = (w, i, j, k)
    if local & 1:
        fi, fj, fk, fw = frames[link, 3], frames[link, 4], frames[link, 5], frames[link, 6]
        turn = (
            w * fw - i * fi - j * fj - k * fk,
            w * fi + i * fw + j * fk - k * fj,
            w * fj - i * fk + j * fw + k * fi,
            w * fk + i * fj - j * fi + k * fw,
        )
        fx, fy, fz = _rotated(turn, (fx, fy, fz))
        tx, ty, tz = _rotated(turn, (tx, ty, tz))
    if local & 2:
        px, py, pz = 0.0, 0.0, 0.0
    elif local & 1:
        px, py, pz = _rotated(turn, (px, py, pz))
    else:
        cx, cy, cz = _rotated(turn, (vx, vy, vz))
        px, py, pz = px - x - cx, py - y - cy, pz - z - cz
    px, py, pz = px + ox, py + oy, pz + oz
    tx, ty, tz = tx + py * fz - pz * fy, ty + pz * fx - px * fz, tz + px * fy - py * fx
    total = fx + fy + fz + tx + ty + tz
    if total - total != 0.0:
        return 0
    out[row, 0] += fx
    out[row, 1] += fy
    out[row, 2] += fz
    out[row, 3] += tx
    out[row, 4] += ty
    out[row, 5] += tz
    return 1


def push_link_of(  # pragma: no cover
    xpos, xquat, xipos, qpos, frames, applied, centres, shown, turns, row, link, free, local,
    fx, fy, fz, tx, ty, tz, px, py, pz,
):  # fmt: skip
    """`push_link` as a part of machine code."""
    arrays = (xpos, xquat, xipos, qpos, frames, applied, centres)
    return push_link(arrays, shown, turns, row, link, free, local, fx, fy, fz, tx, ty, tz, px, py, pz)


class Listed(NamedTuple):
    """The contacts of a step, and room for what getContactPoints returns of them."""

    geom: Any
    """(k, 2) and the next ones: as in MuJoCo's contacts."""
    address: Any
    dim: Any
    distance: Any
    position: Any
    frame: Any
    force: Any
    """Forces along the rows of `frame`, on the second geom (N): `dim` from row NUMBERED - `address` on, or
    `address` where MuJoCo has made the rows."""
    starts: Any
    """As of `Rows`; at 9 the place in `force` of the first of MuJoCo's rows."""
    places: Any
    """(ngeom, 4), see NUMBER."""
    reaches: Any
    """(ngeom,) gaps (m) up to which contacts that do not push count."""
    numbers: Any
    """(k, 19), written."""
    links: Any
    """(k, 4) bodies A and B and their links, written."""
    counts: Any
    """The first is the number of contacts."""
    order: Any
    """Contacts in the order in which they are returned."""
    notes: Any
    """Of `Points`, with the number of those that have an order."""
    turns: Any
    """(ngeom,) `entered` of `Points`, or of no geom."""


_LISTED = record(
    Listed,
    "i4[:,:] i4[:] i4[:] f8[:] f8[:,:] f8[:,:] f8[::1] i8[::1] i4[:,::1] f8[::1] f8[:,::1] i8[:,::1]"
    " i4[::1] i4[::1] i8[::1] i4[::1]",
)
LISTED = Bundle((_LISTED,))


@compiled(LISTED, "f8 i8 i8 i8 i8 -> i8")
def list_known_contacts(listed, parts, body_a, body_b, link_a, link_b):  # pragma: no cover
    """`list_contacts` of arrays that many calls have in common."""
    return _list(listed, parts, body_a, body_b, link_a, link_b)


@compiled(_LISTED, "f8 i8 i8 i8 i8 -> i8")
def list_contacts(listed, parts, body_a, body_b, link_a, link_b):  # pragma: no cover
    """Write the contacts that are asked for; return how many there are, -1 where there is not enough room.

    parts: of the step, over which impulses are shared. body_a, ..., link_b: those that
    are asked for, -1 or `ANY_LINK` for all.

    Bodies are in Bullet's order, or A is the one asked for: then bodies and points are swapped as in Bullet,
    friction stays that on the pair's first link.
    """
    return _list(listed, parts, body_a, body_b, link_a, link_b)


def _list(listed, parts, body_a, body_b, link_a, link_b):  # pragma: no cover
    geom, position, frame, places = listed.geom, listed.position, listed.frame, listed.places
    numbers, links, count = listed.numbers, listed.links, listed.counts[0]
    if count > len(links):
        return -1
    found, is_ordered = 0, listed.notes[ORDERED] == count
    for k in range(count):
        i = listed.order[k] if is_ordered else k
        g, h = geom[i, 0], geom[i, 1]
        if body_a >= 0 and places[g, NUMBER] != body_a and places[h, NUMBER] != body_a:
            continue
        row, dim = listed.address[i], listed.dim[i]
        row = listed.starts[FORCE] + row if row >= 0 else NUMBERED - row
        first = listed.force[row] if row >= 0 else 0.0
        second = listed.force[row + 1] if row >= 0 and dim > 1 else 0.0
        third = listed.force[row + 2] if row >= 0 and dim > 2 else 0.0
        gap, pushing = listed.distance[i], first / parts
        if gap > 0.0 and pushing <= 0.0 and gap > min(listed.reaches[g], listed.reaches[h]):
            continue
        is_turned = comes_second(places, listed.turns, g, h)
        if is_turned:
            g, h = h, g
        sign = 1.0 if is_turned else -1.0
        swaps = body_a >= 0 and body_a != places[g, NUMBER]
        if swaps:
            g, h = h, g
        if body_b >= 0 and body_b != places[h, NUMBER]:
            continue
        if link_a != ANY_LINK and link_a != places[g, LINK]:
            continue
        if link_b != ANY_LINK and link_b != places[h, LINK]:
            continue
        links[found, 0], links[found, 1] = places[g, NUMBER], places[h, NUMBER]
        links[found, 2], links[found, 3] = places[g, LINK], places[h, LINK]
        x, y, z = sign * frame[i, 0], sign * frame[i, 1], sign * frame[i, 2]
        write_tangents(numbers, found, x, y, z)
        half = 0.5 * gap
        across = along = 0.0
        for d in range(3):
            n = sign * frame[i, d]
            turned = -1.0 if swaps else 1.0
            numbers[found, ON_A + d] = position[i, d] + turned * half * n
            numbers[found, ON_B + d] = position[i, d] - turned * half * n
            numbers[found, NORMAL + d] = turned * n
            push = first * frame[i, d] + second * frame[i, 3 + d] + third * frame[i, 6 + d]
            push *= sign / parts
            across += push * numbers[found, FIRST + d]
            along += push * numbers[found, SECOND + d]
        numbers[found, DISTANCE], numbers[found, PUSHING] = gap, pushing
        numbers[found, ACROSS], numbers[found, ALONG] = across, along
        found += 1
    return found


def comes_second(places, turns, g, h):
    """Return whether Bullet lists the second geom's link first; see `kind_of`."""
    if places[g, KIND] != places[h, KIND]:
        return places[g, KIND] < places[h, KIND]
    if turns.shape[0] > 0 and turns[g] != turns[h]:
        return turns[g] > turns[h]
    age = places[g, ID] - places[h, ID]
    return age > 0 or (age == 0 and places[g, LINK] > places[h, LINK])


def write_tangents(numbers, row, x, y, z):
    """Write the two directions along a surface that Bullet chooses; see `tangents`."""
    if abs(z) > _NEARLY_FLAT:
        squared = y * y + z * z
        scale = 1.0 / np.sqrt(squared)
        v, w = -z * scale, y * scale
        numbers[row, FIRST], numbers[row, FIRST + 1], numbers[row, FIRST + 2] = 0.0, v, w
        numbers[row, SECOND] = squared * scale
        numbers[row, SECOND + 1], numbers[row, SECOND + 2] = -x * w, x * v
    else:
        squared = x * x + y * y
        scale = 1.0 / np.sqrt(squared)
        u, v = -y * scale, x * scale
        numbers[row, FIRST], numbers[row, FIRST + 1], numbers[row, FIRST + 2] = u, v, 0.0
        numbers[row, SECOND], numbers[row, SECOND + 1] = -z * v, z * u
        numbers[row, SECOND + 2] = squared * scale

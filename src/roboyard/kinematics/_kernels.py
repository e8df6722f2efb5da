"""Forward kinematics, Jacobians and task errors as compiled loops.

Functions without a signature are compiled as parts of those that call them.

Layouts (see `ChainArrays.nodes`): `whole` (m, 3) parent, kind (1 prismatic), q index; `real` (m, 14)
position, rotation by rows, multiplier, offset. A frame is 12 floats: position, then rotation by rows. A
target is 3 floats (position), 7 (position, quaternion) or 16 (homogeneous matrix by rows). The Jacobian is
kept transposed, so that the columns of one joint are contiguous in memory.
"""

from __future__ import annotations

import math

from roboyard.native import compiled

TREE = "i8[:,::1] f8[:,::1]"
"""Signature of `whole` and `real`."""
CHAIN = f"{TREE} i8[::1] f8[:,::1]"
"""Signature of `whole`, `real`, `node` and `local`."""


def compose(out, i, frames, a, local, b):
    """out[i] = frames[a] · local[b]; `out` may be `frames` for i != a."""
    for r in range(3):
        x, y, z = frames[a, 3 + 3 * r], frames[a, 4 + 3 * r], frames[a, 5 + 3 * r]
        out[i, r] = frames[a, r] + x * local[b, 0] + y * local[b, 1] + z * local[b, 2]
        for c in range(3):
            out[i, 3 + 3 * r + c] = x * local[b, 3 + c] + y * local[b, 6 + c] + z * local[b, 9 + c]


def place_nodes(whole, real, q, frames):
    """Frames (m, 12) of all nodes in the base link's frame."""
    for i in range(whole.shape[0]):
        parent = whole[i, 0]
        if parent < 0:
            for k in range(12):
                frames[i, k] = real[i, k]
        else:
            compose(frames, i, frames, parent, real, i)
        value = real[i, 12] * q[whole[i, 2]] + real[i, 13]
        if whole[i, 1] == 1:
            for r in range(3):
                frames[i, r] += value * frames[i, 5 + 3 * r]
        else:
            c, s = math.cos(value), math.sin(value)
            for r in range(3):
                x, y = frames[i, 3 + 3 * r], frames[i, 4 + 3 * r]
                frames[i, 3 + 3 * r] = c * x + s * y
                frames[i, 4 + 3 * r] = c * y - s * x


def place_links(frames, node, local, out):
    """Frames (k, 12) of links at constant offsets from nodes."""
    for i in range(node.shape[0]):
        if node[i] < 0:
            for k in range(12):
                out[i, k] = local[i, k]
        else:
            compose(out, i, frames, node[i], local, i)


@compiled(f"{CHAIN} f8[:,::1] f8[:,::1] f8[:,:,::1]", fast_math=True, releases_gil=True)
def forward_batch(whole, real, node, local, qs, frames, out):
    """Frames (b, k, 12) of links for configurations (b, n); `frames` is work space (m, 12)."""
    for b in range(qs.shape[0]):
        place_nodes(whole, real, qs[b], frames)
        place_links(frames, node, local, out[b])


def fill_jacobian(whole, real, frames, node, x, y, z, out, row):
    """Six columns of `out` (n, ...) from `row` on: linear and angular velocity of a point of `node`."""
    for j in range(out.shape[0]):
        for r in range(6):
            out[j, row + r] = 0.0
    while node >= 0:
        j = whole[node, 2]
        k = real[node, 12]
        ax, ay, az = k * frames[node, 5], k * frames[node, 8], k * frames[node, 11]
        if whole[node, 1] == 1:
            out[j, row] += ax
            out[j, row + 1] += ay
            out[j, row + 2] += az
        else:
            dx, dy, dz = x - frames[node, 0], y - frames[node, 1], z - frames[node, 2]
            out[j, row] += ay * dz - az * dy
            out[j, row + 1] += az * dx - ax * dz
            out[j, row + 2] += ax * dy - ay * dx
            out[j, row + 3] += ax
            out[j, row + 4] += ay
            out[j, row + 5] += az
        node = whole[node, 0]


@compiled(f"{CHAIN} f8[::1] f8[:,::1] f8[:,::1] f8[:,::1]", fast_math=True)
def jacobian_at(whole, real, node, local, q, frames, tip, out):
    """(n, 6) transposed Jacobian at one frame, which is written to `tip` (1, 12)."""
    place_nodes(whole, real, q, frames)
    place_links(frames, node, local, tip)
    fill_jacobian(whole, real, frames, node[0], tip[0, 0], tip[0, 1], tip[0, 2], out, 0)


def read_targets(targets, out):
    """Targets as frames (t, 12); False where one is not finite or a quaternion has zero length."""
    good = True
    for t in range(targets.shape[0]):
        width = targets.shape[1]
        for k in range(width):
            good = good and math.isfinite(targets[t, k])
        if width == 16:
            for r in range(3):
                out[t, r] = targets[t, 4 * r + 3]
                for c in range(3):
                    out[t, 3 + 3 * r + c] = targets[t, 4 * r + c]
            continue
        for r in range(3):
            out[t, r] = targets[t, r]
        x, y, z, w = 0.0, 0.0, 0.0, 1.0
        if width == 7:
            x, y, z, w = targets[t, 3], targets[t, 4], targets[t, 5], targets[t, 6]
            length = math.sqrt(x * x + y * y + z * z + w * w)
            if not length > 1e-9:
                good = False
                length = 1.0
            x, y, z, w = x / length, y / length, z / length, w / length
        out[t, 3], out[t, 4], out[t, 5] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
        out[t, 6], out[t, 7], out[t, 8] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
        out[t, 9], out[t, 10], out[t, 11] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
    return good


def rotation_log(target, t, tip, i):
    """Rotation vector of target⁻¹ · tip, expressed in the target's frame; exact up to half a turn."""
    e00 = target[t, 3] * tip[i, 3] + target[t, 6] * tip[i, 6] + target[t, 9] * tip[i, 9]
    e01 = target[t, 3] * tip[i, 4] + target[t, 6] * tip[i, 7] + target[t, 9] * tip[i, 10]
    e02 = target[t, 3] * tip[i, 5] + target[t, 6] * tip[i, 8] + target[t, 9] * tip[i, 11]
    e10 = target[t, 4] * tip[i, 3] + target[t, 7] * tip[i, 6] + target[t, 10] * tip[i, 9]
    e11 = target[t, 4] * tip[i, 4] + target[t, 7] * tip[i, 7] + target[t, 10] * tip[i, 10]
    e12 = target[t, 4] * tip[i, 5] + target[t, 7] * tip[i, 8] + target[t, 10] * tip[i, 11]
    e20 = target[t, 5] * tip[i, 3] + target[t, 8] * tip[i, 6] + target[t, 11] * tip[i, 9]
    e21 = target[t, 5] * tip[i, 4] + target[t, 8] * tip[i, 7] + target[t, 11] * tip[i, 10]
    e22 = target[t, 5] * tip[i, 5] + target[t, 8] * tip[i, 8] + target[t, 11] * tip[i, 11]
    trace = e00 + e11 + e22
    if trace >= e00 and trace >= e11 and trace >= e22:
        x, y, z, w = e21 - e12, e02 - e20, e10 - e01, 1.0 + trace
    elif e00 >= e11 and e00 >= e22:
        x, y, z, w = 1.0 + e00 - e11 - e22, e10 + e01, e20 + e02, e21 - e12
    elif e11 >= e22:
        x, y, z, w = e10 + e01, 1.0 + e11 - e00 - e22, e21 + e12, e02 - e20
    else:
        x, y, z, w = e20 + e02, e21 + e12, 1.0 + e22 - e00 - e11, e10 - e01
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    sine = math.sqrt(x * x + y * y + z * z)
    if sine < 1e-12 * w:
        scale = 2.0 / w
    else:
        scale = 2.0 * math.atan2(sine, w) / sine
    return scale * x, scale * y, scale * z


def task_errors(target, weights, tip, raw, errors):
    """Half the weighted squared error, and its parts.

    raw (t, 6): target minus position in base axes, then the rotation vector of `rotation_log`.
    errors (t, 2): length (m) and angle (rad) of the parts with a weight.
    """
    cost = 0.0
    for t in range(target.shape[0]):
        shift, turn = 0.0, 0.0
        for k in range(3):
            raw[t, k] = target[t, k] - tip[t, k]
            if weights[t, k] > 0.0:
                shift += raw[t, k] ** 2
                cost += (weights[t, k] * raw[t, k]) ** 2
        if weights[t, 3] > 0.0 or weights[t, 4] > 0.0 or weights[t, 5] > 0.0:
            raw[t, 3], raw[t, 4], raw[t, 5] = rotation_log(target, t, tip, t)
            for k in range(3, 6):
                if weights[t, k] > 0.0:
                    turn += raw[t, k] ** 2
                    cost += (weights[t, k] * raw[t, k]) ** 2
        errors[t, 0], errors[t, 1] = math.sqrt(shift), math.sqrt(turn)
    return 0.5 * cost


def weight_rotation(target, t, raw, weights, jac, row, rhs):
    """Convert three rows of angular velocity to weighted rates of the rotation vector and its error.

    d(log E) = J_l⁻¹(φ) · R_targetᵀ · ω, with φ = log E (Barfoot, State Estimation for Robotics, 7.2).
    """
    x, y, z = raw[t, 3], raw[t, 4], raw[t, 5]
    square = x * x + y * y + z * z
    if square < 1e-8:
        b = 1.0 / 12.0
    else:
        angle = math.sqrt(square)
        b = 1.0 / square - 0.5 / (angle * math.tan(0.5 * angle))
    diagonal = 1.0 - b * square
    m00, m11, m22 = diagonal + b * x * x, diagonal + b * y * y, diagonal + b * z * z
    m01, m10 = b * x * y + 0.5 * z, b * x * y - 0.5 * z
    m02, m20 = b * x * z - 0.5 * y, b * x * z + 0.5 * y
    m12, m21 = b * y * z + 0.5 * x, b * y * z - 0.5 * x
    w0, w1, w2 = weights[t, 3], weights[t, 4], weights[t, 5]
    for c in range(jac.shape[0]):
        ox, oy, oz = jac[c, row + 3], jac[c, row + 4], jac[c, row + 5]
        u = target[t, 3] * ox + target[t, 6] * oy + target[t, 9] * oz
        v = target[t, 4] * ox + target[t, 7] * oy + target[t, 10] * oz
        s = target[t, 5] * ox + target[t, 8] * oy + target[t, 11] * oz
        jac[c, row + 3] = w0 * (m00 * u + m01 * v + m02 * s)
        jac[c, row + 4] = w1 * (m10 * u + m11 * v + m12 * s)
        jac[c, row + 5] = w2 * (m20 * u + m21 * v + m22 * s)
    rhs[row + 3], rhs[row + 4], rhs[row + 5] = -w0 * x, -w1 * y, -w2 * z


def linearize(whole, real, frames, node, target, weights, tip, raw, jac, rhs):
    """Weighted transposed Jacobian (n, 6t) and right side (6t,): jacᵀ · dq = rhs moves tips to targets."""
    for t in range(node.shape[0]):
        row = 6 * t
        fill_jacobian(whole, real, frames, node[t], tip[t, 0], tip[t, 1], tip[t, 2], jac, row)
        for k in range(3):
            w = weights[t, k]
            rhs[row + k] = w * raw[t, k]
            for c in range(jac.shape[0]):
                jac[c, row + k] *= w
        if weights[t, 3] > 0.0 or weights[t, 4] > 0.0 or weights[t, 5] > 0.0:
            weight_rotation(target, t, raw, weights, jac, row, rhs)
        else:
            for k in range(3, 6):
                rhs[row + k] = 0.0
                for c in range(jac.shape[0]):
                    jac[c, row + k] = 0.0

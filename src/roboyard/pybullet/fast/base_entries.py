"""Pose and velocity of a floating base as machine code; see `fast_entries`."""

from __future__ import annotations

from math import sqrt

from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.fast_entries import PARTS


def _rotated(x, y, z, w, v):  # pragma: no cover
    a, b, c = 2.0 * (y * v[2] - z * v[1]), 2.0 * (z * v[0] - x * v[2]), 2.0 * (x * v[1] - y * v[0])
    return v[0] + w * a + y * c - z * b, v[1] + w * b + z * a - x * c, v[2] + w * c + x * b - y * a


def write_base_pose(qpos, qvel, places, frame, x, y, z, i, j, k, w):  # pragma: no cover
    """Put a base where its inertial frame has a pose, at rest; return 0 where there is none.

    places: (2,) first numbers of the free joint in qpos and qvel. frame: (7,) inertial frame in the link
    frame (m, then x, y, z, w). x, y, z: position (m). i, j, k, w: quaternion of any length.
    """
    length = sqrt(i * i + j * j + k * k + w * w)
    total = x + y + z + length
    if length == 0.0 or total - total != 0.0:
        return 0
    if length != 1.0:
        i, j, k, w = i / length, j / length, k / length, w / length
    fx, fy, fz, fi, fj, fk, fw = frame[0], frame[1], frame[2], frame[3], frame[4], frame[5], frame[6]
    if fx != 0.0 or fy != 0.0 or fz != 0.0 or fw != 1.0:
        i, j, k, w = (
            i * fw - w * fi - j * fk + k * fj,
            i * fk - w * fj + j * fw - k * fi,
            -(w * fk) - i * fj + j * fi + k * fw,
            w * fw + i * fi + j * fj + k * fk,
        )
        a, b, c = _rotated(i, j, k, w, (fx, fy, fz))
        x, y, z = x - a, y - b, z - c
    first, dof = places[0], places[1]
    qpos[first], qpos[first + 1], qpos[first + 2], qpos[first + 3] = x, y, z, w
    qpos[first + 4], qpos[first + 5], qpos[first + 6] = i, j, k
    for n in range(6):
        qvel[dof + n] = 0.0
    return 1


def write_base_velocity(  # pragma: no cover
    qpos, qvel, places, frame, is_pushed, is_turned, vx, vy, vz, wx, wy, wz
):
    """Give a base a velocity of its centre of mass (m/s) and an angular one (rad/s); return 0 for none.

    qpos, ..., frame: see `write_base_pose`. is_pushed, is_turned: 1 for what is given; the other stays.
    """
    first, dof = places[0], places[1]
    w, x, y, z = qpos[first + 3], qpos[first + 4], qpos[first + 5], qpos[first + 6]
    ax, ay, az = _rotated(x, y, z, w, (frame[0], frame[1], frame[2]))
    if is_turned == 0:
        wx, wy, wz = _rotated(x, y, z, w, (qvel[dof + 3], qvel[dof + 4], qvel[dof + 5]))
    if is_pushed == 0:
        ox, oy, oz = wx, wy, wz
        if is_turned == 1:
            ox, oy, oz = _rotated(x, y, z, w, (qvel[dof + 3], qvel[dof + 4], qvel[dof + 5]))
        vx, vy, vz = (
            qvel[dof] + oy * az - oz * ay,
            qvel[dof + 1] + oz * ax - ox * az,
            (qvel[dof + 2] + ox * ay - oy * ax),
        )
    total = vx + vy + vz + wx + wy + wz
    if total - total != 0.0:
        return 0
    qvel[dof] = vx - (wy * az - wz * ay)
    qvel[dof + 1] = vy - (wz * ax - wx * az)
    qvel[dof + 2] = vz - (wx * ay - wy * ax)
    qvel[dof + 3], qvel[dof + 4], qvel[dof + 5] = _rotated(-x, -y, -z, w, (wx, wy, wz))
    return 1


_MARKS = f"""{PARTS}
COMMAND, PREPARED, NONE, TRUE, ONE, MOVED, FASTER, OLD, KNOWN_POSES = range(3, 12)
SCENE, WORLD, RECORD, QPOS, QVEL, PLACES, FRAME = range(3, 10)

@part
def mark(state, body):
    true = word(state, TRUE)
    PyObject_SetAttr(word(body, WORLD), word(state, MOVED), true)
    PyObject_SetAttr(word(body, WORLD), word(state, FASTER), true)
    PyObject_SetAttr(word(body, SCENE), word(state, OLD), true)
    PyObject_SetAttr(word(body, RECORD), word(state, KNOWN_POSES), word(state, NONE))
"""
_POSE = f"""{_MARKS}
@part
def is_put(state, body, given):
    if not has_length(given[2], 3) or not has_length(given[3], 4):
        return False
    position, turn = given[2], given[3]
    if _loop(
        numbers(word(body, QPOS)), numbers(word(body, QVEL)), integers(word(body, PLACES)),
        numbers(word(body, FRAME)), item(position, 0), item(position, 1), item(position, 2),
        item(turn, 0), item(turn, 1), item(turn, 2), item(turn, 3),
    ) == 0:
        return False
    mark(state, body)
    return True

def entry(state, given, count, keywords):
    body = prepared(state, given[0], given[1]) if keywords == 0 and count == 4 else 0
    if body != 0:
        Py_IncRef(body)
        is_done = is_put(state, body, given)
        Py_DecRef(body)
        if is_done:
            Py_IncRef(word(state, NONE))
            return word(state, NONE)
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""
POSE = Front(write_base_pose, EntrySignature(_POSE))
"""resetBasePositionAndOrientation."""
_SPEED = f"""{_MARKS}
@part
def is_set(state, body, linear, angular):
    pushed, turned = np.int64(linear != word(state, NONE)), np.int64(angular != word(state, NONE))
    if pushed + turned == 0:
        return False
    if (pushed == 1 and not has_length(linear, 3)) or (turned == 1 and not has_length(angular, 3)):
        return False
    vx = vy = vz = wx = wy = wz = 0.0
    if pushed == 1:
        vx, vy, vz = item(linear, 0), item(linear, 1), item(linear, 2)
    if turned == 1:
        wx, wy, wz = item(angular, 0), item(angular, 1), item(angular, 2)
    if _loop(
        numbers(word(body, QPOS)), numbers(word(body, QVEL)), integers(word(body, PLACES)),
        numbers(word(body, FRAME)), pushed, turned, vx, vy, vz, wx, wy, wz,
    ) == 0:
        return False
    mark(state, body)
    return True

def entry(state, given, count, keywords):
    body = prepared(state, given[0], given[1]) if keywords == 0 and 3 <= count <= 4 else 0
    if body != 0:
        Py_IncRef(body)
        is_done = is_set(state, body, given[2], given[3] if count == 4 else word(state, NONE))
        Py_DecRef(body)
        if is_done:
            Py_IncRef(word(state, NONE))
            return word(state, NONE)
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""
SPEED = Front(write_base_velocity, EntrySignature(_SPEED))
"""resetBaseVelocity."""

for _front in (POSE, SPEED):
    vars(_front.core)["front"] = _front

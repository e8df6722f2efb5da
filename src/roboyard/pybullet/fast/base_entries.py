"""Pose and velocity of a base as machine code: both set, the velocity read; see `fast_entries`.

A fixed base has no velocity.
"""

from __future__ import annotations

from math import sqrt

from roboyard.native.entry_parts import TRIPLE, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.fast_entries import PARTS


def _rotated(x, y, z, w, v):  # pragma: no cover
    a, b, c = 2.0 * (y * v[2] - z * v[1]), 2.0 * (z * v[0] - x * v[2]), 2.0 * (x * v[1] - y * v[0])
    return v[0] + w * a + y * c - z * b, v[1] + w * b + z * a - x * c, v[2] + w * c + x * b - y * a


def write_base_pose(  # pragma: no cover
    place, turn, kept_place, kept_turn, speed, frame, x, y, z, i, j, k, w
):
    """Put a base where its inertial frame has a pose, at rest; return 0 where there is none.

    Returns 2 for a fixed base that is there already. place, turn: (3,) and (4,) w, x, y, z of the link frame.
    kept_place, kept_turn: (3,) and (4,) the same of a fixed base in the spec. speed: (6,) velocity, (0,) for
    a fixed base. frame: (7,) inertial frame in the link frame (m, then x, y, z, w). x, y, z: position (m).
    i, j, k, w: quaternion of any length.
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
    if len(speed) == 0:
        is_there = place[0] == x and place[1] == y and place[2] == z and turn[0] == w
        if is_there and turn[1] == i and turn[2] == j and turn[3] == k:
            return 2
        kept_place[0], kept_place[1], kept_place[2] = x, y, z
        kept_turn[0], kept_turn[1], kept_turn[2], kept_turn[3] = w, i, j, k
    place[0], place[1], place[2] = x, y, z
    turn[0], turn[1], turn[2], turn[3] = w, i, j, k
    for n in range(len(speed)):
        speed[n] = 0.0
    return 1


def write_base_velocity(  # pragma: no cover
    turn, speed, frame, is_pushed, is_turned, vx, vy, vz, wx, wy, wz
):
    """Give a base a velocity of its centre of mass (m/s) and an angular one (rad/s); return 0 for none.

    turn, speed, frame: see `write_base_pose`. is_pushed, is_turned: 1 for what is given; the other stays.
    """
    if len(speed) == 0:
        return 0
    w, x, y, z = turn[0], turn[1], turn[2], turn[3]
    ax, ay, az = _rotated(x, y, z, w, (frame[0], frame[1], frame[2]))
    if is_turned == 0:
        wx, wy, wz = _rotated(x, y, z, w, (speed[3], speed[4], speed[5]))
    if is_pushed == 0:
        ox, oy, oz = wx, wy, wz
        if is_turned == 1:
            ox, oy, oz = _rotated(x, y, z, w, (speed[3], speed[4], speed[5]))
        vx, vy, vz = (
            speed[0] + oy * az - oz * ay,
            speed[1] + oz * ax - ox * az,
            speed[2] + ox * ay - oy * ax,
        )
    total = vx + vy + vz + wx + wy + wz
    if total - total != 0.0:
        return 0
    speed[0] = vx - (wy * az - wz * ay)
    speed[1] = vy - (wz * ax - wx * az)
    speed[2] = vz - (wx * ay - wy * ax)
    speed[3], speed[4], speed[5] = _rotated(-x, -y, -z, w, (wx, wy, wz))
    return 1


def base_velocity(turn, speed, frame):  # pragma: no cover
    """Return the velocity of a base's centre of mass (m/s), then the angular one (rad/s), in the world frame.

    turn, speed, frame: see `write_base_pose`; the speed is not empty.
    """
    w, x, y, z = turn[0], turn[1], turn[2], turn[3]
    i, j, k = _turned(x, y, z, w, speed[3], speed[4], speed[5])
    a, b, c = _turned(x, y, z, w, frame[0], frame[1], frame[2])
    return speed[0] + (j * c - k * b), speed[1] + (k * a - i * c), speed[2] + (i * b - j * a), i, j, k


def _turned(x, y, z, w, a, b, c):  # pragma: no cover
    """Return what `frames.rotated` does, to the last bit."""
    d, e, f = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * d + (y * f - z * e), b + w * e + (z * d - x * f), c + w * f + (x * e - y * d)


_MARKS = f"""{PARTS}
COMMAND, PREPARED, NONE, TRUE, ONE, MOVED, FASTER, KNOWN_POSES, KNOWN_PLACE, BOXES_OLD = range(3, 13)
SCENE, WORLD, RECORD, PLACE, TURN, KEPT_PLACE, KEPT_TURN, SPEED, FRAME, STEPS, SHOWN = range(3, 14)

@part
def mark_shown(state, body):
    steps, shown = numbers(word(body, STEPS)), numbers(word(body, SHOWN))
    shown[0] = steps[0]
    PyObject_SetAttr(word(body, SCENE), word(state, BOXES_OLD), word(state, TRUE))

@part
def mark(state, body):
    true = word(state, TRUE)
    PyObject_SetAttr(word(body, WORLD), word(state, MOVED), true)
    PyObject_SetAttr(word(body, WORLD), word(state, FASTER), true)
    PyObject_SetAttr(word(body, RECORD), word(state, KNOWN_POSES), word(state, NONE))
    PyObject_SetAttr(word(body, RECORD), word(state, KNOWN_PLACE), word(state, NONE))
"""
_POSE = f"""{_MARKS}
@part
def is_put(state, body, given):
    if not has_length(given[2], 3) or not has_length(given[3], 4):
        return False
    position, turn = given[2], given[3]
    done = _loop(
        numbers(word(body, PLACE)), numbers(word(body, TURN)), numbers(word(body, KEPT_PLACE)),
        numbers(word(body, KEPT_TURN)), numbers(word(body, SPEED)), numbers(word(body, FRAME)),
        item(position, 0), item(position, 1), item(position, 2),
        item(turn, 0), item(turn, 1), item(turn, 2), item(turn, 3),
    )
    if done == 1:
        mark(state, body)
    if done != 0:
        mark_shown(state, body)
    return done != 0

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
        numbers(word(body, TURN)), numbers(word(body, SPEED)), numbers(word(body, FRAME)), pushed, turned,
        vx, vy, vz, wx, wy, wz,
    ) == 0:
        return False
    mark(state, body)
    mark_shown(state, body)
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

_VELOCITY = f"""{PARTS}{parts(TRIPLE)}
COMMAND, PREPARED, NONE, TRUE, ONE, REST = range(3, 9)
SCENE, WORLD, RECORD, PLACE, TURN, KEPT_PLACE, KEPT_TURN, SPEED, FRAME = range(3, 12)

def entry(state, given, count, keywords):
    body = prepared(state, given[0], given[1]) if keywords == 0 and count == 2 else 0
    if body == 0:
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    speed = numbers(word(body, SPEED))
    if len(speed) == 0:
        Py_IncRef(word(state, REST))
        return word(state, REST)
    a, b, c, d, e, f = _loop(numbers(word(body, TURN)), speed, numbers(word(body, FRAME)))
    made = PyTuple_New(2)
    PyTuple_SetItem(made, 0, triple(a, b, c))
    PyTuple_SetItem(made, 1, triple(d, e, f))
    return made
"""
VELOCITY = Front(base_velocity, EntrySignature(_VELOCITY))
"""getBaseVelocity."""

for _front in (POSE, SPEED, VELOCITY):
    vars(_front.core)["front"] = _front

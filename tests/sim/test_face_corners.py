"""The compiled order of two boxes' points is that of a plain version, on boxes with MuJoCo's contacts."""

from __future__ import annotations

import mujoco
import numpy as np

from roboyard.sim.stepping import manifold_kernels as kernels
from roboyard.sim.stepping.face_corners import LEFT, ORDER, SCRATCH
from roboyard.sim.stepping.narrow_phase.fields import no_fields
from roboyard.sim.stepping.step_row_kernels import Contacts

SCENE = """<mujoco><worldbody>
  <body name="one" pos="{one}" quat="{turn}"><freejoint/><geom type="box" size="{size}" margin="0.02"/></body>
  <body name="two" pos="{two}" quat="{other_turn}"><freejoint/>
    <geom type="box" pos="{offset}" size="{other_size}" margin="0.02"/></body>
  </worldbody></mujoco>"""
BOX = 6


class _Box:
    """A box in the world: its middle and its half axes, as rows."""

    def __init__(self, middle: np.ndarray, axes: np.ndarray) -> None:
        self.middle, self.axes = middle, axes
        self.halves = np.linalg.norm(axes, axis=1)
        self.units = axes / self.halves[:, None]


def _two_boxes(rng: np.random.Generator, *, is_exact: bool) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return boxes of which one is on the other, turned and tilted a little, or both in parallel.

    Those in parallel have two faces that are as deep as each other, to the last bit.
    """
    whole, turn = np.array([1.0, 0, 0, 0]), np.array([1.0, 0, 0, 0])
    if is_exact:
        size, other_size = rng.integers(4, 16, (2, 3)) / 128
        offset, middle = rng.integers(-8, 8, (2, 3)) / 64
        place = np.array(
            [*(rng.integers(-4, 4, 2) / 64), size[2] + other_size[2] - rng.integers(-2, 2) / 2048]
        )
    else:
        size, other_size = rng.uniform(0.05, 0.2, (2, 3))
        offset, middle = rng.normal(size=(2, 3)) * 0.1
        whole = rng.normal(size=4)
        whole /= np.linalg.norm(whole)
        tilt, about, face = np.zeros((3, 4))
        axis = rng.normal(size=3)
        mujoco.mju_axisAngle2Quat(tilt, axis / np.linalg.norm(axis), rng.choice([3e-4, 0.01, 0.03]))
        mujoco.mju_axisAngle2Quat(about, np.array([0.0, 0, 1]), rng.uniform(-np.pi, np.pi))
        mujoco.mju_axisAngle2Quat(face, np.eye(3)[rng.integers(3)], rng.integers(4) * np.pi / 2)
        for more in (tilt, about, face):
            mujoco.mju_mulQuat(turn, turn.copy(), more)
        height = size[2] + float(np.abs(_matrix(turn)[2]) @ other_size) - rng.uniform(-0.001, 0.004)
        place = np.array([*(rng.uniform(-0.8, 0.8, 2) * size[:2]), height])
    other = np.zeros(4)
    mujoco.mju_mulQuat(other, whole, turn)
    two = middle + _matrix(whole) @ place - _matrix(other) @ offset
    given = {"one": middle, "turn": whole, "size": size, "two": two, "other_turn": other}
    given |= {"offset": offset, "other_size": other_size}
    texts = {name: " ".join(map(repr, values.tolist())) for name, values in given.items()}
    model = mujoco.MjModel.from_xml_string(SCENE.format(**texts))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def _matrix(quat: np.ndarray) -> np.ndarray:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quat)
    return matrix.reshape(3, 3)


def _cut(polygon: list[np.ndarray], across: int, sign: float, bound: float) -> list[np.ndarray]:
    """Return a polygon's part where a coordinate times a sign is below a bound (Sutherland and Hodgman)."""
    left = []
    for here, there in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        is_in, goes_in = sign * here[across] < bound, sign * there[across] < bound
        if is_in:
            left.append(here)
        if is_in != goes_in:
            share = (sign * bound - here[across]) / (there[across] - here[across])
            left.append(here + share * (there - here))
    return left


def _best(corners: list[tuple[int, np.ndarray]], dist: np.ndarray) -> list[int]:
    """Return the places of the deepest corner and of those nearest to quarters of a turn from it."""
    points = np.array([point for _, point in corners])
    after = np.roll(points, -1, axis=0)
    twice = points[:, 0] * after[:, 1] - after[:, 0] * points[:, 1]
    middle = twice @ (points + after) / (3.0 * twice.sum())
    angles = np.arctan2(*(points - middle).T[::-1])
    deepest = int(np.argmin([dist[n] for n, _ in corners]))
    chosen = [deepest]
    for quarter in range(1, LEFT):
        apart = np.abs(np.angle(np.exp(1j * (angles - angles[deepest] - quarter * np.pi / 2))))
        apart[chosen] = np.inf
        chosen.append(int(np.argmin(apart)))
    return chosen


def _twin(boxes: list[_Box], points: np.ndarray, dist: np.ndarray, thickness: float) -> tuple[list[int], int]:
    """Return contacts in Bullet's order, the others behind them, and how many of them it takes."""
    faces = []
    for side in range(2):
        box, other = boxes[side], boxes[1 - side]
        reaches = box.halves + np.abs(box.units @ other.axes.T).sum(axis=1)
        gaps = np.abs(box.units @ (other.middle - box.middle)) - reaches
        faces += [(gap, side, axis) for axis, gap in enumerate(gaps)]
    _, side, axis = max(faces, key=lambda face: face[0])
    box, other = boxes[side], boxes[1 - side]
    normal = box.units[axis] * np.sign(box.units[axis] @ (other.middle - box.middle))
    flat = int(np.argmax(np.abs(other.units @ normal)))
    face = other.middle - np.sign(other.axes[flat] @ normal) * other.axes[flat]
    u, v = (k for k in range(3) if k != axis)
    p, q = (k for k in range(3) if k != flat)
    signs = ((-1, -1), (-1, 1), (1, 1), (1, -1))
    corners = [face + s * other.axes[p] + t * other.axes[q] for s, t in signs]
    plane = box.units[[u, v]]
    polygon = [plane @ (corner - box.middle) for corner in corners]
    for across, half in ((0, box.halves[u]), (1, box.halves[v])):
        for sign in (-1.0, 1.0):
            polygon = _cut(polygon, across, sign, half)
    flattened = (points - box.middle) @ plane.T
    found: list[tuple[int, np.ndarray]] = []
    seen: set[int] = set()
    for corner in polygon:
        apart = {n: ((flattened[n] - corner) ** 2).sum() for n in range(len(points)) if n not in seen}
        n = min(apart, key=lambda k: apart[k], default=-1)
        if n >= 0 and apart[n] < 1e-6 * (box.halves[u] ** 2 + box.halves[v] ** 2):
            seen.add(n)
            if dist[n] <= thickness:
                found.append((n, corner))
    if len(found) > LEFT:
        chosen = _best(found, dist)
        rest = [k for k in range(len(found)) if k not in chosen]
        return [found[k][0] for k in chosen + rest], LEFT
    listed = [n for n, _ in found]
    return listed + [n for n in range(len(points)) if n not in listed], len(points)


def test_the_points_of_two_boxes_are_in_the_order_of_a_plain_version() -> None:
    rng = np.random.default_rng(11)
    seen: list[int] = []
    matched = 0
    for case in range(400):
        model, data = _two_boxes(rng, is_exact=case % 4 == 0)
        count, thickness = data.ncon, rng.choice([0.0, 0.001])
        if count < 2:
            continue
        contact = data.contact
        dist = contact.dist.copy()
        axes = [np.diag(model.geom_size[geom]) @ data.geom_xmat[geom].reshape(3, 3).T for geom in range(2)]
        boxes = [_Box(data.geom_xpos[geom], axes[geom]) for geom in range(2)]
        order, taken = _twin(boxes, contact.pos, dist, thickness)

        in_body = np.zeros((2, 4, 3))  # neither geom is turned in its body
        in_body[:, 0] = model.geom_pos
        in_body[:, 1:] = [np.diag(size) for size in model.geom_size]
        given = Contacts(
            contact.geom.copy(), np.zeros(count, np.int32), np.zeros(count, np.int32), dist.copy(),
            contact.pos.copy(), contact.frame.copy(), np.zeros((count, 5)), np.zeros(count),
            np.zeros(count, np.int32),
        )  # fmt: skip
        tables = [(np.zeros(4, np.int64), np.zeros(4, np.int32), np.zeros((4, 4, 17))) for _ in range(2)]
        work, ends = np.zeros(SCRATCH), np.zeros(4, np.int64)
        kinds = np.zeros((8, 8), np.uint8)
        kinds[BOX, BOX] = 1
        kernels.keep_points(
            given, count, kinds, model.geom_type, model.geom_bodyid, data.xpos, data.xmat,
            np.array([thickness, 0.0]), np.full(2, 1e-7), np.zeros(2, np.uint8), 1.0, 0, *tables[0],
            *tables[1], work, np.zeros(32, np.int32), np.zeros((32, 13)), np.zeros(40, np.int32), ends,
            in_body, np.zeros(2, np.uint8), np.arange(2, dtype=np.int32), np.zeros(2), np.zeros((0, 3)),
            np.zeros((2, 2), np.int32), no_fields(),
        )  # fmt: skip
        assert work[ORDER : ORDER + len(order)].tolist() == order, case
        kept = [n for n in order[:taken] if dist[n] <= thickness]
        stay = (given.dist == dist) & (dist <= thickness)  # points of the others would be within no reach
        assert np.flatnonzero(stay).tolist() == sorted(kept), case
        seen.append(count)
        matched += len(kept)
    assert np.count_nonzero(np.array(seen) > LEFT) > 100 and max(seen) > 6
    assert matched > sum(seen) / 2

"""Bodies meet concave meshes where PyBullet 3.2.7 has them, step by step.

The positions were recorded from PyBullet. The mesh is turned, given in memory (with a margin of 1 mm), as a
file, and as a part that is placed in its body.
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import roboyard.pybullet as p

STEPS = 120
POSITIONS = {
    "memory": {
        "box": [(-1.09791046, -0.4667712, 0.229713), (-1.13515571, 0.44080513, 0.34295499)],
        "sphere": [(-0.50710394, -0.48379026, 0.08796301), (-0.44150955, 0.41892164, 0.19940293)],
        "capsule": [(0.00388542, -0.63005122, 0.05507467), (0.03966972, 0.42230474, 0.1603194)],
        "cylinder": [(0.62084932, -0.61821156, 0.10198019), (0.68198406, 0.45474504, 0.20682698)],
        "hull": [(1.37323578, -0.58126715, -0.0703019), (1.44466238, 0.56691681, 0.00920943)],
    },
    "file": {
        "box": [(-1.09171129, -0.47358257, 0.22729563), (-1.18537339, 0.49311963, 0.36107744)],
        "sphere": [(-0.50710394, -0.48379026, 0.08796301), (-0.44150954, 0.41892163, 0.19940293)],
        "capsule": [(0.00406321, -0.63012805, 0.05409476), (0.0394649, 0.42240754, 0.15930047)],
        "cylinder": [(0.62083544, -0.61817124, 0.10097578), (0.68080676, 0.45611742, 0.2058528)],
        "hull": [(1.37561092, -0.57889162, -0.07269665), (1.44877351, 0.56885961, 0.00310735)],
    },
    "placed": {
        "box": [(-0.92230618, -0.55346421, 0.36414965), (-1.15974783, 0.53974903, 0.35801989)],
        "sphere": [(-0.34006674, -0.56849858, 0.12103619), (-0.569087, 0.45818365, 0.31234692)],
        "capsule": [(0.09904556, -0.6623538, -0.0520594), (0.12768571, 0.31422312, 0.24976008)],
        "cylinder": [(0.61359893, -0.59848897, -0.07358566), (0.74405009, 0.40452131, 0.12649445)],
        "hull": [(1.2843798, -0.5396036, -0.12979798), (1.43479345, 0.52620302, -0.18037186)],
    },
}
CONTACTS = {"memory": 30, "file": 28, "placed": 26}


def _hills(count: int = 20, half: float = 2.0) -> tuple[list[list[float]], list[int]]:
    at = [half * (2 * k / count - 1) for k in range(count + 1)]
    vertices = [[x, y, 0.15 * math.sin(2 * x) * math.cos(1.7 * y)] for y in at for x in at]
    faces: list[int] = []
    for corner in (j * (count + 1) + i for j in range(count) for i in range(count)):
        beyond = corner + count + 2
        faces += [corner, corner + 1, beyond, corner, beyond, beyond - 1]
    return vertices, faces


def _shape(name: str) -> int:
    match name:
        case "box":
            return p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.15, 0.1, 0.08])
        case "sphere":
            return p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
        case "capsule":
            return p.createCollisionShape(p.GEOM_CAPSULE, radius=0.07, height=0.2)
        case "cylinder":
            return p.createCollisionShape(p.GEOM_CYLINDER, radius=0.08, height=0.2)
    corners = [[0.1, 0, -0.05], [-0.06, 0.09, -0.05], [-0.06, -0.08, -0.04], [0.02, 0.01, 0.12]]
    return p.createCollisionShape(p.GEOM_MESH, vertices=[*corners, [0.05, 0.06, 0.04]])


@pytest.mark.parametrize("way", POSITIONS)
def test_bodies_roll_over_hills_as_in_pybullet(client: int, tmp_path: Path, way: str) -> None:
    p.setGravity(0, 0, -10)
    vertices, faces = _hills()
    given: dict[str, object] = {"vertices": vertices, "indices": faces}
    if way == "file":
        lines = ["v {!r} {!r} {!r}".format(*vertex) for vertex in vertices]
        numbers = iter(face + 1 for face in faces)
        lines += ["f {} {} {}".format(*triangle) for triangle in zip(numbers, numbers, numbers, strict=True)]
        (tmp_path / "hills.obj").write_text("\n".join([*lines, ""]))
        given = {"fileName": str(tmp_path / "hills.obj")}
    if way == "placed":
        turn = p.getQuaternionFromEuler([0.1, -0.05, 0.8])
        given |= {"collisionFramePosition": [0.1, 0.05, -0.02], "collisionFrameOrientation": turn}
    shape = p.createCollisionShape(p.GEOM_MESH, flags=p.GEOM_FORCE_CONCAVE_TRIMESH, **given)
    turn = p.getQuaternionFromEuler([0.05, 0.1, 0.6])
    ground = p.createMultiBody(0, shape, -1, [0.2, -0.1, 0.05], turn)
    bodies = {
        (name, m): p.createMultiBody(
            1, _shape(name), -1, [-1.2 + 0.6 * k, -0.5 + m, 0.45],
            p.getQuaternionFromEuler([0.3 * k, 0.2, 0.5 * m]),
        )
        for k, name in enumerate(POSITIONS[way])
        for m in range(2)
    }  # fmt: skip
    for _ in range(STEPS):
        p.stepSimulation()
    for (name, m), body in bodies.items():
        # the search in a cylinder that is deep in a triangle ends at other corners of its round edge
        within = 1e-3 if name == "cylinder" else 5e-6
        place = p.getBasePositionAndOrientation(body)[0]
        assert place == pytest.approx(POSITIONS[way][name][m], abs=within), (name, m)
    assert sum(len(p.getContactPoints(body, ground)) for body in bodies.values()) == CONTACTS[way]
    p.performCollisionDetection()
    touching = {name for (name, _), body in bodies.items() if p.getContactPoints(body, ground)}
    assert touching == set(POSITIONS[way])

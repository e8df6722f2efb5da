"""Sliding in worlds with soft bodies: accelerations of Coulomb's law, and no lift of what slides."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p

STEP, STEPS, MARGIN = 1 / 240, 160, 0.02
CLOTH = "\n".join(
    [f"v {i * 0.25 - 0.5} {j * 0.25 - 0.5} 0" for i in range(5) for j in range(5)]
    + [f"f {a} {a + 5} {a + 6}\nf {a} {a + 6} {a + 1}" for i in range(4) for a in range(5 * i + 1, 5 * i + 5)]
)


@pytest.fixture
def cloth(client: int, tmp_path: Path) -> int:
    """A cloth of 25 nodes at rest on a floor, with a friction of 0.5 on 0.5 or, on the box, of 1."""
    p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)
    p.setGravity(0, 0, -10)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    p.changeDynamics(0, -1, lateralFriction=0.5)
    (tmp_path / "cloth.obj").write_text(CLOTH)
    return p.loadSoftBody(
        str(tmp_path / "cloth.obj"),
        [0, 3, MARGIN],
        mass=1.0,
        useMassSpring=1,
        springElasticStiffness=40,
        springDampingStiffness=0.1,
        frictionCoeff=0.5,
    )


@pytest.mark.parametrize("pull", [4.0, 8.0, -20.0])
def test_cloth_slides_without_leaving_the_floor(cloth: int, pull: float) -> None:
    p.setGravity(pull, 0, -10)
    start = np.array(p.getMeshData(cloth, -1)[1])
    for _ in range(STEPS):
        p.stepSimulation()
        heights = np.array(p.getMeshData(cloth, -1)[1])[:, 2]
        assert heights.min() > MARGIN - 1e-3 and heights.max() < MARGIN + 1e-3
    moved = (np.array(p.getMeshData(cloth, -1)[1]) - start)[:, 0].mean()
    expected = 0.5 * np.sign(pull) * (abs(pull) - 0.25 * 10) * (STEPS * STEP) ** 2
    assert moved == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(
    ("speed", "friction", "distance", "highest"), [(4.0, 1.0, 1.4696, 0.1), (6.0, 2.0, 1.6697, 0.1421)]
)
def test_a_box_beside_a_cloth_slides_and_tips_as_in_pybullet(
    cloth: int, speed: float, friction: float, distance: float, highest: float
) -> None:
    """Distances and heights (m) are PyBullet's; coarser corrections let the second box go 1.79 m."""
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
    box = p.createMultiBody(1, shape, -1, [0, 0, 0.1])
    p.changeDynamics(box, -1, lateralFriction=friction)
    for _ in range(20):
        p.stepSimulation()
    start = p.getBasePositionAndOrientation(box)[0]
    p.resetBaseVelocity(box, [speed, 0, 0])
    heights = []
    for _ in range(400):
        p.stepSimulation()
        heights.append(p.getBasePositionAndOrientation(box)[0][2])
    assert p.getBasePositionAndOrientation(box)[0][0] - start[0] == pytest.approx(distance, rel=0.02)
    assert max(heights) == pytest.approx(highest, abs=5e-3)

"""Heightfields from lists and files, and terrain that changes. Numbers are PyBullet 3.2.7's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import roboyard.pybullet as p

STAR = [[0.1, 0, 0], [-0.07, 0.09, 0.02], [-0.06, -0.08, 0.01], [0.01, 0.02, 0.11], [0, -0.01, -0.1]]
NX, NY = 10, 6
HEIGHTS = (np.arange(NX * NY) * 37 % 23 / 23.0).tolist()


def field(heights: list[float], **more: int) -> int:
    return p.createCollisionShape(
        p.GEOM_HEIGHTFIELD, heightfieldData=heights, numHeightfieldRows=NX, numHeightfieldColumns=NY, **more
    )


def waves() -> int:
    """A field of 40 by 40 points, 5 cm apart, with waves of 3 cm."""
    number = 40
    heights = [0.03 * np.sin(1.7 * i) * np.cos(2.3 * j) for j in range(number) for i in range(number)]
    shape = p.createCollisionShape(
        p.GEOM_HEIGHTFIELD,
        meshScale=[0.05, 0.05, 1],
        heightfieldData=heights,
        numHeightfieldRows=number,
        numHeightfieldColumns=number,
    )
    return p.createMultiBody(0, shape)


def height_at(x: float, y: float) -> float:
    return p.rayTest([x, y, 50], [x, y, -50])[0][3][2]


def surface() -> list[float]:
    return [height_at(x, y) for x in (-4.01, -0.3, 2.2) for y in (-1.7, 0.4, 2.1)]


def test_other_heights_keep_the_origin(client: int) -> None:
    shape = field(HEIGHTS)
    body = p.createMultiBody(0, shape, basePosition=[0, 0, 0])
    middle = (max(HEIGHTS) + min(HEIGHTS)) / 2
    before = surface()
    assert field([0.5 * h - 3.0 for h in HEIGHTS], replaceHeightfieldIndex=shape) == shape
    np.testing.assert_allclose(surface(), [0.5 * (h + middle) - 3.0 - middle for h in before], atol=1e-5)
    field(HEIGHTS, replaceHeightfieldIndex=shape)
    np.testing.assert_allclose(surface(), before, atol=1e-6)
    assert p.getNumBodies() == 1 and p.getVisualShapeData(body)[0][2] == p.GEOM_HEIGHTFIELD


def test_a_ball_rides_on_rising_terrain(client: int) -> None:
    p.setGravity(0, 0, -9.81)
    shape = field([0.0, 0.2] + [0.0] * (NX * NY - 2))  # origin at 0.1
    p.createMultiBody(0, shape)
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.2), basePosition=[1, 0, 0.3])
    for k in range(240):
        field([0.4 * k / 240] * (NX * NY), replaceHeightfieldIndex=shape)
        p.stepSimulation()
    for _ in range(60):  # a step corrects 0.08 of what the terrain rises
        p.stepSimulation()
    p.getCameraImage(8, 8)
    assert p.getBasePositionAndOrientation(ball)[0][2] == pytest.approx(0.4 - 0.1 + 0.2, abs=0.02)


def test_pictures_show_the_other_heights(client: int) -> None:
    shape = field([0.0] * (NX * NY))
    p.createMultiBody(0, shape)
    view = p.computeViewMatrix([0, 0, 5], [0, 0, 0], [0, 1, 0])
    projection = p.computeProjectionMatrixFOV(20, 1, 1, 10)

    def distance() -> float:
        depth = p.getCameraImage(9, 9, view, projection)[3][4, 4]
        return 10 * 1 / (10 - 9 * depth)

    assert distance() == pytest.approx(5, abs=1e-3)
    field([2.0] * (NX * NY), replaceHeightfieldIndex=shape)
    assert distance() == pytest.approx(3, abs=1e-3)


def test_tables_and_images(client: int, tmp_path: Path) -> None:
    """An image's red, right to left, from 0 to 1; a table is laid out by its transpose."""
    red = np.arange(12, dtype=np.uint8).reshape(3, 4) * 20
    Image.fromarray(np.dstack([red, red * 0, red * 0])).save(tmp_path / "hill.png")
    lines = "\n".join(",".join(f"{v / 255}" for v in row) + "," for row in red.tolist())
    (tmp_path / "hill.txt").write_text(lines)
    p.setAdditionalSearchPath(str(tmp_path))
    expected = {"hill.png": red[:, ::-1] / 255, "hill.txt": (red / 255).T.reshape(3, 4)}
    for name, points in expected.items():
        ground = p.createMultiBody(
            0, p.createCollisionShape(p.GEOM_HEIGHTFIELD, fileName=name, meshScale=[1, 1, 2])
        )
        middle = points.max() + points.min()
        for i, x in enumerate((-1.5, -0.5, 0.5, 1.5)):
            for j, y in enumerate((-1.0, 0.0, 1.0)):
                here = height_at(x * 0.9999, y * 0.9999)
                assert here == pytest.approx(2 * points[j, i] - middle, abs=2e-3), (name, x, y)
        p.removeBody(ground)


@pytest.mark.parametrize(
    ("content", "note"),
    [
        (b"1,2,\n3,\n", "the same number"),
        (b"", "2 by 2"),
        (b"1,2,\nx,4\n", "the same number"),
        (b"1,nan\n2,3", "finite"),
    ],
)
def test_poor_files_are_refused(client: int, tmp_path: Path, content: bytes, note: str) -> None:
    path = tmp_path / "field.txt"
    path.write_bytes(content)
    with pytest.raises(p.error, match="createCollisionShape failed") as caught:
        p.createCollisionShape(p.GEOM_HEIGHTFIELD, fileName=str(path))
    assert note in "".join(caught.value.__notes__)


def test_what_cannot_be_replaced(client: int, tmp_path: Path) -> None:
    sphere, shape = p.createCollisionShape(p.GEOM_SPHERE), field(HEIGHTS)
    for index in (sphere, 99):
        with pytest.raises(p.error) as caught:
            field(HEIGHTS, replaceHeightfieldIndex=index)
        assert "not a heightfield" in "".join(caught.value.__notes__)
    with pytest.raises(p.error) as caught:
        p.createCollisionShape(
            p.GEOM_HEIGHTFIELD, heightfieldData=[0, 1, 2, 3], numHeightfieldRows=2, numHeightfieldColumns=2,
            replaceHeightfieldIndex=shape,
        )  # fmt: skip
    assert "points, got" in "".join(caught.value.__notes__)
    (tmp_path / "no.png").write_text("not an image")
    with pytest.raises(p.error):
        p.createCollisionShape(p.GEOM_HEIGHTFIELD, fileName=str(tmp_path / "no.png"))
    with pytest.raises(p.error):
        p.createCollisionShape(p.GEOM_HEIGHTFIELD, fileName="nowhere.png")
    with pytest.raises(p.error):
        p.createCollisionShape(p.GEOM_HEIGHTFIELD)


def test_a_ball_on_terrain_touches_it_at_four_points(client: int) -> None:
    """Which of the points of several cells Bullet keeps decides how a ball that rolls over them goes on."""
    p.setGravity(0, 0, -9.81)
    waves()
    ball = p.createMultiBody(
        1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.12), basePosition=[0.02, 0.01, 0.2]
    )
    seen = []
    for step in range(1, 122):
        p.stepSimulation()
        if step in (41, 61, 81, 101, 121):
            seen.append(p.getBasePositionAndOrientation(ball)[0])
            assert len(p.getContactPoints(ball)) == 4
    expected = [
        [0.02681, 0.02522, 0.12502],
        [0.02971, 0.05537, 0.12271],
        [0.01878, 0.07598, 0.12673],
        [0.00735, 0.07963, 0.12955],
        [0.00169, 0.0662, 0.12467],
    ]
    np.testing.assert_allclose(seen, expected, atol=2e-5)


FALLS: list[tuple[str, dict[str, object], list[list[float]], float]] = [
    (
        "GEOM_BOX",
        {"halfExtents": [0.12, 0.07, 0.05]},
        [[-0.017927, 0.030222, 0.069294], [-0.027396, 0.03068, 0.067677], [-0.027409, 0.030663, 0.067702]],
        2e-6,
    ),
    (
        "GEOM_CAPSULE",
        {"radius": 0.05, "height": 0.2},
        [[0.054938, 0.008708, 0.092709], [0.101901, -0.029791, 0.05151], [0.102045, -0.030161, 0.051424]],
        2e-6,
    ),
    (  # the ways out of each other of round shapes are found to some digits in both programs
        "GEOM_CYLINDER",
        {"radius": 0.1, "height": 0.08},
        [[0.007952, 0.017755, 0.063385], [0.011035, 0.014968, 0.059122], [0.011035, 0.014968, 0.059122]],
        5e-4,
    ),
    (
        "GEOM_MESH",
        {"vertices": STAR},
        [[0.048172, 0.000341, 0.067074], [0.090294, -0.026252, 0.062769], [0.085948, -0.029358, 0.059413]],
        2e-6,
    ),
    (
        "GEOM_SPHERE",
        {"radius": 0.09},
        [[0.021777, 0.063181, 0.089953], [-0.007011, 0.061705, 0.089579], [0.00493, 0.043782, 0.082409]],
        5e-5,
    ),
]
"""A shape, its sizes, where it is after 60, 120 and 360 steps (m), and up to which distance it is there."""


@pytest.mark.parametrize(("kind", "sizes", "places", "tolerance"), FALLS, ids=[fall[0] for fall in FALLS])
def test_shapes_fall_on_terrain_as_in_pybullet(
    client: int, kind: str, sizes: dict[str, object], places: list[list[float]], tolerance: float
) -> None:
    """They tumble over crests and edges of cells, and come to rest on up to four of the points found."""
    p.setGravity(0, 0, -9.81)
    waves()
    body = p.createMultiBody(
        1,
        p.createCollisionShape(getattr(p, kind), **sizes),
        basePosition=[0.02, 0.01, 0.16],
        baseOrientation=p.getQuaternionFromEuler([0.3, 0.2, 0.5]),
    )
    for steps, place in zip((60, 60, 240), places, strict=True):
        for _ in range(steps):
            p.stepSimulation()
        np.testing.assert_allclose(p.getBasePositionAndOrientation(body)[0], place, atol=tolerance)


def test_points_on_terrain_come_in_the_order_of_its_cells(client: int) -> None:
    """The capsule of the test above at step 40: point on the field, normal and distance of each."""
    p.setGravity(0, 0, -9.81)
    waves()
    body = p.createMultiBody(
        1,
        p.createCollisionShape(p.GEOM_CAPSULE, radius=0.05, height=0.2),
        basePosition=[0.02, 0.01, 0.16],
        baseOrientation=p.getQuaternionFromEuler([0.3, 0.2, 0.5]),
    )
    for _ in range(40):
        p.stepSimulation()
    rows = [(*c[6], *c[7], c[8]) for c in p.getContactPoints(body)]
    expected = [
        [-0.03458, 0.05103, -0.00616, 0.3273, -0.0209, 0.9447, 1e-06],
        [-0.00808, 0.05808, -0.00825, -0.1987, -0.1588, 0.9671, 0.001007],
        [-0.01506, 0.05109, -0.00884, -0.0632, -0.0221, 0.9978, 3.8e-05],
        [-0.04235, 0.04235, -0.00366, 0.4694, 0.1486, 0.8704, 0.0014],
    ]
    np.testing.assert_allclose(rows, expected, atol=6e-5)


def test_a_large_box_rests_on_fine_terrain(client: int) -> None:
    """MuJoCo finds 50 contacts of a pair at most, here those of one side."""
    p.setGravity(0, 0, -9.81)
    waves()
    box = p.createMultiBody(
        20, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.5, 0.4, 0.1]), basePosition=[0, 0, 0.14]
    )
    for _ in range(240):
        p.stepSimulation()
    np.testing.assert_allclose(
        p.getBasePositionAndOrientation(box)[0], [-0.000142, 9e-06, 0.129346], atol=2e-6
    )

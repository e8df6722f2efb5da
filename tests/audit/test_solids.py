"""Hull intersection against linear programming; volumes and masses of a draft's shapes."""

from pathlib import Path

import numpy as np
import pytest
from audit_cases import CUBE, INERTIAL, arm, both, mesh, stl, write_case
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from roboyard.audit import audit_urdf
from roboyard.audit.solids import hulls_meet, link_solid, shape_points
from roboyard.description.urdf.parse import parse_urdf


def meet_by_programming(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether some point is a convex combination of both sets."""
    n, m = len(a), len(b)
    equal = np.zeros((5, n + m))
    equal[:3, :n], equal[:3, n:] = a.T, -b.T
    equal[3, :n] = equal[4, n:] = 1
    return linprog(np.zeros(n + m), A_eq=equal, b_eq=[0, 0, 0, 1, 1], method="highs").status == 0


@pytest.mark.parametrize("seed", range(40))
def test_random_hulls(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(5):
        a = rng.normal(size=(rng.integers(4, 40), 3)) * rng.uniform(0.2, 2, size=3)
        b = rng.normal(size=(rng.integers(4, 40), 3)) + rng.normal(size=3) * 2.5
        assert hulls_meet(a, b) == meet_by_programming(a, b)


@pytest.mark.parametrize(("gap", "expected"), [(-1e-4, True), (1e-4, False)])
def test_turned_boxes_that_almost_touch(gap: float, expected: bool) -> None:
    corners = np.unique(CUBE.reshape(-1, 3), axis=0)
    turn = Rotation.from_euler("xyz", [0.4, -0.9, 1.3]).as_matrix()
    other = corners + np.array([1.0 + gap, 0.2, -0.1])
    assert hulls_meet(corners @ turn.T, other @ turn.T) is expected


def test_one_inside_the_other_and_flat_and_single_points() -> None:
    corners = np.unique(CUBE.reshape(-1, 3), axis=0)
    assert hulls_meet(corners, 0.1 * corners)
    assert hulls_meet(0.1 * corners, corners)
    assert hulls_meet(corners * (1, 1, 0), corners)
    assert hulls_meet(np.zeros((1, 3)), corners)
    assert not hulls_meet(np.full((1, 3), 0.51), corners)
    assert not hulls_meet(corners * (1, 1, 0) + (0, 0, 0.6), corners)


def tip_of(folder: Path, shapes: str):
    (folder / "arm").mkdir()
    (folder / "arm" / "part.stl").write_bytes(stl(CUBE))
    file = folder / "arm" / "arm.urdf"
    file.write_text(arm(tip=INERTIAL + shapes))
    draft = parse_urdf(file)
    audit_urdf(draft)
    return draft.link_by_name["tip"]


def test_a_link_of_several_shapes_adds_them_up(tmp_path: Path) -> None:
    shapes = both('<box size="0.2 0.1 0.1"/>', '<origin xyz="0.3 0 0"/>') + both(
        mesh("part.stl", "0.1 0.1 0.2")
    )
    solid = link_solid(tip_of(tmp_path, shapes))
    assert solid is not None
    assert solid.mass == pytest.approx(0.004, rel=1e-5)
    np.testing.assert_allclose(solid.center, (0.15, 0, 0), atol=1e-6)
    across = 0.002 * (0.01 + 0.01) / 12
    assert solid.inertia[0, 0] == pytest.approx(across + 0.002 * (0.01 + 0.04) / 12, rel=1e-4)


@pytest.mark.parametrize(
    "geometry",
    [
        '<box size="0.2 0.4 0.6"/>',
        '<cylinder radius="0.1" length="0.6"/>',
        '<capsule radius="0.1" length="0.4"/>',
        '<sphere radius="0.3"/>',
        '<mesh filename="part.stl" scale="0.2 -0.4 0.6"/>',
    ],
)
def test_points_span_the_shape(geometry: str, tmp_path: Path) -> None:
    origin = '<origin xyz="1 2 3" rpy="0 1.5707963267948966 0"/>'
    link = tip_of(tmp_path, both(geometry, origin))
    points = shape_points(link.collisions[0])
    assert points is not None
    np.testing.assert_allclose(points.min(axis=0), link.bounds[0], atol=0.01)
    np.testing.assert_allclose(points.max(axis=0), link.bounds[1], atol=0.01)


def test_a_draft_of_a_case_is_complete(tmp_path: Path) -> None:
    draft = parse_urdf(write_case(arm(), tmp_path))
    audit_urdf(draft)
    assert [link.name for link in draft.links] == ["base", "tip"]
    assert draft.reach == pytest.approx(0.2)

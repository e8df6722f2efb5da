"""Cameras look out of their housing, along the axis that is free."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from roboyard.description import load_description
from roboyard.description.evidence.read import read_evidence
from roboyard.morphology.analyze import infer_semantics
from roboyard.morphology.sensors.rays import hit_fraction, triangles_near
from roboyard.morphology.sensors.views import camera_view, with_camera_views
from roboyard.transforms import Array, matrix_from_quaternion

ROBOT = """
<robot name="mast">
  <link name="base_link"><visual><geometry><box size="0.3 0.3 0.1"/></geometry></visual>
    <inertial><mass value="5"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="head_camera_link"><visual>{housing}</visual></link>
  <joint name="head_camera_joint" type="fixed"><parent link="base_link"/><child link="head_camera_link"/>
    <origin xyz="0.1 0 0.5" rpy="{rpy}"/></joint>
  {more}
</robot>
"""
OPTICAL = """
  <link name="head_camera_optical_frame"/>
  <joint name="optical" type="fixed"><parent link="head_camera_link"/>
    <child link="head_camera_optical_frame"/>
    <origin rpy="-1.5707963267948966 0 -1.5707963267948966"/></joint>
"""


def view(tmp_path: Path, housing: str, rpy: str = "0 0 0", more: str = "") -> tuple[Array, Array]:
    """Return position (3,) and rotation (3, 3) of the camera in the frame of the link it looks from."""
    file = tmp_path / "mast.urdf"
    file.write_text(ROBOT.format(housing=housing, rpy=rpy, more=more))
    description = load_description(file)
    semantic = infer_semantics(description, evidence=read_evidence(description, file))
    (camera,) = [s for s in with_camera_views(semantic, description).sensors if s.kind == "camera"]
    assert camera.view is not None
    return np.array(camera.view.position), matrix_from_quaternion(camera.view.quaternion)


BOX = '<geometry><box size="{} {} {}"/></geometry>'


def test_a_camera_inside_its_housing_looks_from_in_front_of_it(tmp_path: Path) -> None:
    position, rotation = view(tmp_path, BOX.format(0.05, 0.1, 0.03))
    np.testing.assert_allclose(rotation, [[0, 0, -1], [-1, 0, 0], [0, 1, 0]], atol=1e-12)  # along x, z up
    np.testing.assert_allclose(position, [0.03, 0, 0], atol=1e-12)  # first step outside of 25 mm


def test_an_optical_frame_keeps_its_direction_and_leaves_the_housing(tmp_path: Path) -> None:
    position, rotation = view(tmp_path, BOX.format(0.03, 0.1, 0.03), more=OPTICAL)
    np.testing.assert_allclose(rotation, np.diag([1.0, -1, -1]), atol=1e-12)
    np.testing.assert_allclose(position, [0, 0, 0.02], atol=1e-12)


def test_a_camera_whose_z_axis_looks_out_is_recognised_by_what_blocks_the_others(tmp_path: Path) -> None:
    tube = '<origin xyz="0 0 -0.095"/>' + BOX.format(0.3, 0.3, 0.2)
    position, rotation = view(tmp_path, tube, rpy="1.5707963267948966 0 1.5707963267948966")
    np.testing.assert_allclose(-rotation[:, 2], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(rotation[:, 1], [0, 1, 0], atol=1e-12)  # the link's y axis is up
    np.testing.assert_allclose(position, [0, 0, 0.01], atol=1e-12)


def test_rays_hit_a_triangle_from_either_side_within_their_reach() -> None:
    triangle = np.array([[[1.0, -1, -1], [1.0, 1, -1], [1.0, 0, 2]]])
    ways = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0.6, 0.8, 0]])
    assert hit_fraction(triangle, np.zeros(3), ways, 2.0) == 0.25
    assert hit_fraction(triangle[:, ::-1], np.zeros(3), ways, 2.0) == 0.25
    assert hit_fraction(triangle, np.zeros(3), ways, 0.9) == 0.0
    assert hit_fraction(np.empty((0, 3, 3)), np.zeros(3), ways, 2.0) == 0.0


@pytest.mark.parametrize("seed", range(3))
def test_rays_agree_with_a_sphere(seed: int) -> None:
    from roboyard.shapes import primitives

    rng = np.random.default_rng(seed)
    mesh = primitives.sphere(0.5)
    ways = rng.normal(size=(400, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    start = np.array([0.0, 0.0, 1.0])
    share = hit_fraction(np.asarray(mesh.vertices)[np.asarray(mesh.faces)], start, ways, 5.0)
    along = -ways[:, 2]
    assert share == pytest.approx(np.mean(along > np.sqrt(1 - 0.25)), abs=0.03)  # within 30 degrees of -z


def struck(triangles: Array, start: Array, ways: Array, reach: float) -> float:
    """Return the share of rays that hit a triangle: the linear equations of each pair, solved."""
    hits = np.zeros(len(ways), dtype=bool)
    for a, b, c in triangles:
        for i, way in enumerate(ways):
            columns = np.stack([b - a, c - a, -way], axis=1)
            if abs(np.linalg.det(columns)) < 1e-12:
                continue
            u, v, distance = np.linalg.solve(columns, start - a)
            hits[i] |= min(u, v) >= 0 and u + v <= 1 and 0 < distance < reach
    return float(hits.mean())


@pytest.mark.parametrize("width", [0.3, 4.0])
@pytest.mark.parametrize("seed", range(3))
def test_rays_agree_with_each_pair_solved(seed: int, width: float) -> None:
    rng = np.random.default_rng(seed)
    triangles = rng.normal(scale=0.05, size=(60, 1, 3)) + rng.normal(scale=0.02, size=(60, 3, 3))
    triangles[::10, 2] = triangles[::10, 1]  # without an area
    ways = rng.normal(size=3) + rng.uniform(-width, width, size=(40, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    start = rng.normal(scale=0.02, size=3)
    share = hit_fraction(triangles, start, ways, 0.07)
    assert share == struck(triangles, start, ways, 0.07)
    assert share > 0


def test_triangles_near_a_point_are_those_whose_boxes_reach_its_box() -> None:
    rng = np.random.default_rng(0)
    vertices = rng.uniform(-1, 1, size=(300, 3))
    faces = rng.integers(0, 300, size=(500, 3))
    centre = np.array([0.3, -0.2, 0.1])
    found = triangles_near(vertices, faces, centre, 0.2)
    corners = vertices[faces]
    low, high = corners.min(axis=1), corners.max(axis=1)
    expected = corners[((low < centre + 0.2) & (high > centre - 0.2)).all(axis=1)]
    assert 0 < len(expected) < 500
    np.testing.assert_array_equal(found, expected)


SIDEWAYS = "1.5707963267948966 0 1.5707963267948966"
"""Turns a link such that its z axis looks forwards and its y axis up."""


def test_a_camera_on_a_mast_is_upright_although_a_sideways_view_is_free(tmp_path: Path) -> None:
    small = '<origin xyz="0 0 -0.014"/>' + BOX.format(0.02, 0.02, 0.028)  # free along x, too
    _, rotation = view(tmp_path, small, rpy=SIDEWAYS)
    np.testing.assert_allclose(-rotation[:, 2], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(rotation[:, 1], [0, 1, 0], atol=1e-12)


def test_a_camera_on_an_arm_keeps_the_usual_axes(tmp_path: Path) -> None:
    file = tmp_path / "mast.urdf"
    small = '<origin xyz="0 0 -0.014"/>' + BOX.format(0.02, 0.02, 0.028)
    file.write_text(ROBOT.format(housing=small, rpy=SIDEWAYS, more=""))
    description = load_description(file)
    semantic = infer_semantics(description, evidence=read_evidence(description, file))
    (camera,) = [sensor for sensor in semantic.sensors if sensor.kind == "camera"]
    found = camera_view(camera, description, {"head_camera_joint"})
    assert found is not None
    np.testing.assert_allclose(-matrix_from_quaternion(found.quaternion)[:, 2], [1, 0, 0], atol=1e-12)

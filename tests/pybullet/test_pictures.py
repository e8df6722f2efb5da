"""How getCameraImage lights and draws, compared with PyBullet 3.2.7's software renderer."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import roboyard.pybullet as p

VIEW = ([0, 0, 2], [0, 0, 0], [0, 1, 0])


def _box(*rgba: float) -> int:
    look = p.createVisualShape(p.GEOM_BOX, halfExtents=[0.5, 0.5, 0.5], rgbaColor=rgba)
    return p.createMultiBody(0, -1, look)


def _top(**arguments: object) -> list[int]:
    """Colour of the middle of a box seen from above."""
    projection = p.computeProjectionMatrixFOV(40, 1, 0.05, 10)
    image = p.getCameraImage(20, 20, p.computeViewMatrix(*VIEW), projection, **arguments)
    return image[2][10, 10].tolist()


@pytest.mark.parametrize(
    ("arguments", "color"),
    [
        ({}, (239, 239, 239)),
        ({"lightAmbientCoeff": 0}, (86, 86, 86)),
        ({"lightDiffuseCoeff": 0}, (162, 162, 162)),
        ({"lightAmbientCoeff": 0, "lightDiffuseCoeff": 0, "lightSpecularCoeff": 1}, (190, 190, 190)),
        ({"lightColor": [1, 0, 0.5]}, (239, 153, 196)),
        ({"lightDirection": [1, 0, 1]}, (222, 222, 222)),
        ({"lightDirection": [0, 0, -1]}, (153, 153, 153)),
    ],
)
def test_level_surfaces_are_lit_as_in_pybullet(
    client: int, arguments: dict[str, object], color: tuple[int, int, int]
) -> None:
    _box(1, 1, 1, 1)
    np.testing.assert_allclose(_top(**arguments)[:3], color, atol=1)


def test_light_stays_as_it_was_set(client: int) -> None:
    _box(1, 1, 1, 1)
    before = _top()
    set_once = _top(lightColor=[1, 0, 0.5], lightAmbientCoeff=0.2)
    assert set_once != before
    assert _top() == set_once
    p.resetSimulation()
    _box(1, 1, 1, 1)
    assert _top() == set_once


def test_shapes_of_some_alpha_are_solid_without_a_window(client: int) -> None:
    box = _box(1, 0, 0, 1)
    solid = _top()
    p.changeVisualShape(box, -1, rgbaColor=[1, 0, 0, 0.3])
    assert _top() == solid
    p.changeVisualShape(box, -1, rgbaColor=[1, 0, 0, 0])
    assert _top() == [255, 255, 255, 255]


@pytest.mark.parametrize(
    ("arguments", "shade", "lit"),
    [
        ({}, 180, 194),
        ({"lightDiffuseCoeff": 0.8, "lightAmbientCoeff": 0.2, "lightSpecularCoeff": 0}, 157, 186),
    ],
)
def test_shadows_are_as_light_as_in_pybullet(
    client: int, arguments: dict[str, float], shade: int, lit: int
) -> None:
    """A box of 1 m, 1.2 m over a grey floor."""
    for half, height, color in (([3, 3, 0.1], -0.1, [0.8] * 3), ([0.5, 0.5, 0.1], 1.2, [0.2, 0.9, 0.2])):
        look = p.createVisualShape(p.GEOM_BOX, halfExtents=half, rgbaColor=[*color, 1])
        p.createMultiBody(0, -1, look, [0, 0, height])
    view = p.computeViewMatrix([0, -4, 2.5], [0, 0, 0], [0, 0, 1])
    projection = p.computeProjectionMatrixFOV(50, 1, 0.1, 20)
    sun = {"lightDirection": [0.3, -0.4, 1], "shadow": 1, **arguments}
    rgb = p.getCameraImage(100, 100, view, projection, **sun)[2][..., :3].astype(int)
    floor = rgb[(np.ptp(rgb, axis=-1) == 0) & (rgb[..., 0] < 255)][:, 0]
    levels, counts = np.unique(floor, return_counts=True)
    dark, bright = levels[levels < lit - 5], levels[np.argmax(counts)]
    assert abs(dark.min() - shade) <= 2
    assert abs(bright - lit) <= 1


@pytest.mark.parametrize(
    ("side", "up", "color"),
    [
        ((1, 0, 0), (0, 0, 1), [153, 76, 30]),
        ((-1, 0, 0), (0, 0, 1), [191, 95, 38]),
        ((0, 1, 0), (0, 0, 1), [176, 87, 35]),
        ((0, -1, 0), (0, 0, 1), [153, 76, 30]),
        ((0, 0, 1), (1, 0, 0), [239, 119, 47]),
        ((0, 0, -1), (1, 0, 0), [162, 80, 32]),
    ],
)
def test_the_sides_of_a_box_have_tiny_renderers_colours(
    client: int, side: tuple[int, int, int], up: tuple[int, int, int], color: list[int]
) -> None:
    """PyBullet 3.2.7's, to the last bit: levels are cut, and the highlight is the sun mirrored upwards."""
    shape = p.createVisualShape(p.GEOM_BOX, halfExtents=[0.5] * 3, rgbaColor=[1, 0.5, 0.2, 1])
    p.createMultiBody(0, -1, shape)
    view = p.computeViewMatrix([2.0 * part for part in side], [0, 0, 0], up)
    projection = p.computeProjectionMatrixFOV(40, 1, 0.1, 20)
    picture = np.reshape(p.getCameraImage(20, 20, view, projection, shadow=0)[2], (20, 20, 4))
    assert picture[10, 10, :3].tolist() == color
    own = p.getCameraImage(
        *(20, 20, p.computeViewMatrix([0, -2, 0], [0, 0, 0], [0, 0, 1]), projection, [1, -2, 0.5]),
        *([0.9, 0.8, 0.7], 10, 0, 0.3, 0.5, 0.4),
    )
    assert np.reshape(own[2], (20, 20, 4))[10, 10, :3].tolist() == [176, 82, 30]


def _counts(width: int, height: int, **arguments: object) -> tuple[float, float, list[int]]:
    """Nearest and mean depth of a picture, and the pixels of the background and of three bodies."""
    image = p.getCameraImage(width, height, **arguments)
    pixels = [int((image[4] == body).sum()) for body in (-1, 0, 1, 2)]
    return round(float(image[3].min()), 4), round(float(image[3].mean()), 4), pixels


def test_a_picture_without_matrices_has_the_renderers_camera(client: int) -> None:
    """Neither the size nor the visualizer's camera changes it; its planes are those of the last picture."""
    for size, place in (
        ([0.2] * 3, [0, 0, 0.1]), ([0.1, 0.3, 0.2], [0.4, 0.5, 0.2]), ([0.3, 0.1, 0.1], [-0.5, -0.3, -0.2]),
    ):  # fmt: skip
        look = p.createVisualShape(p.GEOM_BOX, halfExtents=size)
        p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=size), look, place)
    assert _counts(160, 120) == (0.9852, 0.9995, [18190, 350, 189, 471])
    p.resetDebugVisualizerCamera(3, 30, -30, [0, 0, 0])
    assert _counts(80, 80) == (0.9852, 0.9995, [6061, 123, 62, 154])
    view = p.computeViewMatrixFromYawPitchRoll([0, 0, 0.5], 3, 50, -35, 0, 2)
    p.getCameraImage(16, 16, view, p.computeProjectionMatrixFOV(60, 1, 0.1, 50))
    for arguments in ({}, {"viewMatrix": view}):
        assert _counts(160, 120, **arguments) == (0.8534, 0.9950, [18190, 350, 189, 471])


_COLLADA = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="common"><phong><diffuse>
<color>0.9 0.1 0.1 1</color></diffuse></phong></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="pa" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array><technique_common>
<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source><source id="n">
<float_array id="na" count="12">0 0 -1 0 -1 0 -1 0 0 0.577 0.577 0.577</float_array><technique_common>
<accessor source="#na" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="4" material="mm">
<input semantic="VERTEX" source="#v" offset="0"/><input semantic="NORMAL" source="#n" offset="1"/>
<p>0 0 2 0 1 0 0 1 1 1 3 1 0 2 3 2 2 2 1 3 2 3 3 3</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="x"><instance_geometry url="#g"><bind_material>
<technique_common><instance_material symbol="mm" target="#m"/></technique_common></bind_material>
</instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
_OBJ = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl r\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.mark.parametrize("suffix", ["dae", "obj"])
@pytest.mark.parametrize(
    ("material", "flags", "color"),
    [
        ("", 0, (188, 188, 188)),
        ('<material name="w"><color rgba="0.2 0.4 0.9 1"/></material>', 0, (37, 75, 169)),
        ("", p.URDF_USE_MATERIAL_COLORS_FROM_MTL, {"dae": (188, 188, 188), "obj": (169, 18, 18)}),
    ],
)
def test_colours_of_mesh_files_show_only_where_flags_ask_for_them(
    client: int, tmp_path: Path, suffix: str, material: str, flags: int, color: Any
) -> None:
    """The files' own colour is red; numbers of PyBullet 3.2.7."""
    (tmp_path / "a.dae").write_text(_COLLADA)
    (tmp_path / "a.obj").write_text(_OBJ)
    (tmp_path / "a.mtl").write_text("newmtl r\nKd 0.9 0.1 0.1\n")
    file = tmp_path / "a.urdf"
    file.write_text(
        f'<robot name="a"><link name="b"><visual><geometry><mesh filename="a.{suffix}"/></geometry>'
        f"{material}</visual></link></robot>"
    )
    p.loadURDF(str(file), flags=flags)
    view = p.computeViewMatrix([2, 2, 2], [0.2, 0.2, 0.2], [0, 0, 1])
    image = p.getCameraImage(40, 40, view, p.computeProjectionMatrixFOV(40, 1, 0.1, 10))
    wanted = color[suffix] if isinstance(color, dict) else color
    assert image[2][20, 20, :3] == pytest.approx(np.array(wanted), abs=1)


@pytest.mark.parametrize(
    ("near", "far", "drawn"),
    [(0.1, 4.35, 0), (0.1, 4.4, 9), (0.1, 4.9999, 9), (0.1, 5.0, 256), (0.1, 5.01, 256)],
)
def test_surfaces_in_the_far_plane_are_drawn(client: int, near: float, far: float, drawn: int) -> None:
    """Counts of pixels were recorded with PyBullet 3.2.7: the floor is 5 m away, a box's top 4.4 m."""
    plane = p.createCollisionShape(p.GEOM_BOX, halfExtents=[9, 9, 1])
    p.createMultiBody(0, plane, basePosition=[0, 0, -1])
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), basePosition=[0, 0, 0.5])
    view = p.computeViewMatrix([0, 0, 5], [0, 0, 0], [0, 1, 0])
    projection = p.computeProjectionMatrixFOV(20, 1, near, far)
    image = p.getCameraImage(16, 16, view, projection, renderer=p.ER_TINY_RENDERER)
    assert int((np.asarray(image[4]) >= 0).sum()) == drawn


def _scene_of_matrices() -> tuple[np.ndarray, np.ndarray]:
    look = p.createVisualShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.15], rgbaColor=[1, 0, 0, 1])
    p.createMultiBody(0, -1, look, [0, 0, 0], [0.1, 0.2, 0.3, 0.9])
    ball = p.createVisualShape(p.GEOM_SPHERE, radius=0.1, rgbaColor=[0, 1, 0, 1])
    p.createMultiBody(0, -1, ball, [0.3, 0, 0])
    view = p.computeViewMatrix([0.5, 0.8, 0.6], [0, 0, 0], [0, 0, 1])
    projection = p.computeProjectionMatrixFOV(60, 80 / 60, 0.1, 3)
    return np.reshape(view, (4, 4)).T, np.reshape(projection, (4, 4)).T


def _image(view: np.ndarray, projection: np.ndarray) -> list[np.ndarray]:
    matrices = view.T.ravel().tolist(), projection.T.ravel().tolist()
    image = p.getCameraImage(80, 60, *matrices, lightDirection=[1, 1, 1])
    return [image[2].copy(), image[3].copy(), image[4].copy()]


@pytest.mark.parametrize("turned", [(1, 3), (1, 4), (3, 4)])
@pytest.mark.parametrize("flip", [(-1, 1, 1), (1, -1, 1), (2, 2, 2), (0.5, 1.5, 1), (-3, 2, 1)])
def test_scale_and_mirror_of_the_view_may_be_undone_by_the_projection(
    client: int, flip: tuple[float, float, float], turned: tuple[int, int]
) -> None:
    """The matrices of cameras of calibration tools, whose y points down."""
    view, projection = _scene_of_matrices()
    shear = np.eye(4)
    shear[0, 1] = 0.2 * (turned[0] == 3)
    change = np.diag([*flip, 1.0]) @ shear
    change[:3, :3] *= turned[1] / 4
    first = _image(view, projection)
    second = _image(change @ view, projection @ np.linalg.inv(change))
    np.testing.assert_allclose(second[0].astype(int), first[0], atol=1)
    np.testing.assert_allclose(second[1], first[1], atol=1e-6)
    np.testing.assert_array_equal(second[2], first[2])


@pytest.mark.parametrize(
    ("flip", "depth", "centre"),
    [
        ((1, 1, 1), 0.99408, (33.55, 26.47)),
        ((-1, 1, 1), 0.99408, (33.55, 53.53)),
        ((1, -1, 1), 0.99408, (24.45, 26.47)),
        ((-1, -1, 1), 0.99408, (24.45, 53.53)),
        ((2, 2, 2), 0.99851, (33.55, 26.47)),
        ((1, 2, 1), 0.98817, (38.22, 26.46)),
    ],
)
def test_pictures_of_scaled_and_mirrored_views_are_those_of_pybullet(
    client: int, flip: tuple[float, float, float], depth: float, centre: tuple[float, float]
) -> None:
    """PyBullet 3.2.7's mean depth, and the mean row and column of the sphere."""
    view, projection = _scene_of_matrices()
    rgba, buffer, ids = _image(np.diag([*flip, 1.0]) @ view, projection)
    assert buffer.mean() == pytest.approx(depth, abs=2e-4)
    assert np.argwhere(ids == 1).mean(axis=0) == pytest.approx(centre, abs=0.3)
    assert rgba[ids == 0].mean(axis=0)[:3] == pytest.approx((208.3, 0, 0), abs=1), "its outside is drawn"


@pytest.mark.parametrize(
    ("name", "text"),
    [("a.stl", "solid a\nendsolid a\n"), ("a.obj", "v 0 0 0\nv 1 0 0\n"), ("a.dae", "<COLLADA")],
)
def test_visual_meshes_that_cannot_be_read_are_shown_as_nothing(
    client: int, tmp_path: Path, name: str, text: str, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / name).write_text(text)
    box = '<visual><geometry><box size="0.2 0.2 0.2"/></geometry></visual>'
    mesh = f'<visual><geometry><mesh filename="{name}"/></geometry></visual>'
    file = tmp_path / "robot.urdf"
    file.write_text(f'<robot name="r"><link name="l">{mesh}{box}</link></robot>')
    robot = p.loadURDF(str(file), [0, 0, 0.5])
    assert [data[2] for data in p.getVisualShapeData(robot)] == [p.GEOM_MESH, p.GEOM_BOX]
    p.changeVisualShape(robot, -1, shapeIndex=1, rgbaColor=[0, 1, 0, 1])
    image = p.getCameraImage(
        20, 20, p.computeViewMatrix(*VIEW), p.computeProjectionMatrixFOV(40, 1, 0.05, 10)
    )
    assert image[4][10, 10] == robot
    assert image[2][10, 10, :3].argmax() == 1
    assert name in caplog.text


TEXTURE = '<texture filename="t.png"/>'


@pytest.mark.parametrize(
    ("own", "of_visual", "level"),
    [
        ("", "", 1.0),
        ("", f'<material name="t">{TEXTURE}</material>', 0.8),
        ('<material name="t"/>', '<material name="t"/>', 0.8),
        ("", '<material name="t"/>', 1.0),
        (f'<material name="t">{TEXTURE}</material>', '<material name="t"/>', 0.8),
        ("", '<material name="t"><color rgba="1 1 1 1"/></material>', 1.0),
        (f'<material name="s">{TEXTURE}</material>', '<material name="t"/>', 1.0),
    ],
)
def test_materials_that_are_defined_without_a_colour_are_grey(
    client: int, tmp_path: Path, own: str, of_visual: str, level: float
) -> None:
    """As in PyBullet 3.2.7."""
    Image.fromarray(np.full((8, 8, 3), [200, 100, 50], np.uint8)).save(tmp_path / "t.png")
    corners = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n"
    faces = "f 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/4/1\n"
    (tmp_path / "m.obj").write_text(f"mtllib m.mtl\nusemtl m\n{corners}{faces}")
    (tmp_path / "m.mtl").write_text("newmtl m\nKd 1 1 1\nmap_Kd t.png\n")
    visual = f'<visual><geometry><mesh filename="m.obj"/></geometry>{of_visual}</visual>'
    (tmp_path / "r.urdf").write_text(f'<robot name="r">{own}<link name="l">{visual}</link></robot>')
    robot = p.loadURDF(str(tmp_path / "r.urdf"))
    assert p.getVisualShapeData(robot)[0][7] == (level, level, level, 1.0)
    expected = np.array([200, 100, 50]) * level
    np.testing.assert_allclose(_top(lightDirection=[0, 0, 1])[:3], expected, atol=15)


@pytest.mark.parametrize("has_coordinates", [True, False])
def test_images_are_shown_on_meshes_whose_files_have_none(
    client: int, tmp_path: Path, has_coordinates: bool
) -> None:
    """Without texture coordinates the centre of the image is everywhere, as in PyBullet."""
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[:, :20, 0] = pixels[:, 20:, 2] = 255
    Image.fromarray(pixels).save(tmp_path / "t.png")
    corners = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"
    if has_coordinates:
        corners += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    faces = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n" if has_coordinates else "f 1 2 3\nf 1 3 4\n"
    (tmp_path / "m.obj").write_text(corners + faces)
    visual = '<visual><geometry><mesh filename="m.obj" scale="0.5 0.5 1"/></geometry></visual>'
    (tmp_path / "r.urdf").write_text(f'<robot name="r"><link name="l">{visual}</link></robot>')
    robot = p.loadURDF(str(tmp_path / "r.urdf"))
    p.changeVisualShape(robot, -1, textureUniqueId=p.loadTexture(str(tmp_path / "t.png")))
    projection = p.computeProjectionMatrixFOV(28, 1, 0.05, 10)
    image = p.getCameraImage(40, 40, p.computeViewMatrix(*VIEW), projection)[2]
    assert image[20, 30, :3].argmax() == 2
    assert image[20, 4, :3].argmax() == (0 if has_coordinates else 2)
    assert (image[20, [4, 30], 1] < 60).all()


def test_depths_of_a_parallel_projection_are_converted_as_bullet_does(client: int) -> None:
    shape = p.createVisualShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    p.createMultiBody(0, -1, shape)
    near, far, width = 0.1, 1.5, 0.613
    projection = [2 / width, 0, 0, 0, 0, 2 / width, 0, 0, 0, 0, -2 / (far - near), 0]
    projection += [0, 0, -(far + near) / (far - near), 1]
    view = p.computeViewMatrix([0, 0, 1], [0, 0, 0], [1, 0, 0])
    depth = p.getCameraImage(24, 24, view, projection)[3]
    assert depth[0, 0] == 1.0
    assert depth[12, 12] == pytest.approx(0.5793651, abs=1e-6)  # recorded with PyBullet 3.2.7


def test_a_camera_of_zeros_sees_nothing(client: int) -> None:
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[1, 1, 1]))
    zeros = p.getDebugVisualizerCamera()
    view = p.computeViewMatrix([3, 3, 3], [0, 0, 0], [0, 0, 1])
    for matrices in ((view, zeros[3]), (zeros[2], zeros[3])):
        _, _, rgba, depth, mask = p.getCameraImage(8, 4, *matrices)
        assert (rgba.shape, rgba.min()) == ((4, 8, 4), 255)  # recorded with PyBullet 3.2.7
        assert np.isnan(depth).all()
        assert (mask == -1).all()
    depth = p.getCameraImage(8, 4, zeros[2], p.computeProjectionMatrixFOV(60, 1, 0.1, 9))[3]
    assert depth == pytest.approx(np.ones((4, 8)))
    with pytest.raises(p.error):
        p.getCameraImage(10**6, 10**6, zeros[2], zeros[3])

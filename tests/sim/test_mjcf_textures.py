"""Textures of MJCF files: each colour at the place where MuJoCo's own renderer shows it.

The places were read off pictures of MuJoCo 4's OpenGL renderer; those here are the software renderer's.
"""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from roboyard.rendering import UNLIT, Camera
from roboyard.shapes import primitives
from roboyard.sim import World
from roboyard.sim.appearance.cube_texture import wrap_in_cube

RED, GREEN, BLUE, YELLOW = (255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 0)
PURPLE, CYAN, WHITE = (255, 0, 255), (0, 255, 255), (255, 255, 255)


def picture(asset, geom, view=(0, 0, 1), up=(0, 1, 0)):
    """Look-up of the colour at (right, up), m, in a picture from `view` towards the origin, 2.4 m wide."""
    world = World()
    folder = tempfile.gettempdir()
    text = f"<mujoco><asset>{asset}</asset><worldbody><geom {geom}/></worldbody></mujoco>"
    world.add_mjcf(text, search_paths=[Path(folder)])
    camera = Camera.orthographic(5.0 * np.array(view), (0, 0, 0), up, width=240, height=240, extent=2.4)
    image = world.render(camera, light=UNLIT, shadow=False, backend="software", background=(0, 0, 0))

    def at(right, above):
        return tuple(int(v) for v in image.rgba[round(119.5 - 100 * above), round(119.5 + 100 * right), :3])

    return at


@pytest.fixture
def quarters(tmp_path):
    """A picture file: red and green above, blue and yellow below."""
    pixels = np.array([[RED, GREEN], [BLUE, YELLOW]], dtype=np.uint8).repeat(32, 0).repeat(32, 1)
    path = tmp_path / "quarters.png"
    Image.fromarray(pixels).save(path)
    return f'<texture name="t" type="2d" file="{path}"/>'


CHECKER = """<texture name="t" type="2d" builtin="checker" width="64" height="64" rgb1="1 0 0" rgb2="0 0 1"/>
<material name="m" texture="t" texrepeat="{repeat}" texuniform="{uniform}"/>"""


@pytest.mark.parametrize(
    ("repeat", "uniform", "size", "red", "blue"),
    [
        ("1 1", "false", "1 .6", [(-0.5, 0.3), (0.5, -0.3)], [(0.5, 0.3), (-0.5, -0.3)]),
        ("2 1", "false", "1 .6", [(-0.75, 0.3), (0.25, 0.3), (-0.25, -0.3)], [(-0.25, 0.3), (0.75, 0.3)]),
        # "uniform" counts from the corner, two metres for a repetition
        ("1 1", "true", "1 .4", [(-0.5, 0.2), (-0.5, -0.3)], [(0.5, 0.2), (0.5, -0.3)]),
        # an endless plane has the middle of the picture at its origin
        ("1 1", "false", "0 0", [(-0.5, 0.5), (0.5, -0.5)], [(0.5, 0.5), (-0.5, -0.5), (-1.1, 0.5)]),
        (
            "2 2",
            "true",
            "0 0",
            [(-0.25, 0.25), (0.25, -0.25), (0.75, 0.25)],
            [(0.25, 0.25), (0.75, 0.75)][:1],
        ),
    ],
)
def test_a_checker_on_a_plane(repeat, uniform, size, red, blue):
    asset = CHECKER.format(repeat=repeat, uniform=uniform)
    at = picture(asset, f'type="plane" size="{size} .1" material="m"')
    assert [at(*place) for place in red] == [RED] * len(red)
    assert [at(*place) for place in blue] == [BLUE] * len(blue)


@pytest.mark.parametrize("geom", ['type="plane" size="1 .6 .1"', 'type="box" size="1 .6 .1"'])
def test_an_image_file_stands_upright(quarters, geom):
    at = picture(f'{quarters}<material name="m" texture="t"/>', f'{geom} material="m"')
    assert [at(-0.5, 0.3), at(0.5, 0.3), at(-0.5, -0.3), at(0.5, -0.3)] == [RED, GREEN, BLUE, YELLOW]


def test_texture_coordinates_of_a_mesh_are_used(quarters):
    """MuJoCo's v runs down the picture; texrepeat multiplies it."""
    mesh = """<mesh name="s" vertex="-1 -.6 0  1 -.6 0  1 .6 0  -1 .6 0  0 0 -.9"
    texcoord="0 0 1 0 1 1 0 1 .5 .5" face="0 1 2 0 2 3 1 0 4 2 1 4 3 2 4 0 3 4"/>"""
    once = picture(f'{quarters}{mesh}<material name="m" texture="t"/>', 'type="mesh" mesh="s" material="m"')
    assert [once(-0.5, -0.3), once(0.5, -0.3), once(-0.5, 0.3), once(0.5, 0.3)] == [RED, GREEN, BLUE, YELLOW]
    material = '<material name="m" texture="t" texrepeat="2 1"/>'
    twice = picture(f"{quarters}{mesh}{material}", 'type="mesh" mesh="s" material="m"')
    assert [twice(x, -0.3) for x in (-0.75, -0.25, 0.25, 0.75)] == [RED, GREEN, RED, GREEN]


@pytest.fixture
def cube(tmp_path):
    """A cube texture with a colour for each side, white in the upper left corner of each."""
    files = {
        "right": RED, "left": GREEN, "up": BLUE, "down": YELLOW, "front": PURPLE, "back": CYAN,
    }  # fmt: skip
    for name, color in files.items():
        pixels = np.full((64, 64, 3), color, dtype=np.uint8)
        pixels[:20, :20] = 255
        Image.fromarray(pixels).save(tmp_path / f"{name}.png")
    sides = " ".join(f'file{name}="{tmp_path}/{name}.png"' for name in files)
    return f'<texture name="t" type="cube" {sides}/>'


@pytest.mark.parametrize(
    ("view", "up", "color"),
    [
        ((1, 0, 0), (0, 0, 1), RED), ((-1, 0, 0), (0, 0, 1), GREEN), ((0, 1, 0), (0, 0, 1), BLUE),
        ((0, -1, 0), (0, 0, 1), YELLOW), ((0, 0, 1), (0, 1, 0), PURPLE), ((0, 0, -1), (0, 1, 0), CYAN),
    ],
)  # fmt: skip
@pytest.mark.parametrize("geom", ['type="box" size=".9 .6 .3"', 'type="sphere" size=".8"'])
def test_a_cube_texture_has_a_side_for_each_direction(cube, geom, view, up, color):
    at = picture(f'{cube}<material name="m" texture="t"/>', f'{geom} material="m"', view, up)
    assert at(0, 0) == color


def test_a_uniform_cube_texture_is_projected_from_the_centre_of_the_real_shape(cube):
    """Not uniform: the cube is stretched to the box; uniform: its edges cut the large sides of a flat box."""
    box = 'type="box" size=".9 .6 .3" material="m"'
    stretched = picture(f'{cube}<material name="m" texture="t"/>', box)
    assert stretched(-0.6, 0.4) == WHITE and stretched(0.6, 0.0) == PURPLE and stretched(0.0, -0.5) == PURPLE
    real = picture(f'{cube}<material name="m" texture="t" texuniform="true"/>', box)
    assert real(0.2, 0.0) == PURPLE and real(-0.25, 0.25) == WHITE
    assert real(0.8, 0.0) == RED and real(-0.8, 0.0) == GREEN
    assert real(0.0, 0.5) == BLUE and real(0.0, -0.5) == YELLOW


def test_a_geoms_own_colour_overrides_its_materials(quarters):
    asset = f'{quarters}<material name="m" texture="t" rgba=".2 1 1 1"/><material name="n" rgba="1 0 0 1"/>'
    ball = 'type="box" size="1 .6 .1"'
    assert picture(asset, f'{ball} material="m"')(-0.5, 0.3) == (51, 0, 0)
    assert picture(asset, f'{ball} material="m" rgba=".6 1 1 1"')(-0.5, 0.3) == (153, 0, 0)
    assert picture(asset, f'{ball} material="n"')(0, 0) == RED
    assert picture(asset, f'{ball} material="n" rgba="0 1 0 1"')(0, 0) == GREEN


def test_equal_geoms_share_image_and_mesh():
    world = World()
    world.add_mjcf("""<mujoco><asset><texture name="t" type="cube" builtin="gradient" width="16" height="16"/>
    <material name="m" texture="t"/></asset><worldbody>
    <body><geom size=".1" material="m"/></body><body pos="1 0 0"><geom size=".1" material="m"/></body>
    </worldbody></mujoco>""")
    one, other = world.render_scene().shapes
    assert one.texture is other.texture and one.mesh is other.mesh


@pytest.mark.parametrize("offset", [0.0, 0.31, 0.5])
def test_cutting_a_mesh_for_a_cube_texture_leaves_its_shape(offset):
    """Same volume; every edge has two faces, but where a face of the box runs through the cube's middle."""
    box = primitives.box(0.5, 0.3, 0.2)
    shifted = replace(box, vertices=box.vertices + np.array([offset, 0.02, 0.0]))
    cut = wrap_in_cube(shifted, np.ones(3), None, 64, 6)
    assert 12 < len(cut.faces) < 5000
    corners = cut.vertices[cut.faces]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
    assert volume == pytest.approx(1.0 * 0.6 * 0.4)
    if offset == 0.5:
        return
    places, number = np.unique(np.round(cut.vertices, 6), axis=0, return_inverse=True)
    a, b = number.reshape(-1, 3), np.roll(number.reshape(-1, 3), -1, axis=1)
    edges = np.stack([np.minimum(a, b).ravel(), np.maximum(a, b).ravel()], axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert len(places) - len(edges) // 2 + len(cut.faces) == 2

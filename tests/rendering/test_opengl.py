"""MuJoCo's OpenGL renderer against our own; skipped where no OpenGL library works."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from roboyard.errors import RoboyardError
from roboyard.rendering import Camera, DebugLines, RenderScene, opengl, render
from roboyard.shapes import primitives

XML = """
<mujoco>
  <worldbody>
    <geom type="plane" size="4 4 .1"/>
    <body pos="0.2 0.1 0.3" quat="0.8 0.2 -0.3 0.4"><geom type="box" size="0.2 0.15 0.25"/></body>
    <body pos="-0.5 0.2 0.3"><geom type="sphere" size="0.25"/></body>
    <body pos="0.1 -0.6 0.4" quat="0.9 0.3 0.1 0"><geom type="cylinder" size="0.15 0.25"/></body>
  </worldbody>
</mujoco>
"""

CAMERAS = [
    Camera.look_at((1.5, -1.6, 1.1), (0, 0, 0.2), width=320, height=240, near=0.05, far=20),
    Camera.orthographic((1.5, -1.6, 1.1), (0, 0, 0.2), width=200, height=150, near=0.05, far=20),
    Camera.pinhole(
        260, 240, 170, 90, width=320, height=200, near=0.05, far=20,
        position=(0.1, -2.2, 0.5), orientation=(0.7071068, 0, 0, 0.7071068),
    ),
]  # fmt: skip


@pytest.fixture(scope="module")
def world():
    model = mujoco.MjModel.from_xml_string(XML)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    try:
        opengl.GlRenderer(model).close()
    except RoboyardError as error:
        pytest.skip(str(error))
    return model, data


@pytest.fixture(scope="module")
def scene(shape):
    meshes = (
        primitives.plane(4.0, 4.0),
        primitives.box(0.2, 0.15, 0.25),
        primitives.sphere(0.25, 64),
        primitives.cylinder(0.15, 0.5, 64),
    )
    return RenderScene(shapes=[shape(mesh, frame=k, owner=(k, k - 1)) for k, mesh in enumerate(meshes)])


@pytest.mark.parametrize("camera", CAMERAS)
def test_both_back_ends_give_the_same_picture(camera, world, scene):
    _, data = world
    frames = data.xpos, data.xmat
    ours = render(scene, *frames, camera, backend="software")
    theirs = render(scene, *frames, camera, backend="gl", mujoco=world)
    same = (ours.segmentation == theirs.segmentation).all(axis=-1)
    assert same.mean() > 0.99
    both = same & np.isfinite(ours.depth)
    assert both.mean() > 0.3
    assert (np.abs(ours.depth[both] - theirs.depth[both]) < 0.01).mean() > 0.995
    assert theirs.rgba.shape == ours.rgba.shape


def test_opengl_draws_shadow_background_and_lines(world, scene):
    _, data = world
    camera = CAMERAS[0]
    lines = DebugLines(
        start=np.array([[-0.5, -0.5, 1.0]]),
        end=np.array([[0.5, -0.5, 1.0]]),
        rgb=np.array([[1.0, 0.0, 0.0]]),
        width=np.array([4.0]),
    )
    draw = {"backend": "gl", "mujoco": world, "background": (0.0, 1.0, 0.0)}
    with_shadow = render(scene, data.xpos, data.xmat, camera, **draw)
    without = render(scene, data.xpos, data.xmat, camera, shadow=False, lines=lines, **draw)
    empty = with_shadow.segmentation[..., 0] < 0
    assert (with_shadow.rgba[empty] == (0, 255, 0, 255)).all()
    ground = without.segmentation[..., 0] == 0
    assert with_shadow.rgba[ground].astype(int).sum() < without.rgba[ground].astype(int).sum()
    red = (without.rgba[..., 0] > 150) & (without.rgba[..., 1] < 80)
    assert red.sum() > 50


def test_gl_without_a_model_names_the_missing_argument(scene):
    with pytest.raises(RoboyardError, match="mujoco="):
        render(scene, np.zeros((4, 3)), np.tile(np.eye(3), (4, 1, 1)), CAMERAS[0], backend="gl")


def test_a_missing_library_is_one_clear_error(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "disabled")
    import sys

    for name in [name for name in sys.modules if "gl_context" in name]:
        monkeypatch.delitem(sys.modules, name)
    with pytest.raises(RoboyardError, match="software"):
        opengl.open_context(16, 16)


def test_auto_uses_the_software_renderer_without_a_graphics_card(world, scene, monkeypatch):
    _, data = world
    monkeypatch.setattr(opengl, "has_hardware", lambda: False)
    monkeypatch.setattr(opengl, "draw", lambda *a, **k: pytest.fail("asked OpenGL"))
    image = render(scene, data.xpos, data.xmat, CAMERAS[1], mujoco=world)
    assert np.isfinite(image.depth).any()


def test_a_software_driver_does_not_count_as_a_graphics_card(monkeypatch):
    class Done:
        returncode = 0
        stdout = "renderer: llvmpipe (LLVM 15.0.6, 256 bits)\n"

    monkeypatch.setattr(opengl, "_device_files", lambda: True)
    monkeypatch.setattr(opengl.subprocess, "run", lambda *a, **k: Done)
    opengl.has_hardware.cache_clear()
    assert not opengl.has_hardware()
    Done.stdout = "renderer: NVIDIA H200/PCIe/SSE2\n"
    opengl.has_hardware.cache_clear()
    assert opengl.has_hardware()
    Done.returncode = -11  # the probe crashed
    opengl.has_hardware.cache_clear()
    assert not opengl.has_hardware()
    opengl.has_hardware.cache_clear()

"""MJCF files that would read outside their folders, hang or take all memory are refused first."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from roboyard.errors import DescriptionError, RoboyardError
from roboyard.scenes import load_scene
from roboyard.sim import World

BALL = '<body name="b"><freejoint/><geom size=".1"/></body>'
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
NESTED = '<replicate count="100" offset="1 0 0">'
TEXTURED = '<asset><texture name="t" type="2d" file="{}"/></asset>'
MESHED = '<asset><mesh name="m" file="{}"/></asset><worldbody><geom type="mesh" mesh="m"/></worldbody>'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "private").mkdir()
    (tmp_path / "private" / "plan.obj").write_text(OBJ)
    (tmp_path / "private" / "part.xml").write_text(f"<mujoco><worldbody>{BALL}</worldbody></mujoco>")
    inside = tmp_path / "scene_1"
    inside.mkdir()
    (inside / "linked").symlink_to("/")
    os.mkfifo(inside / "pipe.obj")
    os.mkfifo(inside / "pipe.png")
    os.mkfifo(inside / "pipe.xml")
    return inside


def refused(folder: Path, body: str) -> str:
    """The error of a document with these contents; it is the same as a scene, and the world stays usable."""
    file = folder / "model.xml"
    outside = folder.parent / "private"
    text = body.replace("OUTSIDE", str(outside)).replace("LINKED", f"linked{outside}")
    file.write_text(f"<mujoco>{text}</mujoco>")
    world = World()
    box = world.add_box((1, 1, 1), (0, 0, 5))
    with pytest.raises(DescriptionError) as error:
        world.add_mjcf(file)
    with pytest.raises(DescriptionError):
        load_scene(file)
    world.step(3)
    assert world.bodies == (box,)
    return str(error.value)


@pytest.mark.parametrize("name", ["../private/plan.obj", "OUTSIDE/plan.obj", "LINKED/plan.obj", "pipe.obj"])
@pytest.mark.parametrize("form", [MESHED, '<compiler strippath="false"/>' + MESHED])
def test_meshes_outside_and_pipes_are_not_opened(folder: Path, name: str, form: str) -> None:
    assert 'mesh "m"' in refused(folder, form.format(name))


@pytest.mark.parametrize("name", ["../private/part.xml", "OUTSIDE/part.xml", "LINKED/part.xml", "pipe.xml"])
def test_includes_outside_and_pipes_are_not_opened(folder: Path, name: str) -> None:
    assert "<include>" in refused(folder, f'<include file="{name}"/>')
    (folder / "inner.xml").write_text(
        f'<mujoco><include file="{name}"/></mujoco>'.replace("OUTSIDE", str(folder.parent / "private"))
    )
    if "LINKED" not in name:
        assert "<include>" in refused(folder, '<include file="inner.xml"/>')


@pytest.mark.parametrize("key", ["meshdir", "assetdir"])
def test_an_asset_folder_outside_is_not_used(folder: Path, key: str) -> None:
    assert "outside" in refused(folder, f'<compiler {key}="OUTSIDE"/>' + MESHED.format("plan.obj"))


def test_attached_models_and_pipes_of_textures_are_checked_too(folder: Path) -> None:
    attached = '<worldbody><attach model="o" body="b" prefix="x"/></worldbody>'
    attach = '<asset><model name="o" file="{}"/></asset>' + attached
    assert "outside" in refused(folder, attach.format("../private/part.xml"))
    assert "no regular file" in refused(folder, TEXTURED.format("pipe.png"))
    (folder / "mid.xml").write_text(f"<mujoco>{MESHED.format('../private/plan.obj')}</mujoco>")
    assert "outside" in refused(folder, attach.format("mid.xml"))


def test_a_comment_in_a_repaired_file_hides_no_include(folder: Path) -> None:
    """The include is text for one reader and an element for another: what is checked is what MuJoCo reads."""
    hidden = '<include file="OUTSIDE/part.xml"/>'
    trick = f"<!-- -- --><custom><![CDATA[<!-- ]]></custom>{hidden}<custom><![CDATA[-->]]></custom>"
    file = folder / "model.xml"
    file.write_text(f"<mujoco>{trick.replace('OUTSIDE', str(folder.parent / 'private'))}</mujoco>")
    try:
        bodies = World().add_mjcf(file)
    except DescriptionError:
        return
    assert not any(body.name.endswith("/b") for body in bodies)


@pytest.mark.parametrize(
    "body",
    [
        '<worldbody><replicate count="1000000000" offset="1 0 0"><geom size="1"/></replicate></worldbody>',
        f'<worldbody>{NESTED * 5}<geom size="1"/>{"</replicate>" * 5}</worldbody>',
        '<worldbody><flexcomp name="f" type="grid" count="2000 2000 2000" spacing="1 1 1"/></worldbody>',
        '<size nkey="2000000000"/>',
        '<size memory="1T"/>',
        '<size nuserdata="2000000000"/>',
        '<asset><hfield name="h" nrow="46000" ncol="46000" size="1 1 1 1"/></asset>',
        '<asset><texture name="t" type="2d" builtin="checker" width="46000" height="46000"/></asset>',
        "<worldbody>" + "<body>" * 2000 + "</body>" * 2000 + "</worldbody>",
        '<worldbody><body pos="nan 0 0"><geom size="1"/></body></worldbody>',
        '<worldbody><body pos="0 -Inf 0"><geom size="1"/></body></worldbody>',
        "<worldbody>" + '<geom size="1"/>' * 100_001 + "</worldbody>",
    ],
)  # fmt: skip
def test_what_no_world_can_hold_is_refused_at_once(folder: Path, body: str) -> None:
    refused(folder, body)


def test_a_field_of_heights_whose_header_lies_is_refused(folder: Path) -> None:
    (folder / "h.bin").write_bytes(np.array([30000, 30000], dtype="<i4").tobytes() + b"\0" * 64)
    assert "30000 x 30000" in refused(folder, '<asset><hfield name="h" file="h.bin" size="1 1 1 1"/></asset>')


def test_a_urdf_is_sent_to_its_own_function(tmp_path: Path) -> None:
    (tmp_path / "r.xml").write_text('<robot name="r"><link name="a"/></robot>')
    with pytest.raises(DescriptionError, match="use add_urdf"):
        World().add_mjcf(tmp_path / "r.xml")


def test_includes_meshes_names_and_sloppy_comments_of_valid_files_are_read(folder: Path) -> None:
    (folder / "meshes").mkdir()
    (folder / "meshes" / "plan.obj").write_text(OBJ)
    (folder / "nan.xml").write_text(
        '<mujocoinclude><body name="nan"><geom type="mesh" mesh="m"/></body></mujocoinclude>'
    )
    file = folder / "model.xml"
    file.write_text(
        '<mujoco><!-- ---- parts ---- --><compiler meshdir="meshes"/>'
        '<asset><mesh name="m" file="plan.obj"/></asset>'
        '<worldbody><body name="body1"><geom size="1"/></body><body><geom size="1"/></body>'
        '<include file="nan.xml"/></worldbody>'
        '<contact><exclude body1="nan" body2="body1"/></contact></mujoco>'
    )
    bodies = World().add_mjcf(file)
    assert len({body.name for body in bodies}) == 3
    moved = folder.parent / "elsewhere"
    moved.mkdir()
    (moved / "m.xml").write_text(f"<mujoco>{MESHED.format('../private/plan.obj')}</mujoco>")
    assert World().add_mjcf(moved / "m.xml", search_paths=[folder.parent / "private"])


@pytest.mark.parametrize("position", [(0, 0), (0, 0, float("nan")), (0, 0, float("inf"))])
def test_a_position_that_is_none_is_refused(position: tuple[float, ...]) -> None:
    with pytest.raises(RoboyardError, match="three finite numbers"):
        World().add_mjcf(f"<mujoco><worldbody>{BALL}</worldbody></mujoco>", position)

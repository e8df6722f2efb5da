"""One hostile tree through all readers: none opens a file from outside, none waits at a pipe."""

from __future__ import annotations

import os
import signal
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from roboyard.audit import audit_urdf
from roboyard.config.yaml_lines import read_yaml
from roboyard.description import load_description
from roboyard.description.urdf.xml import read_xml
from roboyard.errors import RoboyardError
from roboyard.recording import load_log
from roboyard.scenes import load_scene
from roboyard.shapes import load_mesh
from roboyard.shapes.mesh_stats import mesh_stats
from roboyard.sim import World

SECRET = 11
"""Triangles of the mesh that nothing may open."""
PLACES = ("../private/{}", "{out}/{}", "file://{out}/{}", "linked{out}/{}", "src{out}/{}", "meshes/out/{}")


def stl(count: int) -> bytes:
    record = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    return b"x".ljust(80) + struct.pack("<I", count) + record * count


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A robot's folder with links to everywhere, marks of a workspace, and pipes; the secret is beside it."""
    (tmp_path / "private").mkdir()
    (tmp_path / "private" / "secret.stl").write_bytes(stl(SECRET))
    robot = tmp_path / "arm_7"
    for name in ("log", "build", "install", "meshes"):
        (robot / name).mkdir(parents=True)
    for name in ("src", "linked"):
        (robot / name).symlink_to("/")
    (robot / "meshes" / "out").symlink_to(tmp_path / "private")
    for suffix in ("stl", "obj", "dae", "ply", "glb", "gltf", "png", "xml", "urdf", "yaml", "npz", "mtl"):
        os.mkfifo(robot / f"pipe.{suffix}")
    return robot


@pytest.fixture(autouse=True)
def deadline() -> Iterator[None]:
    def stop(*_: object) -> None:
        raise TimeoutError("a reader waits")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(30)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def urdf(mesh: str) -> str:
    shape = f'<geometry><mesh filename="{mesh}"/></geometry>'
    body = f"<visual>{shape}</visual><collision>{shape}</collision>"
    return f'<robot name="r"><link name="a">{body}</link></robot>'


def mjcf(mesh: str) -> str:
    shown = '<worldbody><geom type="mesh" mesh="m"/></worldbody>'
    return f'<mujoco><asset><mesh name="m" file="{mesh}"/></asset>{shown}</mujoco>'


@pytest.mark.parametrize("place", PLACES)
def test_no_reader_opens_a_mesh_outside(tree: Path, place: str) -> None:
    name = place.format("secret.stl", out=tree.parent / "private")
    robot, scene = tree / "robot.urdf", tree / "scene.xml"
    robot.write_text(urdf(name))
    scene.write_text(mjcf(name.removeprefix("file://")))
    report = audit_urdf(robot)
    assert not report.is_usable
    assert report.facts.triangles == 0
    readers: dict[str, Callable[[], object]] = {
        "description": lambda: load_description(robot),
        "world": lambda: World().add_urdf(robot),
        "scene": lambda: load_scene(robot),
        "mjcf": lambda: World().add_mjcf(scene),
        "mjcf scene": lambda: load_scene(scene),
    }
    for reader, read in readers.items():
        with pytest.raises(RoboyardError):
            read()
            pytest.fail(f"{reader} opened {name}")


def test_no_reader_waits_at_a_pipe(tree: Path) -> None:
    readers: dict[str, Callable[[Path], object]] = {
        "urdf": load_description,
        "xml": lambda file: (read_xml(file), World().add_mjcf(file)),
        "yaml": read_yaml,
        "npz": load_log,
        **dict.fromkeys(("stl", "obj", "dae", "ply", "glb", "gltf"), load_mesh),
    }
    for suffix, read in readers.items():
        with pytest.raises(RoboyardError):
            read(tree / f"pipe.{suffix}")
    for suffix in ("stl", "obj", "dae"):
        with pytest.raises(RoboyardError):
            mesh_stats(tree / f"pipe.{suffix}")


BLANKS = f'<mass value="$(optenv A{" " * 30_000}x"/>'
REPEATED = {
    "blanks of optenv": '<robot name="$(optenv A' + " " * 300_000 + 'x"><link name="a"/></robot>',
    "mass of blanks": urdf("m.stl").replace("<visual>", f"<inertial>{BLANKS}</inertial><visual>", 1),
    "declarations": "<robot>" + "<?xml " * 100_000,
    "comments": "<robot>" + "<!--x" * 100_000,
    "starts of tags": "<robot>&" + "<a" * 100_000,
    "attributes": "<robot>" + '<a b="1" b="1"/>\n' * 30_000 + "</robot>",
}  # fmt: skip


@pytest.mark.parametrize("name", REPEATED)
def test_what_is_repeated_is_read_in_linear_time(tree: Path, name: str) -> None:
    file = tree / "robot.urdf"
    file.write_text(REPEATED[name])
    audit_urdf(file)  # within the deadline

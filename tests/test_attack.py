"""One hostile tree through all readers: none opens a file from outside, none waits at a pipe."""

from __future__ import annotations

import base64
import json
import os
import signal
import struct
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from roboyard import import_robot
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
    signal.alarm(120)  # a busy machine takes long, a pipe for ever
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


OPENED: list[Path] = []
"""Files that Python opened while a test watches."""


@pytest.fixture(scope="module")
def hook() -> list[bool]:
    watching = [False]

    def note(event: str, arguments: tuple[object, ...]) -> None:
        if event == "open" and watching[0] and isinstance(arguments[0], str | bytes | os.PathLike):
            OPENED.append(Path(os.fsdecode(arguments[0])).resolve())

    sys.addaudithook(note)  # hooks stay, so that there is one
    return watching


@pytest.fixture
def watched(hook: list[bool]) -> Iterator[list[Path]]:
    OPENED.clear()
    hook[0] = True
    yield OPENED
    hook[0] = False


def obj(materials: str) -> str:
    return f"mtllib {materials}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n"


def gltf(buffer: str, image: str) -> str:
    scene = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"uri": image}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC2"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": buffer}],
    }
    return json.dumps(scene)


XACRO = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{}<link name="a"/></robot>'
TRIANGLE = "data:;base64," + base64.b64encode(struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)).decode()
NAMING: dict[str, tuple[str, Callable[[str], dict[str, str]]]] = {
    "materials": ("secret.mtl", lambda name: {"robot.urdf": urdf("m.obj"), "m.obj": obj(name)}),
    "texture of materials": (
        "secret.png",
        lambda name: {
            "robot.urdf": urdf("m.obj"),
            "m.obj": obj("m.mtl"),
            "m.mtl": f"newmtl a\nmap_Kd {name}\nbump {name}\n",
        },
    ),
    "buffer": ("secret.bin", lambda name: {"robot.urdf": urdf("m.gltf"), "m.gltf": gltf(name, "none.png")}),
    "image": ("secret.png", lambda name: {"robot.urdf": urdf("m.gltf"), "m.gltf": gltf(TRIANGLE, name)}),
    "texture": (
        "secret.png",
        lambda name: {
            "robot.urdf": '<robot name="r"><link name="a"><visual><geometry><box size="1 1 1"/></geometry>'
            f'<material name="m"><texture filename="{name}"/></material></visual></link></robot>'
        },
    ),
    "included xacro": (
        "secret.xacro",
        lambda name: {"robot.urdf": XACRO.format(f'<xacro:include filename="{name}"/>')},
    ),
    "yaml of xacro": (
        "secret.yaml",
        lambda name: {
            "robot.urdf": XACRO.format(
                f'<xacro:property name="y" value="${{xacro.load_yaml(\'{name}\')}}"/><link name="${{y}}"/>'
            )
        },
    ),
}  # fmt: skip


def read_all(robot: Path, *, is_xacro: bool) -> None:
    """Load, audit, draw and import a robot, as far as that goes; one that is expanded is loaded only."""
    with suppress(RoboyardError):
        world = World()
        world.add_urdf(robot)
        world.render_scene()
    if not is_xacro:
        audit_urdf(robot)
        with suppress(RoboyardError):
            import_robot(robot, name="r", out=robot.parents[1] / "data", validate=False)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("naming", NAMING)
def test_no_file_outside_is_opened_for_what_a_robot_names(
    tree: Path, watched: list[Path], place: str, naming: str
) -> None:
    secret, write = NAMING[naming]
    private = tree.parent / "private"
    (private / secret).write_bytes(b"newmtl a\nKd 1 0 0\n")
    for name, text in write(place.format(secret, out=private)).items():
        (tree / name).write_text(text)
    watched.clear()
    read_all(tree / "robot.urdf", is_xacro="xacro" in naming)
    assert tree.resolve() / "robot.urdf" in watched
    assert not [path for path in watched if path.is_relative_to(private.resolve())]


@pytest.mark.parametrize("naming", sorted(name for name in NAMING if "xacro" not in name))
def test_the_same_files_are_opened_inside(tree: Path, watched: list[Path], naming: str) -> None:
    secret, write = NAMING[naming]
    for name, text in write(secret).items():
        (tree / name).write_text(text)
    (tree / secret).write_bytes(b"newmtl a\nKd 1 0 0\n")
    watched.clear()
    read_all(tree / "robot.urdf", is_xacro=False)
    assert tree.resolve() / secret in watched

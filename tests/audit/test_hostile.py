"""Hostile input: a clear refusal in under 5 s and 1 GB; nothing touched outside the robot's folders."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from audit_cases import CUBE, INERTIAL, arm, both, link, many_links, mesh, stl, write_case

import roboyard
from roboyard.audit import audit_urdf
from roboyard.repair import repair_urdf

SECRET = "the-text-of-a-file-elsewhere"
CHILD = """
import json, resource, sys
from roboyard.audit import audit_urdf
from roboyard.repair import repair_urdf
from roboyard.errors import RoboyardError
result = audit_urdf(sys.argv[1])
try:
    repair_urdf(sys.argv[1], sys.argv[2])
except RoboyardError:
    pass
used = resource.getrusage(resource.RUSAGE_SELF)
peak = used.ru_maxrss / 1024
try:  # what the process itself needed: ru_maxrss begins with what its parent held
    lines = open("/proc/self/status").read().splitlines()
    peak = next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))
except OSError:
    pass
print(json.dumps({
    "usable": result.is_usable, "codes": result.codes, "text": json.dumps(result.to_json())[:2_000_000],
    "cpu_s": used.ru_utime + used.ru_stime, "peak_mib": peak,
}))
"""


def in_a_child(file: Path, out: Path) -> dict:
    """Audit and repair the file in a process of its own."""
    environment = dict(os.environ, PYTHONPATH=str(Path(roboyard.__file__).parents[1]))
    command = [sys.executable, "-c", CHILD, str(file), str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=environment)
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout)


def with_mesh(name: str, data: bytes) -> Callable[[Path], str]:
    def write(folder: Path) -> str:
        (folder / name).write_bytes(data)
        return arm(tip=INERTIAL + both(mesh(name)))

    return write


def bomb(prolog: str = "") -> str:
    entities = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 12))
    return f'{prolog}<!DOCTYPE robot [<!ENTITY a0 "ha">{entities}]>'


DAE = '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">&a11;</COLLADA>'
GLTF = json.dumps(
    {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 2**40, "uri": "data:,"}],
        "bufferViews": [{"buffer": 0, "byteLength": 2**40}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 2**38, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    }
).encode()

REFUSED = {
    "entity bomb": bomb() + '<robot name="r"><link name="&a11;"/></robot>',
    "external entity": '<!DOCTYPE robot [<!ENTITY x SYSTEM "../secret.txt">]><robot name="r">&x;</robot>',
    "parameter entity": '<!DOCTYPE r [<!ENTITY % x SYSTEM "../secret.txt"> %x;]><robot name="r"/>',
    "entity bomb in UTF-16": (bomb() + '<robot name="&a11;"><link name="a"/></robot>').encode("utf-16"),
    "UTF-7": b'<?xml version="1.0" encoding="utf-7"?>+ADw-robot name=+ACI-r+ACI-/+AD4-',
    "device": arm(tip=INERTIAL + both(mesh("/dev/zero"))),
    "external DTD": '<!DOCTYPE robot SYSTEM "../secret.txt"><robot/>',
    "chain of 100,000 links": many_links(100_000),
    "deep nesting": "<robot>" + "<a>" * 200_000,
    "300,000 empty links": "<robot>" + "<link/>" * 300_000 + "</robot>",
    "STL of four billion triangles": with_mesh("part.stl", stl(CUBE, count=0xFFFFFFFF)),
    "OBJ with a far index": with_mesh("part.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 999999999\n"),
    "OBJ of one endless face": with_mesh(
        "part.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf " + b"1 2 3 " * 1_000_000
    ),
    "glTF with a buffer elsewhere": with_mesh("part.gltf", GLTF.replace(b"data:,", b"../secret.stl")),
    "glTF with an endless buffer": with_mesh("part.gltf", GLTF.replace(b"data:,", b"/dev/zero")),
    "DAE with an entity bomb": with_mesh("part.dae", (bomb('<?xml version="1.0"?>') + DAE).encode()),
    "glTF that claims a terabyte": with_mesh("part.gltf", GLTF),
    "PLY that claims a billion vertices": with_mesh(
        "part.ply",
        b"ply\nformat binary_little_endian 1.0\nelement vertex 1000000000\n"
        b"property float x\nproperty float y\nproperty float z\n"
        b"element face 1\nproperty list uchar int vertex_indices\nend_header\n",
    ),
    "path traversal": arm(tip=INERTIAL + both(mesh("package://arm/../../secret.stl"))),
    "absolute path": arm(tip=INERTIAL + both(mesh("file:///etc/passwd"))),
    "percent-coded traversal": arm(tip=INERTIAL + both(mesh("%2e%2e/secret.stl"))),
    "http": arm(tip=INERTIAL + both(mesh("http://localhost:1/part.stl"))),
    "null byte": arm(tip=INERTIAL + both(mesh("part.stl%00.obj"))),
    "name of a megabyte": arm(tip=INERTIAL + both(mesh("m" * 1_000_000))),
}


@pytest.mark.parametrize("name", REFUSED)
def test_hostile_input_is_refused_quickly(name: str, tmp_path: Path) -> None:
    for secret in ("secret.txt", "secret.stl"):
        (tmp_path / secret).write_text(f"solid {SECRET}\nendsolid\n")
    file = write_case(REFUSED[name], tmp_path)
    before = sorted(path.name for path in file.parent.iterdir())
    found = in_a_child(file, tmp_path / "out")
    assert not found["usable"]
    assert found["cpu_s"] < 5.0
    assert found["peak_mib"] < 1024
    assert SECRET not in found["text"]
    assert sorted(path.name for path in file.parent.iterdir()) == before
    for written in (tmp_path / "out").rglob("*"):
        assert not written.is_file() or SECRET.encode() not in written.read_bytes()


def test_many_overlapping_shapes_take_no_longer(tmp_path: Path) -> None:
    """2000 links on one hub, all in one place."""
    links = [link(f"l{k}") for k in range(2000)]
    joints = [
        f'<joint name="j{k}" type="continuous"><parent link="hub"/><child link="l{k}"/>'
        '<axis xyz="0 0 1"/></joint>'
        for k in range(2000)
    ]
    text = f'<robot name="star">{link("hub")}{"".join(links)}{"".join(joints)}</robot>'
    found = in_a_child(write_case(text, tmp_path), tmp_path / "out")
    assert found["cpu_s"] < 10.0  # audited, repaired, and audited again
    assert found["peak_mib"] < 1024


def test_a_link_out_of_the_folders_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "secret.stl").write_bytes(stl(0.1 * CUBE))

    def write(folder: Path) -> str:
        (folder / "meshes").mkdir()
        (folder / "meshes" / "part.stl").symlink_to(tmp_path / "secret.stl")
        return arm(tip=INERTIAL + both(mesh("meshes/part.stl")))

    file = write_case(write, tmp_path)
    assert audit_urdf(file).codes == ("mesh-outside",)
    repair_urdf(file, tmp_path / "out")
    assert not (tmp_path / "out" / "meshes").exists()


def test_a_material_library_out_of_the_folders_is_not_staged(tmp_path: Path) -> None:
    (tmp_path / "secret.mtl").write_text("newmtl m\nmap_Kd secret.png\n")

    def write(folder: Path) -> str:
        lines = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
        (folder / "part.obj").write_text(f"mtllib ../secret.mtl\n{lines}")
        return arm(tip=INERTIAL + both(mesh("part.obj", "0.1 0.1 0.1")))

    file = write_case(write, tmp_path)
    repair_urdf(file, tmp_path / "out")
    staged = [path.name for path in (tmp_path / "out").rglob("*") if path.is_file()]
    assert "secret.mtl" not in staged
    assert "part.obj" in staged


def test_loops_of_links_end(tmp_path: Path) -> None:
    def write(folder: Path) -> str:
        (folder / "meshes").symlink_to(folder)
        (folder / "a.stl").symlink_to(folder / "b.stl")
        (folder / "b.stl").symlink_to(folder / "a.stl")
        far = "meshes/" * 60 + "a.stl"
        return arm(tip=INERTIAL + both(mesh(far)))

    assert "mesh-missing" in audit_urdf(write_case(write, tmp_path)).codes
    loop = tmp_path / "loop.urdf"
    loop.symlink_to(loop)
    assert audit_urdf(loop).codes == ("file-unreadable",)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "arm.urdf")
    found = in_a_child(tmp_path / "arm.urdf", tmp_path / "out")
    assert found["codes"] == ["file-unreadable"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
@pytest.mark.parametrize("name", ["part.obj", "colours.mtl", "wood.png"])
def test_a_pipe_beside_the_robot_is_not_waited_for(name: str, tmp_path: Path) -> None:
    def write(folder: Path) -> str:
        corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
        (folder / "part.obj").write_text(f"mtllib colours.mtl\nusemtl m\n{corners}")
        (folder / "colours.mtl").write_text("newmtl m\nmap_Kd wood.png\n")
        (folder / name).unlink(missing_ok=True)
        os.mkfifo(folder / name)
        return arm(tip=INERTIAL + both(mesh("part.obj", "0.1 0.1 0.1")))

    found = in_a_child(write_case(write, tmp_path), tmp_path / "out")
    assert found["codes"][0] == ("mesh-missing" if name == "part.obj" else "mesh-external-missing")
    assert found["cpu_s"] < 5.0


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig", "utf-16-be"])
def test_other_encodings_are_read(encoding: str, tmp_path: Path) -> None:
    assert audit_urdf(write_case(arm().encode(encoding), tmp_path)).codes == ()


def test_nothing_is_left_where_a_repair_is_refused(tmp_path: Path) -> None:
    file = write_case(bomb() + "<robot/>", tmp_path)
    found = in_a_child(file, tmp_path / "out")
    assert found["codes"] == ["xml-unsafe"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["arm"]


def test_thousands_of_joints_that_follow_each_other_take_seconds(tmp_path: Path) -> None:
    count = 2000
    links = "".join(f'<link name="l{k}"/>' for k in range(count))
    joints = "".join(
        f'<joint name="j{k}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/>'
        '<axis xyz="0 0 1"/>' + (f'<mimic joint="j{k - 1}"/>' if k else "") + "</joint>"
        for k in range(count - 1)
    )
    file = write_case(f'<robot name="r">{links}{joints}</robot>', tmp_path)
    found = in_a_child(file, tmp_path / "out")
    assert "mimic-chain" in found["codes"]
    assert found["cpu_s"] < 10.0  # audited, repaired, and audited again
    assert '<mimic joint="j0"' in (tmp_path / "out" / "arm.urdf").read_text()

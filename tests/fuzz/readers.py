"""Every reader of files from outside, as a function of a file, and small valid files to start from."""

from __future__ import annotations

import contextlib
import io
import json
import os
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from roboyard.audit import audit_urdf
from roboyard.config.yaml_lines import read_yaml
from roboyard.description import load_description
from roboyard.envs.policy import load_policy
from roboyard.errors import RoboyardError
from roboyard.planning import load_problems
from roboyard.pybullet.face import wire
from roboyard.pybullet.remote.datagram import Datagram
from roboyard.pybullet.remote.dispatch import Dispatcher
from roboyard.recording import load_log
from roboyard.scenes import load_scene
from roboyard.shapes import load_mesh
from roboyard.sim import World
from roboyard.untrusted.arrays import ArraysError, unpack_arrays

CORPUS = Path(__file__).parent / "corpus"
"""Files that once broke a reader; the name begins with the reader's and a dot."""
_BOX = '<geometry><box size="0.1 0.2 0.3"/></geometry>'
_INERTIAL = (
    '<inertial><origin xyz="0 0 0"/><mass value="1"/>'
    '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>'
)


def _urdf() -> bytes:
    links = "".join(
        f'<link name="{name}">{_INERTIAL}<visual>{_BOX}<material name="m"><color rgba="1 0 0 1"/></material>'
        f"</visual><collision>{_BOX}</collision></link>"
        for name in "abc"
    )
    joint = (
        '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
        '<origin xyz="0 0 0.1" rpy="0 1 0"/><limit lower="-1" upper="1" effort="9" velocity="2"/></joint>'
        '<joint name="k" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="1 0 0"/>'
        '<limit lower="0" upper="1" effort="9" velocity="2"/><mimic joint="j" multiplier="2"/></joint>'
    )
    return f'<?xml version="1.0"?>\n<robot name="r">{links}{joint}</robot>'.encode()


_SDF = (
    '<sdf version="1.6"><world name="w"><model name="m"><pose>0 0 1 0 0 0</pose><link name="a">'
    "<inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>"
    f'<collision name="c">{_BOX.replace(" size=", "><size>").replace("/>", "</size></box>")}</collision>'
    '</link><link name="b"/><joint name="j" type="revolute"><parent>a</parent><child>b</child>'
    "<axis><xyz>0 0 1</xyz></axis></joint></model></world></sdf>"
).replace('"0.1 0.2 0.3"', "0.1 0.2 0.3")
_ROBOT_SDF = (
    '<sdf version="1.10"><model name="m" canonical_link="a"><frame name="f" attached_to="a">'
    '<pose degrees="true">0 0 1 0 45 0</pose></frame><link name="a"><inertial><mass>1</mass></inertial>'
    '<visual name="v"><geometry><ellipsoid><radii>1 2 3</radii></ellipsoid></geometry></visual></link>'
    '<link name="b"><pose relative_to="f" rotation_format="quat_xyzw">0 0 1 0 0 0 1</pose>'
    '<sensor name="s" type="imu"><pose>0 0 1 0 0 0</pose></sensor></link><joint name="j" type="screw">'
    "<parent>f</parent><child>b</child><screw_thread_pitch>0.1</screw_thread_pitch><axis>"
    '<xyz expressed_in="f">0 1 0</xyz><limit><lower>-1</lower></limit></axis></joint>'
    '<model name="n" placement_frame="c"><pose relative_to="b"/><link name="c"/></model>'
    '<include merge="true"><uri>model://m</uri><name>i</name></include><joint name="k" type="universal">'
    "<parent>b</parent><child>n::c</child><axis><xyz>1 0 0</xyz></axis>"
    "<axis2><xyz>0 1 0</xyz></axis2></joint><plugin name='p' filename='x'/></model></sdf>"
)
_MJCF = (
    '<mujoco model="m"><option timestep="0.002"/><default><geom friction="1 0.1 0.1"/></default>'
    '<asset><texture name="t" type="2d" builtin="checker" width="8" height="8"/>'
    '<material name="p" texture="t"/><mesh name="q" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset>'
    '<worldbody><light pos="0 0 3"/><geom type="plane" size="1 1 1"/><body name="b" pos="0 0 1"><freejoint/>'
    '<geom type="box" size="1 1 1" material="p"/><body><joint type="hinge" axis="0 1 0" range="-1 1"/>'
    '<geom type="mesh" mesh="q"/><replicate count="2"><site/></replicate></body></body></worldbody>'
    '<actuator><motor joint="x"/></actuator></mujoco>'
).replace('<actuator><motor joint="x"/></actuator>', "")
_OBJ = (
    b"mtllib m.mtl\no a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvn 0 0 1\nusemtl red\n"
    b"f 1/1/1 3/2/1 2/1/1\nf 1 2 4\nf -3 -2 -1\nf 1//1 4//1 3//1\nusemtl blue\nf 1 2 3 4\n"
)
_MTL = b"newmtl red\nKd 1 0 0\nd 0.5\nmap_Kd t.png\nnewmtl blue\nKd 0 0 1\nTr 0.1\nmap_Kd -s 1 1 1 t.png\n"
_DAE = b"""<?xml version="1.0"?><COLLADA version="1.4.1">
<asset><unit meter="0.1"/><up_axis>Z_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="c"><phong>
<diffuse><color>1 0 0 1</color></diffuse>
</phong></technique></profile_COMMON></effect></library_effects><library_materials><material id="m">
<instance_effect url="#e"/></material></library_materials><library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array><technique_common>
<accessor source="#a" count="4" stride="3"/></technique_common></source><vertices id="v">
<input semantic="POSITION" source="#p"/></vertices><triangles count="2" material="s"><input semantic="VERTEX"
source="#v" offset="0"/><p>0 1 2 0 2 3</p></triangles><polylist count="1"><input semantic="VERTEX" source="#v"
offset="0"/><vcount>4</vcount><p>0 1 2 3</p></polylist></mesh></geometry></library_geometries>
<library_nodes><node id="n"><instance_geometry url="#g"/></node></library_nodes><library_visual_scenes>
<visual_scene id="s"><node><matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_node url="#n"/>
<instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="s" target="#m"/>
</technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
_PLY = (
    b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    b"property uchar red\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
    b"0 0 0 9\n1 0 0 9\n0 1 0 9\n0 0 1 9\n3 0 1 2\n4 0 1 2 3\n"
)
_YAML = b"urdf_path: r.urdf\nname: r\nxacro_args: {a: b}\nc:\n  hulls: 4\n  x: &a [1, 2.5, ~]\n  y: *a\n"


def _stl() -> bytes:
    records = b"".join(struct.pack("<12fH", 0, 0, 1, *np.eye(3).ravel() * (k + 1), 0) for k in range(4))
    return b"x".ljust(80) + struct.pack("<I", 4) + records


def _gltf() -> dict[str, object]:
    data = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]).tobytes() + struct.pack("<4H", 0, 1, 2, 0)
    import base64

    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "scale": [1, 2, 1], "children": [1]}, {"mesh": 0, "translation": [0, 0, 1]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36, "byteOffset": 0},
            {"buffer": 0, "byteLength": 6, "byteOffset": 36},
        ],
        "buffers": [{"byteLength": 44, "uri": f"data:;base64,{base64.b64encode(data).decode()}"}],
    }


def _glb() -> bytes:
    text = json.dumps(_gltf()).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text), len(text), b"JSON") + text


def _npz() -> bytes:
    stream = io.BytesIO()
    np.savez(stream, time=np.arange(3.0), positions=np.zeros((3, 2)), names=np.array(["a", "b"]))
    return stream.getvalue()


def _frames() -> bytes:
    messages = (
        [1, "setGravity", [0, 0, -9.8]],
        [2, "addUserDebugPoints", [np.eye(3), np.eye(3)]],
        wire.HELLO,
    )
    return b"".join(map(wire.frame, messages))


def _read_frames(file: Path) -> None:
    data, dispatcher = file.read_bytes(), Dispatcher()
    Datagram.read(data)
    try:
        while data:
            length = wire.body_length(data[:4].ljust(4, b"\xff"))
            with contextlib.suppress(wire.WireError):
                dispatcher.answer(wire.decode(data[4 : 4 + length]))
            data = data[4 + length :]
    finally:
        dispatcher.client.close()


def _read_obj_with(file: Path) -> None:
    mesh = file.with_name("m.obj")
    mesh.write_bytes(_OBJ.replace(b"m.mtl", file.name.encode()))
    load_mesh(mesh)


def _read_arrays(file: Path) -> None:
    with contextlib.suppress(ArraysError):
        unpack_arrays(file.read_bytes(), 1 << 24)
    load_log(file)


def _read_urdf(file: Path) -> None:
    audit_urdf(file)
    World().add_urdf(load_description(file))


def _read_mjcf(file: Path) -> None:
    world = World()
    world.add_mjcf(file)
    world.step(2)


def _read_robot(file: Path) -> None:
    audit_urdf(file)
    load_description(file, missing_meshes="note")


_USD = """#usda 1.0
(
    defaultPrim = "r"
    metersPerUnit = 1
    upAxis = "Z"
)
def Xform "r"
{
    def Xform "a" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 1
        quatf physics:principalAxes = (1, 0, 0, 0)
        def Mesh "m" (prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMeshCollisionAPI"])
        {
            point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
            int[] faceVertexCounts = [3, 3, 3, 3]
            int[] faceVertexIndices = [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]
            texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
        }
        def Xform "b" (prepend apiSchemas = ["PhysicsRigidBodyAPI"])
        {
            double3 xformOp:translate = (1, 0, 0)
            float3 xformOp:scale = (2, 2, -1)
            uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
            def Cylinder "c" (prepend apiSchemas = ["PhysicsCollisionAPI"])
            {
                uniform token axis = "X"
                double radius = 0.1
            }
        }
    }
    def PhysicsRevoluteJoint "j" (prepend apiSchemas = ["PhysicsDriveAPI:angular"])
    {
        rel physics:body0 = </r/a>
        rel physics:body1 = </r/a/b>
        uniform token physics:axis = "Y"
        point3f physics:localPos0 = (1, 0, 0)
        quatf physics:localRot1 = (1, 0, 0, 0)
        float physics:lowerLimit = -90
        float drive:angular:physics:maxForce = 5
    }
    def PhysicsJoint "k"
    {
        rel physics:body0 = </r/a>
        rel physics:body1 = </r/a/b>
        float limit:rotX:physics:low = 1
        float limit:rotX:physics:high = -1
    }
}
"""


def _read_sdf(file: Path) -> None:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.face.errors import error

    client = Client()
    try:
        client.loadSDF(str(file))
    except error as problem:
        raise RoboyardError(str(problem)) from None
    finally:
        client.close()


_POLICY = json.dumps(
    {
        "format": "roboyard-policy 1",
        "task": "roboyard/Reach-v0",
        "options": {"robot": "arm7"},
        "activation": "tanh",
        "mean": [0.0, 0.5],
        "deviation": [1.0, 2.0],
        "layers": [
            {"weight": [[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]], "bias": [0, 0, 1]},
            {"weight": [[1, 2, 3]], "bias": [0.5]},
        ],
    }
)
_PROBLEMS = json.dumps(
    {
        "urdf": "arm.urdf",
        "joints": ["a", "b"],
        "hold": {"c": 0.04},
        "time_limit": 2.0,
        "limits": {"velocity": [1, 2], "acceleration": 3.5},
        "obstacles": [{"type": "box", "size": [1, 1, 1], "position": [0, 0, 1], "quaternion": [0, 0, 0, 1]}],
        "problems": [
            {"name": "p", "start": [0, 0], "goal": {"joints": [1, 1]}},
            {"start": [0, 1], "goal": {"link": "tip", "position": [1, 0, 0], "quaternion": [0, 1, 0, 0]}},
        ],
    }
)


READERS: dict[str, tuple[str, Callable[[Path], object], bytes]] = {
    "urdf": (".urdf", _read_urdf, _urdf()),
    "robot-sdf": (".sdf", _read_robot, _ROBOT_SDF.encode()),
    "sdf": (".sdf", _read_sdf, _SDF.encode()),
    "usd": (".usda", _read_robot, _USD.encode()),
    "mjcf": (".xml", _read_mjcf, _MJCF.encode()),
    "scene": (".xml", load_scene, _MJCF.encode()),
    "obj": (".obj", load_mesh, _OBJ),
    "mtl": (".mtl", _read_obj_with, _MTL),
    "stl": (".stl", load_mesh, _stl()),
    "dae": (".dae", load_mesh, _DAE),
    "gltf": (".gltf", load_mesh, json.dumps(_gltf()).encode()),
    "glb": (".glb", load_mesh, _glb()),
    "ply": (".ply", load_mesh, _PLY),
    "yaml": (".yaml", read_yaml, _YAML),
    "log": (".npz", _read_arrays, _npz()),
    "policy": (".json", load_policy, _POLICY.encode()),
    "problems": (".json", load_problems, _PROBLEMS.encode()),
    "frames": (".bin", _read_frames, _frames()),
}
"""Reader's name to the suffix of its files, the function, and a valid file."""


def survives(reader: str, data: bytes, folder: Path) -> None:
    """Read data as a file; only errors of Roboyard are allowed.

    Raises:
        Exception: any other error, which is a fault.
    """
    suffix, read, _ = READERS[reader]
    file = folder / f"case{suffix}"
    file.write_bytes(data)
    with _quiet(), contextlib.suppress(RoboyardError):
        read(file)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Discard what readers print, also those in C."""
    saved = [(number, os.dup(number)) for number in (1, 2)]
    sink = os.open(os.devnull, os.O_WRONLY)
    try:
        for number, _ in saved:
            os.dup2(sink, number)
        yield
    finally:
        for number, copy in saved:
            os.dup2(copy, number)
            os.close(copy)
        os.close(sink)

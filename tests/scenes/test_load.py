"""Scene files of other people: MJCF, URDF and USD, and what is said of those that cannot be used."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from roboyard.errors import DescriptionError, RoboyardError
from roboyard.scenes import load_scene

MJCF = """<mujoco model="hut"><worldbody>
  <geom name="ground" type="plane" size="5 5 0.1"/>
  <body name="gate" pos="1 0 0.5"><joint name="turn" type="hinge" axis="0 0 1" range="0 90"/>
    <geom type="box" size="0.4 0.02 0.5" mass="3"/></body>
  <body name="crate" pos="0 1 0.2"><freejoint/><geom type="box" size="0.1 0.1 0.1" mass="1"/></body>
</worldbody></mujoco>"""

URDF = """<robot name="shelf">
  <link name="base"><collision><geometry><box size="1 1 0.5"/></geometry></collision></link>
  <link name="tray">
    <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><box size="0.5 0.5 0.1"/></geometry></collision>
  </link>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="tray"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.4" effort="10" velocity="1"/></joint>
</robot>"""

USDA = """#usda 1.0
(
    defaultPrim = "Room"
    metersPerUnit = 0.01
    upAxis = "Y"
)
def Xform "Room"
{
    def Cube "Block" (prepend apiSchemas = ["PhysicsCollisionAPI"])
    {
        double size = 20
        color3f[] primvars:displayColor = [(1, 0, 0)]
        double3 xformOp:translate = (100, 10, 50)
        double3 xformOp:scale = (2, 1, 1)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
    }
    def Xform "Corner" (prepend apiSchemas = ["PhysicsRigidBodyAPI"])
    {
        def Mesh "Angle" (prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMeshCollisionAPI"])
        {
            uniform token physics:approximation = "none"
            point3f[] points = [(0,0,0),(100,0,0),(100,0,20),(20,0,20),(20,0,100),(0,0,100),
                                (0,40,0),(100,40,0),(100,40,20),(20,40,20),(20,40,100),(0,40,100)]
            int[] faceVertexCounts = [6,6,4,4,4,4,4,4]
            int[] faceVertexIndices = [0,1,2,3,4,5, 6,11,10,9,8,7,
                0,6,7,1, 1,7,8,2, 2,8,9,3, 3,9,10,4, 4,10,11,5, 5,11,6,0]
        }
    }
    def Cylinder "Post"
    {
        uniform token axis = "Y"
        double radius = 5
        double height = 100
        double3 xformOp:translate = (-50, 50, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def SphereLight "Lamp" {}
}
"""


def _write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_mjcf_keeps_its_joints_and_free_bodies(tmp_path: Path) -> None:
    scene = load_scene(_write(tmp_path, "hut.xml", MJCF))
    assert {"hut", "hut/gate", "hut/crate"} == set(scene.bodies)
    assert "hut/gate/turn" in scene.joints
    scene.world.step(480)
    assert scene.body("hut/crate").position[2] == pytest.approx(0.1, abs=2e-3)


@pytest.mark.parametrize("name", ["shelf.urdf", "shelf.xml"])
def test_urdf_has_a_fixed_base_and_keeps_its_joints(tmp_path: Path, name: str) -> None:
    scene = load_scene(_write(tmp_path, name, URDF))
    joint = scene.joints["shelf/slide"]
    joint.position = 0.3
    assert scene.body("shelf").link("tray").pose[0][0] == pytest.approx(0.3)
    scene.world.step(100)
    assert scene.body("shelf").position[2] == 0.0


class TestUsd:
    @pytest.fixture(autouse=True)
    def _needs_openusd(self) -> None:
        pytest.importorskip("pxr.Usd")

    def test_units_axes_and_shapes(self, tmp_path: Path) -> None:
        """Centimetres, y up: (x, y, z) cm becomes (x, -z, y) / 100 m."""
        scene = load_scene(_write(tmp_path, "room.usda", USDA))
        assert set(scene.bodies) == {"Block", "Corner", "Post"}
        expected = {
            "Block": [(0.8, -0.6, 0.0), (1.2, -0.4, 0.2)],
            "Corner": [(0, -1.0, 0), (1.0, 0, 0.4)],
            "Post": [(-0.55, -0.05, 0), (-0.45, 0.05, 1.0)],
        }
        for name, bounds in expected.items():
            (visual,) = scene.body(name).description.root.visuals
            assert np.allclose(visual.geometry.data.bounds, bounds, atol=1e-6), name

    def test_collision_shapes_follow_the_approximation(self, tmp_path: Path) -> None:
        scene = load_scene(_write(tmp_path, "room.usda", USDA))
        world = scene.world
        assert world.ray((1.0, -0.5, 2), (1.0, -0.5, -1)).position[2] == pytest.approx(0.2, abs=1e-6)
        corner = scene.body("Corner")
        assert world.ray((0.1, -0.8, 2), (0.1, -0.8, -1)).body is corner
        assert world.ray((0.8, -0.1, 2), (0.8, -0.1, -1)).body is corner
        assert world.ray((0.45, -0.45, 2), (0.45, -0.45, -1)) is None, "the corner is not its hull"
        assert world.ray((-0.5, 0, 2), (-0.5, 0, -1)) is None, "no CollisionAPI, as others have it"

    def test_without_physics_everything_collides(self, tmp_path: Path) -> None:
        text = USDA.replace('"PhysicsCollisionAPI", "PhysicsMeshCollisionAPI"', "").replace(
            ' (prepend apiSchemas = ["PhysicsCollisionAPI"])', ""
        )
        world = load_scene(_write(tmp_path, "room.usda", text.replace("prepend apiSchemas = []", ""))).world
        assert world.ray((-0.5, 0, 2), (-0.5, 0, -1)).position[2] == pytest.approx(1.0, abs=1e-6)
        assert world.ray((0.45, -0.45, 2), (0.45, -0.45, -1)) is None

    def test_colours_and_skipped_elements(self, tmp_path: Path) -> None:
        scene = load_scene(_write(tmp_path, "room.usda", USDA))
        (visual,) = scene.body("Block").description.root.visuals
        assert visual.material.rgba == (1.0, 0.0, 0.0, 1.0)
        notes = "\n".join(scene.notes)
        assert "1 x rigid body (made static)" in notes
        assert "1 x SphereLight" in notes

    def test_a_mirrored_mesh_faces_outwards(self, tmp_path: Path) -> None:
        mirrored = USDA.replace(
            'def Xform "Corner" (prepend apiSchemas = ["PhysicsRigidBodyAPI"])\n    {',
            'def Xform "Corner"\n    {\n        double3 xformOp:scale = (-1, 1, 1)\n'
            '        uniform token[] xformOpOrder = ["xformOp:scale"]',
        )
        scene = load_scene(_write(tmp_path, "room.usda", mirrored))
        mesh = scene.body("Corner").description.root.visuals[0].geometry.data
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
        assert volume == pytest.approx(1.0 * 0.2 * 0.4 + 0.8 * 0.2 * 0.4, rel=1e-6)

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("this is no stage", "bad.usda: OpenUSD cannot read it"),
            ('#usda 1.0\ndef Xform "Nothing" {}\n', "is a Mesh, Cube"),
            ('#usda 1.0\ndef Xform "A" (references = @gone.usda@) {}\n', "the stage does not compose"),
            (
                '#usda 1.0\ndef Mesh "M" {\n int[] faceVertexCounts=[3]\n int[] faceVertexIndices=[0,1,7]\n'
                " point3f[] points=[(0,0,0),(1,0,0),(0,1,0)]\n}\n",
                "mesh /M: face counts, indices and points do not match",
            ),
        ],
    )
    def test_broken_stages_raise_with_the_cause(self, tmp_path: Path, text: str, message: str) -> None:
        with pytest.raises(DescriptionError, match=message):
            load_scene(_write(tmp_path, "bad.usda", text))


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("bad.xml", "<mujoco><worldbody><geom/></worldbody></mujoco>", "MuJoCo cannot read it"),
        ("bad.urdf", "<robot name='x'/>", "bad.urdf"),
        ("room.blend", "x", "unknown scene format '.blend'"),
    ],
)
def test_broken_files_are_named(tmp_path: Path, name: str, text: str, message: str) -> None:
    with pytest.raises(DescriptionError, match=message):
        load_scene(_write(tmp_path, name, text))


def test_unknown_names_and_missing_files() -> None:
    with pytest.raises(RoboyardError, match="no scene named 'hom'; did you mean 'home'"):
        load_scene("hom")
    with pytest.raises(DescriptionError, match="no such scene file"):
        load_scene("nowhere/room.usda")

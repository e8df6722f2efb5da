"""USD stages as descriptions: stages by hand, round trips, and OpenUSD's own reading of the same joints."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pxr")

from pxr import Usd, UsdGeom, UsdPhysics  # type: ignore[import-not-found]

from roboyard.assets import assets_root
from roboyard.audit import audit_urdf
from roboyard.description import Box, Mesh, Plane, RobotDescription, load_description, write_urdf
from roboyard.description.geometry import geometry_mesh
from roboyard.description.robot_model import RobotModel
from roboyard.description.semantic import SemanticDescription
from roboyard.description.usd.build import read_stage
from roboyard.errors import DescriptionError
from roboyard.export import usd
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.transforms import Array, matrix_from_quaternion

PARSER = getattr(UsdPhysics, "UsdPhysicsLoadStageFromPrimRange", None)
HEAD = '#usda 1.0\n(\n    defaultPrim = "bot"\n    metersPerUnit = {unit}\n    upAxis = "{up}"\n)\n'


def body(name: str, place: str, inner: str = "", more: str = "", schemas: str = "") -> str:
    return f"""
    def Xform "{name}" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"{schemas}])
    {{
        {more}
        double3 xformOp:translate = ({place})
        uniform token[] xformOpOrder = ["xformOp:translate"]
        {inner}
    }}
"""


def joint(kind: str, name: str, first: str, second: str, inner: str = "") -> str:
    ends = "".join(
        f"rel physics:body{number} = </bot/{link}>\n" for number, link in enumerate((first, second)) if link
    )
    return f'def Physics{kind} "{name}"\n{{\n{ends}\n{inner}\n}}\n'


def stage(folder: Path, *parts: str, unit: float = 1.0, up: str = "Z", root: str = "") -> Path:
    file = folder / "bot.usda"
    text = HEAD.format(unit=unit, up=up) + f'def Xform "bot" {root}\n{{\n' + "\n".join(parts) + "\n}\n"
    file.write_text(text)
    return file


CUBE = 'def Cube "box" (prepend apiSchemas = ["PhysicsCollisionAPI"])\n{{\ndouble size = {size}\n}}'
TURN = """
    uniform token physics:axis = "Y"
    point3f physics:localPos0 = (0, 0, 50)
    point3f physics:localPos1 = (0, 0, -50)
    float physics:lowerLimit = -90
    float physics:upperLimit = 45
    float physxJoint:maxJointVelocity = 180
"""


def test_units_axes_limits_and_masses_without_inertia(tmp_path: Path) -> None:
    """A stage in centimetres with y up: two cubes of 20 cm, a hinge half way between them."""
    file = stage(
        tmp_path,
        body("base", "0, 0, 0", CUBE.format(size=20), "float physics:mass = 3"),
        body("arm", "0, 0, 100", CUBE.format(size=20), "float physics:density = 0.002"),
        joint("RevoluteJoint", "hinge", "base", "arm", TURN),
        unit=0.01,
        up="Y",
    )
    description = load_description(file)
    assert (description.name, description.root.name) == ("bot", "base")
    (hinge,) = description.joints
    assert hinge.type == "revolute"
    np.testing.assert_allclose(hinge.origin.position, (0, 0, 0.5), atol=1e-9)
    np.testing.assert_allclose(hinge.axis, (0, 1, 0), atol=1e-9)
    assert hinge.position_limits() == pytest.approx((-math.pi / 2, math.pi / 4), abs=1e-6)
    assert hinge.limit is not None
    assert hinge.limit.velocity == pytest.approx(math.pi, rel=1e-6)
    base, arm = (description.link_by_name[name].inertial for name in ("base", "arm"))
    assert base is not None
    assert arm is not None
    assert base.mass == pytest.approx(3)
    assert arm.mass == pytest.approx(16, rel=1e-6)  # 8000 cm³ of 2 g/cm³: density is kg per cubic unit
    assert np.diag(base.matrix()) == pytest.approx([3 * 0.04 / 6] * 3)  # m a² / 6
    assert arm.origin.position == pytest.approx((0, 0, 0.5))  # the link's frame is at its joint
    shape = description.link_by_name["arm"].collisions[0]
    assert isinstance(shape.geometry, Box)
    assert shape.geometry.size == pytest.approx((0.2, 0.2, 0.2))
    assert shape.origin.position == pytest.approx((0, 0, 0.5))


def test_a_joint_drawn_away_from_zero_is_turned_back(tmp_path: Path) -> None:
    """The arm is drawn at 90 degrees; position zero is where the frames of the joint coincide."""
    turn = """
        uniform token physics:axis = "Z"
        point3f physics:localPos0 = (1, 0, 0)
        quatf physics:localRot0 = (0.70710677, 0, 0, -0.70710677)
    """
    file = stage(
        tmp_path,
        body("base", "0, 0, 0"),
        body("arm", "1, 0, 0"),
        joint("RevoluteJoint", "hinge", "base", "arm", turn),
    )
    description = load_description(file)
    pose = forward_kinematics(description, {"hinge": math.pi / 2})["arm"]
    np.testing.assert_allclose(pose[:3, :3], np.eye(3), atol=1e-6)
    np.testing.assert_allclose(pose[:3, 3], (1, 0, 0), atol=1e-6)


def test_a_joint_of_several_axes_is_a_chain_and_a_locked_one_fixed(tmp_path: Path) -> None:
    axes = "\n".join(
        f"float limit:{axis}:physics:low = {low}\nfloat limit:{axis}:physics:high = {high}"
        for axis, low, high in (
            ("transX", -0.5, 0.25),
            ("transY", 1, -1),
            ("transZ", 1, -1),
            ("rotX", 1, -1),
            ("rotZ", -30, 60),
        )
    )
    locked = "\n".join(
        f"float limit:{kind}{axis}:physics:low = 1\nfloat limit:{kind}{axis}:physics:high = -1"
        for kind in ("trans", "rot")
        for axis in "XYZ"
    )
    file = stage(
        tmp_path,
        body("base", "0, 0, 0"),
        body("arm", "0, 0, 1"),
        body("tip", "0, 0, 2"),
        joint("Joint", "free", "base", "arm", f"point3f physics:localPos0 = (0, 0, 1)\n{axes}"),
        joint("Joint", "stiff", "arm", "tip", f"point3f physics:localPos0 = (0, 0, 1)\n{locked}"),
    )
    description = load_description(file)
    kinds = {each.name: each.type for each in description.joints}
    assert kinds == {
        "free_1": "prismatic",
        "free_2": "continuous",
        "free_3": "revolute",
        "stiff": "fixed",
    }
    assert description.joint_by_name["free_1"].position_limits() == pytest.approx((-0.5, 0.25))
    pose = forward_kinematics(description, {"free_1": 0.2, "free_3": 0.5})["tip"]
    np.testing.assert_allclose(pose[:3, 3], (0.2, 0, 2), atol=1e-9)
    np.testing.assert_allclose(pose[:2, 0], (math.cos(0.5), math.sin(0.5)), atol=1e-9)


@pytest.mark.parametrize("bounded", [True, False])
def test_three_turns_are_a_ball_only_without_limits(tmp_path: Path, bounded: bool) -> None:
    """Isaac's humanoid states hips and shoulders so, each turn with its range."""
    axes = "\n".join(
        f"float limit:trans{axis}:physics:low = 1\nfloat limit:trans{axis}:physics:high = -1"
        for axis in "XYZ"
    )
    if bounded:
        axes += "\nfloat limit:rotX:physics:low = -45\nfloat limit:rotX:physics:high = 90"
    file = stage(
        tmp_path, body("base", "0, 0, 0"), body("arm", "0, 0, 0"), joint("Joint", "hip", "base", "arm", axes)
    )
    description = load_description(file)
    kinds = {each.name: each.type for each in description.joints}
    if not bounded:
        assert kinds == {"hip": "spherical"}
        return
    assert kinds == {"hip_1": "revolute", "hip_2": "continuous", "hip_3": "continuous"}
    assert description.joint_by_name["hip_1"].position_limits() == pytest.approx((-math.pi / 4, math.pi / 2))
    pose = forward_kinematics(description, {"hip_1": 0.3, "hip_2": 0.4, "hip_3": 0.5})["arm"]
    turns = (
        matrix_from_quaternion((math.sin(0.15), 0, 0, math.cos(0.15)))
        @ matrix_from_quaternion((0, math.sin(0.2), 0, math.cos(0.2)))
        @ matrix_from_quaternion((0, 0, math.sin(0.25), math.cos(0.25)))
    )
    np.testing.assert_allclose(pose[:3, :3], turns, atol=1e-9)


FOUR_BAR = (
    body("ground", "0, 0, 0"),
    body("crank", "0, 0, 0"),
    body("rod", "0, 0, 1"),
    body("rocker", "2, 0, 0"),
    joint("RevoluteJoint", "a", "ground", "crank", 'uniform token physics:axis = "Y"'),
    joint(
        "RevoluteJoint",
        "closing",
        "rod",
        "rocker",
        'uniform token physics:axis = "Y"\npoint3f physics:localPos0 = (2, 0, 0)\n'
        "point3f physics:localPos1 = (0, 0, 1)\nbool physics:excludeFromArticulation = true",
    ),
    joint(
        "RevoluteJoint",
        "b",
        "crank",
        "rod",
        'uniform token physics:axis = "Y"\npoint3f physics:localPos0 = (0, 0, 1)',
    ),
    joint(
        "RevoluteJoint",
        "c",
        "ground",
        "rocker",
        'uniform token physics:axis = "Y"\npoint3f physics:localPos0 = (2, 0, 0)',
    ),
)


def test_loops_stay_as_loop_joints_and_survive_urdf(tmp_path: Path) -> None:
    description = load_description(stage(tmp_path, *FOUR_BAR))
    assert [each.name for each in description.joints] == ["a", "b", "c"]
    (loop,) = description.loops
    assert (loop.type, loop.first, loop.second, loop.axis) == ("revolute", "rod", "rocker", (0, 1, 0))
    poses = forward_kinematics(description)
    ends = [
        poses[link] @ pose.matrix()
        for link, pose in ((loop.first, loop.first_origin), (loop.second, loop.second_origin))
    ]
    np.testing.assert_allclose(*ends, atol=1e-9)
    write_urdf(description, tmp_path / "bot.urdf")
    again = load_description(tmp_path / "bot.urdf")
    assert len(again.loops) == 1
    np.testing.assert_allclose(again.loops[0].first_origin.matrix(), loop.first_origin.matrix())
    codes = {finding.code for finding in audit_urdf(tmp_path / "bot.urdf").findings}
    assert not codes & {"element-unread", "attribute-unread"}


def test_a_joint_to_the_world_and_one_the_other_way_round(tmp_path: Path) -> None:
    slide = 'uniform token physics:axis = "X"\nfloat physics:lowerLimit = 0\nfloat physics:upperLimit = 2'
    file = stage(
        tmp_path,
        body("base", "0, 0, 1"),
        body("arm", "0, 0, 1"),
        joint("FixedJoint", "mount", "", "base", "point3f physics:localPos0 = (0, 0, 1)"),
        joint("PrismaticJoint", "slide", "arm", "base", slide),
    )
    description = load_description(file)
    assert description.root.name == "world"
    assert description.joint_by_name["slide"].parent == "base"
    poses = forward_kinematics(description, {"slide": 0.5})
    np.testing.assert_allclose(poses["base"][:3, 3], (0, 0, 1), atol=1e-9)
    np.testing.assert_allclose(poses["arm"][:3, 3], (-0.5, 0, 1), atol=1e-9)


@pytest.mark.parametrize("first", ["", "base"])
@pytest.mark.parametrize("stated", [False, True])
def test_a_joint_to_the_world_without_a_frame_there_holds_a_body_as_drawn(
    tmp_path: Path, first: str, stated: bool
) -> None:
    """The body is drawn at (0, 0, 2), its joint is 0.5 above it."""
    own, world = ("1", "0") if not first else ("0", "1")
    inner = f"point3f physics:localPos{own} = (0, 0, 0.5)\n"
    inner += f"point3f physics:localPos{world} = (0, 0, 0)\n" if stated else ""
    ends = (first, "") if first else ("", "base")
    file = stage(tmp_path, body("base", "0, 0, 2"), joint("FixedJoint", "held", *ends, inner))
    description = load_description(file)
    height = forward_kinematics(description, {})["base"][2, 3]
    assert description.root.name == "world"
    assert height == pytest.approx(-0.5 if stated else 2.0)


def test_the_articulation_is_the_robot_and_the_rest_is_noted(tmp_path: Path) -> None:
    file = stage(
        tmp_path,
        body("one", "0, 0, 0"),
        body("two", "0, 0, 0"),
        body("three", "0, 0, 0"),
        joint("FixedJoint", "ab", "one", "two"),
        joint("FixedJoint", "bc", "two", "three"),
        body("root", "5, 0, 0", schemas=', "PhysicsArticulationRootAPI"'),
        body("tip", "5, 0, 0"),
        joint("RevoluteJoint", "turn", "root", "tip"),
    )
    description = read_stage(file)
    assert [link.name for link in description.links] == ["root", "tip"]
    assert any("3 bodies" in note for note in description.notes)


def test_meshes_become_files_with_their_colours_and_scale(tmp_path: Path) -> None:
    tetrahedron = """
        def Mesh "part" (prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMeshCollisionAPI"])
        {
            point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
            int[] faceVertexCounts = [3, 3, 3, 3]
            int[] faceVertexIndices = [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]
            uniform token physics:approximation = "convexHull"
            color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0)] (
                interpolation = "uniform"
            )
            float3 xformOp:scale = (1, 2, -1)
            uniform token[] xformOpOrder = ["xformOp:scale"]
        }
    """
    file = stage(tmp_path, body("base", "0, 0, 0", tetrahedron))
    link = load_description(file).root
    mesh = link.visuals[0].geometry
    assert isinstance(mesh, Mesh)
    assert mesh.path is not None
    assert mesh.path.is_file()
    from roboyard.shapes import load_mesh

    loaded = load_mesh(mesh.path)
    assert loaded.bounds == pytest.approx(np.array([[0, 0, -1], [1, 2, 0]]))
    assert loaded.colors is not None
    assert {tuple(color) for color in loaded.colors[:, :3]} == {
        (255, 0, 0),
        (0, 255, 0),
        (0, 0, 255),
        (255, 255, 0),
    }
    assert link.inertial is not None
    assert link.inertial.mass == pytest.approx(1000 / 3)  # of water, 1/6 of 2 m³: faces still point outwards


def _tensor(description: RobotDescription, name: str) -> tuple[Array, Array] | None:
    inertial = description.link_by_name[name].inertial
    if inertial is None or inertial.mass <= 0:
        return None
    turn = matrix_from_quaternion(inertial.origin.quaternion)
    return np.array([inertial.mass, *inertial.origin.position]), turn @ inertial.matrix() @ turn.T


def _shapes(description: RobotDescription, link: str) -> list[tuple[Any, ...]]:
    """Class, kind and colour of each shape of a link, and the box around it in the link's frame."""
    found = []
    for shape in (*description.link_by_name[link].visuals, *description.link_by_name[link].collisions):
        kind, material, rgba, corners = type(shape.geometry), getattr(shape, "material", None), (), ()
        if material is not None and material.rgba is not None and kind is not Mesh:
            rgba = tuple(np.round(material.rgba, 4))
        mesh = geometry_mesh(shape.geometry)
        if mesh is not None:
            T = shape.origin.matrix()
            points = mesh.vertices @ T[:3, :3].T + T[:3, 3]
            corners = tuple(np.concatenate([points.min(axis=0), points.max(axis=0)]).tolist())
        found.append((type(shape).__name__, kind.__name__, rgba, corners))
    return found


BUNDLED = sorted(path.relative_to(assets_root()).as_posix() for path in assets_root().rglob("*.urdf"))


@pytest.mark.parametrize("name", BUNDLED)
def test_urdf_to_usd_and_back_keeps_the_robot(tmp_path: Path, name: str) -> None:
    before = load_description(assets_root() / name)
    robot = RobotModel(
        name=before.name,
        description=before,
        semantic=SemanticDescription(base_link=before.root.name),
    )
    usd.write(robot, tmp_path / "robot.usda")
    write_urdf(load_description(tmp_path / "robot.usda"), tmp_path / "robot.urdf")
    after = load_description(tmp_path / "robot.urdf")
    assert {link.name for link in after.links} == {link.name for link in before.links}
    generator = np.random.default_rng(3)
    positions = {
        each.name: generator.uniform(-1, 1)
        for each in before.joints
        if each.type in ("revolute", "continuous", "prismatic") and each.mimic is None
    }
    old, new = (forward_kinematics(each, positions) for each in (before, after))
    for link in before.links:
        np.testing.assert_allclose(new[link.name], old[link.name], atol=1e-6)
        shapes = [_shapes(each, link.name) for each in (before, after)]
        assert [shape[:3] for shape in shapes[1]] == [shape[:3] for shape in shapes[0]]
        for one, other in zip(*shapes, strict=True):
            np.testing.assert_allclose(other[3], one[3], atol=2e-6)
        one, other = (_tensor(each, link.name) for each in (before, after))
        assert (one is None) == (other is None)
        if one is not None and other is not None:
            np.testing.assert_allclose(other[0], one[0], rtol=1e-6, atol=1e-6)
            np.testing.assert_allclose(other[1], one[1], atol=1e-6 * np.abs(one[1]).max())
    for each in before.joints:
        same = after.joint_by_name[each.name]
        assert same.mimic == each.mimic
        if each.is_moving:
            assert (same.damping, same.friction) == pytest.approx((each.damping, each.friction), rel=1e-6)
        limits = each.position_limits()
        if limits is not None:
            assert same.position_limits() == pytest.approx(limits, abs=1e-6)
            assert each.limit is not None
            assert same.limit is not None
            assert same.limit.effort == pytest.approx(each.limit.effort, rel=1e-6)
            assert same.limit.velocity == pytest.approx(each.limit.velocity, rel=1e-6)


@pytest.mark.parametrize("normal", ["0 0 1", "0 -1 0", "0.6 0 0.8"])
def test_a_plane_is_a_plane_to_openusd_and_comes_back(tmp_path: Path, normal: str) -> None:
    before = load_description(f"""<robot name="floor"><link name="floor">
        <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
        <collision><origin xyz="0 0 0.5" rpy="0.3 0 1"/><geometry><plane normal="{normal}"/></geometry>
        </collision></link></robot>""")
    robot = RobotModel(name="floor", description=before, semantic=SemanticDescription(base_link="floor"))
    file = tmp_path / "floor.usda"
    usd.write(robot, file)
    opened = Usd.Stage.Open(str(file))
    (prim,) = [each for each in opened.Traverse() if each.IsA(UsdGeom.Plane)]
    assert prim.HasAPI(UsdPhysics.CollisionAPI)
    turn = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim)).T[:3, :3]
    drawn = turn[:, "XYZ".index(UsdGeom.Plane(prim).GetAxisAttr().Get())]
    shapes = [each.root.collisions[0] for each in (before, load_description(file))]
    first, second = (
        shape.origin.matrix()[:3, :3] @ np.array(shape.geometry.normal)
        for shape in shapes
        if isinstance(shape.geometry, Plane)
    )
    np.testing.assert_allclose(second, first, atol=1e-9)
    np.testing.assert_allclose(drawn, first, atol=1e-9)
    np.testing.assert_allclose(shapes[1].origin.position, (0, 0, 0.5), atol=1e-9)


def _parsed_joints(file: Path) -> dict[str, Any]:
    """OpenUSD's own reading of the joints of a stage."""
    opened = Usd.Stage.Open(str(file))
    found: dict[str, Any] = {}
    for kind, (paths, descriptors) in PARSER(opened, ["/"]).items():
        if "Joint" in str(kind):
            found |= {path.name: each for path, each in zip(paths, descriptors, strict=True)}
    return found


def test_joint_frames_and_limits_agree_with_openusd(tmp_path: Path) -> None:
    """Bodies are scaled, nested and turned; OpenUSD resolves the frames of joints by itself."""
    if PARSER is None:
        pytest.skip("this OpenUSD has no parser of physics")
    frames = """
        uniform token physics:axis = "X"
        point3f physics:localPos0 = (0.1, 0.2, 0.3)
        quatf physics:localRot0 = (0.5, 0.5, 0.5, 0.5)
        point3f physics:localPos1 = (-0.1, 0, 0.2)
        quatf physics:localRot1 = (0.8, 0, 0.6, 0)
        float physics:lowerLimit = -10
        float physics:upperLimit = 20
    """
    inner = body("arm", "0.3, 0, 0").replace(
        '["xformOp:translate"]', '["xformOp:translate", "xformOp:scale"]'
    )
    inner = inner.replace(
        "double3 xformOp:translate", "float3 xformOp:scale = (2, 2, 2)\ndouble3 xformOp:translate"
    )
    file = stage(
        tmp_path,
        body("base", "0, 0, 1", inner),
        joint("RevoluteJoint", "hinge", "base", "base/arm", frames),
    )
    parsed = _parsed_joints(file)["hinge"]
    expected = []
    for number in (0, 1):
        T = np.eye(4)
        T[:3, 3] = getattr(parsed, f"localPose{number}Position")
        turn = getattr(parsed, f"localPose{number}Orientation")
        T[:3, :3] = matrix_from_quaternion([*turn.GetImaginary(), turn.GetReal()])
        expected.append(T)
    description = load_description(file)
    (hinge,) = description.joints
    shift = np.eye(4)
    shift[:3, 3] = expected[1][:3, 3]
    stated = expected[0] @ np.linalg.inv(expected[1]) @ shift
    np.testing.assert_allclose(hinge.origin.matrix(), stated, atol=1e-6)
    np.testing.assert_allclose(hinge.axis, expected[1][:3, 0], atol=1e-6)
    assert hinge.position_limits() == pytest.approx(
        (math.radians(parsed.limit.lower), math.radians(parsed.limit.upper)), abs=1e-6
    )


def test_files_outside_the_robots_folders_are_refused(tmp_path: Path) -> None:
    (tmp_path / "secret.usda").write_text(HEAD.format(unit=1, up="Z") + 'def Xform "bot" {}')
    folder = tmp_path / "robot_7"
    folder.mkdir()
    file = stage(folder, root="(references = @../secret.usda@)")
    with pytest.raises(DescriptionError, match="outside"):
        load_description(file)
    assert [finding.code for finding in audit_urdf(file).findings] == ["format-refused"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("#usda 1.0\n", "rigid body"),
        ("#usda 1.0\ndef", "cannot read"),
        ("", "cannot read"),
        (HEAD.format(unit=0, up="Z"), "metersPerUnit"),
        (HEAD.format(unit=1, up="Z") + body("bot", "0, 0, inf"), "not finite"),
    ],
)
def test_bad_stages_are_refused_with_a_reason(tmp_path: Path, text: str, reason: str) -> None:
    file = tmp_path / "bot.usda"
    file.write_text(text)
    with pytest.raises(DescriptionError, match=reason) as raised:
        load_description(file)
    assert raised.value.file == file


def test_without_openusd_the_error_names_the_extra(tmp_path: Path) -> None:
    code = (
        "import sys\nsys.modules['pxr'] = None\n"
        "from roboyard.cli import main\n"
        f"sys.exit(main(['audit', {str(stage(tmp_path))!r}]))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert 'the extra "usd": pip install "usd-core' in done.stderr

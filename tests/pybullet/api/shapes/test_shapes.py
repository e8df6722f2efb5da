"""Collision and visual shapes and createMultiBody, compared with PyBullet 3.2.7."""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p

HALF_TURN = [0, 0, sqrt(0.5), sqrt(0.5)]
TETRAHEDRON = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3])


def message_of(call: Callable[[], Any]) -> list[str]:
    try:
        return ["no error", repr(call())]
    except Exception as problem:
        return [type(problem).__name__, str(problem)]


def kinds(p: Any) -> dict[str, dict[str, Any]]:
    return {
        "sphere": {"shapeType": p.GEOM_SPHERE, "radius": 0.3},
        "box": {"shapeType": p.GEOM_BOX, "halfExtents": [0.1, 0.2, 0.3]},
        "cylinder": {"shapeType": p.GEOM_CYLINDER, "radius": 0.2},
        "capsule": {"shapeType": p.GEOM_CAPSULE, "radius": 0.2},
        "plane": {"shapeType": p.GEOM_PLANE, "planeNormal": [0, 0, 1]},
    }


def record_collision_shape_data(p: Any, folder: Path) -> Any:
    found = {}
    for name, options in kinds(p).items():
        shape = p.createCollisionShape(
            **options, collisionFramePosition=[0.1, 0, 0], collisionFrameOrientation=HALF_TURN
        )
        body = p.createMultiBody(1, shape, baseInertialFramePosition=[0, 0, 0.2])
        found[name] = p.getCollisionShapeData(body, -1)
    return found


def record_collision_shape_arrays(p: Any, folder: Path) -> Any:
    shape = p.createCollisionShapeArray(
        shapeTypes=[p.GEOM_SPHERE, p.GEOM_BOX],
        radii=[0.1, 0.2],
        halfExtents=[[1, 1, 1], [0.1, 0.2, 0.3]],
        collisionFramePositions=[[0, 0, 0], [0.5, 0, 0]],
    )
    body = p.createMultiBody(1, shape)
    return [p.getAABB(body), p.getDynamicsInfo(body, -1)[2]]  # PyBullet's shape data has random numbers here


def record_visual_shape_data(p: Any, folder: Path) -> Any:
    found = {}
    for name, options in kinds(p).items():
        if name == "plane":
            continue
        shape = p.createVisualShape(
            **options,
            rgbaColor=[0.1, 0.2, 0.3, 1],
            visualFramePosition=[0, 0.1, 0],
            visualFrameOrientation=HALF_TURN,
        )
        body = p.createMultiBody(1, baseVisualShapeIndex=shape)
        found[name] = p.getVisualShapeData(body)
    return found


def record_changed_colours(p: Any, folder: Path) -> Any:
    shape = p.createVisualShape(p.GEOM_BOX, halfExtents=[0.1] * 3, rgbaColor=[1, 0, 0, 1])
    body = p.createMultiBody(1, baseVisualShapeIndex=shape)
    p.changeVisualShape(body, -1, rgbaColor=[0, 1, 0, 0.5])
    changed = p.getVisualShapeData(body)[0][7]
    p.changeVisualShape(99, -1, rgbaColor=[0, 1, 0, 0.5])
    return [changed, p.getVisualShapeData(99)]


def record_errors(p: Any, folder: Path) -> Any:
    body = p.createMultiBody(1)
    return [
        message_of(lambda: p.createCollisionShape(77)),
        message_of(lambda: p.createCollisionShape(p.GEOM_MESH, fileName="missing.obj")),
        message_of(lambda: p.getCollisionShapeData(99, -1)),
        message_of(lambda: p.loadTexture("missing.png")),
        message_of(lambda: p.createMultiBody(1, linkMasses=[1], linkCollisionShapeIndices=[-1, -1])),
        message_of(lambda: p.createMultiBody(1, 55) > body),
    ]


def tree(p: Any, **options: Any) -> Any:
    """A base with two links in a row and a third beside them."""
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.2])
    return p.createMultiBody(
        2.0, shape, basePosition=[0, 0, 1], linkMasses=[1, 0.5, 0.25],
        linkCollisionShapeIndices=[shape, shape, -1],
        linkVisualShapeIndices=[-1] * 3, linkPositions=[[0, 0, 0.5], [0, 0, 0.4], [0.3, 0, 0]],
        linkOrientations=[[0, 0, 0, 1], HALF_TURN, [0, 0, 0, 1]],
        linkInertialFramePositions=[[0, 0, 0.1], [0, 0, 0], [0, 0, 0]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * 3, linkParentIndices=[0, 1, 0],
        linkJointTypes=[p.JOINT_REVOLUTE, p.JOINT_PRISMATIC, p.JOINT_FIXED],
        linkJointAxis=[[0, 0, 1], [1, 0, 0], [0, 0, 1]], **options,
    )  # fmt: skip


def record_a_tree_of_links(p: Any, folder: Path) -> Any:
    body = tree(p)
    return [
        p.getNumJoints(body),
        [p.getJointInfo(body, joint) for joint in range(3)],
        [p.getLinkState(body, link)[:6] for link in range(3)],
        [p.getDynamicsInfo(body, link)[:5] for link in range(-1, 3)],
    ]


def record_a_batch(p: Any, folder: Path) -> Any:
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    ids = p.createMultiBody(1, shape, batchPositions=[[0, 0, 1], [1, 0, 1], [2, 0, 1]])
    p.syncBodyInfo()
    return [ids, [p.getBasePositionAndOrientation(body) for body in ids]]


@pytest.mark.parametrize(
    "scenario",
    [
        record_collision_shape_data,
        record_collision_shape_arrays,
        record_visual_shape_data,
        record_changed_colours,
        record_a_tree_of_links,
        record_a_batch,
    ],
)
def test_tables_are_pybullets(agrees: Any, scenario: Any) -> None:
    agrees(scenario, 1e-6)


def test_errors_are_pybullets(agrees: Any) -> None:
    agrees(record_errors)


@pytest.mark.parametrize(
    ("options", "note"),
    [
        ({"shapeType": p.GEOM_SPHERE, "radius": 0.0}, "radius must be positive, got 0.0"),
        ({"shapeType": p.GEOM_CYLINDER, "radius": -1.0}, "radius must be positive, got -1.0"),
        ({"shapeType": p.GEOM_CYLINDER, "height": 0.0}, "height must be positive, got 0.0"),
        ({"shapeType": p.GEOM_BOX}, "a box needs halfExtents"),
        ({"shapeType": 77}, "shape type 77 is unknown"),
        ({"shapeType": p.GEOM_MESH}, "give fileName or vertices"),
    ],
)
def test_notes_explain_what_is_wrong(client: int, options: dict[str, Any], note: str) -> None:
    with pytest.raises(p.error) as caught:
        p.createCollisionShape(**options)
    assert str(caught.value) == "createCollisionShape failed."
    assert note in "".join(caught.value.__notes__)


@pytest.mark.parametrize("create", ["createCollisionShapeArray", "createVisualShapeArray"])
def test_an_array_needs_shapes(client: int, create: str) -> None:
    with pytest.raises(p.error, match=f"{create} failed"):
        getattr(p, create)([])


@pytest.mark.parametrize(
    ("vertices", "indices", "note"),
    [
        ([[0, 0, 0], [1, 0, 0]], None, "at least three finite vertices, got 2"),
        ([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], None, "finite"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [0, 1, 3], "indices must be 0 to 2, got 0 to 3"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], None, "coplanar"),
    ],
)
def test_poor_meshes_are_refused(client: int, vertices: Any, indices: Any, note: str) -> None:
    with pytest.raises(p.error) as caught:
        p.createCollisionShape(p.GEOM_MESH, vertices=vertices, indices=indices)
    assert note in "".join(caught.value.__notes__)


@pytest.mark.parametrize(("is_hull", "height"), [(True, 0.25099), (False, -0.93214)])
def test_a_mesh_of_vertices_falls_onto_its_face(client: int, is_hull: bool, height: float) -> None:
    """One of triangles falls through a plane, as in PyBullet 3.2.7: Bullet has no contacts of both."""
    vertices, indices = TETRAHEDRON
    shape = p.createCollisionShape(p.GEOM_MESH, vertices=vertices, indices=None if is_hull else indices)
    body = p.createMultiBody(
        1, shape, basePosition=[0, 0, 0.05], baseInertialFramePosition=[0.25, 0.25, 0.25]
    )
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    p.setGravity(0, 0, -10)
    for _ in range(120):
        p.stepSimulation()
    assert p.getBasePositionAndOrientation(body)[0][2] == pytest.approx(height, abs=1e-5)
    count, points = p.getMeshData(body)
    assert count == 4
    expected = np.array(sorted(map(tuple, (np.array(vertices) - 0.25).tolist())))
    assert np.array(sorted(points)) == pytest.approx(expected, abs=1e-6)


def test_removed_shapes_stay_in_bodies(client: int) -> None:
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.25)
    body = p.createMultiBody(1, shape)
    p.removeCollisionShape(shape)
    p.removeCollisionShape(99)
    assert p.getCollisionShapeData(body, -1)[0][3] == (0.25, 0.25, 0.25)


def test_shape_ids_count_up(client: int) -> None:
    assert [p.createCollisionShape(p.GEOM_SPHERE) for _ in range(3)] == [0, 1, 2]
    assert [p.createVisualShape(p.GEOM_SPHERE) for _ in range(3)] == [0, 1, 2]


@pytest.mark.parametrize("parent", [2, 5, -1])
def test_parents_lead_to_the_base(client: int, parent: int) -> None:
    with pytest.raises(p.error, match=r"createMultiBody failed\.") as caught:
        p.createMultiBody(
            1, linkMasses=[1], linkCollisionShapeIndices=[-1], linkVisualShapeIndices=[-1],
            linkPositions=[[0, 0, 0]], linkOrientations=[[0, 0, 0, 1]],
            linkInertialFramePositions=[[0, 0, 0]], linkInertialFrameOrientations=[[0, 0, 0, 1]],
            linkParentIndices=[parent], linkJointTypes=[p.JOINT_FIXED], linkJointAxis=[[0, 0, 1]],
        )  # fmt: skip
    assert f"is {parent};" in caught.value.__notes__[0]


def test_a_changed_texture_needs_all_its_pixels(client: int) -> None:
    vertices, indices = TETRAHEDRON
    p.createMultiBody(1, p.createCollisionShape(p.GEOM_MESH, vertices=vertices, indices=indices))
    with pytest.raises(p.error, match="Error processing changeTexture"):
        p.changeTexture(5, [0, 0, 0], 1, 1)


def test_textures_are_loaded_and_replaced(client: int, tmp_path: Path) -> None:
    from PIL import Image

    file = tmp_path / "red.png"
    Image.new("RGB", (2, 2), (255, 0, 0)).save(file)
    first, second = p.loadTexture(str(file)), p.loadTexture(str(file))
    assert (first, second) == (0, 1)
    p.changeTexture(first, [0, 255, 0] * 4, 2, 2)
    with pytest.raises(p.error, match="invalid arguments in changeTexture") as caught:
        p.changeTexture(first, [0, 255, 0], 2, 2)
    assert "got 3 numbers for 2 by 2 pixels" in caught.value.__notes__
    (tmp_path / "no.png").write_text("text")
    with pytest.raises(p.error, match="Error loading texture"):
        p.loadTexture(str(tmp_path / "no.png"))


def test_scaling_and_headsets_are_not_available(client: int) -> None:
    body = p.createMultiBody(1)
    with pytest.raises(p.error, match="is not available"):
        p.unsupportedChangeScaling(body, 2)
    assert p.getVREvents() == ()
    assert p.setVRCameraState() is None
    assert p.loadPlugin("some.so") == -1
    assert p.executePluginCommand(0) == -1
    assert p.unloadPlugin(0) is None


def test_a_debug_colour_has_three_numbers(client: int) -> None:
    body = p.createMultiBody(1)
    p.setDebugObjectColor(body, -1, [1, 0, 0])
    with pytest.raises(p.error, match="Error converting objectDebugColorRGB"):
        p.setDebugObjectColor(body, -1, [1, 0])


@pytest.mark.parametrize(
    ("folder", "given", "shown"),
    [
        ("models/m/urdf", "package://m/meshes/a.obj", "models/m/meshes/a.obj"),
        ("models/m/urdf", "../meshes/a.obj", "models/m/urdf/../meshes/a.obj"),
        ("models/m/urdf", "meshes/a.obj", "models/m/meshes/a.obj"),
        ("./models/m/urdf", "package://meshes/a.obj", "./models/m/meshes/a.obj"),
        ("./models/m/urdf", "b.obj", "./models/m/urdf/b.obj"),
    ],
)
def test_mesh_files_are_named_as_the_urdf_was(
    client: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: str, given: str, shown: str
) -> None:
    """Names of PyBullet 3.2.7; with an absolute folder they are absolute."""
    for name in ("meshes/a.obj", "urdf/b.obj"):
        file = tmp_path / "models/m" / name
        file.parent.mkdir(parents=True)
        file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    mesh = f'<geometry><mesh filename="{given}"/></geometry>'
    (tmp_path / "models/m/urdf/r.urdf").write_text(
        f'<robot name="r"><link name="l"><visual>{mesh}</visual><collision>{mesh}</collision></link></robot>'
    )
    monkeypatch.chdir(tmp_path)
    for place, name in ((folder, shown), (f"{tmp_path}/{folder}", f"{tmp_path}/{shown}")):
        body = p.loadURDF(f"{place}/r.urdf")
        assert p.getVisualShapeData(body)[0][4] == name.encode()
        assert p.getCollisionShapeData(body, -1)[0][4] == name.encode()


def test_capsules_between_two_points_are_reported_without_a_frame(client: int, tmp_path: Path) -> None:
    """Recorded from PyBullet: of an MJCF file's capsules it has the lengths, as of those with a place."""
    file = tmp_path / "capsules.xml"
    file.write_text(
        """<mujoco><worldbody><body name="a" pos="0 0 1"><freejoint/>
<geom type="capsule" size="0.05" fromto="0.1 0 0 0.1 0 -0.4"/>
<geom type="capsule" size="0.05 0.2" pos="0 0.3 0"/></body></worldbody></mujoco>"""
    )
    (body,) = p.loadMJCF(str(file))
    between, placed = p.getVisualShapeData(body)
    assert between[3] == pytest.approx((0.4, 0.05, 0.0))
    assert between[5:7] == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    assert placed[5] == pytest.approx((0.0, 0.3, 0.0))

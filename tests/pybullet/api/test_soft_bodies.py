"""loadSoftBody and its like, compared with PyBullet 3.2.7."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import roboyard.pybullet as p

GRID = "# vtk DataFile Version 2.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID"


def write_cloth(file: Path, n: int = 5, size: float = 1.0) -> str:
    """Write a square of n by n vertices as OBJ."""
    step = size / (n - 1)
    line = [f"{i * step - size / 2:.6f}" for i in range(n)]
    return write_grid(file, n, [f"v {x} {y} 0" for x in line for y in line])


def write_grid(file: Path, n: int, vertices: list[str]) -> str:
    """Write n by n vertices and the triangles between them as OBJ."""
    lines = list(vertices)
    for i in range(n - 1):
        for j in range(n - 1):
            a = i * n + j + 1
            lines += [f"f {a} {a + n} {a + n + 1}", f"f {a} {a + n + 1} {a + 1}"]
    file.write_text("\n".join(lines) + "\n")
    return str(file)


def write_block(file: Path, cells: tuple[int, int, int] = (2, 2, 3), h: float = 0.2) -> str:
    """Write a block of cubes, six tetrahedra each, as VTK; its lower face is centred at the origin."""
    nx, ny, nz = cells
    points = [
        (i * h - nx * h / 2, j * h - ny * h / 2, k * h)
        for i in range(nx + 1)
        for j in range(ny + 1)
        for k in range(nz + 1)
    ]
    cut = ((0, 4, 6, 7), (0, 6, 2, 7), (0, 2, 3, 7), (0, 3, 1, 7), (0, 1, 5, 7), (0, 5, 4, 7))
    rows = []
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                corners = [
                    ((i + a) * (ny + 1) + j + b) * (nz + 1) + k + c
                    for a in (0, 1)
                    for b in (0, 1)
                    for c in (0, 1)
                ]
                rows += [" ".join(str(corners[at]) for at in four) for four in cut]
    lines = ["# vtk DataFile Version 2.0", "a block", "ASCII", "DATASET UNSTRUCTURED_GRID"]
    lines += [f"POINTS {len(points)} double", *(f"{x:.6f} {y:.6f} {z:.6f}" for x, y, z in points), ""]
    lines += [f"CELLS {len(rows)} {5 * len(rows)}", *("4 " + row for row in rows), ""]
    lines += [f"CELL_TYPES {len(rows)}", *["10"] * len(rows)]
    file.write_text("\n".join(lines) + "\n")
    return str(file)


def write_deformable(folder: Path) -> str:
    write_block(folder / "block.vtk")
    file = folder / "block.urdf"
    file.write_text(
        '<?xml version="1.0"?><robot name="soft"><deformable name="block">'
        '<inertial><mass value="2"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>'
        '<collision_margin value="0.005"/><friction value="0.5"/>'
        '<neohookean mu="3000" lambda="4000" damping="0.005"/><visual filename="block.vtk"/>'
        "</deformable></robot>"
    )
    return str(file)


def nodes(p: Any, body: int) -> np.ndarray:
    return np.array(p.getMeshData(body, -1, flags=p.MESH_DATA_SIMULATION_MESH)[1])


def summary(points: np.ndarray) -> list[list[float]]:
    return [points.min(axis=0).tolist(), points.max(axis=0).tolist(), points.mean(axis=0).tolist()]


def pinned_cloth(p: Any, folder: Path, **options: Any) -> int:
    p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)
    p.setGravity(0, 0, -9.81)
    settings = {"springElasticStiffness": 40, "springDampingStiffness": 0.1, "springBendingStiffness": 0.5}
    cloth = p.loadSoftBody(
        write_cloth(folder / "cloth.obj"),
        basePosition=[0, 0, 1],
        mass=1.0,
        useMassSpring=1,
        **{**settings, "useBendingSprings": 1, "springDampingAllDirections": 1, **options},
    )
    p.createSoftBodyAnchor(cloth, 0, -1, -1)
    p.createSoftBodyAnchor(cloth, 4, -1, -1)
    return cloth


def record_swing(p: Any, folder: Path) -> Any:
    cloth = pinned_cloth(p, folder)
    found = []
    for count in (30, 30, 60, 240):
        for _ in range(count):
            p.stepSimulation()
        found.append([nodes(p, cloth)[[12, 20, 24]].tolist(), p.getBasePositionAndOrientation(cloth)[0]])
    return found


def record_swing_without_bending_springs(p: Any, folder: Path) -> Any:
    cloth = pinned_cloth(p, folder, useBendingSprings=0, springDampingAllDirections=0)
    for _ in range(60):
        p.stepSimulation()
    return nodes(p, cloth)[[12, 20, 24]].tolist()


def falling_block(p: Any, folder: Path, *, from_urdf: bool) -> list[Any]:
    p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)
    p.setGravity(2, 0, -9.81)
    p.setTimeStep(1 / 480)
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 5, 0.5])
    floor = p.createMultiBody(0, shape, -1, [0, 0, -0.5])
    p.changeDynamics(floor, -1, lateralFriction=1)
    if from_urdf:
        block = p.loadURDF(write_deformable(folder), [0, 0, 0.3])
    else:
        block = p.loadSoftBody(
            write_block(folder / "block.vtk"),
            basePosition=[0, 0, 0.3],
            mass=2.0,
            useNeoHookean=1,
            NeoHookeanMu=3000,
            NeoHookeanLambda=4000,
            NeoHookeanDamping=0.005,
            frictionCoeff=0.5,
            collisionMargin=0.005,
        )
    found = []
    for count in (60, 60, 30, 50):
        for _ in range(count):
            p.stepSimulation()
        found.append(summary(nodes(p, block)))
    return found


def record_block_that_falls_on_its_foot(p: Any, folder: Path) -> Any:
    return falling_block(p, folder, from_urdf=False)


def record_block_of_a_urdf(p: Any, folder: Path) -> Any:
    found = falling_block(p, folder, from_urdf=True)
    return [found[0], p.getNumBodies(), p.getBodyInfo(1)[1].decode(), p.getNumJoints(1)]


def write_fold(file: Path, n: int = 9) -> str:
    """Write a cloth whose one half is 0.1 m to 0.15 m over its other half, as OBJ."""
    line = [k / (n - 1) - 0.5 for k in range(n)]
    return write_grid(
        file, n, [f"v {abs(x)} {y} {0.0 if x < 0 else 0.1 + 0.1 * x}" for x in line for y in line]
    )


def record_halves_of_a_cloth_on_each_other(p: Any, folder: Path) -> Any:
    p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)
    p.setGravity(0, 0, -9.8)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[2, 2, 0.1]), -1, [0, 0, -0.1])
    cloth = p.loadSoftBody(
        write_fold(folder / "fold.obj"), basePosition=[0, 0, 0.05], mass=0.5, useMassSpring=1,
        springElasticStiffness=40, springDampingStiffness=0.1, useBendingSprings=1, springBendingStiffness=1,
        frictionCoeff=0.5, useSelfCollision=1, collisionMargin=0.02,
    )  # fmt: skip
    found = []
    for _ in range(3):
        for _ in range(20):
            p.stepSimulation()
        points = nodes(p, cloth)
        found.append([points[:36, 2].mean(), points[45:, 2].mean(), points.mean(axis=0).tolist()])
    return found


def record_a_strongly_damped_ball_that_falls(p: Any, folder: Path) -> Any:
    """Strong dampers, and nodes near the poles that are within reach of each other."""
    p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)
    p.setGravity(0, 0, -9.8)
    p.setTimeStep(0.002)
    rows, lines = 12, ["v 0 0 0.4", "v 0 0 -0.4"]
    for i in range(rows):
        t = np.pi * (i + 1) / (rows + 1)
        for a in 2 * np.pi * np.arange(rows) / rows:
            lines.append(f"v {0.4 * np.sin(t) * np.cos(a)} {0.4 * np.sin(t) * np.sin(a)} {0.4 * np.cos(t)}")
    for j in range(rows):
        first, second, last = 3 + j, 3 + (j + 1) % rows, 3 + (rows - 1) * rows
        lines += [f"f 1 {first} {second}", f"f 2 {last + (j + 1) % rows} {last + j}"]
        for i in range(rows - 1):
            a, b = first + i * rows, second + i * rows
            lines += [f"f {a} {a + rows} {b + rows}", f"f {a} {b + rows} {b}"]
    (folder / "ball.obj").write_text("\n".join(lines) + "\n")
    ball = p.loadSoftBody(
        str(folder / "ball.obj"), basePosition=[0, 0, 0.5], mass=1, useMassSpring=1, useBendingSprings=1,
        springElasticStiffness=10, springDampingStiffness=1, springBendingStiffness=10,
        springDampingAllDirections=1, frictionCoeff=0.1, useSelfCollision=1, collisionMargin=0.05,
    )  # fmt: skip
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[2, 2, 0.1]), -1, [0, 0, -0.1])
    found = []
    for _ in range(4):
        for _ in range(25):
            p.stepSimulation()
        found.append(summary(nodes(p, ball)))
    return found


def record_colours_and_textures(p: Any, folder: Path) -> Any:
    """Colours in the four quarters of a cloth of a file with or without coordinates, and with a material."""
    picture = Image.new("RGB", (64, 64), (0, 0, 255))
    picture.paste((255, 0, 0), (0, 0, 31, 64))
    picture.paste((0, 255, 0), (0, 0, 31, 32))
    picture.save(folder / "four.png")
    (folder / "red.mtl").write_text("newmtl red\nKd 1 0 0\n")
    plain_lines = Path(write_cloth(folder / "plain.obj")).read_text().splitlines()
    mapped = [line for line in plain_lines if line.startswith("v ")]
    mapped += ["vt {} {}".format(*(0.5 + float(x) for x in line.split()[1:3])) for line in mapped]
    faces = [line.split()[1:] for line in plain_lines if line.startswith("f ")]
    mapped += ["f " + " ".join(f"{k}/{k}" for k in face) for face in faces]
    (folder / "mapped.obj").write_text("\n".join(mapped) + "\n")
    (folder / "red.obj").write_text("\n".join(["mtllib red.mtl", "usemtl red", *mapped]) + "\n")
    view = p.computeViewMatrix([0, 0, 3], [0, 0, 0], [0, 1, 0])
    lens = p.computeProjectionMatrixFOV(30, 1, 0.1, 9)

    def quarters() -> Any:
        image = p.getCameraImage(64, 64, view, lens, renderer=p.ER_TINY_RENDERER)[2]
        return np.reshape(image, (64, 64, 4))[24:41:16, 24:41:16, :3].tolist()

    found = []
    for name in ("plain", "mapped", "red"):
        p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)
        cloth = p.loadSoftBody(str(folder / f"{name}.obj"), mass=1, useMassSpring=1, collisionMargin=0.01)
        found.append(quarters())
        p.changeVisualShape(cloth, -1, textureUniqueId=p.loadTexture(str(folder / "four.png")))
        found.append(quarters())
        p.changeVisualShape(cloth, -1, rgbaColor=[1, 1, 0, 1])
        found.append(quarters())
        p.changeVisualShape(cloth, -1, textureUniqueId=-1)
        found.append(quarters())
    return found


def record_cloth_that_begins_half_in_a_box(p: Any, folder: Path) -> Any:
    found = []
    for tilt in (0.1, 1.5):
        p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)
        p.setGravity(0, 0, -9.8)
        shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[2, 2, 0.5])
        p.createMultiBody(0, shape, basePosition=[0, 0, -0.5])
        cloth = p.loadSoftBody(
            write_cloth(folder / "cloth.obj", 9), baseOrientation=p.getQuaternionFromEuler([0, tilt, 0]),
            mass=0.5, useMassSpring=1, springElasticStiffness=40, springDampingStiffness=0.1,
            useBendingSprings=1, springBendingStiffness=1, frictionCoeff=0.5, collisionMargin=0.01,
        )  # fmt: skip
        for count in (10, 30):
            for _ in range(count):
                p.stepSimulation()
            found.append(summary(nodes(p, cloth)))
    return found


def record_queries(p: Any, folder: Path) -> Any:
    cloth = pinned_cloth(p, folder)
    cube = p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), -1, [0, 2, 1])
    anchors = [p.createSoftBodyAnchor(cloth, 20, cube, -1, [0.5, -2.5, 0]), p.getNumConstraints()]
    p.removeConstraint(1)
    count, positions = p.getMeshData(cloth, -1, flags=p.MESH_DATA_SIMULATION_MESH)
    p.stepSimulation()
    p.resetBasePositionAndOrientation(cloth, [0, 0, 3], [0, 0, 0, 1])
    moved = p.getBasePositionAndOrientation(cloth)[0][2]
    return [
        [p.getNumBodies(), p.getNumJoints(cloth), [name.decode() for name in p.getBodyInfo(cloth)]],
        [anchors, p.getNumConstraints(), count, positions, moved],
        p.getMeshData(cloth, -1)[0],
        [p.rayTest([0.11, 0.1, 5], [0.11, 0.1, -5])[0][0], p.getClosestPoints(cloth, cube, 1.0)],
    ]


def record_errors(p: Any, folder: Path) -> Any:
    cloth = pinned_cloth(p, folder)
    cube = p.createMultiBody(1.0)
    return [
        message_of(lambda: p.loadSoftBody("there_is_no_such_file.obj")),
        message_of(lambda: p.createSoftBodyAnchor(cloth, 99, -1, -1)),
        message_of(lambda: p.createSoftBodyAnchor(cube, 0, -1, -1)),
        message_of(lambda: p.getTetraMeshData(cube)),
        message_of(lambda: p.resetMeshData(cube, [[0, 0, 0]])),
        message_of(lambda: p.getJointInfo(cloth, 0)),
        message_of(lambda: p.getCollisionShapeData(cloth, -1)),
    ]


def message_of(call: Callable[[], Any]) -> list[str]:
    try:
        return ["no error", repr(call())]
    except Exception as problem:
        return [type(problem).__name__, str(problem)]


def test_a_pinned_cloth_swings_as_in_pybullet(agrees: Callable[..., None]) -> None:
    agrees(record_swing, 1e-2)


def test_dampers_along_springs_as_in_pybullet(agrees: Callable[..., None]) -> None:
    agrees(record_swing_without_bending_springs, 1e-2)


def test_a_soft_block_bounces_and_slides_as_in_pybullet(agrees: Callable[..., None]) -> None:
    agrees(record_block_that_falls_on_its_foot, 1.5e-2)


def test_halves_of_a_cloth_lie_on_each_other_as_in_pybullet(agrees: Callable[..., None]) -> None:
    agrees(record_halves_of_a_cloth_on_each_other, 4e-3)


def test_a_strongly_damped_ball_falls_as_in_pybullet(agrees: Callable[..., None]) -> None:
    agrees(record_a_strongly_damped_ball_that_falls, 1e-2)


def test_colours_and_textures_of_soft_bodies(agrees: Callable[..., None]) -> None:
    agrees(record_colours_and_textures, 1)


def test_an_image_shows_its_middle_on_the_surface_of_a_solid(client: int, tmp_path: Path) -> None:
    p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)
    block = p.loadSoftBody(write_block(tmp_path / "block.vtk"), useNeoHookean=1, NeoHookeanMu=100)
    Image.new("RGB", (8, 8), (0, 255, 0)).save(tmp_path / "green.png")
    p.changeVisualShape(block, -1, textureUniqueId=p.loadTexture(str(tmp_path / "green.png")))
    view = p.computeViewMatrix([0, 0, 4], [0, 0, 0], [0, 1, 0])
    lens = p.computeProjectionMatrixFOV(30, 1, 0.1, 9)
    p.stepSimulation()
    image = np.reshape(p.getCameraImage(64, 64, view, lens)[2], (64, 64, 4))
    assert image[32, 32].tolist() == [0, 239, 0, 255]


def test_cloth_comes_slowly_out_of_a_box_as_in_pybullet(agrees: Callable[..., None]) -> None:
    agrees(record_cloth_that_begins_half_in_a_box, 2e-2)


def test_urdf_files_of_soft_bodies(agrees: Callable[..., None]) -> None:
    agrees(record_block_of_a_urdf, 1e-3)


def test_queries_of_soft_bodies(agrees: Callable[..., None]) -> None:
    agrees(record_queries, 1e-6)


def test_refusals_of_soft_bodies(agrees: Callable[..., None]) -> None:
    agrees(record_errors)


def test_nodes_can_be_moved(client: int, tmp_path: Path) -> None:
    cloth = pinned_cloth(p, tmp_path)
    goal = nodes(p, cloth) + np.array([1.0, 0.0, 0.5])
    p.resetMeshData(cloth, goal.tolist())
    np.testing.assert_allclose(nodes(p, cloth), goal, atol=1e-12)
    with pytest.raises(p.error, match="resetMeshData failed"):
        p.resetMeshData(cloth, goal[:3].tolist())


def test_friction_and_mass_change(client: int, tmp_path: Path) -> None:
    """On a plane tilted by 0.3 rad, sliding begins below a coefficient of tan 0.3 = 0.309."""
    slid = []
    for friction in (0.2, 0.4):
        p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)
        p.setGravity(9.81 * np.sin(0.3), 0, -9.81 * np.cos(0.3))
        floor = p.createMultiBody(
            0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 5, 0.5]), -1, [0, 0, -0.5]
        )
        p.changeDynamics(floor, -1, lateralFriction=1.0)
        cloth = p.loadSoftBody(
            write_cloth(tmp_path / "cloth.obj"), [0, 0, 0.02], useMassSpring=1, springElasticStiffness=40
        )
        p.changeDynamics(cloth, -1, lateralFriction=friction, mass=2.0)
        for _ in range(120):
            p.stepSimulation()
        slid.append(p.getBasePositionAndOrientation(cloth)[0][0])
    expected = 0.5 * 9.81 * (np.sin(0.3) - 0.2 * np.cos(0.3)) * 0.5**2
    assert slid[0] == pytest.approx(expected, rel=0.05)
    assert abs(slid[1]) < 1e-3


def test_states_of_soft_bodies_are_restored(client: int, tmp_path: Path) -> None:
    cloth = pinned_cloth(p, tmp_path)
    for _ in range(20):
        p.stepSimulation()
    state = p.saveState()
    ends = []
    for _ in range(2):
        p.restoreState(state)
        for _ in range(40):
            p.stepSimulation()
        ends.append(nodes(p, cloth))
    np.testing.assert_array_equal(ends[0], ends[1])


def test_removal_leaves_the_others_as_they_are(client: int, tmp_path: Path) -> None:
    cloth = pinned_cloth(p, tmp_path)
    cube = p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), -1, [0, 0, 5])
    for _ in range(10):
        p.stepSimulation()
    height = p.getBasePositionAndOrientation(cube)[0][2]
    p.removeBody(cloth)
    assert p.getNumConstraints() == 0 and p.getNumBodies() == 1
    assert p.getBasePositionAndOrientation(cube)[0][2] == height
    p.stepSimulation()


def test_cameras_see_the_deformed_surface(client: int, tmp_path: Path) -> None:
    cloth = pinned_cloth(p, tmp_path)
    view = p.computeViewMatrix([0, 0, 4], [0, 0, 0], [0, 1, 0])
    lens = p.computeProjectionMatrixFOV(30, 1, 0.1, 10)

    def seen() -> int:
        return int((np.array(p.getCameraImage(64, 64, view, lens)[4]) == cloth).sum())

    flat = seen()
    for _ in range(150):
        p.stepSimulation()
    assert 0 < seen() < 0.8 * flat


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.vtk", "not a grid", "begin"),
        ("a.vtk", GRID.replace("ASCII", "BINARY"), "binary"),
        ("a.vtk", f"{GRID}\nPOINTS 9999999999 float\n", "vertices"),
        ("a.obj", "v 0 0 0\n", "no faces"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "vertex 9"),
        ("a.stl", "solid", ".obj or .vtk"),
    ],
)  # fmt: skip
def test_files_that_are_refused(client: int, tmp_path: Path, name: str, content: str, message: str) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(p.error, match="Cannot load soft body") as caught:
        p.loadSoftBody(str(tmp_path / name))
    assert message in " ".join(caught.value.__notes__)
    assert p.getNumBodies() == 0


def test_mesh_of_another_file_follows_the_nodes(client: int, tmp_path: Path) -> None:
    """A visible box around the block keeps its distance from the nodes while these turn and move."""
    block = write_block(tmp_path / "block.vtk")
    skin = tmp_path / "skin.obj"
    skin.write_text("v 0.1 0.1 0.1\nv 0.1 -0.1 0.5\nv -0.1 0.1 0.3\nf 1 2 3\n")
    soft = p.loadSoftBody(str(skin), [0, 0, 1], simFileName=block, useNeoHookean=1, NeoHookeanMu=100, scale=1)
    before = np.array(p.getMeshData(soft, -1)[1])
    np.testing.assert_allclose(before, [[0.1, 0.1, 1.1], [0.1, -0.1, 1.5], [-0.1, 0.1, 1.3]], atol=1e-9)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    p.resetMeshData(soft, (nodes(p, soft) @ turn.T).tolist())
    np.testing.assert_allclose(p.getMeshData(soft, -1)[1], before @ turn.T, atol=1e-9)


def test_dynamics_of_soft_bodies_are_the_same_for_all_links(client: int, tmp_path: Path) -> None:
    """As in PyBullet, whose type of such a body is 3."""
    cloth = p.loadSoftBody(write_cloth(tmp_path / "cloth.obj"), mass=2.5, useMassSpring=1)
    answers = {p.getDynamicsInfo(cloth, link) for link in (-1, 0, 7)}
    assert len(answers) == 1
    assert answers.pop()[10] == 3

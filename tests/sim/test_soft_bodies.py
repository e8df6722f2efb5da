"""Soft bodies: forces against energies and NumPy, statics, contacts, anchors, editing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from roboyard.errors import RoboyardError, StaleHandleError
from roboyard.rendering import Camera
from roboyard.shapes.mesh import TriangleMesh
from roboyard.sim.soft.forces import force_calls
from roboyard.sim.soft.materials import NeoHookean, Springs
from roboyard.sim.soft.rest_shape import Lattice, Solid, lattice, right_handed, solid, surface_of
from roboyard.sim.soft.skin import embedded_skin
from roboyard.sim.soft.soft_body import SoftBody
from roboyard.sim.soft.stability import fastest_rates, parts_of_step
from roboyard.sim.world import World

Array = np.ndarray


def sheet(n: int = 5, size: float = 1.0) -> tuple[Array, Array]:
    """Nodes and triangles of a square in the x-y plane."""
    line = np.linspace(-size / 2, size / 2, n)
    nodes = np.array([(x, y, 0.0) for x in line for y in line])
    cells = []
    for i in range(n - 1):
        for j in range(n - 1):
            a = i * n + j
            cells += [(a, a + n, a + n + 1), (a, a + n + 1, a + 1)]
    return nodes, np.array(cells)


def cube(size: float = 0.4) -> tuple[Array, Array]:
    """Nodes and tetrahedra of a cube cut into six."""
    nodes = size * np.array([(a, b, c) for a in (0, 1) for b in (0, 1) for c in (0, 1)], dtype=float)
    cut = [(0, 4, 6, 7), (0, 6, 2, 7), (0, 2, 3, 7), (0, 3, 1, 7), (0, 1, 5, 7), (0, 5, 4, 7)]
    return nodes, np.array(cut)


def forces(part: Lattice | Solid, positions: Array, velocities: Array | None = None) -> Array:
    """The (n, 3) forces of the compiled loops."""
    found = np.zeros(positions.size)
    speed = np.zeros(positions.size) if velocities is None else velocities.ravel().copy()
    for function, arguments in force_calls([part], 0, 0, positions.copy(), speed, found):
        function(*arguments)
    return found.reshape(-1, 3)


def gradient(energy: Callable[[Array], float], positions: Array) -> Array:
    """Minus the derivative of an energy by the nodes, by central differences."""
    found, h = np.zeros_like(positions), 1e-6
    for index in np.ndindex(positions.shape):
        moved = positions.copy()
        moved[index] += h
        up = energy(moved)
        moved[index] -= 2 * h
        found[index] = -(up - energy(moved)) / (2 * h)
    return found


def deformed(nodes: Array, seed: int = 1) -> Array:
    return nodes * [1.1, 0.9, 1.05] + 0.02 * np.random.default_rng(seed).normal(size=nodes.shape)


def solid_of(material: NeoHookean) -> tuple[Array, Solid]:
    nodes, cells = cube()
    return nodes, solid(nodes, right_handed(nodes, cells), material)


def test_spring_forces_are_the_gradient_of_their_energy() -> None:
    nodes, cells = sheet()
    part = lattice(nodes, cells, Springs(stiffness=40.0, bending_stiffness=3.0))
    moved = deformed(nodes)

    def energy(x: Array) -> float:
        length = np.linalg.norm(x[part.ends[:, 1]] - x[part.ends[:, 0]], axis=1)
        return float((0.5 * part.stiffness * (length - part.length) ** 2).sum())

    np.testing.assert_allclose(forces(part, moved), gradient(energy, moved), atol=1e-6)
    assert len(part.ends) > len(np.unique(np.sort(cells[:, [0, 1]], axis=1), axis=0))


def test_neo_hookean_forces_are_the_gradient_of_the_papers_energy() -> None:
    """Smith, de Goes, Kim 2018, equation 14: mu/2 (I - 3) + lam/2 (J - a)² - mu/2 log(I + 1)."""
    mu, lam = 400.0, 600.0
    nodes, part = solid_of(NeoHookean(mu=mu, lam=lam))
    moved = deformed(nodes)
    alpha = 1 + mu / lam - mu / (4 * lam)

    def energy(x: Array) -> float:
        corners = x[part.nodes]
        sides = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
        gradients = sides @ part.inverse
        square, j = (gradients**2).sum(axis=(1, 2)), np.linalg.det(gradients)
        density = mu / 2 * (square - 3) + lam / 2 * (j - alpha) ** 2 - mu / 2 * np.log(square + 1)
        return float((part.volume * density).sum())

    np.testing.assert_allclose(forces(part, moved), gradient(energy, moved), atol=1e-5)
    np.testing.assert_allclose(forces(part, nodes), 0.0, atol=1e-9)


@pytest.mark.parametrize("every", [False, True])
def test_dampers_of_springs_as_in_numpy(every: bool) -> None:
    nodes, cells = sheet(3)
    springs = Springs(stiffness=0.0, damping=0.3, damps_all_directions=every, bending_stiffness=0.0)
    part = lattice(nodes, cells, springs)
    speed = np.random.default_rng(3).normal(size=nodes.shape)
    expected = np.zeros_like(nodes)
    for a, b in part.ends:
        relative, along = speed[b] - speed[a], nodes[b] - nodes[a]
        along = along / np.linalg.norm(along)
        force = 0.3 * (relative if every else along * (along @ relative))
        expected[a] += force
        expected[b] -= force
    np.testing.assert_allclose(forces(part, nodes, speed), expected, atol=1e-12)


def test_viscous_stress_as_in_numpy() -> None:
    mu, lam, time = 400.0, 600.0, 0.01
    nodes, part = solid_of(NeoHookean(mu=mu, lam=lam, damping=time))
    speed = np.random.default_rng(3).normal(size=nodes.shape)
    expected = np.zeros_like(nodes)
    for cell, inverse, volume in zip(part.nodes, part.inverse, part.volume, strict=True):
        rate = (speed[cell[1:]] - speed[cell[0]]).T @ inverse
        stress = time * (mu * (rate + rate.T) + lam * np.trace(rate) * np.eye(3))
        columns = -volume * stress @ inverse.T
        expected[cell[1:]] += columns.T
        expected[cell[0]] -= columns.sum(axis=1)
    np.testing.assert_allclose(forces(part, nodes, speed), expected, atol=1e-9)


def test_inner_forces_have_no_resultant() -> None:
    nodes, part = solid_of(NeoHookean(mu=400.0, lam=600.0, damping=0.01))
    moved, speed = deformed(nodes), np.random.default_rng(5).normal(size=nodes.shape)
    found = forces(part, moved, speed)
    np.testing.assert_allclose(found.sum(axis=0), 0.0, atol=1e-9)
    still = forces(part, moved)
    np.testing.assert_allclose(np.cross(moved, still).sum(axis=0), 0.0, atol=1e-9)


def test_fastest_rates_are_the_largest_eigenvalues() -> None:
    nodes, part = solid_of(NeoHookean(mu=400.0, lam=600.0, damping=0.01))
    masses, h = np.full(len(nodes), 0.2), 1e-6
    stiffness, damping = np.zeros((24, 24)), np.zeros((24, 24))
    for k in range(24):
        step = np.zeros(24)
        step[k] = 1.0
        stiffness[:, k] = -forces(part, nodes + h * step.reshape(-1, 3)).ravel() / h
        damping[:, k] = -forces(part, nodes, step.reshape(-1, 3)).ravel()
    squared, rate = fastest_rates(nodes, masses, (part,))
    assert squared == pytest.approx(np.linalg.eigvals(stiffness / 0.2).real.max(), rel=0.02)
    assert rate == pytest.approx(np.linalg.eigvals(damping / 0.2).real.max(), rel=0.02)
    assert parts_of_step(1e-6, squared, rate) == 1
    assert parts_of_step(0.1, squared, rate) > 5


def test_surface_and_orientation_of_tetrahedra() -> None:
    nodes, cells = cube()
    flipped = cells.copy()
    flipped[::2] = flipped[::2][:, [1, 0, 2, 3]]
    turned = right_handed(nodes, flipped)
    triangles = surface_of(turned)
    assert len(triangles) == 12
    corners = nodes[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", normals, corners.mean(axis=1) - nodes.mean(axis=0)) > 0).all()


def test_a_skin_follows_affine_motion() -> None:
    nodes, cells = cube()
    points = np.random.default_rng(2).uniform(0.05, 0.35, size=(30, 3))
    mesh = TriangleMesh(vertices=points, faces=np.arange(30, dtype=np.int32).reshape(-1, 3))
    skin = embedded_skin(mesh, nodes, cells)
    change = np.array([[1.1, 0.2, 0.0], [0.0, 0.9, 0.1], [0.3, 0.0, 1.0]])
    np.testing.assert_allclose(skin.vertices(nodes @ change.T + 1.0), points @ change.T + 1.0, atol=1e-9)


# ------------------------------------------------------------------------------------------------ in a world


def add_sheet(world: World, height: float = 0.5, **options: Any) -> SoftBody:
    nodes, cells = sheet()
    material = Springs(stiffness=60.0, damping=0.1, damps_all_directions=True, bending_stiffness=0.5)
    return world.add_soft_body(nodes, cells, (0, 0, height), material=material, **options)


def test_a_free_body_falls_and_keeps_its_shape() -> None:
    world = World()
    nodes, cells = cube()
    body = world.add_soft_body(nodes, cells, (0, 0, 5), material=NeoHookean(mu=2e3, lam=2e3), mass=2.0)
    start = body.positions
    world.step(120)
    fallen = start - body.positions
    assert fallen[:, 2] == pytest.approx(0.5 * 9.81 * 0.5**2, rel=0.01)
    np.testing.assert_allclose(np.ptp(fallen, axis=0), 0.0, atol=1e-9)
    np.testing.assert_allclose(body.velocities[:, 2], -9.81 * 0.5, rtol=1e-9)


def test_a_hanging_spring_stretches_by_its_weight() -> None:
    """Two triangles in a strip: the lower node of 0.1 kg hangs on two springs of 50 N/m at an angle."""
    world = World()
    nodes = np.array([(-0.3, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.0, -0.4)])
    body = world.add_soft_body(
        nodes, [(0, 1, 2)], (0, 0, 1), mass=0.3, material=Springs(stiffness=50.0, damping=1.0)
    )
    body.anchor(0)
    body.anchor(1)
    world.step(2000)
    drop = body.positions[2, 2] - 1.0
    length = np.hypot(0.3, drop)
    up = 2 * 50.0 * (length - 0.5) * (-drop / length)
    assert up == pytest.approx(0.1 * 9.81, rel=1e-3)


def test_cloth_drapes_over_a_box() -> None:
    world = World()
    world.add_plane()
    world.add_box((0.8, 0.8, 0.3), (0, 0, 0.15), mass=0.0)
    cloth = add_sheet(world, 0.35, radius=0.01)
    world.step(480)
    nodes = cloth.positions
    on_top = (np.abs(nodes[:, :2]) < 0.35).all(axis=1)
    assert on_top.sum() == 9
    assert np.median(nodes[on_top, 2]) == pytest.approx(0.31, abs=1e-3)
    assert nodes[on_top, 2].min() > 0.309
    assert nodes[~on_top, 2].max() < 0.31
    assert any(contact.body_a is cloth.body or contact.body_b is cloth.body for contact in world.contacts())


def test_a_soft_block_carries_a_box() -> None:
    """A block carries a box of 1 kg, and rays see its surface."""
    world = World()
    world.add_plane()
    nodes, cells = cube()
    stiff = NeoHookean(mu=2e4, lam=2e4, damping=0.02)
    block = world.add_soft_body(nodes, cells, (-0.2, -0.2, 0.01), material=stiff, radius=0.01)
    box = world.add_box((0.2, 0.2, 0.2), (0, 0, 0.54))
    world.step(480)
    assert 0.45 < box.position[2] < 0.53
    assert np.abs(block.velocities).max() < 0.01
    hit = world.ray((0.15, 0.15, 1.0), (0.15, 0.15, -1.0))
    assert hit is not None and hit.body is block.body
    assert 0.35 < hit.position[2] < 0.42


def test_anchors_hold_let_go_and_vanish_with_their_link() -> None:
    world = World()
    cloth = add_sheet(world, 1.0)
    corner = cloth.positions[0]
    first = cloth.anchor(0)
    box = world.add_box((0.1, 0.1, 0.1), (0.5, 0.5, 1.0), mass=0.5)
    cloth.anchor(24, box.links[0])
    world.step(100)
    np.testing.assert_allclose(cloth.positions[0], corner, atol=2e-3)
    assert np.linalg.norm(cloth.positions[24] - box.position) < 0.01
    world.remove(box)
    assert [anchor.node for anchor in cloth.anchors] == [0]
    cloth.release(first)
    world.step(50)
    assert cloth.positions[0, 2] < corner[2] - 0.1
    with pytest.raises(StaleHandleError):
        cloth.release(first)


def test_states_survive_edits_and_are_restored_bit_for_bit() -> None:
    world = World()
    cloth = add_sheet(world, 1.0)
    cloth.anchor(0)
    world.step(30)
    before = cloth.positions
    box = world.add_box((0.1, 0.1, 0.1), (3, 0, 1))
    np.testing.assert_array_equal(cloth.positions, before)
    state = world.save_state()
    world.step(30)
    after = cloth.positions
    world.restore_state(state)
    world.step(30)
    np.testing.assert_array_equal(cloth.positions, after)
    world.remove(cloth.body)
    world.step()
    assert world.model.nflex == 0 and box.position[2] < 1.0


def test_pose_and_pictures_follow_the_nodes() -> None:
    world = World()
    cloth = add_sheet(world, 1.0, rgba=(1.0, 0.0, 0.0, 1.0))
    cloth.set_pose((0.0, 0.0, 2.0), (0.0, 0.0, np.sin(0.25), np.cos(0.25)))
    centre, turn = cloth.pose
    np.testing.assert_allclose(centre, (0, 0, 2), atol=1e-9)
    np.testing.assert_allclose(turn, (0, 0, np.sin(0.25), np.cos(0.25)), atol=1e-9)
    camera = Camera.look_at((0, 0, 5), (0, 0, 0), up=(0, 1, 0), width=64, height=64)
    seen = (world.render(camera).segmentation[..., 0] == cloth.body.id).sum()
    cloth.positions = cloth.positions * [0.5, 0.5, 1.0]
    assert 0 < (world.render(camera).segmentation[..., 0] == cloth.body.id).sum() < 0.5 * seen


def test_what_cannot_be_a_soft_body_is_refused() -> None:
    world = World()
    nodes, cells = sheet(3)
    springs = Springs(stiffness=1.0)
    with pytest.raises(RoboyardError, match="at least 0"):
        Springs(stiffness=-1.0)
    with pytest.raises(RoboyardError, match="node 9 belongs to no element"):
        world.add_soft_body(np.vstack([nodes, [(5, 5, 5)]]), cells, material=springs)
    with pytest.raises(RoboyardError, match="nodes 0 to 8"):
        world.add_soft_body(nodes, [*cells.tolist(), (0, 1, 99)], material=springs)
    with pytest.raises(RoboyardError, match="needs tetrahedra"):
        world.add_soft_body(nodes, cells, material=NeoHookean(mu=1.0, lam=1.0))
    with pytest.raises(RoboyardError, match="mass"):
        world.add_soft_body(nodes, cells, material=springs, mass=0.0)
    with pytest.raises(RoboyardError, match="no volume"):
        world.add_soft_body(nodes, [(0, 1, 2, 3)], material=springs)
    assert not world.bodies
    cloth = world.add_soft_body(nodes, cells, material=springs)
    with pytest.raises(RoboyardError, match="nodes 0 to 8"):
        cloth.anchor(9)
    with pytest.raises(RoboyardError, match="shape"):
        cloth.positions = np.zeros((2, 3))

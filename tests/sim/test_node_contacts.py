"""Contacts of soft bodies with shapes at single nodes, against the nodes' weights."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.sim.physics_profile import BULLET, PLAIN, PhysicsProfile
from roboyard.sim.soft.kernels import limit_push
from roboyard.sim.soft.materials import Springs
from roboyard.sim.world import World


def strip() -> tuple[np.ndarray, np.ndarray]:
    """Nodes and triangles of three by three nodes, whose middle is a node of six triangles."""
    nodes = np.array([(x, y, 0.0) for x in (-0.2, 0.0, 0.2) for y in (-0.2, 0.0, 0.2)])
    cells = [(a, a + 3, a + 4) for a in (0, 1, 3, 4)] + [(a, a + 4, a + 1) for a in (0, 1, 3, 4)]
    return nodes, np.array(cells)


@pytest.mark.parametrize("profile", [PLAIN, BULLET], ids=["plain", "bullet"])
def test_a_node_on_a_box_has_one_contact_with_its_weight(profile: PhysicsProfile) -> None:
    """Each of several triangles touches the box there; the springs are loose, so no node carries another."""
    world = World(profile=profile)
    world.add_box((1.0, 1.0, 0.2), (0, 0, 0.1), mass=0.0)
    nodes, cells = strip()
    material = Springs(stiffness=1.0, damping=0.1, damps_all_directions=True)
    cloth = world.add_soft_body(nodes, cells, (0, 0, 0.215), material=material, mass=0.9, radius=0.01)
    world.step(240)
    contacts = world.contacts()
    assert len(contacts) == len(nodes)
    places = np.array([contact.position[:2] for contact in contacts])
    apart = np.linalg.norm(places[:, None] - cloth.positions[None, :, :2], axis=2)
    order = apart.argmin(axis=1)
    assert sorted(order) == list(range(len(nodes)))
    forces = [contact.normal_force for contact in contacts]
    np.testing.assert_allclose(forces, cloth.masses[order] * 9.81, rtol=2e-2)


def test_a_tilted_triangle_rests_on_the_node_that_touches() -> None:
    """The lowest node alone touches: its contact carries it, and the others fall as if it were not there."""
    world = World(profile=BULLET)
    world.add_box((1.0, 1.0, 0.2), (0, 0, 0.1), mass=0.0)
    nodes = np.array([(0.0, 0.0, 0.0), (0.3, 0.0, 0.3), (0.0, 0.3, 0.3)])
    cloth = world.add_soft_body(
        nodes, np.array([(0, 1, 2)]), (0, 0, 0.21), material=Springs(stiffness=1e-6, damping=0.0), radius=0.01
    )
    world.step(24)
    fall = -9.81 * 24 / 240
    np.testing.assert_allclose(cloth.velocities[:, 2], [0.0, fall, fall], atol=1e-3)


def test_speeds_out_of_a_shape_are_bounded_as_in_numpy() -> None:
    """Of soft bodies that have rows; the wanted speed is that before and time step times reference."""
    rng, h, largest = np.random.default_rng(3), 0.004, 0.1
    address = np.array([0, -1, 3, 6, 9], np.int32)
    flex = np.array([(-1, 0), (-1, 0), (-1, -1), (1, 0), (0, -1)], np.int32)
    velocity, base = rng.normal(size=12), rng.normal(size=12) / h
    reference = base - rng.uniform(size=12)
    expected, others = base.copy(), reference.copy()
    for row in (0, 6, 9):
        expected[row] = min(velocity[row] + h * base[row], largest) / h - velocity[row] / h
        others[row] += expected[row] - base[row]
    assert (expected != base).any()
    limit_push(address, flex, velocity, h, largest, base, reference)
    np.testing.assert_allclose(base, expected, atol=1e-9)
    np.testing.assert_allclose(reference, others, atol=1e-9)

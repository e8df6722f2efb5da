"""Friction, restitution and drag, against closed forms."""

import numpy as np
import pytest

from roboyard.errors import RoboyardError
from roboyard.sim import World
from roboyard.sim.physics_profile import BULLET, PLAIN


def _floor(world, profile):
    """Return a floor; for Bullet's rules a box, since of a body on a plane they find one corner in a step."""
    if profile is BULLET:
        return world.add_box((20, 20, 0.2), (0, 0, -0.1), mass=0.0)
    return world.add_plane()


@pytest.mark.parametrize("profile", [PLAIN, BULLET], ids=["plain", "bullet"])
@pytest.mark.parametrize("direction", [0.0, 0.5, 1.2])
def test_a_sliding_box_slows_at_mu_g_in_every_direction(profile, direction):
    world = World(profile=profile)
    floor = _floor(world, profile)
    box = world.add_box((0.4, 0.4, 0.1), (0, 0, 0.05), friction=0.5)
    floor.links[0].friction = 1.0 if profile is BULLET else 0.5
    world.step(120)
    box.set_velocity((2 * np.cos(direction), 2 * np.sin(direction), 0))
    world.step(48)
    speed = np.linalg.norm(box.velocity[0])
    assert speed == pytest.approx(2 - 0.5 * 9.81 * 0.2, abs=0.03)
    assert box.position[2] == pytest.approx(0.05, abs=1e-4 if profile is BULLET else 2e-4)


def test_hard_contacts_do_not_lift_sliding_bodies():
    world = World(profile=BULLET)
    _floor(world, BULLET).links[0].friction = 1.0
    box = world.add_box((1, 1, 1), (0, 0, 0.5), friction=0.5)
    world.step(60)
    box.set_velocity((2, 1, 0))
    heights = []
    for _ in range(60):
        world.step()
        heights.append(box.position[2])
    assert max(heights) < 0.5005 and min(heights) > 0.4995


def test_friction_in_the_bullet_profile_is_the_product():
    world = World(profile=BULLET)
    _floor(world, BULLET).links[0].friction = 0.8
    box = world.add_box((0.4, 0.4, 0.1), (0, 0, 0.05), friction=0.25)
    world.step(60)
    box.set_velocity((1, 0, 0))
    world.step(24)
    assert box.velocity[0][0] == pytest.approx(1 - 0.2 * 9.81 * 0.1, abs=5e-3)


@pytest.mark.parametrize(
    ("profile", "e", "height", "error"),
    [
        (PLAIN, 0.5, 0.25, 0.0125),
        (PLAIN, 0.9, 0.81, 0.04),
        (BULLET, 0.5, 0.226168, 1e-6),
        (BULLET, 0.9, 0.767274, 1e-6),
    ],
    ids=["plain-0.5", "plain-0.9", "bullet-0.5", "bullet-0.9"],
)
def test_a_sphere_bounces_by_its_restitution(profile, e, height, error):
    """In a plain world by its square, in Bullet's as with PyBullet 3.2.7, which stops it before."""
    world = World(profile=profile, timestep=1e-3)
    floor = world.add_plane()
    ball = world.add_sphere(0.1, (0, 0, 1.1))
    floor.links[0].restitution = 1.0
    ball.links[0].restitution = e
    heights = []
    for _ in range(1400):
        world.step()
        heights.append(ball.position[2])
    after = np.array(heights[480:])
    assert after[: int(1000 * e * 0.9)].max() - 0.1 == pytest.approx(height, abs=error)


def test_restitution_has_bounds():
    ball = World().add_sphere(0.1)
    with pytest.raises(RoboyardError, match="between 0 and 1"):
        ball.links[0].restitution = 1.5


def test_drag_slows_exponentially():
    world = World(gravity=(0, 0, 0), timestep=1e-3)
    ball = world.add_sphere(0.1)
    ball.links[0].set_damping(linear=0.5, angular=0.8)
    ball.set_velocity((2, 0, 0), (0, 0, 3))
    world.step(1000)
    linear, angular = ball.velocity
    assert linear[0] == pytest.approx(2 * np.exp(-0.5), rel=1e-3)
    assert angular[2] == pytest.approx(3 * np.exp(-0.8), rel=1e-3)


def test_quadratic_drag_matches_bullets_recorded_flight():
    """A box thrown at (3, -1, 2) m/s under 9.81: PyBullet 3.2.7's velocity after 240 steps."""
    world = World(profile=BULLET)
    box = world.add_box((0.2, 0.2, 0.2), (0, 0, 50))
    world.surfaces.set_damping(box.links[0], 0.04, 0.04, linear_quadratic=0.04, angular_quadratic=0.04)
    box.set_velocity((3, -1, 2))
    world.step(240)
    np.testing.assert_allclose(box.velocity[0], [2.40160, -0.80053, -7.06465], atol=2e-4)


def test_a_spinning_body_with_bullets_drag():
    """A spin of 4 rad/s is 3.3217 rad/s after one second in PyBullet 3.2.7."""
    world = World(profile=BULLET, gravity=(0, 0, 0))
    box = world.add_box((0.2, 0.2, 0.2))
    world.surfaces.set_damping(box.links[0], 0.04, 0.04, linear_quadratic=0.04, angular_quadratic=0.04)
    box.set_velocity(None, (0, 0, 4))
    world.step(240)
    assert box.velocity[1][2] == pytest.approx(3.3217, abs=2e-4)


def test_kernels_agree_with_plain_numpy():
    from roboyard.sim.stepping import kernels

    rng = np.random.default_rng(3)
    n = 5
    damping = rng.random((n, 4))
    mass, inertia = rng.random(n) + 0.1, rng.random((n, 3))
    rootid = np.zeros(n, dtype=np.int32)
    cvel, xipos = rng.normal(size=(n, 6)), rng.normal(size=(n, 3))
    ximat = np.stack([np.linalg.qr(rng.normal(size=(3, 3)))[0].ravel() for _ in range(n)])
    com = rng.normal(size=(n, 3))
    xfrc = np.zeros((n, 6))
    kernels.add_damping(damping, mass, inertia, rootid, cvel, xipos, ximat, com, xfrc)
    for b in range(1, n):
        w = cvel[b, :3]
        v = cvel[b, 3:] + np.cross(w, xipos[b] - com[0])
        r = ximat[b].reshape(3, 3)
        force = -mass[b] * v * (damping[b, 0] + damping[b, 1] * np.linalg.norm(v))
        torque = -(r @ np.diag(inertia[b]) @ r.T @ w) * (damping[b, 2] + damping[b, 3] * np.linalg.norm(w))
        np.testing.assert_allclose(xfrc[b], np.concatenate([force, torque]), atol=1e-12)

"""Mechanisms that turn fast do not gain energy."""

import mujoco
import numpy as np
import pytest
from sim_robots import rod

from roboyard.description.model import Inertial, Joint, Link, Pose, RobotDescription
from roboyard.sim import World


def _tumbler() -> RobotDescription:
    """A body with three different moments of inertia and two limbs on free hinges."""
    base = Link(name="base", inertial=Inertial(mass=2.0, inertia=(0.027, 0, 0, 0.007, 0, 0.033)))
    joints = tuple(
        Joint(
            name=name,
            type="continuous",
            parent="base",
            child=name,
            axis=(0, 1, 0),
            origin=Pose(position=(x, 0, 0)),
        )
        for name, x in (("left", 0.2), ("right", -0.2))
    )
    limbs = tuple(rod(joint.child, mass=0.3, length=0.2) for joint in joints)
    return RobotDescription(name="tumbler", links=(base, *limbs), joints=joints)


def _energy(world: World) -> float:
    data = mujoco.MjData(world.model)
    data.qpos[:], data.qvel[:] = world.data.qpos, world.data.qvel
    mujoco.mj_forward(world.model, data)
    mujoco.mj_energyVel(world.model, data)
    return float(data.energy[1])


@pytest.mark.parametrize("speed", [15.0, 40.0, 100.0])
def test_a_robot_that_tumbles_in_weightlessness_gains_no_energy(speed):
    world = World(gravity=(0, 0, 0))
    body = world.add_urdf(_tumbler(), fixed_base=False)
    body.set_velocity((0, 0, 0), (speed, 0.05 * speed, 0.05 * speed))
    energies = [_energy(world)]
    for _ in range(20):
        world.step(120)
        energies.append(_energy(world))
    assert max(energies) < 1.2 * energies[0]
    assert np.isfinite(world.data.qvel).all()


def test_slow_mechanisms_and_single_bodies_keep_the_cheap_integrator():
    world = World(gravity=(0, 0, 0))
    body = world.add_urdf(_tumbler(), fixed_base=False)
    box = world.add_box((0.1, 0.2, 0.3), (2, 0, 0))
    box.set_velocity((0, 0, 0), (100, 5, 5))
    kinds = mujoco.mjtIntegrator
    found = []
    for speed in (1.0, 50.0, 1.0):
        body.set_velocity((0, 0, 0), (speed, 0, 0))
        body.joint_velocities = (0.0, 0.0)
        world.step()
        found.append(int(world.live_model.opt.integrator))
    assert found == [kinds.mjINT_IMPLICITFAST, kinds.mjINT_IMPLICIT, kinds.mjINT_IMPLICITFAST]

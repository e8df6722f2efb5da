"""Drives without gains of their own: how they move a joint, and how quiet they keep a robot on the floor."""

import numpy as np
import pytest
from sim_robots import pendulum

from roboyard import World
from roboyard.description.model import (
    Box,
    Collision,
    Inertial,
    Joint,
    Limit,
    Link,
    Pose,
    RobotDescription,
    Sphere,
)
from roboyard.sim import Body

FREQUENCY = 2 * np.pi * 8.0
"""rad/s of every joint under the usual gains."""


def critically_damped(t: float) -> float:
    """Share of a step of the target that is left after t seconds."""
    return (1 + FREQUENCY * t) * np.exp(-FREQUENCY * t)


def weightless(limit: Limit | None = None) -> tuple[World, Body]:
    world = World(gravity=(0, 0, 0), timestep=1e-4)
    return world, world.add_urdf(pendulum(limit=limit), fixed_base=True)


@pytest.mark.parametrize("effort", [None, 200.0, 2000.0])
def test_every_joint_is_critically_damped_at_eight_hertz(effort: float | None) -> None:
    """However strong: the motor's inertia grows with its effort."""
    limit = None if effort is None else Limit(lower=-9, upper=9, effort=effort, velocity=9)
    world, swing = weightless(limit)
    hinge = swing.joint("hinge")
    hinge.drive_position(0.1)
    for steps in (100, 200, 400):
        world.step(steps)
        assert 1 - hinge.position / 0.1 == pytest.approx(critically_damped(world.time), abs=4e-3)


def test_motor_inertia_is_removed_with_the_drive() -> None:
    """It is not in `armature`, outlives a new compilation, and leaves with the next kind of drive."""
    world, swing = weightless(Limit(lower=-9, upper=9, effort=2000.0, velocity=9))
    hinge = swing.joint("hinge")
    hinge.armature = 0.25
    hinge.drive_position(0.1)
    assert hinge.armature == pytest.approx(0.25)
    world.add_box((1, 1, 1), (5, 5, 5))
    hinge.drive_position(0.1)
    world.step(400)
    assert 1 - hinge.position / 0.1 == pytest.approx(critically_damped(world.time), abs=4e-3)
    hinge.position, hinge.velocity = 0.0, 0.0
    hinge.drive_effort(1.0)
    world.step(1000)
    assert hinge.velocity == pytest.approx(0.1 / (1 / 3 + 0.25), rel=1e-3)


def quadruped() -> RobotDescription:
    """60 kg on four legs whose light shanks have strong knees."""

    def block(mass: float, size: tuple[float, float, float], z: float) -> Inertial:
        x, y, height = (side**2 * mass / 12 for side in size)
        return Inertial(
            mass=mass, origin=Pose(position=(0, 0, z)), inertia=(y + height, 0, 0, x + height, 0, x + y)
        )

    trunk = (0.8, 0.3, 0.2)
    links = [
        Link(name="base", inertial=block(60, trunk, 0), collisions=(Collision(geometry=Box(size=trunk)),))
    ]
    joints = []
    foot = Collision(geometry=Sphere(radius=0.02), origin=Pose(position=(0, 0, -0.33)))
    for name, x, y in (("fl", 1, 1), ("fr", 1, -1), ("hl", -1, 1), ("hr", -1, -1)):
        links += [
            Link(name=f"{name}_thigh", inertial=block(2.6, (0.06, 0.06, 0.35), -0.175)),
            Link(name=f"{name}_shank", inertial=block(0.9, (0.04, 0.04, 0.33), -0.125), collisions=(foot,)),
        ]
        strong = Limit(lower=-2.5, upper=2.5, effort=150, velocity=12)
        ends = (("hip", "base", f"{name}_thigh", (0.37 * x, 0.2 * y, 0)),)
        ends += (("knee", f"{name}_thigh", f"{name}_shank", (0, 0, -0.35)),)
        joints += [
            Joint(
                name=f"{name}_{kind}",
                type="revolute",
                parent=parent,
                child=child,
                origin=Pose(position=place),
                axis=(0, 1, 0),
                limit=strong,
            )
            for kind, parent, child, place in ends
        ]
    return RobotDescription(name="quadruped", links=tuple(links), joints=tuple(joints))


def test_a_legged_robot_comes_to_rest() -> None:
    """Without motors its knees chatter at 0.5 rad/s."""
    world = World()
    world.add_plane()
    robot = world.add_urdf(quadruped(), (0, 0, 0.72))
    robot.joint_positions = {
        joint.name: (0.4 if "hip" in joint.name else -0.8) * (1 if joint.name[0] == "f" else -1)
        for joint in robot.joints
    }
    for joint in robot.joints:
        joint.drive_position(joint.position)
    world.step(960)
    fastest = 0.0
    for _ in range(120):
        world.step()
        fastest = max(fastest, float(np.abs(robot.joint_velocities).max()))
    assert fastest < 0.01


def test_armature_set_at_run_time_equals_one_set_before() -> None:
    """Values that MuJoCo derives from the inertia of a joint and of all joints coupled with it."""
    derived = []
    for live in (True, False):
        world = World()
        body = world.add_urdf(quadruped(), position=(0, 0, 1))
        if live:
            world.step(3)
        for joint in body.joints[::2]:
            joint.armature = 0.02
        world.step()
        model = world.model
        derived.append((model.dof_M0, model.dof_invweight0, model.body_invweight0, model.actuator_acc0))
    for running, fresh in zip(*derived, strict=True):
        assert running == pytest.approx(fresh, rel=1e-9)

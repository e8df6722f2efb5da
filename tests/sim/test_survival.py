"""A world after errors: lack of memory, explosions, numbers that are not finite, states that are restored."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from roboyard.description.model import Inertial, Pose
from roboyard.errors import ModelError, RoboyardError
from roboyard.sim import World, compiled_world
from roboyard.sim.body import Body

HINGE = """<mujoco><worldbody><body name="arm"><joint name="j" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 0 0 0.5" size="0.05"/></body></worldbody></mujoco>"""


def heap(count: int) -> World:
    """Boxes in one place: every pair touches."""
    world = World(solver="newton")
    world.add_plane()
    for _ in range(count):
        world.add_box((0.2, 0.2, 0.2), (0, 0, 0.1), mass=1)
    return world


def heights(world: World) -> np.ndarray:
    return np.array([body.position for body in world.bodies[1:]])


@pytest.fixture
def little_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled_world, "MEMORY_PER_GEOM", 1)
    monkeypatch.setattr(compiled_world, "MEMORY_LEAST", 300_000)


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("at_once", [True, False])
def test_memory_grows_and_the_steps_are_those_of_a_world_with_enough(
    monkeypatch: pytest.MonkeyPatch, restitution: float, at_once: bool
) -> None:
    def run() -> tuple[float, np.ndarray]:
        world = heap(12)
        world.bodies[1].links[0].restitution = restitution
        for n in [20] if at_once else [1] * 20:
            world.step(n)
        return world.time, heights(world)

    time, expected = run()
    monkeypatch.setattr(compiled_world, "MEMORY_PER_GEOM", 1)
    monkeypatch.setattr(compiled_world, "MEMORY_LEAST", 100_000)
    grown_time, found = run()
    assert grown_time == pytest.approx(time, abs=1e-12)
    assert np.abs(found - expected).max() < 1e-6


@pytest.mark.usefixtures("little_memory")
def test_a_world_without_memory_left_says_so_twice_and_goes_on_when_bodies_leave(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(compiled_world, "MEMORY_MOST", 300_000)
    world = heap(30)
    before = heights(world)
    for _ in range(2):
        with pytest.raises(ModelError, match=r"more than .* MiB; move bodies apart"):
            world.step(5)
        assert (heights(world) == before).all()
    state = world.save_state()
    world.restore_state(state)
    for body in world.bodies[2:]:
        world.remove(body)
    world.step(5)
    assert world.time == pytest.approx(5 * world.timestep)
    assert world.contact_arrays().distance.size > 0


def test_an_explosion_is_reported_at_the_body_and_step_where_it_began() -> None:
    def bomb() -> tuple[World, Body]:
        world = World()
        world.add_sphere(0.1, (0, 0, 5), mass=1)
        bad = world.add_sphere(0.1, (9, 0, 5), mass=1, name="bad")
        world.step(10)
        bad.set_velocity((1e200, 0, 0))
        return world, bad

    for many in (1, 1000):
        world, bad = bomb()
        with pytest.raises(ModelError, match=r"diverged at 0\.0(4|2)\d* s: body 'bad'") as error:
            world.step(many)
        assert f"at {10 * world.timestep:.4f} s" in str(error.value)
        for place, body in enumerate(world.bodies):
            body.set_pose((9 * place, 0, 5), (0, 0, 0, 1))
            body.set_velocity((0, 0, 0), (0, 0, 0))
        world.step(3)
        bad.set_velocity((1e200, 0, 0))
        with pytest.raises(ModelError, match="body 'bad'"):
            world.step()


def inertial(**changed: Any) -> Inertial:
    return replace(Inertial(mass=1.0, origin=Pose(), inertia=(1, 0, 0, 1, 0, 1)), **changed)


NAN, INF = float("nan"), float("inf")
REFUSED: dict[str, Callable[[World], object]] = {
    "step": lambda w: w.step(-1),
    "step nan": lambda w: w.step(NAN),  # type: ignore[arg-type]
    "timestep": lambda w: setattr(w, "timestep", INF),
    "gravity": lambda w: setattr(w, "gravity", (0, 0, NAN)),
    "new timestep": lambda w: World(timestep=INF),
    "new gravity": lambda w: World(gravity=(0, 0, INF)),
    "limits": lambda w: w.bodies[0].joints[0].set_limits(NAN, NAN),
    "lower limit": lambda w: w.bodies[0].joints[0].set_limits(NAN, 1),
    "infinite limits": lambda w: w.bodies[0].joints[0].set_limits(-INF, INF),
    "joint position": lambda w: setattr(w.bodies[0].joints[0], "position", NAN),
    "joint velocity": lambda w: setattr(w.bodies[0].joints[0], "velocity", INF),
    "joint positions": lambda w: setattr(w.bodies[0], "joint_positions", [NAN]),
    "joint velocities": lambda w: setattr(w.bodies[0], "joint_velocities", [NAN]),
    "joint damping": lambda w: setattr(w.bodies[0].joints[0], "damping", INF),
    "armature": lambda w: setattr(w.bodies[0].joints[0], "armature", INF),
    "velocity": lambda w: w.bodies[1].set_velocity((NAN, 0, 0)),
    "angular velocity": lambda w: w.bodies[1].set_velocity(angular=(0, INF, 0)),
    "pose": lambda w: w.bodies[1].set_pose((0, 0, NAN)),
    "force": lambda w: w.bodies[1].links[0].apply_wrench((NAN, 0, 0)),
    "torque": lambda w: w.bodies[1].links[0].apply_wrench(torque=(0, 0, INF)),
    "point of a force": lambda w: w.bodies[1].links[0].apply_wrench((1, 0, 0), point=(0, 0, NAN)),
    "restitution": lambda w: setattr(w.bodies[1].links[0], "restitution", NAN),
    "friction": lambda w: setattr(w.bodies[1].links[0], "friction", INF),
    "frictionless": lambda w: w.bodies[1].links[0].set_frictionless(INF),
    "flattened": lambda w: w.bodies[1].links[0].flatten_spheres(NAN),
    "drag": lambda w: w.bodies[1].links[0].set_damping(linear=NAN),
    "position": lambda w: w.add_box((1, 1, 1), (0, 0, NAN)),
    "orientation": lambda w: w.add_box((1, 1, 1), orientation=(0, 0, 0, NAN)),
    "infinite turn": lambda w: w.bodies[1].set_pose(orientation=(0, 0, 0, INF)),
    "infinite turn of a box": lambda w: w.add_box((1, 1, 1), orientation=(0, INF, 0, 1)),
    "radius beyond numbers": lambda w: w.add_sphere(1e308),
    "length beyond numbers": lambda w: w.add_cylinder(0.1, 1e308),
    "friction of a plane": lambda w: w.add_plane(friction=NAN),
    "friction of a new box": lambda w: w.add_box((1, 1, 1), friction=INF),
    "mass": lambda w: w.bodies[1].links[0].set_inertial(inertial(mass=NAN)),
    "moment": lambda w: w.bodies[1].links[0].set_inertial(inertial(inertia=(INF, 0, 0, 1, 0, 1))),
    "centre of mass": lambda w: (
        w.bodies[1].links[0].set_inertial(inertial(origin=Pose(position=(0, NAN, 0))))
    ),
    "weld": lambda w: w.constraints.add_weld(w.bodies[1].links[0], None, position_b=(0, 0, NAN)),
    "turned weld": lambda w: w.constraints.add_weld(w.bodies[1].links[0], None, orientation_b=(0, 0, INF, 1)),
    "point": lambda w: w.constraints.add_point(w.bodies[1].links[0], None, position_a=(INF, 0, 0)),
    "slide": lambda w: w.constraints.add_slide(w.bodies[1].links[0], None, (INF, 0, 0)),
    "largest force": lambda w: w.constraints.add_weld(w.bodies[1].links[0], None, max_force=NAN),
    "scale": lambda w: w.add_urdf("none.urdf", scale=NAN),
}


@pytest.mark.parametrize("name", REFUSED)
def test_numbers_that_are_not_finite_are_refused_where_they_are_given(name: str) -> None:
    world = World()
    world.add_mjcf(HINGE)
    world.add_box((0.1, 0.1, 0.1), (3, 0, 5), mass=1)
    world.step()
    with pytest.raises((RoboyardError, ValueError)):
        REFUSED[name](world)
    world.step(5)
    assert np.isfinite(world.data.qpos).all()
    assert len(world.bodies) == 2


def test_a_restored_state_has_its_friction_and_its_pending_forces_again() -> None:
    def push(world: World) -> np.ndarray:
        world.step()
        return np.concatenate([body.velocity[0] for body in world.bodies])

    world = World()
    world.add_plane()
    box = world.add_box((0.2, 0.2, 0.1), (0, 0, 0.05), mass=1)
    box.links[0].friction = 0.3
    box.links[0].apply_wrench((50, 0, 0))
    state = world.save_state()
    expected = push(world)
    assert expected[3] > 0.1
    box.links[0].friction = 2.0
    world.restore_state(state)
    assert box.links[0].friction == 0.3
    np.testing.assert_array_equal(push(world), expected)
    world.step()
    world.add_box((1, 1, 1), (5, 5, 5), mass=1)  # compiles again
    world.step()
    assert world.model.geom_friction[box.links[0].geom_ids[0], 0] == 0.3


LEGS = 4


def test_newton_solves_touching_limbs_on_dense_matrices(tmp_path: Path) -> None:
    """MuJoCo 4.0's sparse Newton stops at forces far above the solution where limbs of a robot touch."""
    file = tmp_path / "legs.urdf"
    file.write_text(_legged())
    world = World()
    world.add_plane()
    for i in range(12):  # MuJoCo would choose sparse matrices
        world.add_sphere(0.05, position=(3 + 0.2 * i, 0, 0.05), mass=1)
    world.step(1)
    assert world.live_model.nv > 60
    assert world.live_model.opt.jacobian == mujoco.mjtJacobian.mjJAC_AUTO
    body = world.add_urdf(file, (0, 0, 0.4), self_collision=True)
    world.step(1)
    model, data = world.live_model, world.live_data
    assert model.opt.jacobian == mujoco.mjtJacobian.mjJAC_DENSE
    rng, balance, touched = np.random.default_rng(0), np.zeros(model.nv), False
    for step in range(240):
        if step % 60 == 0:
            for joint in body.joints:
                if joint.type == "revolute":
                    joint.drive_position(float(rng.uniform(-1.5, 1.5)))
        world.step(1)
        touched |= bool(world.contacts(body, body))
        mujoco.mj_mulM(model, data, balance, data.qacc - data.qacc_smooth)
        assert np.abs(balance - data.qfrc_constraint).max() < 0.2  # N m: M a = J' f, the solver's solution
    assert touched


def _legged() -> str:
    """Return a body with two-part legs that reach each other."""
    inertial = (
        '<inertial><mass value="{m}"/><inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/>'
        "</inertial>"
    )
    box = '<collision><origin xyz="0 0 {z}"/><geometry><box size="{size}"/></geometry></collision>'
    joint = (
        '<joint name="{name}" type="revolute"><parent link="{up}"/><child link="{name}_link"/>'
        '<origin xyz="{xyz}"/><axis xyz="0 1 0"/>'
        '<limit lower="-1.5" upper="1.5" effort="30" velocity="20"/></joint>'
    )
    base = inertial.format(m=4, i=0.05) + box.format(z=0, size="0.3 0.1 0.08")
    parts = [f'<link name="base">{base}</link>']
    for leg in range(LEGS):
        up, xyz = "base", f"{0.1 if leg < 2 else -0.1} {0.05 if leg % 2 else -0.05} -0.04"
        for part in "ab":
            name = f"{part}{leg}"
            own = inertial.format(m=0.4, i=0.001) + box.format(z=-0.1, size="0.03 0.03 0.18")
            parts.append(f'<link name="{name}_link">{own}</link>')
            parts.append(joint.format(name=name, up=up, xyz=xyz))
            up, xyz = f"{name}_link", "0 0 -0.2"
    return f'<robot name="legs">{"".join(parts)}</robot>'

"""Rows of motors and limits that are made here are MuJoCo's, and so is what is computed before them."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from sim_robots import arm

from roboyard.sim import World
from roboyard.sim.physics_profile import BULLET
from roboyard.sim.stepping.impulses import finding


def world_with_arm() -> tuple[World, list[int]]:
    """Return an arm with two motors, above a plane, beside a box, and the dofs of its joints."""
    world = World(profile=BULLET)
    world.add_plane()
    whole = arm()
    robot = world.add_description(replace(whole, links=whole.links[:4], joints=whole.joints[:3]), (0, 0, 2.5))
    world.add_box((0.2, 0.2, 0.2), position=(1.0, 0.0, 0.1), mass=1.0)
    world.motors.set(robot.joints[0], position=0.7, max_force=30.0)
    world.motors.set(robot.joints[2], velocity=0.2, max_force=5.0)
    world.ensure_compiled()
    return world, [joint.dof_slice.start for joint in robot.joints]


@pytest.mark.parametrize(
    "angles", [(0.0, 0.0, 0.02), (2.1, 0.5, 0.06), (-2.3, 2.2, -0.01)], ids=["inside", "above", "below"]
)
def test_rows_are_those_that_mujoco_makes(angles: tuple[float, float, float]) -> None:
    world, dofs = world_with_arm()
    model, data = world.live_model, world.live_data
    data.qpos[model.jnt_qposadr[model.dof_jntid[dofs]]] = angles
    data.qvel[dofs] = -0.3, 0.8, 0.1
    before = data.qpos.copy(), data.qvel.copy()
    world.step()
    own = world.stepping.in_turn.contact_rows
    assert own.is_last and data.nefc == 0
    rows, _, search = own.records(world.stepping._compiled[1])
    theirs = mujoco.MjData(model)
    theirs.qpos[:], theirs.qvel[:] = before
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    mujoco.mj_step1(model, theirs)
    count = theirs.nefc
    assert search.counts[1:4].tolist() == [theirs.ne, theirs.nf, theirs.nl] and theirs.nf == 2
    assert (theirs.nl > 0) == (max(np.abs(angles)) > 2.0)
    np.testing.assert_array_equal(rows.kind[:count], theirs.efc_type)
    np.testing.assert_array_equal(rows.ids[:count], theirs.efc_id)
    np.testing.assert_allclose(rows.position[:count], theirs.efc_pos, atol=1e-15)
    np.testing.assert_allclose(rows.velocity[:count], theirs.efc_vel, atol=1e-15)
    np.testing.assert_array_equal(rows.loss[:count], theirs.efc_frictionloss)
    jacobian = np.zeros((count, model.nv))
    for row in range(count):
        first = rows.addresses[row]
        here = slice(first, first + rows.entries[row])
        jacobian[row, rows.columns[here]] = rows.jacobian[here]
    dense = np.zeros((count, model.nv))
    if mujoco.mj_isSparse(model):
        for row, (first, entries) in enumerate(zip(theirs.efc_J_rowadr, theirs.efc_J_rownnz, strict=True)):
            dense[row, theirs.efc_J_colind[first : first + entries]] = theirs.efc_J[first : first + entries]
    else:
        dense = theirs.efc_J.reshape(count, model.nv)
    np.testing.assert_array_equal(jacobian, dense)


def test_forces_of_motors_are_known_without_mujocos_rows() -> None:
    world, dofs = world_with_arm()
    world.step(120)
    assert world.stepping.in_turn.contact_rows.is_last
    forces = world.motors.forces()
    assert forces[dofs[2]] == 5.0  # against the stop
    assert forces[dofs[1]] == 0.0 != forces[dofs[0]]
    (robot,) = (body for body in world.bodies if len(body.joints) == 3)
    for joint, dof in zip(robot.joints, dofs, strict=True):
        np.testing.assert_array_equal(world.motors.applied(joint), forces[dof])
    np.testing.assert_array_equal(world.stepping.forces.motor_forces(), forces)


def test_one_call_finds_what_mujocos_functions_find(monkeypatch: pytest.MonkeyPatch) -> None:
    """Positions, velocities, contacts and flags afterwards are the same to the last bit."""
    assert finding.flags_place() >= 0, "a new version of MuJoCo: see finding.py"
    found = []
    for place in (finding.flags_place(), -1):
        monkeypatch.setattr(finding, "flags_place", lambda place=place: place)
        world, _ = world_with_arm()
        flags = world.live_model.opt.disableflags
        world.step(60)
        model, data = world.live_model, world.live_data
        own = world.stepping.in_turn.contact_rows
        assert own.is_last and data.ncon >= 4 and bool(own._addresses) == (place >= 0)
        kept = int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
        assert (model.opt.disableflags ^ flags) & kept == 0
        found.append((data.qpos.copy(), data.qvel.copy(), data.contact.pos.copy(), data.qfrc_bias.copy()))
    for one, other in zip(*found, strict=True):
        np.testing.assert_array_equal(one, other)


def _wrenches(model: mujoco.MjModel, data: mujoco.MjData, forces: np.ndarray) -> np.ndarray:
    """What `add_wrenches` adds, contact by contact."""
    out = np.zeros((model.nbody, 6))
    for contact, numbers in zip(data.contact, forces, strict=True):
        frame = contact.frame.reshape(3, 3)
        force, torque = frame.T @ numbers[:3], frame.T @ numbers[3:]
        for geom, sign in zip(contact.geom, (-1.0, 1.0), strict=True):
            body = model.geom_bodyid[geom]
            on_surface = contact.pos + 0.5 * sign * contact.dist * frame[0]
            arm_of_force = on_surface - data.xipos[body]
            out[body] += sign * np.concatenate([force, torque + np.cross(arm_of_force, force)])
    return out


def test_contacts_push_bodies_at_their_points() -> None:
    world = World(profile=BULLET)
    world.add_plane()
    for k in range(3):
        world.add_box((0.2, 0.2, 0.2), position=(0.05 * k, 0.0, 0.1 + 0.21 * k), mass=1.0)
    world.step(20)
    model, data = world.live_model, world.live_data
    found, own = world.stepping._compiled[1], world.stepping.in_turn.contact_rows
    forces = np.random.default_rng(0).normal(size=(data.ncon, 6))
    wrenches = np.ones((model.nbody, 6))
    in_turn, points = world.stepping.in_turn, world.stepping.manifolds.points
    own.add_wrenches(model, data, found, forces, in_turn.surface, points, wrenches)
    assert data.ncon > 4
    np.testing.assert_allclose(wrenches - 1.0, _wrenches(model, data, forces), atol=1e-12)
    assert np.abs(wrenches).max() > 1.0

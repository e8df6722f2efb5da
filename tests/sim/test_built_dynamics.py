"""Dynamics of a built robot against MuJoCo's own reading of the same URDF."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from roboyard.description import write_urdf
from roboyard.description.model import Inertial, Joint, Limit, Link, Pose, RobotDescription
from roboyard.sim import World


def pose(rng: np.random.Generator) -> Pose:
    quaternion = Rotation.random(random_state=rng).as_quat()
    return Pose(position=tuple(rng.normal(size=3).tolist()), quaternion=tuple(quaternion.tolist()))


def random_tree(seed: int, count: int = 9) -> RobotDescription:
    """Links with random full tensors on hinges, slides and fixed joints in a random tree."""
    rng = np.random.default_rng(seed)
    links, joints = [Link(name="l0")], []
    for i in range(1, count):
        extents, mass = rng.uniform(0.1, 0.5, 3), float(rng.uniform(0.5, 3))
        turn = Rotation.random(random_state=rng).as_matrix()
        tensor = turn @ np.diag(mass / 12 * ((extents**2).sum() - extents**2)) @ turn.T
        inertial = Inertial(mass=mass, origin=pose(rng), inertia=tuple(tensor[np.triu_indices(3)].tolist()))
        links.append(Link(name=f"l{i}", inertial=inertial))
        axis = rng.normal(size=3)
        joints.append(
            Joint(
                name=f"j{i}",
                type=("revolute", "prismatic", "continuous", "fixed")[i % 4],  # type: ignore[arg-type]
                parent=f"l{rng.integers(i)}",
                child=f"l{i}",
                origin=pose(rng),
                axis=tuple((axis / np.linalg.norm(axis)).tolist()),
                limit=Limit(lower=-3.0, upper=3.0),
                damping=float(rng.uniform(0, 1)),
            )
        )
    return RobotDescription(name="tree", links=tuple(links), joints=tuple(joints))


def accelerations(
    model: mujoco.MjModel, state: dict[str, tuple[float, float]]
) -> tuple[dict, np.ndarray, float]:
    """Acceleration by joint, mass matrix by sorted joints, and kinetic energy (J)."""
    data = mujoco.MjData(model)
    names = {model.joint(i).name.rpartition("/")[2]: i for i in range(model.njnt)}
    for name, (position, velocity) in state.items():
        data.qpos[model.jnt_qposadr[names[name]]] = position
        data.qvel[model.jnt_dofadr[names[name]]] = velocity
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    mujoco.mj_forward(model, data)
    rows = [model.jnt_dofadr[names[name]] for name in sorted(state)]
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    found = {name: data.qacc[model.jnt_dofadr[names[name]]] for name in state}
    return found, full[np.ix_(rows, rows)], data.energy[1]


@pytest.mark.parametrize("seed", range(5))
def test_mass_matrix_and_accelerations_are_those_of_mujocos_urdf_reader(seed: int, tmp_path: Path) -> None:
    robot = random_tree(seed)
    write_urdf(robot, tmp_path / "tree.urdf")
    world = World()
    world.add_urdf(tmp_path / "tree.urdf", fixed_base=True)
    own = mujoco.MjModel.from_xml_path(str(tmp_path / "tree.urdf"))
    rng = np.random.default_rng(seed + 100)
    moving = [joint.name for joint in robot.joints if joint.is_moving]
    for _ in range(3):
        state = {name: (float(rng.uniform(-1, 1)), float(rng.normal())) for name in moving}
        ours, ours_matrix, ours_energy = accelerations(world.model, state)
        theirs, their_matrix, their_energy = accelerations(own, state)
        np.testing.assert_allclose(ours_matrix, their_matrix, rtol=1e-6, atol=1e-6)
        assert ours_energy == pytest.approx(their_energy, rel=1e-6)
        for name in moving:
            assert ours[name] == pytest.approx(theirs[name], rel=1e-5, abs=1e-5)


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_a_scaled_robot_has_moments_that_grow_with_the_fifth_power(scale: float) -> None:
    robot = random_tree(7)
    turns = [joint.name for joint in robot.joints if joint.type in ("revolute", "continuous")]
    matrices = []
    for factor in (1.0, scale):
        world = World()
        world.add_urdf(robot, fixed_base=True, scale=factor)
        moving = {joint.name: (0.0, 0.0) for joint in robot.joints if joint.is_moving}
        _, matrix, _ = accelerations(world.model, moving)
        rows = [sorted(moving).index(name) for name in turns]
        matrices.append(matrix[np.ix_(rows, rows)])
    np.testing.assert_allclose(matrices[1], matrices[0] * scale**5, rtol=1e-9, atol=1e-9)

"""Inverse kinematics of a seven-joint arm side by side with mink and with PyBullet's loop, where installed.

    python benchmarks/ik.py [--poses 200] [--seed 0]

The arm is PyBullet's panda where `pybullet` is installed, else one built here. Every pose is reachable (the
tool's pose at random joint positions inside the limits) and every solver starts at home, with random
restarts, until 1e-4 m and 1e-3 rad hold inside the limits. Solvers take turns, ten poses each, so that load
on the machine meets all alike; each answer is checked by one forward pass. PyBullet answers one call without
limits: its loop applies the answer, clips it and calls again.
"""

from __future__ import annotations

import argparse
import importlib.util
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from roboyard.description.model import Joint, Limit, Link, Pose, RobotDescription
from roboyard.kinematics import (
    ChainArrays,
    differential_step,
    forward_kinematics,
    from_description,
    sample_reachable,
    solve_ik,
    solve_ik_batch,
)
from roboyard.transforms import quaternion_from_matrix, quaternion_from_rpy, rpy_from_matrix

POSITION, ORIENTATION = 1e-4, 1e-3
BLOCK = 10
Solver = Callable[[np.ndarray, np.random.Generator], np.ndarray]


def own_arm() -> tuple[RobotDescription, str, list[float]]:
    """A seven-joint arm with a reach of about 0.9 m; the tool link; the home posture."""
    rows = [  # height along the previous z, roll that follows, lower, upper
        (0.34, -np.pi / 2, -2.9, 2.9),
        (0.00, np.pi / 2, -1.9, 1.9),
        (0.40, np.pi / 2, -2.9, 2.9),
        (0.00, -np.pi / 2, -2.6, 0.1),
        (0.38, -np.pi / 2, -2.9, 2.9),
        (0.00, np.pi / 2, -0.2, 3.6),
        (0.12, 0.0, -2.9, 2.9),
    ]
    joints, links, turn = [], [Link(name="base")], 0.0
    for i, (height, roll, lower, upper) in enumerate(rows):
        offset = (0.0, height * np.sin(turn), height * np.cos(turn))
        joints.append(
            Joint(
                name=f"joint{i + 1}",
                type="revolute",
                parent=links[-1].name,
                child=f"link{i + 1}",
                origin=Pose(position=offset, quaternion=tuple(quaternion_from_rpy([turn, 0, 0]).tolist())),
                axis=(0.0, 0.0, 1.0),
                limit=Limit(lower=lower, upper=upper, effort=50.0, velocity=2.0),
            )
        )
        links.append(Link(name=f"link{i + 1}"))
        turn = roll
    joints.append(
        Joint(
            name="flange", type="fixed", parent="link7", child="tool", origin=Pose(position=(0.0, 0.0, 0.1))
        )
    )
    robot = RobotDescription(name="arm", links=(*links, Link(name="tool")), joints=tuple(joints))
    return robot, "tool", [0.0, -0.6, 0.0, -1.8, 0.0, 1.5, 0.7]


def panda() -> tuple[RobotDescription, str, list[float]]:
    import pybullet_data

    from roboyard.description import load_description

    robot = load_description(Path(pybullet_data.getDataPath()) / "franka_panda" / "panda.urdf")
    return robot, "panda_hand", [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]


def skeleton(robot: RobotDescription, chain: ChainArrays, tip: str) -> str:
    """URDF of the links between the base and the tip, without shapes: what the peers load."""
    rows, link, joints = [], tip, []
    while link != chain.base_link:
        joints.append(robot.parent_joint[link])
        link = joints[-1].parent
    inertia = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
    for name in [chain.base_link, *(joint.child for joint in reversed(joints))]:
        rows.append(f'<link name="{name}"><inertial><mass value="1"/>{inertia}</inertial></link>')
    for joint in joints:
        pose = joint.origin.matrix()
        xyz = " ".join(f"{v:.17g}" for v in pose[:3, 3])
        rpy = " ".join(f"{v:.17g}" for v in rpy_from_matrix(pose[:3, :3]))
        low, high = joint.position_limits() or (0.0, 0.0)
        rows.append(
            f'<joint name="{joint.name}" type="{joint.type}"><parent link="{joint.parent}"/>'
            f'<child link="{joint.child}"/><origin xyz="{xyz}" rpy="{rpy}"/>'
            f'<axis xyz="{" ".join(str(v) for v in joint.axis)}"/>'
            f'<limit lower="{low}" upper="{high}" effort="50" velocity="2"/></joint>'
        )
    head = '<mujoco><compiler fusestatic="false" balanceinertia="true"/></mujoco>'
    return f'<robot name="arm">{head}{"".join(rows)}</robot>'


def with_roboyard(chain: ChainArrays, home: np.ndarray) -> Solver:
    return lambda target, rng: solve_ik(chain, target, home).q


def with_mink(chain: ChainArrays, home: np.ndarray, urdf: Path, tip: str, restarts: int = 50) -> Solver:
    import mink
    import mujoco

    configuration = mink.Configuration(mujoco.MjModel.from_xml_path(str(urdf)))
    task = mink.FrameTask(tip, "body", position_cost=1.0, orientation_cost=1.0, lm_damping=1e-3)
    limits = [mink.ConfigurationLimit(configuration.model)]

    def solve(target: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        task.set_target(mink.SE3.from_matrix(target))
        q = home
        for _ in range(restarts + 1):
            configuration.update(np.clip(q, chain.lower, chain.upper))
            for _ in range(40):
                error = task.compute_error(configuration)
                if np.linalg.norm(error[:3]) < POSITION and np.linalg.norm(error[3:]) < ORIENTATION:
                    return configuration.q.copy()
                velocity = mink.solve_ik(configuration, [task], 1.0, "daqp", damping=1e-6, limits=limits)
                configuration.integrate_inplace(velocity, 1.0)
            q = rng.uniform(chain.lower, chain.upper)
        return configuration.q.copy()

    return solve


def with_pybullet(chain: ChainArrays, home: np.ndarray, urdf: Path, restarts: int = 20) -> Solver:
    import pybullet as p

    p.connect(p.DIRECT)
    body = p.loadURDF(str(urdf), useFixedBase=True)
    tip = p.getNumJoints(body) - 1
    movable = [i for i in range(tip + 1) if p.getJointInfo(body, i)[2] != p.JOINT_FIXED]

    def place(q: np.ndarray) -> None:
        for joint, value in zip(movable, q, strict=True):
            p.resetJointState(body, joint, value)

    def solve(target: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        position, orientation = target[:3, 3].tolist(), quaternion_from_matrix(target[:3, :3]).tolist()
        q = home
        for _ in range(restarts + 1):
            place(q)
            for _ in range(20):
                q = np.array(
                    p.calculateInverseKinematics(
                        body, tip, position, orientation, maxNumIterations=50, residualThreshold=1e-6
                    )
                )
                q = np.clip(q, chain.lower, chain.upper)
                place(q)
                state = p.getLinkState(body, tip, computeForwardKinematics=1)
                turn = p.getDifferenceQuaternion(state[5], orientation)
                near = np.linalg.norm(np.subtract(state[4], position)) < POSITION
                if near and 2 * np.arcsin(min(1.0, np.linalg.norm(turn[:3]))) < ORIENTATION:
                    return q
            q = rng.uniform(chain.lower, chain.upper)
        return q

    return solve


def holds(chain: ChainArrays, q: np.ndarray, target: np.ndarray) -> bool:
    pose = forward_kinematics(chain, q)
    turn = 0.5 * (np.trace(pose[:3, :3].T @ target[:3, :3]) - 1.0)
    near = np.linalg.norm(pose[:3, 3] - target[:3, 3]) < POSITION * 1.01
    inside = np.all(q >= chain.lower - 1e-9) and np.all(q <= chain.upper + 1e-9)
    return bool(near and inside and np.arccos(np.clip(turn, -1.0, 1.0)) < ORIENTATION * 1.01)


def report(name: str, seconds: list[float], solved: list[bool], reference: float) -> None:
    median, p95 = statistics.median(seconds) * 1e3, float(np.percentile(seconds, 95)) * 1e3
    ratio = f"{median / reference:8.1f}x" if reference else ""
    print(f"{name:12s} {sum(solved):4d}/{len(solved)} {median:9.4f} ms {p95:9.4f} ms {ratio}")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--poses", type=int, default=200)
    options.add_argument("--seed", type=int, default=0)
    given = options.parse_args()
    has = {name: importlib.util.find_spec(name) is not None for name in ("pybullet", "mink", "daqp")}
    robot, tip, posture = panda() if has["pybullet"] else own_arm()
    chain, home = from_description(robot, tip), np.array(posture)
    _, targets = sample_reachable(chain, given.poses, given.seed)

    start = time.perf_counter()
    solve_ik(chain, targets[0], home)
    print(f"{robot.name}: {chain.size} joints; first call {time.perf_counter() - start:.2f} s")
    solvers: dict[str, Solver] = {"Roboyard": with_roboyard(chain, home)}
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "arm.urdf"
        urdf.write_text(skeleton(robot, chain, tip))
        if has["mink"] and has["daqp"]:
            solvers["mink"] = with_mink(chain, home, urdf, tip)
        if has["pybullet"]:
            solvers["pybullet"] = with_pybullet(chain, home, urdf)
        seconds: dict[str, list[float]] = {name: [] for name in solvers}
        solved: dict[str, list[bool]] = {name: [] for name in solvers}
        generators = {name: np.random.default_rng(given.seed) for name in solvers}
        for block in np.array_split(targets, max(1, len(targets) // BLOCK)):
            for name, solver in solvers.items():
                for target in block:
                    start = time.perf_counter()
                    q = solver(target, generators[name])
                    seconds[name].append(time.perf_counter() - start)
                    solved[name].append(holds(chain, q, target))
    print(f"{'':12s} {'solved':>8s} {'median':>9s}    {'p95':>9s}    {'median ratio':>9s}")
    reference = statistics.median(seconds["Roboyard"]) * 1e3
    for name in solvers:
        report(name, seconds[name], solved[name], 0.0 if name == "Roboyard" else reference)

    once = [solve_ik(chain, target, home, restarts=0) for target in targets]
    spent, reached = statistics.median(answer.iterations for answer in once), sum(a.converged for a in once)
    print(f"from home alone: {reached}/{len(once)}, {spent} iterations")
    _, many = sample_reachable(chain, 1000, given.seed + 1)
    start = time.perf_counter()
    answer = solve_ik_batch(chain, many, home)
    print(f"batch: {answer.converged.sum()}/1000 in {(time.perf_counter() - start) * 1e3:.1f} ms")
    differential_step(chain, home, targets[0], rest=home, max_step=0.1)
    start = time.perf_counter()
    for target in targets:
        differential_step(chain, home, target, rest=home, max_step=0.1)
    print(f"differential step: {(time.perf_counter() - start) / len(targets) * 1e6:.1f} us")


if __name__ == "__main__":
    main()

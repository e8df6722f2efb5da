"""Environments for learning: rates per CPU second beside raw `mujoco.batch`, `Robot`, and PyBullet.

    python benchmarks/envs.py [--seconds 2] [--threads 1]

Every row runs for the same CPU time, one after another in rounds. The task is Reach with the bundled arm, 8
time steps an action. "raw" is `mujoco.batch` on the same model, fed with the drives' inputs of such a run;
"Robot" is one world with a robot's own controllers for each environment; PyBullet (where it is installed) is
the same arm in two processes of Gymnasium's AsyncVectorEnv, whose CPU time is counted with ours.
"""

from __future__ import annotations

import argparse
import importlib.util
import itertools
import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import gymnasium
import numpy as np

from roboyard import World, add_robot
from roboyard.assets import asset_path
from roboyard.envs import make_vec

SUBSTEPS, EPISODE = 8, 59
ROBOTS = 4
"""Worlds with a robot each."""


def main() -> None:
    """Run all rows in rounds and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=2.0, help="CPU time of each row in each round (s)")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=1)
    given = parser.parse_args()
    rows: dict[str, tuple[Callable[[], None], int]] = {}
    for count in (1, 16, 256, 1024):
        rows[f"raw mujoco.batch, {count}"] = raw(count, given.threads), count
        for control in ("joints", "tip"):
            rows[f"batch, {control}, {count}"] = batch(count, control, given.threads), count
    for control in ("joints", "tip"):
        rows[f"Robot, {control}"] = robots(control), ROBOTS
    rates: dict[str, list[float]] = {name: [] for name in rows}
    for _ in range(given.rounds):
        for name, (step, count) in rows.items():
            rates[name].append(rate(step, count, given.seconds))
    if importlib.util.find_spec("pybullet") is not None and Path("/proc").is_dir():
        rates["PyBullet in 2 processes, joints"] = [pybullet_rate(given.seconds)]
    if importlib.util.find_spec("ray") is not None and Path("/proc").is_dir():
        for count in (256, 1024):
            rates[f"ray in 2 actors, joints, {count}"] = [ray_rate(count, given.seconds)]
    medians = {name: statistics.median(found) for name, found in rates.items()}
    print(f"{'':<28}{'steps per CPU s':>16}{'of raw':>9}")
    for name, value in medians.items():
        count = name.rsplit(", ", 1)[-1]
        base = medians.get(f"raw mujoco.batch, {count}")
        print(f"{name:<28}{value:>16.0f}" + (f"{value / base:>9.2f}" if base else ""))
    joints, tip = medians["batch, joints, 256"], medians["batch, tip, 256"]
    print(f"tip of joints at 256: {tip / joints:.2f}")
    print(f"joints of Robot: {joints / medians['Robot, joints']:.1f}; tip: {tip / medians['Robot, tip']:.1f}")
    for count in (256, 1024):
        if f"ray in 2 actors, joints, {count}" in medians:
            share = medians[f"ray in 2 actors, joints, {count}"] / medians[f"batch, joints, {count}"]
            print(f"ray of batch at {count}: {share:.2f}")
    theirs = medians.get("PyBullet in 2 processes, joints")
    if theirs:
        print(f"joints of PyBullet: {joints / theirs:.1f}")


def rate(step: Callable[[], None], count: int, seconds: float) -> float:
    """Return environment steps for each second of CPU time."""
    step()
    start, done = time.process_time(), 0
    while time.process_time() - start < seconds:
        step()
        done += count
    return done / (time.process_time() - start)


def batch(count: int, control: str, threads: int) -> Callable[[], None]:
    """Return a step of n environments."""
    envs = make_vec("roboyard/Reach-v0", count, control=control, threads=threads)
    envs.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1, 1, (64, *envs.action_space.shape)).astype(np.float32)
    turn = itertools.count()

    def step() -> None:
        envs.step(actions[next(turn) % 64])

    return step


def raw(count: int, threads: int) -> Callable[[], None]:
    """Return a step of the same simulations, with the drives' inputs of a run of the environments."""
    envs = make_vec("roboyard/Reach-v0", count, threads=threads)
    envs.reset(seed=0)
    physics = envs.runner.physics
    start, inputs = physics.batch.state.copy(), []
    random = np.random.default_rng(0)
    for _ in range(EPISODE):
        envs.step(random.uniform(-1, 1, envs.action_space.shape))
        inputs.append(physics.field("ctrl").copy())
    turn = itertools.count()

    def step() -> None:
        k = next(turn) % EPISODE
        if k == 0:
            physics.batch.state[:] = start
        physics.field("ctrl")[:] = inputs[k]
        physics.batch.step(nstep=SUBSTEPS)

    return step


def robots(control: str) -> Callable[[], None]:
    """Return a step of worlds with a robot each and its own controllers."""
    keys = {
        "joints": {"name": "JointController", "motor_type": "position", "use_delta_commands": True},
        "tip": {"name": "InverseKinematicsController", "mode": "position_fixed_ori"},
    }[control]
    worlds = []
    for _ in range(ROBOTS):
        world = World()
        world.add_plane()
        bent = [0.0, 0.6, 0.0, -1.2, 0.0, 0.8, 0.0]
        robot = add_robot(world, str(asset_path("arm7")), reset_joint_pos=bent)
        robot.reload_controllers({"arm_0": keys})
        worlds.append((world, robot))
    random = np.random.default_rng(0)

    def step() -> None:
        for world, robot in worlds:
            robot.apply_action(0.1 * random.uniform(-1, 1, robot.action_dim))
            world.step(SUBSTEPS)
            robot.proprioception()

    return step


class PybulletArm(gymnasium.Env):
    """The same arm in PyBullet, for Gymnasium's subprocesses."""

    def __init__(self) -> None:
        """Load the arm."""
        import pybullet

        self.p = pybullet
        self.client = pybullet.connect(pybullet.DIRECT)
        pybullet.setGravity(0, 0, -9.81)
        self.arm = pybullet.loadURDF(str(asset_path("arm7")), useFixedBase=True)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (7,))
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (17,))

    def reset(self, *, seed: int | None = None, options: dict | None = None) -> tuple:
        """Return an observation."""
        super().reset(seed=seed)
        return self._observe(), {}

    def step(self, action: np.ndarray) -> tuple:
        """Advance by one action."""
        q = np.array([state[0] for state in self.p.getJointStates(self.arm, range(7))])
        goal = (q + 0.1 * action).tolist()
        self.p.setJointMotorControlArray(self.arm, range(7), self.p.POSITION_CONTROL, goal, forces=[80.0] * 7)
        for _ in range(SUBSTEPS):
            self.p.stepSimulation()
        return self._observe(), 0.0, False, False, {}

    def _observe(self) -> np.ndarray:
        states = np.array([state[:2] for state in self.p.getJointStates(self.arm, range(7))])
        tip = self.p.getLinkState(self.arm, 6)[0]
        return np.concatenate([states.T.ravel(), tip]).astype(np.float32)


def pybullet_rate(seconds: float, workers: int = 2) -> float:
    """Return steps of PyBullet's arms in subprocesses for each second of CPU time, theirs and ours."""
    envs = gymnasium.vector.AsyncVectorEnv([PybulletArm] * workers)
    envs.reset(seed=0)
    action = np.zeros((workers, 7), dtype=np.float32)
    for _ in range(20):
        envs.step(action)
    workers_before = sum(cpu_time(process.pid) for process in envs.processes)
    before, end, steps = time.process_time(), time.monotonic() + 2.0 * seconds, 0
    while time.monotonic() < end:
        envs.step(action)
        steps += workers
    spent = time.process_time() - before
    spent += sum(cpu_time(process.pid) for process in envs.processes) - workers_before
    envs.close()
    return steps / spent


def ray_rate(count: int, seconds: float) -> float:
    """Return environment steps on two Ray actors for each second of CPU time, ours and that of the actors."""
    envs = make_vec("roboyard/Reach-v0", count, backend="ray", workers=2)
    envs.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1, 1, (count, 7)).astype(np.float32)
    for _ in range(5):
        envs.step(actions)
    actors = [
        int(entry.name)
        for entry in Path("/proc").iterdir()
        if entry.name.isdigit() and b"ray::Worker" in (entry / "cmdline").read_bytes()
    ]
    before, steps = sum(map(cpu_time, actors)) + time.process_time(), 0
    end = time.monotonic() + 2.0 * seconds
    while time.monotonic() < end:
        envs.step(actions)
        steps += count
    spent = sum(map(cpu_time, actors)) + time.process_time() - before
    envs.close()
    return steps / spent


def cpu_time(process: int) -> float:
    """Return the CPU time of another process (s); Linux only."""
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main()

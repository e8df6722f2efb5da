"""Environments for learning: rates per CPU second beside raw `mujoco.batch`, `Robot`, Ray and PyBullet.

    python benchmarks/envs.py [--seconds 0.4] [--rounds 16] [--threads 1]

The rows take turns in short slices of CPU time, so that all see the same load of the machine; a rate is that
of all slices together. The task is Reach with the bundled arm, 8 time steps an action. "raw" is
`mujoco.batch` on the same model, fed with the drives' inputs of such a run, apart for each kind of actions:
"joints" and "pose" (position and orientation of the end effector) move all joints; "tip" (position alone)
leaves the last one at rest, held by its friction, where MuJoCo's solver needs twice as many iterations.
"Robot" is one world with a robot's own controllers for each environment. Ray's two actors and PyBullet (where
it is installed: the same arm in two processes of Gymnasium's AsyncVectorEnv) are counted with the CPU time of
their processes and of ours. Ray is compared with a batch on two threads, since it, too, uses two cores at
once.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import itertools
import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import gymnasium
import numpy as np

from roboyard import World, add_robot
from roboyard.assets import asset_path
from roboyard.envs import make_vec

SUBSTEPS, EPISODE = 8, 59
CONTROLS = ("joints", "tip", "pose")
ROBOTS = 4
"""Worlds with a robot each."""


def main() -> None:
    """Run all rows in rounds and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=0.4, help="CPU time of each row in each round (s)")
    parser.add_argument("--rounds", type=int, default=16)
    parser.add_argument("--threads", type=int, default=1)
    given = parser.parse_args()
    rows: dict[str, Row] = {}
    for count in (1, 16, 256, 1024):
        for control in CONTROLS:
            rows[f"raw mujoco.batch, {control}, {count}"] = Row(raw(count, control, given.threads), count)
            rows[f"batch, {control}, {count}"] = Row(batch(count, control, given.threads), count)
    for control in ("joints", "tip"):
        rows[f"Robot, {control}"] = Row(robots(control), ROBOTS)
    if importlib.util.find_spec("ray") is not None and Path("/proc").is_dir():
        import ray

        ray.init(num_cpus=4, include_dashboard=False, log_to_driver=False)
        for count in (256, 1024):
            rows[f"batch on 2 threads, {count}"] = Row(batch(count, "joints", 2), count)
            rows[f"ray in 2 actors, {count}"] = ray_row(count)
    if importlib.util.find_spec("pybullet") is not None and Path("/proc").is_dir():
        rows["PyBullet in 2 processes"] = pybullet_row()
    for row in rows.values():
        row.run(0.0)
    for _ in range(given.rounds):
        for row in rows.values():
            row.run(given.seconds)
    if "ray" in sys.modules:
        sys.modules["ray"].shutdown()
    rates = {name: row.done / row.spent for name, row in rows.items()}
    print(f"{'':<28}{'steps per CPU s':>16}{'of raw':>9}")
    for name, value in rates.items():
        base = rates.get(f"raw {name}".replace("raw batch", "raw mujoco.batch"))
        print(f"{name:<28}{value:>16.0f}" + (f"{value / base:>9.2f}" if base else ""))
    for count, control in itertools.product((256, 1024), ("tip", "pose")):
        share = rates[f"batch, {control}, {count}"] / rates[f"batch, joints, {count}"]
        motions = rates[f"raw mujoco.batch, {control}, {count}"] / rates[f"raw mujoco.batch, joints, {count}"]
        print(
            f"{control} of joints at {count}: {share:.3f}, of which {motions:.3f} are MuJoCo's steps of ",
            end="",
        )
        print(f"other motions; at equal motions {share / motions:.3f}")
    joints, tip = rates["batch, joints, 256"], rates["batch, tip, 256"]
    print(f"joints of Robot: {joints / rates['Robot, joints']:.1f}; tip: {tip / rates['Robot, tip']:.1f}")
    for count in (256, 1024):
        if f"ray in 2 actors, {count}" in rates:
            share = rates[f"ray in 2 actors, {count}"] / rates[f"batch on 2 threads, {count}"]
            print(f"ray of batch at {count}: {share:.2f}")
    if "PyBullet in 2 processes" in rates:
        print(f"joints of PyBullet: {joints / rates['PyBullet in 2 processes']:.1f}")


class Row:
    """Steps done, and CPU time spent on them in this process and in others."""

    def __init__(self, step: Callable[[], None], count: int, processes: Sequence[int] = ()) -> None:
        """Create a row.

        Args:
            step: of `count` environments.
            count: steps of environments in each call.
            processes: others that work for it.
        """
        self.step, self.count, self.processes = step, count, processes
        self.done, self.spent = 0, 0.0

    def run(self, seconds: float) -> None:
        """Step for some CPU time (s) and count it; 0 steps once, without counting."""
        if not seconds:
            self.step()
            return
        start, spent = self._clock(), 0.0
        while spent < seconds:
            self.step()
            self.done += self.count
            spent = self._clock() - start
        self.spent += spent

    def _clock(self) -> float:
        return time.process_time() + sum(map(cpu_time, self.processes))


def batch(count: int, control: str, threads: int) -> Callable[[], None]:
    """Return a step of n environments."""
    envs = make_vec("roboyard/Reach-v0", count, control=control, threads=threads)
    envs.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1, 1, (64, *envs.action_space.shape)).astype(np.float32)
    turn = itertools.count()

    def step() -> None:
        envs.step(actions[next(turn) % 64])

    return step


def raw(count: int, control: str, threads: int) -> Callable[[], None]:
    """Return a step of the same simulations, with the drives' inputs of a run of the environments."""
    envs = make_vec("roboyard/Reach-v0", count, control=control, threads=threads)
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


def pybullet_row(workers: int = 2) -> Row:
    """Return PyBullet's arms in subprocesses."""
    envs = gymnasium.vector.AsyncVectorEnv([PybulletArm] * workers)
    envs.reset(seed=0)
    action = np.zeros((workers, 7), dtype=np.float32)

    def step() -> None:
        for _ in range(50):  # the clock of processes has ticks of 10 ms
            envs.step(action)

    return Row(step, 50 * workers, [process.pid for process in envs.processes if process.pid])


def ray_row(count: int) -> Row:
    """Return environments on two Ray actors."""
    known = actors()
    envs = make_vec("roboyard/Reach-v0", count, backend="ray", workers=2)
    envs.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1, 1, (64, count, 7)).astype(np.float32)
    turn = itertools.count()

    def step() -> None:
        envs.step(actions[next(turn) % 64])

    step()
    return Row(step, count, sorted(actors() - known))


def actors() -> set[int]:
    """Return the processes of Ray's actors; Linux only."""
    found = set()
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError):
            if entry.name.isdigit() and b"ray::Worker" in (entry / "cmdline").read_bytes():
                found.add(int(entry.name))
    return found


def cpu_time(process: int) -> float:
    """Return the CPU time of another process (s); Linux only."""
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main()

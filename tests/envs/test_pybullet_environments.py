"""Environments written for PyBullet run on its functions here, several at once and beside our own tasks."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import roboyard
import roboyard.envs as envs
import roboyard.pybullet as p

POLE = """<robot name="pole">
  <link name="rail"/>
  <link name="cart">
    <inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><box size="0.3 0.2 0.1"/></geometry></visual>
  </link>
  <link name="pole">
    <inertial><origin xyz="0 0 0.3"/><mass value="0.2"/>
      <inertia ixx="0.006" iyy="0.006" izz="0.0001" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0 0 0.3"/><geometry><cylinder radius="0.02" length="0.6"/></geometry></visual>
  </link>
  <joint name="slide" type="prismatic"><parent link="rail"/><child link="cart"/><axis xyz="1 0 0"/>
    <limit lower="-3" upper="3" effort="100" velocity="10"/></joint>
  <joint name="swing" type="continuous"><parent link="cart"/><child link="pole"/><axis xyz="0 1 0"/></joint>
</robot>"""


class PoleEnv(gymnasium.Env):
    """A cart with a pole, as programs for PyBullet write one: a client of its own, motors off, torques."""

    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (4,), np.float64)

    def __init__(self, folder: Path, gravity: float = -9.8) -> None:
        self.file = folder / "pole.urdf"
        self.file.write_text(POLE)
        self.client, self.gravity = p.connect(p.DIRECT), gravity

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict]:
        super().reset(seed=seed)
        p.resetSimulation(physicsClientId=self.client)
        p.setGravity(0, 0, self.gravity, physicsClientId=self.client)
        p.setTimeStep(1 / 240, physicsClientId=self.client)
        flags = p.URDF_USE_INERTIA_FROM_FILE
        self.body = p.loadURDF(str(self.file), useFixedBase=True, flags=flags, physicsClientId=self.client)
        for joint in range(2):
            p.setJointMotorControl2(
                self.body, joint, p.VELOCITY_CONTROL, force=0, physicsClientId=self.client
            )
            p.resetJointState(
                self.body, joint, self.np_random.uniform(-0.05, 0.05), 0.0, physicsClientId=self.client
            )
        return self.observe(), {}

    def step(self, action: np.ndarray) -> tuple[Any, float, bool, bool, dict]:
        force = 10.0 * float(action[0])
        p.setJointMotorControl2(self.body, 0, p.TORQUE_CONTROL, force=force, physicsClientId=self.client)
        p.stepSimulation(physicsClientId=self.client)
        seen = self.observe()
        return seen, float(np.cos(seen[2])), bool(abs(seen[2]) > 2.0), False, {}

    def observe(self) -> np.ndarray:
        states = p.getJointStates(self.body, [0, 1], physicsClientId=self.client)
        return np.array([number for state in states for number in state[:2]])

    def close(self) -> None:
        if self.client >= 0:
            p.disconnect(self.client)
            self.client = -1


def run(env: Any, seed: int, steps: int = 60) -> list[np.ndarray]:
    random = np.random.default_rng(seed)
    seen = [env.reset(seed=seed)[0]]
    seen += [env.step(random.uniform(-1, 1, (1,)))[0] for _ in range(steps)]
    return seen


def test_two_of_them_and_ours_do_not_disturb_one_another(tmp_path: Path) -> None:
    (tmp_path / "b").mkdir()
    alone = [PoleEnv(tmp_path), PoleEnv(tmp_path / "b", gravity=-1.6)]
    expected = [run(env, k) for k, env in enumerate(alone)]
    ours = envs.make_vec("roboyard/Reach-v0", 2)
    task = [ours.reset(seed=0)[0]] + [ours.step(np.full((2, 7), 0.3))[0] for _ in range(30)]
    assert not np.allclose(expected[0][-1], expected[1][-1], atol=0.1)

    together = [PoleEnv(tmp_path), PoleEnv(tmp_path / "b", gravity=-1.6)]
    random = [np.random.default_rng(k) for k in range(2)]
    seen = [[env.reset(seed=k)[0]] for k, env in enumerate(together)]
    again = [ours.reset(seed=0)[0]]
    for step in range(60):
        for k, env in enumerate(together):
            seen[k].append(env.step(random[k].uniform(-1, 1, (1,)))[0])
        if step % 2:
            again.append(ours.step(np.full((2, 7), 0.3))[0])
    for k in range(2):
        assert np.array_equal(seen[k], expected[k])
    assert np.array_equal(again, task)
    for env in (*alone, *together):
        env.close()


def test_the_pole_falls_as_a_pendulum_does(tmp_path: Path) -> None:
    env = PoleEnv(tmp_path)
    env.reset(seed=0)
    p.resetJointState(env.body, 0, 0.0, 0.0, physicsClientId=env.client)
    p.resetJointState(env.body, 1, 0.1, 0.0, physicsClientId=env.client)
    angles = [env.step(np.zeros(1))[0][2] for _ in range(48)]
    # linear motion of cart and pole: m l x'' + (I + m l²) t'' = m g l t, (M + m) x'' = -m l t''
    arm, inertia = 0.2 * 0.3, 0.006 + 0.2 * 0.3**2
    rate = np.sqrt(9.8 * arm / (inertia - arm**2 / 1.2))
    np.testing.assert_allclose(angles[-1], 0.1 * np.cosh(rate * 48 / 240), rtol=0.02)
    env.close()


def test_gymnasium_accepts_it(tmp_path: Path) -> None:
    env = PoleEnv(tmp_path)
    with pytest.warns(UserWarning, match=r".*"):  # the space is unbounded
        check_env(env, skip_render_check=True)
    env.close()


PANDA = """
import gymnasium, panda_gym
env = gymnasium.make("PandaReach-v3")
env.reset(seed=0)
env.action_space.seed(0)
moved = 0.0
for _ in range(120):
    seen, reward, ended, cut, _ = env.step(env.action_space.sample())
    moved = max(moved, abs(seen["observation"]).max())
    if ended or cut:
        env.reset()
env.close()
assert 0.01 < moved < 10.0, moved
"""
CARTPOLE = """
import importlib.util, sys, types
import gymnasium, gymnasium.envs.registration, gymnasium.utils.seeding
import numpy as np
# these environments are older than Gymnasium; their package registers them with gym
for name in ("", ".spaces", ".utils", ".utils.seeding", ".envs", ".envs.registration"):
    sys.modules.setdefault("gym" + name, sys.modules["gymnasium" + name])
package = sys.modules["pybullet_envs"] = types.ModuleType("pybullet_envs")
package.__path__ = list(FOLDERS)
from pybullet_envs.bullet.cartpole_bullet import CartPoleBulletEnv
from pybullet_envs.gym_pendulum_envs import InvertedPendulumBulletEnv
cart, pendulum = CartPoleBulletEnv(renders=False), InvertedPendulumBulletEnv()
cart.reset(), pendulum.reset()
for k in range(60):  # side by side
    seen = [*cart.step(k % 2)[0], *pendulum.step(np.array([0.2]))[0]]
    assert np.isfinite(seen).all() and np.abs(seen).max() < 100.0, seen
cart.close(), pendulum.close()
"""


def run_script(folder: Path, text: str) -> None:
    script = folder / "script.py"
    script.write_text(text + "\nimport pybullet\nprint('done on', pybullet.__name__)\n")
    done = subprocess.run(
        [sys.executable, "-m", "roboyard.pybullet", str(script)],
        capture_output=True,
        text=True,
        timeout=240,
        env={**os.environ, "PYTHONPATH": str(Path(roboyard.__file__).parents[1])},
        cwd=folder,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "done on roboyard.pybullet"


@pytest.mark.slow
def test_panda_gym_runs(tmp_path: Path) -> None:
    if importlib.util.find_spec("panda_gym") is None:
        pytest.skip("panda-gym is not installed")
    run_script(tmp_path, PANDA)


@pytest.mark.slow
def test_environments_of_pybullets_wheel_run(tmp_path: Path) -> None:
    found = importlib.util.find_spec("pybullet_envs")
    if found is None:
        pytest.skip("PyBullet is not installed")
    run_script(tmp_path, CARTPOLE.replace("FOLDERS", repr(list(found.submodule_search_locations or []))))

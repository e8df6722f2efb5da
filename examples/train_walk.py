"""Train a quadruped to walk at 0.5 m/s, in under four minutes of CPU time; needs "roboyard[learn]".

python examples/train_walk.py [--seed 0] [POLICY.json [CURVE.png [FILM.gif]]]   policy, learning curve, film
roboyard drive --policy POLICY.json                                             shows what it learned
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO

from roboyard.envs import Policy, make_vec
from roboyard.envs.play import film
from roboyard.envs.plots import plot_learning
from roboyard.envs.stable_baselines import StableBaselinesEnv, policy_of

TASK, ENVS, STEPS, SPEED = "roboyard/Locomotion-v0", 256, 1_600_000, "speed of the slowest of 32 (m/s)"


def walk(policy: Policy) -> dict[str, float]:
    """Let 32 robots walk for ten seconds; return the worst of them, after two seconds to get going."""
    envs = make_vec(TASK, 32, limit=501)
    observed, _ = envs.reset(seed=10_000)
    base = envs.runner.env.robot.base
    fell, start = np.zeros(32, dtype=bool), base.position
    for step in range(500):
        observed, _, terminated, _, _ = envs.step(policy(observed))
        fell |= terminated
        if step == 99:
            start = base.position.copy()
    speed = (base.position - start)[:, 0] / 8.0
    x, y, z, w = base.quaternion.T
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return {
        "slowest (m/s)": float(speed.min()),
        "fastest (m/s)": float(speed.max()),
        "off the line (m)": float(np.abs(base.position[:, 1]).max()),
        "yaw (rad)": float(np.abs(yaw).max()),
        "fell": float(fell.mean()),
    }


def main(seed: int = 0, steps: int = STEPS) -> tuple[Policy, list[tuple[float, float]]]:
    """Return the policy and its learning curve, (seconds of CPU time, speed of the slowest robot)."""
    torch.set_num_threads(1)
    begin, points = time.process_time(), [(0.0, 0.0)]
    network: dict[str, Any] = {"net_arch": [128, 64], "log_std_init": -1.8, "activation_fn": torch.nn.ELU}
    schedule = {"n_steps": 24, "batch_size": 6 * ENVS, "n_epochs": 4, "gamma": 0.97}
    rate = {"learning_rate": lambda left: 1e-3 * min(1.0, 0.1 + 1.8 * left)}
    envs = StableBaselinesEnv(make_vec(TASK, ENVS, limit=250))
    model = PPO("MlpPolicy", envs, policy_kwargs=network, seed=seed, device="cpu", **schedule, **rate)

    def watch(*_: Any) -> bool:
        if model.num_timesteps % (steps // 10) < ENVS:
            found = walk(policy_of(model, TASK))
            points.append((time.process_time() - begin, found["slowest (m/s)"]))
            print(f"{points[-1][0]:5.0f} s of CPU:", {k: round(v, 2) for k, v in found.items()}, flush=True)
        return True

    model.learn(steps, callback=watch)
    return policy_of(model, TASK), points


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("files", nargs="*", help="of the policy, the curve and the film")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    trained, curve = main(given.seed)
    writers = [trained.save, lambda path: plot_learning(Path(path), {"walker": curve}, SPEED, goal=0.5)]
    for path, write in zip(given.files, [*writers, lambda path: film(path, trained)], strict=False):
        write(path)

"""Train an arm to reach points, in under a minute of CPU time, and draw the learning curve.

python examples/train_reach.py [POLICY.json [CURVE.png]] [--seed 0]      pip install "roboyard[learn]"
roboyard drive --policy POLICY.json                                      shows what it learned
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import torch
from stable_baselines3 import PPO

from roboyard.envs import Policy, make_vec
from roboyard.envs.plots import plot_learning
from roboyard.envs.stable_baselines import StableBaselinesEnv, policy_of

TASK, OPTIONS = "roboyard/Reach-v0", {"robot": "arm7", "control": "tip"}
STEPS, ROUNDS = 80_000, 12


def held(policy: Policy) -> float:
    """Return the share of 256 episodes whose last half second is within 2 cm of the goal."""
    envs = make_vec(TASK, 256, **OPTIONS)
    observed, _ = envs.reset(seed=10_000)
    stays = np.ones(256, dtype=bool)
    for step in range(59):
        observed, _, _, _, info = envs.step(policy(observed))
        if step >= 44:
            stays &= info["success"]
    return float(stays.mean())


def main(file: Path | None = None, curve: Path | None = None, *, seed: int = 0, steps: int = STEPS) -> float:
    """Train, write the policy and the curve, and return the share of goals held."""
    torch.set_num_threads(1)
    start = time.process_time()
    model = PPO(
        "MlpPolicy",
        StableBaselinesEnv(make_vec(TASK, 64, **OPTIONS)),
        n_steps=32,
        batch_size=512,
        n_epochs=8,
        learning_rate=1e-3,
        gamma=0.95,
        gae_lambda=0.9,
        policy_kwargs={"net_arch": [64, 64], "log_std_init": -0.5},
        seed=seed,
        device="cpu",
    )
    points = []
    for _ in range(ROUNDS):
        model.learn(steps // ROUNDS, reset_num_timesteps=False)
        policy = policy_of(model, TASK, OPTIONS)
        points.append((time.process_time() - start, held(policy)))
        print(f"{points[-1][0]:5.1f} s of CPU: {points[-1][1]:6.1%} of goals held within 2 cm")
    if file is not None:
        policy_of(model, TASK, OPTIONS).save(file)
    if curve is not None:
        plot_learning(curve, {f"seed {seed}": points}, "goals held within 2 cm", goal=0.95)
    return points[-1][1]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", nargs="?", type=Path)
    parser.add_argument("curve", nargs="?", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    main(given.file, given.curve, seed=given.seed)

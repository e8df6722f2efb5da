"""A stop stops a joint without throwing it back, however large the share of a request that a step makes."""

import numpy as np
import pytest

from roboyard.sim.stepping.joint_stops import ATTEMPTS, stopping_impulses
from roboyard.sim.stepping.stop_kernels import passed_stops

DT = 1 / 240


@pytest.mark.parametrize("inwards", [1.0, -1.0], ids=["lower", "upper"])
@pytest.mark.parametrize("start", [0.001, -0.002], ids=["within", "beyond"])
@pytest.mark.parametrize(("weak", "held"), [(1.0, 0.0), (0.3, 0.0), (0.02, 0.5), (0.02, 4.0)])
def test_requests_end_at_a_joint_that_stops(inwards, start, weak, held):
    """The joint does `weak` of what is asked of it, until the request exceeds what others hold by `held`."""
    side, ask, bracket = np.zeros(1, np.uint8), np.zeros(1), np.zeros((1, 5))
    limits = np.array([[0.0, 10.0]]) if inwards > 0 else np.array([[-10.0, 0.0]])
    before, free = np.array([inwards * start]), -3.0
    one, here = np.zeros(1, np.int64), np.zeros(1, np.int32)
    speeds = []
    for _ in range(ATTEMPTS + 1):
        request = inwards * ask[0] if side[0] else -np.inf
        speed = free
        if side[0]:
            speed += weak * min(request - free, held) if held else weak * (request - free)
            speed += max(request - free - held, 0.0) if held else 0.0
        speeds.append(speed)
        q, v = before + inwards * speed * DT, np.array([inwards * speed])
        if not passed_stops(one, limits, here, here, before, q, v, DT, side, ask, bracket):
            break
    assert side[0] == (1 if inwards > 0 else 2)
    assert start + speeds[-1] * DT > -0.0035 and speeds[-1] < 0.8, speeds


@pytest.mark.parametrize("seed", range(20))
def test_impulses_at_stops_are_the_least_that_stop(seed):
    """The conditions of the linear complementarity problem; rows are the two sides of six joints."""
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(6, 4))
    rows = np.concatenate([np.eye(6), -np.eye(6)])
    effect = rows @ (half @ half.T + np.eye(6)) @ rows.T
    lacking = rng.normal(size=12)
    lacking[6:] = np.minimum(lacking[6:], -lacking[:6] - 1.0)  # no joint passes both of its stops
    impulses = stopping_impulses(effect, lacking)
    left = lacking - effect @ impulses
    assert (impulses >= 0.0).all() and (impulses > 0.0).any()
    assert left.max() < 1e-5
    assert np.abs(left * impulses).max() < 1e-5

"""Compiled forward kinematics, Jacobians and manipulability of a chain."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._lazy import lazy_module
from roboyard.kinematics._inputs import wrong_size
from roboyard.kinematics.chain import ChainArrays
from roboyard.transforms import Array

_kernels = lazy_module("roboyard.kinematics._kernels")


def forward_kinematics(chain: ChainArrays, q: ArrayLike, links: str | Sequence[str] | None = None) -> Array:
    """Return poses of links in the frame of `chain.base_link`.

    Args:
        chain: the joints.
        q: (..., n) joint positions (rad or m); limits are ignored.
        links: one name or several of `chain.links`; the chain's tips by default.

    Returns:
        (..., 4, 4) homogeneous matrices (m) for one name, or for the tip of a chain with one tip;
        (..., k, 4, 4) for a list, or for several tips.

    Raises:
        ValueError: q does not have n entries, or a link is unknown.
    """
    qs = np.array(q, dtype=float, order="C")
    if qs.ndim == 0 or qs.shape[-1] != chain.size:
        raise ValueError(wrong_size(chain, "q", qs.shape))
    single = isinstance(links, str) or (links is None and len(chain.tips) == 1)
    node, local = _frames(chain, links)
    whole, real = chain.nodes
    front = qs.shape[:-1]
    qs = qs.reshape(math.prod(front), chain.size)
    packed = np.empty((len(qs), len(node), 12))
    _kernels().forward_batch(whole, real, node, local, qs, np.empty((len(whole), 12)), packed)
    out = np.zeros((*packed.shape[:2], 4, 4))
    out[..., :3, 3] = packed[..., :3]
    out[..., :3, :3] = packed[..., 3:].reshape(*packed.shape[:2], 3, 3)
    out[..., 3, 3] = 1.0
    return out.reshape(*front, 4, 4) if single else out.reshape(*front, len(node), 4, 4)


def jacobian(
    chain: ChainArrays,
    q: ArrayLike,
    point: ArrayLike = (0.0, 0.0, 0.0),
    *,
    link: str | None = None,
    frame: Literal["base", "link"] = "base",
) -> Array:
    """Return the (6, n) geometric Jacobian: linear velocity (m/s) of a point, then angular velocity (rad/s).

    Args:
        chain: the joints.
        q: (n,) joint positions (rad or m).
        point: (3,) point fixed in the link's frame (m).
        link: one of `chain.links`; the first tip by default.
        frame: axes of the velocities: the chain's base link's or the link's own.

    Raises:
        ValueError: q does not have n entries, or the link or frame is unknown.
    """
    values = np.array(q, dtype=float)
    if values.shape != (chain.size,):
        raise ValueError(
            f"q has shape {values.shape}; the chain has {chain.size} joints: {chain.joint_names}"
        )
    if frame not in ("base", "link"):
        raise ValueError(f'frame must be "base" or "link", got {frame!r}')
    node, local = chain.frames(chain.tips[:1]) if link is None else _frames(chain, link)
    rotation = local[0, 3:].reshape(3, 3)
    local[0, :3] += rotation @ np.asarray(point, dtype=float)
    whole, real = chain.nodes
    tip, out = np.empty((1, 12)), np.empty((chain.size, 6))
    _kernels().jacobian_at(whole, real, node, local, values, np.empty((len(whole), 12)), tip, out)
    if frame == "link":
        axes = tip[0, 3:].reshape(3, 3)
        out = np.concatenate([out[:, :3] @ axes, out[:, 3:] @ axes], axis=1)
    return np.ascontiguousarray(out.T)


def manipulability(chain: ChainArrays, q: ArrayLike, *, link: str | None = None) -> float:
    """Return Yoshikawa's measure √det(J Jᵀ) at (n,) `q` (rad or m): 0 in a singular posture.

    With fewer than six joints it is the product of J's singular values. Source: Yoshikawa,
    Manipulability of Robotic Mechanisms, IJRR 4(2), 1985.
    """
    return float(np.prod(np.linalg.svd(jacobian(chain, q, link=link), compute_uv=False)))


def sample_reachable(chain: ChainArrays, count: int, seed: int = 0) -> tuple[Array, Array]:
    """Return random postures inside the limits and the poses of the tips there.

    Joints without limits are sampled within half a turn (1 m for prismatic joints) around zero.

    Returns:
        (count, n) joint positions (rad or m) and their `forward_kinematics`, (count, 4, 4) for one tip.
    """
    spread = np.where(chain.period > 0.0, np.pi, 1.0)
    lower = np.where(np.isfinite(chain.lower), chain.lower, np.minimum(0.0, chain.upper) - spread)
    upper = np.where(np.isfinite(chain.upper), chain.upper, np.maximum(0.0, chain.lower) + spread)
    q = np.random.default_rng(seed).uniform(lower, upper, size=(count, chain.size))
    return q, forward_kinematics(chain, q)


def _frames(chain: ChainArrays, links: str | Sequence[str] | None) -> tuple[Any, Array]:
    if links is None:
        return chain.tip_frames
    names = [links] if isinstance(links, str) else links
    return chain.frames([chain.link(name) for name in names])

"""Soft bodies: nodes joined by springs or filled with an elastic solid, which collide as MuJoCo's flexes."""

from __future__ import annotations

from roboyard.sim.soft.materials import NeoHookean, Springs

__all__ = ["NeoHookean", "Springs"]

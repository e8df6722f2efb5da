"""The compiled loops of a step, imported with the first one."""

from __future__ import annotations

from roboyard._lazy import lazy_module

kernels = lazy_module("roboyard.sim.stepping.kernels")

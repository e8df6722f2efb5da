"""The compiled loops of plans, all at once."""

from __future__ import annotations

import logging

from roboyard._lazy import lazy_module
from roboyard.native import Kernel

_checker = lazy_module("roboyard.planning.kernels.checker")
_sampling = lazy_module("roboyard.planning.kernels.sampling")
_motion = lazy_module("roboyard.planning.kernels.motion")
_shortcuts = lazy_module("roboyard.planning.kernels.shortcuts")
_timing = lazy_module("roboyard.planning.kernels.timing")
_kinematics = lazy_module("roboyard.kinematics._kernels")
_inverse = lazy_module("roboyard.kinematics._lm")

_prepared = False


def planner_loops() -> list[Kernel]:
    """Return the loops that plans use."""
    modules = (_checker, _sampling, _motion, _shortcuts, _timing, _kinematics, _inverse)
    return [loop for module in modules for loop in vars(module()).values() if isinstance(loop, Kernel)]


def compile_loops() -> None:
    """Compile the loops that no earlier process has stored, and say so in a line; once in a process.

    A plan's time begins after it: the first plan on a machine has as much time to search as later ones.
    """
    global _prepared
    if _prepared:
        return
    _prepared = True
    missing = [loop for loop in planner_loops() if not loop.is_ready]
    if missing:
        logging.getLogger("roboyard").warning(
            "compiling the planner for this machine: once, about 20 seconds"
        )
    for loop in missing:
        loop.load()

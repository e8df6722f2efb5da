"""A robot description becomes a robot that moves: what `roboyard demo` does, as a function."""

from __future__ import annotations

from roboyard.demo.run import DemoResult, run_demo

__all__ = ["DemoResult", "run_demo"]

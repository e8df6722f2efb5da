"""`roboyard demo` as a function: load a robot, move its joints on a floor, write pictures and figures."""

from __future__ import annotations

from roboyard.demo.run import DemoResult, run_demo

__all__ = ["DemoResult", "run_demo"]

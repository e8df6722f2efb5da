"""The compiled sums of balance, imported with the first control step."""

from __future__ import annotations

from roboyard._lazy import lazy_module

kernels = lazy_module("roboyard.robots.stability.kernels")

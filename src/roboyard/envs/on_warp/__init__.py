"""Environments on MuJoCo Warp: steps on a CUDA GPU, or on its CPU device to compare (extra `warp`)."""

from __future__ import annotations

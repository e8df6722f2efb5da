"""The line about the renderer's compilation: only for loops that a picture needs."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from roboyard.rendering import Camera, RenderScene, RenderShape, compile_notice, render
from roboyard.shapes import primitives


def test_a_picture_without_textures_says_nothing_about_their_loop(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(compile_notice, "_announced", False)
    monkeypatch.setattr(compile_notice, "_warm", set())
    monkeypatch.setattr(compile_notice, "is_cold", lambda kernel: kernel.__name__ == "sample_textures")
    box = RenderShape(
        mesh=primitives.box(0.1, 0.1, 0.1), position=np.zeros(3), rotation=np.eye(3), frame=0, owner=(0, 0)
    )
    camera = Camera.look_at((1.0, 1.0, 1.0), (0.0, 0.0, 0.0), width=32, height=24)
    with caplog.at_level(logging.WARNING, logger="roboyard"):
        render(RenderScene(shapes=[box]), np.zeros((1, 3)), np.eye(3)[None], camera)
    assert not caplog.records

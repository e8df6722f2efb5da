"""Pictures where the loops run as plain Python, without numba's compiler."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

PROGRAM = """
import sys
import numpy as np
from roboyard.rendering import Camera, RenderScene, RenderShape, render
from roboyard.shapes import primitives

def shape(mesh, place, **options):
    where = {"position": np.array(place, dtype=float), "rotation": np.eye(3), "frame": 0, "owner": (0, -1)}
    return RenderShape(mesh=mesh, **where, **options)

image = (np.arange(8 * 8 * 3) % 255).astype(np.uint8).reshape(8, 8, 3)
shapes = [
    shape(primitives.plane(1.0, 1.0), (0, 0, 0), infinite=True, rgba=(0.8, 0.8, 0.8, 1)),
    shape(primitives.sphere(0.3, 8), (0, 0, 0.3), rgba=(0.9, 0.3, 0.2, 1)),
    shape(primitives.box(0.2, 0.2, 0.2), (0.4, -0.3, 0.2), rgba=(0.2, 0.3, 0.9, 0.5)),
    shape(primitives.plane(1.0, 1.0, 3.0), (0, 0, 0.01), rgba=(1, 1, 1, 1), texture=image),
]
camera = Camera.look_at((1.6, -1.2, 1.1), (0, 0, 0.3), width=40, height=30)
picture = render(RenderScene(shapes=shapes), np.zeros((1, 3)), np.eye(3)[None], camera, backend="software")
np.savez(sys.argv[1], rgba=picture.rgba, depth=picture.depth, owners=picture.segmentation)
"""


def test_plain_python_draws_the_same_picture(tmp_path: Path) -> None:
    found = []
    for off in ("0", "1"):
        file = tmp_path / f"{off}.npz"
        environment = {**os.environ, "NUMBA_DISABLE_JIT": off}
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM, str(file)], env=environment, capture_output=True, timeout=300
        )
        assert done.returncode == 0, done.stderr.decode()
        found.append(np.load(file))
    compiled, plain = found
    assert len(np.unique(compiled["rgba"].reshape(-1, 4), axis=0)) > 50
    assert np.array_equal(compiled["owners"], plain["owners"])
    assert np.allclose(compiled["depth"], plain["depth"], rtol=1e-5)
    assert np.abs(compiled["rgba"].astype(int) - plain["rgba"]).max() <= 1

from __future__ import annotations

import numpy as np
import pytest

from roboyard.rendering import RenderScene, RenderShape, render
from roboyard.shapes import primitives


@pytest.fixture(scope="session")
def shape():
    """Make render shapes, in frame 0 by default."""

    def make(mesh, position=(0.0, 0.0, 0.0), rotation=None, frame=0, owner=(0, -1), **options):
        return RenderShape(
            mesh=mesh,
            position=np.array(position, dtype=float),
            rotation=np.eye(3) if rotation is None else np.asarray(rotation, dtype=float),
            frame=frame,
            owner=owner,
            **options,
        )

    return make


@pytest.fixture(scope="session")
def picture():
    """Render shapes of one frame at the origin by the software renderer."""

    def draw(shapes, camera, **options):
        scene = RenderScene(shapes=list(shapes))
        return render(scene, np.zeros((1, 3)), np.eye(3)[None], camera, backend="software", **options)

    return draw


@pytest.fixture(scope="session")
def floor(shape):
    return shape(
        primitives.plane(1.0, 1.0), infinite=True, rgba=(0.8, 0.8, 0.8, 1.0), specular=0.0, owner=(9, -1)
    )

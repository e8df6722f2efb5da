from __future__ import annotations

import pytest

from roboyard.scenes import Scene, home


@pytest.fixture(scope="module")
def flat() -> Scene:
    """The flat after everything has come to rest."""
    scene = home()
    scene.world.step(480)
    return scene

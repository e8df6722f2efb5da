"""A drop-in for `pybullet_data`: where the bundled robots and scenes are."""

from __future__ import annotations

from pathlib import Path


def getDataPath() -> str:
    """Folder of the bundled files, for `setAdditionalSearchPath`: then `plane.urdf` and others are found."""
    return str(Path(__file__).parent / "assets")

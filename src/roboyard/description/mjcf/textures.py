"""Images of the materials of an MJCF model, taken from it before MuJoCo decodes them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any


def take_textures(spec: Any, file: Path) -> dict[str, Path | None]:
    """Remove all textures and return those of the materials: the image file, None where none can be kept.

    A description names images and holds no pixels, so that MuJoCo, which decodes each into memory, need not
    see them. Made textures, those of boxes' six sides and images that are not found cannot be kept.

    Args:
        spec: the model before it is compiled; its materials and textures are changed.
        file: of the model.
    """
    from roboyard._mujoco import mujoco

    colour = int(mujoco.mjtTextureRole.mjTEXROLE_RGB)
    textures = {texture.name: texture for texture in spec.textures}
    found: dict[str, Path | None] = {}
    for material in spec.materials:
        names: Sequence[str] = list(material.textures)
        if any(names):
            texture = textures.get(names[colour])
            found[material.name] = None if texture is None else _image(texture, spec, file)
            material.textures = [""] * len(names)
    for texture in textures.values():
        spec.delete(texture)
    return found


def _image(texture: Any, spec: Any, file: Path) -> Path | None:
    """Return the file of a flat image."""
    from roboyard._mujoco import mujoco

    if not texture.file or texture.type != mujoco.mjtTexture.mjTEXTURE_2D:
        return None
    folder = file.absolute().parent
    names = (texture.file, Path(texture.file).name)  # the second with `strippath`
    places = (base / name for name in names for base in (folder / spec.compiler.texturedir, folder))
    return next((place for place in places if place.is_file()), None)

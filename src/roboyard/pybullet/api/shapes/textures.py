"""loadTexture and changeTexture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from roboyard.pybullet.face.arguments import text, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.number_lists import integers_up_to
from roboyard.pybullet.state.file_search import find_file, not_found_remedy

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client


@command()
def loadTexture(client: Client, textureFilename: str) -> int:
    """Load an image file and return the texture's id.

    Raises:
        error: the file does not exist or is not an image.
    """
    from roboyard.sim.appearance.shape_appearance import load_texture

    path = find_file(client.search.folder, text(textureFilename), client.mounts)
    image = None if path is None else load_texture(path)
    if image is None:
        remedy = (
            not_found_remedy(client.search.folder, textureFilename)
            if path is None
            else f"{path.name} is not an image"
        )
        raise failure("Error loading texture", remedy)
    scene = client.scene
    scene.textures.assign_pending(scene.world)
    return scene.textures.add(image.view())  # a view: changing it does not affect other users of the file


@command()
def changeTexture(
    client: Client, textureUniqueId: int, pixels: Sequence[int] | bytes, width: int, height: int
) -> None:
    """Replace a texture's image by (height · width · 3,) numbers or bytes from 0 to 255, row by row.

    Raises:
        error: the texture does not exist, or the number of pixels is wrong.
    """
    scene = client.scene
    if scene.textures.image(whole(textureUniqueId), scene.world) is None:
        raise failure("Error processing changeTexture.", f"there is no texture {textureUniqueId}")
    if isinstance(pixels, bytes | bytearray | memoryview):
        values = np.frombuffer(pixels, dtype=np.uint8)
    else:
        values = integers_up_to(pixels, 255)
        if values is None:
            values = np.asarray(pixels).astype(np.uint8).reshape(-1)
    if len(values) != whole(width) * whole(height) * 3:
        raise failure(
            "Error: invalid arguments in changeTexture.",
            f"got {len(values)} numbers for {width} by {height} pixels",
        )
    image = np.full((height, width, 4), 255, dtype=np.uint8)
    image[..., :3] = values.reshape(height, width, 3)
    old = scene.textures.replace(textureUniqueId, image)
    for record in scene.bodies.values():
        for link, rendered_shapes in scene.world.render_shapes.of(record.body).items():
            for index, rendered in enumerate(rendered_shapes):
                if rendered.shape.texture is old:
                    scene.world.render_shapes.change(record.body, link, index, texture=image)

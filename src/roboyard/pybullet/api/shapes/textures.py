"""loadTexture, changeTexture, and the ids of textures: one row of numbers for files and bodies alike.

Every shape that comes with a picture of its own takes the next number when its body is made, as every loaded
file does; resetSimulation does not start anew. A body's pictures are looked for only when a number is asked
for, since most scripts never do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.model import Mesh
from roboyard.pybullet.face.arguments import text, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.file_search import find_file, not_found_remedy

if TYPE_CHECKING:
    from roboyard.pybullet.bullet_rules.models import BodyModel
    from roboyard.pybullet.connections import Client
    from roboyard.pybullet.state.body_records import BodyRecord
    from roboyard.sim.world import World

Image = np.ndarray
"""(h, w, 4) uint8"""


class Textures:
    """Images by number, and the numbers that bodies took."""

    def __init__(self, first: int = 0) -> None:
        self.following = first
        """The number that comes next."""
        self._images: dict[int, Image] = {}
        self._of_shapes: dict[int, dict[tuple[int, int], int]] = {}
        """By body: the number of each of its shapes that has one; shapes by link from 0 and index."""
        self._waiting: list[BodyRecord] = []

    def add_body(self, record: BodyRecord) -> None:
        """A body was made; it may have pictures."""
        if _may_have_pictures(record.model):
            self._waiting.append(record)

    def remove_body(self, record: BodyRecord, world: World) -> None:
        """A body is about to be taken away; its numbers stay taken."""
        if record in self._waiting:
            self.catch_up(world)
        self._of_shapes.pop(record.number, None)

    def catch_up(self, world: World) -> None:
        """Give numbers to the pictures of the bodies that came since."""
        for record in self._waiting:
            found = self._of_shapes[record.number] = {}
            for link, looks in sorted(world.render_shapes.of(record.body).items()):
                for index, look in enumerate(looks):
                    image = look.shape.texture
                    if image is None and look.shape.use_mesh_colors:
                        image = look.shape.mesh.texture
                    if image is not None:
                        found[(link, index)] = self.keep(image)
        self._waiting.clear()

    def keep(self, image: Image) -> int:
        """The number of a new image."""
        self._images[self.following] = image
        self.following += 1
        return self.following - 1

    def image(self, number: int, world: World) -> Image | None:
        """The image of a number, or None."""
        self.catch_up(world)
        return self._images.get(number)

    def replace(self, number: int, image: Image) -> Image:
        """Put an image in another's place; gives the other."""
        old, self._images[number] = self._images[number], image
        return old

    def of_shape(self, record: BodyRecord, link: int, index: int, world: World) -> int:
        """The number that a shape took when its body was made, or -1; links count from 0 for the base."""
        self.catch_up(world)
        return self._of_shapes.get(record.number, {}).get((link, index), -1)


def _may_have_pictures(model: BodyModel) -> bool:
    shapes: list[Any] = [visual for link in model.links for visual in link.visuals]
    shapes = shapes or [shape for link in model.links for shape in link.collisions]
    for shape in shapes:
        material = getattr(shape, "material", None)
        if isinstance(shape.geometry, Mesh) or (material is not None and material.texture is not None):
            return True
    return False


@command()
def loadTexture(client: Client, textureFilename: str) -> int:
    """Load an image and give the texture's id."""
    from roboyard.sim.appearance.render_shapes import load_texture

    path = find_file(client, text(textureFilename))
    image = None if path is None else load_texture(path)
    if image is None:
        remedy = not_found_remedy(client, textureFilename) if path is None else f"{path.name} is no image"
        raise failure("Error loading texture", remedy)
    scene = client.scene
    scene.textures.catch_up(scene.world)
    return scene.textures.keep(image.view())  # to be changed without the other users of the file


@command()
def changeTexture(
    client: Client, textureUniqueId: int, pixels: Sequence[int] | bytes, width: int, height: int
) -> None:
    """Replace a texture's image: width · height · 3 numbers (or bytes) from 0 to 255, row by row."""
    scene = client.scene
    if scene.textures.image(whole(textureUniqueId), scene.world) is None:
        raise failure("Error processing changeTexture.", f"there is no texture {textureUniqueId}")
    if isinstance(pixels, bytes | bytearray | memoryview):
        values = np.frombuffer(pixels, dtype=np.uint8)
    else:
        values = np.asarray(pixels).astype(np.uint8).reshape(-1)
    if len(values) != whole(width) * whole(height) * 3:
        raise failure(
            "Error: invalid arguments in changeTexture.", f"{len(values)} numbers for {width} by {height}"
        )
    image = np.full((height, width, 4), 255, dtype=np.uint8)
    image[..., :3] = values.reshape(height, width, 3)
    old = scene.textures.replace(textureUniqueId, image)
    for record in scene.bodies.values():
        for link, looks in scene.world.render_shapes.of(record.body).items():
            for index, look in enumerate(looks):
                if look.shape.texture is old:
                    scene.world.render_shapes.change(record.body, link, index, texture=image)

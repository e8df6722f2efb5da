"""Texture images and their ids, counted together for loaded files and for bodies.

Every shape that comes with its own image takes the next id when its body is created, as does every loaded
file; resetSimulation does not restart the count. A body's images are looked up only when an id is needed,
since most scripts never use one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.model import Mesh
from roboyard.errors import MeshError
from roboyard.shapes.load import load_mesh

if TYPE_CHECKING:
    from roboyard.pybullet.bullet_rules.models import BodyModel
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.sim.world import World

_MOST_GONE = 256
"""Most removed bodies whose images have no ids yet."""
Image = np.ndarray
"""(h, w, 4) uint8."""


class Textures:
    """Images by id, and the ids of the images of bodies."""

    def __init__(self, first: int = 0) -> None:
        """Start without images; `first` is the first id."""
        self.following = first
        """The next id."""
        self._images: dict[int, Image] = {}
        self._of_shapes: dict[int, dict[tuple[int, int], int]] = {}
        """By body: (link, shape index) to texture id; link 0 is the base."""
        self._pending: list[BodyRecord] = []
        self._gone: list[BodyRecord] = []
        """Those of `_pending` that were removed."""

    def add_body(self, record: BodyRecord) -> None:
        """Register a new body, whose images get ids when one is needed."""
        if _may_have_images(record.model):
            self._pending.append(record)

    def remove_body(self, record: BodyRecord, world: World) -> None:
        """Forget a body before it is removed; the ids of its images are not reused."""
        if record in self._pending:
            self._gone.append(record)
            if record.body.description is None or len(self._gone) > _MOST_GONE:
                self._pending = [one for one in self._pending if one.model.once("has images", _has_images)]
                self.assign_pending(world)
        self._of_shapes.pop(record.number, None)

    def assign_pending(self, world: World) -> None:
        """Assign ids to the images of the bodies added since the last call."""
        for record in self._pending:
            ids, is_gone = dict[tuple[int, int], int](), record in self._gone
            shapes_of = world.render_shapes.of_removed if is_gone else world.render_shapes.of
            for link, shapes in sorted(shapes_of(record.body).items()):
                for index, rendered in enumerate(shapes):
                    image = rendered.shape.texture
                    if image is None and rendered.shape.use_mesh_colors:
                        image = rendered.shape.mesh.texture
                    if image is not None:
                        ids[(link, index)] = self.add(image)
            if not is_gone:
                self._of_shapes[record.number] = ids
        self._pending.clear()
        self._gone.clear()

    def add(self, image: Image) -> int:
        """Store an image, (h, w, 4) uint8, and return its id."""
        self._images[self.following] = image
        self.following += 1
        return self.following - 1

    def image(self, number: int, world: World) -> Image | None:
        """Return the image of an id, (h, w, 4) uint8, or None."""
        self.assign_pending(world)
        return self._images.get(number)

    def replace(self, number: int, image: Image) -> Image:
        """Replace the image of an id and return the old one; both (h, w, 4) uint8."""
        old, self._images[number] = self._images[number], image
        return old

    def of_shape(self, record: BodyRecord, link: int, index: int, world: World) -> int:
        """Return the id of a shape's own image, or -1; link 0 is the base."""
        self.assign_pending(world)
        return self._of_shapes.get(record.number, {}).get((link, index), -1)


def _has_images(model: BodyModel) -> bool:
    """Return whether a shape has an image, or its mesh file cannot be read."""
    for shape in _drawn(model):
        geometry, material = shape.geometry, getattr(shape, "material", None)
        if material is not None and material.texture is not None:
            return True
        if isinstance(geometry, Mesh):
            mesh = geometry.data
            if mesh is None and geometry.path is not None:
                try:
                    mesh = load_mesh(geometry.path)
                except MeshError:
                    return True
            if mesh is None or mesh.texture is not None:
                return True
    return False


def _drawn(model: BodyModel) -> list[Any]:
    """Return the shapes that cameras see."""
    visuals = [visual for link in model.links for visual in link.visuals]
    return visuals or [shape for link in model.links for shape in link.collisions]


def _may_have_images(model: BodyModel) -> bool:
    for shape in _drawn(model):
        material = getattr(shape, "material", None)
        if isinstance(shape.geometry, Mesh) or (material is not None and material.texture is not None):
            return True
    return False

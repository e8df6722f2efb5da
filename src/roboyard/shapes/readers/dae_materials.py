"""Read COLLADA materials: the diffuse colour or image of each."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from roboyard._arrays import NDArray
from roboyard.shapes.readers.dae_ids import ElementIds
from roboyard.shapes.readers.external_files import load_image
from roboyard.shapes.readers.read_mtl import SurfaceMaterial

_SHADERS = ("phong", "lambert", "blinn", "constant")


class Surfaces:
    """The materials of one document, each read once."""

    def __init__(self, root: ET.Element, ids: ElementIds, file: Path) -> None:
        self.root, self.ids, self.file = root, ids, file
        self._materials: dict[int, SurfaceMaterial] = {}
        self._images: dict[str, NDArray[np.uint8] | None] = {}

    def material(self, material: ET.Element | None) -> SurfaceMaterial:
        """Return colour and texture of a `<material>`; empty for None."""
        if material is None:
            return SurfaceMaterial()
        if id(material) not in self._materials:
            self._materials[id(material)] = self._read(material)
        return self._materials[id(material)]

    def _read(self, material: ET.Element) -> SurfaceMaterial:
        instance = material.find("instance_effect")
        effect = None if instance is None else self.ids.find(instance.get("url"), "effect")
        if effect is None:
            return SurfaceMaterial()
        shader = next(
            (found for tag in _SHADERS if (found := next(effect.iter(tag), None)) is not None), None
        )
        if shader is None:
            return SurfaceMaterial()
        texture = shader.find("diffuse/texture")
        if texture is not None:
            name = self._image_file(effect, texture.get("texture"))
            if name is not None:
                if name not in self._images:
                    self._images[name] = load_image(self.file, name)
                if self._images[name] is not None:
                    return SurfaceMaterial(texture=self._images[name])
        diffuse, emission = _rgba(shader.find("diffuse/color")), _rgba(shader.find("emission/color"))
        if diffuse is None or (not diffuse[:3].any() and shader.tag == "constant"):
            diffuse = emission
        return SurfaceMaterial(color=diffuse)

    def _image_file(self, effect: ET.Element, name: str | None) -> str | None:
        """Return the file name of a texture's image, referenced through sampler and surface or directly."""
        parameters = {param.get("sid"): param for param in effect.iter("newparam")}
        for _ in range(3):
            param = parameters.get(name)
            if param is None:
                break
            source = param.find("sampler2D/source")
            if source is None:
                source = param.find("surface/init_from")
            if source is None:
                source = param.find("sampler2D/instance_image")
                name = None if source is None else (source.get("url") or "").removeprefix("#")
            else:
                name = (source.text or "").strip()
        image = self.ids.find(name, "image")
        if image is None:
            return None
        origin = image.find("init_from")
        if origin is None:
            return None
        text = origin.text or ""
        ref = origin.find("ref")
        return (ref.text or "" if ref is not None else text).strip() or None


def _rgba(element: ET.Element | None) -> NDArray[np.uint8] | None:
    """Return a (4,) opaque colour.

    Transparency is ignored, since exporters write it in contradictory ways.
    """
    if element is None:
        return None
    try:
        values = np.array((element.text or "").split(), dtype=np.float64)
    except ValueError:
        return None
    if len(values) < 3 or not np.isfinite(values[:3]).all():
        return None
    return np.rint(255 * np.clip([*values[:3], 1.0], 0.0, 1.0)).astype(np.uint8)

"""Looks as UsdPreviewSurface materials, and how surfaces rub."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from roboyard.description.model import RGBA, Contact, Material
from roboyard.export.geometry import DEFAULT_RGBA, faces_by_color
from roboyard.export.images import ImageCache, material_pixels, write_png
from roboyard.export.names import free_name, identifier
from roboyard.export.usd.geometry import MAX_SUBSETS, Placed, subset_name
from roboyard.export.usd.library import Gf, Sdf, UsdGeom, UsdPhysics, UsdShade, Vt

ROUGHNESS = 0.5


@dataclass(kw_only=True, eq=False)
class MaterialWriter:
    """Materials of a robot, each once; images are written beside the stage."""

    stage: Any
    root: str
    layer_folder: Path
    texture_folder: Path
    materials: dict[tuple[RGBA, str | None], Any] = field(default_factory=dict)
    textures: dict[str, Path] = field(default_factory=dict)
    digests: ImageCache = field(default_factory=ImageCache)
    notes: list[str] = field(default_factory=list)

    def dress(self, placed: Placed, material: Material | None) -> None:
        """Bind what a visual looks like: its own colour, else its mesh file's colours, else grey."""
        rgba = material.rgba if material is not None else None
        image = material_pixels(material) if material is not None else None
        if image is None and material is not None and material.texture is not None:
            self.notes.append(f"image {material.texture.name} cannot be read; skipped")
        mesh = placed.mesh
        has_uv = mesh is not None and mesh.uv is not None
        if image is None and rgba is None and mesh is not None and mesh.texture is not None and has_uv:
            image = mesh.texture
        texture = self._texture(image) if image is not None and has_uv else None
        name = material.name if material is not None else None
        groups = faces_by_color(mesh) if mesh is not None and rgba is None else []
        if texture is None and 2 <= len(groups) <= MAX_SUBSETS:
            assert mesh is not None
            self._dress_subsets(placed, groups)
            return
        if rgba is None and groups and texture is None:
            rgba = groups[0][0]
        whole = rgba or ((1.0, 1.0, 1.0, 1.0) if texture is not None else DEFAULT_RGBA)
        _bind(placed.prim, self._material(whole, texture, name))
        if not (texture is None and len(groups) > MAX_SUBSETS):
            _display(placed.prim, whole)

    def _dress_subsets(self, placed: Placed, groups: list[tuple[RGBA, np.ndarray]]) -> None:
        for number, (rgba, _) in enumerate(groups):
            subset = self.stage.OverridePrim(placed.prim.GetPath().AppendChild(subset_name(number)))
            _bind(subset, self._material(rgba, None, None))
        _display(placed.prim, groups[0][0])

    def _material(self, rgba: RGBA, texture: str | None, name: str | None) -> Any:
        key = (rgba, texture)
        if key not in self.materials:
            scope = f"{self.root}/Looks"
            UsdGeom.Scope.Define(self.stage, scope)
            used = {found.GetPrim().GetName() for found in self.materials.values()}
            path = f"{scope}/{free_name(identifier(name or _color_name(rgba), 'material'), used)}"
            self.materials[key] = _preview_surface(self.stage, path, rgba, texture)
        return self.materials[key]

    def _texture(self, pixels: np.ndarray) -> str:
        """Asset path, relative to the layer, of a PNG with these pixels."""
        digest = self.digests.of(pixels)
        if digest not in self.textures:
            file = self.texture_folder / f"texture_{digest}.png"
            write_png(pixels, digest, file)
            self.textures[digest] = file
        relative = Path(os.path.relpath(self.textures[digest], self.layer_folder)).as_posix()
        return relative if relative.startswith(".") else f"./{relative}"


def _color_name(rgba: RGBA) -> str:
    return "color_" + "".join(f"{round(255 * min(max(c, 0.0), 1.0)):02x}" for c in rgba)


def _preview_surface(stage: Any, path: str, rgba: RGBA, texture: str | None) -> Any:
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/Shader")
    shader.CreateIdAttr("UsdPreviewSurface")
    color = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(ROUGHNESS)
    shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(0.0)
    shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(float(rgba[3]))
    surface = shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput().ConnectToSource(surface)
    if texture is None:
        color.Set(Gf.Vec3f(*rgba[:3]))
        return material
    reader = UsdShade.Shader.Define(stage, f"{path}/Coordinates")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
    coordinates = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    image = UsdShade.Shader.Define(stage, f"{path}/Image")
    image.CreateIdAttr("UsdUVTexture")
    image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(texture))
    image.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(coordinates)
    image.CreateInput("wrapS", Sdf.ValueTypeNames.Token).Set("repeat")
    image.CreateInput("wrapT", Sdf.ValueTypeNames.Token).Set("repeat")
    image.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set("sRGB")
    image.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(*rgba))
    color.ConnectToSource(image.CreateOutput("rgb", Sdf.ValueTypeNames.Float3))
    return material


def _bind(prim: Any, material: Any) -> None:
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)


def _display(prim: Any, rgba: RGBA) -> None:
    """The colour that viewers without materials show."""
    gprim = UsdGeom.Gprim(prim)
    gprim.CreateDisplayColorPrimvar(UsdGeom.Tokens.constant).Set(Vt.Vec3fArray([Gf.Vec3f(*rgba[:3])]))


def add_surface(stage: Any, root: str, link: str, contact: Contact, colliders: list[Any]) -> None:
    """Bind friction and restitution to a link's collision shapes."""
    if contact.lateral_friction is None and contact.restitution is None:
        return
    UsdGeom.Scope.Define(stage, f"{root}/PhysicsMaterials")
    material = UsdShade.Material.Define(stage, f"{root}/PhysicsMaterials/{link}")
    api = UsdPhysics.MaterialAPI.Apply(material.GetPrim())
    if contact.lateral_friction is not None:
        api.CreateStaticFrictionAttr(contact.lateral_friction)
        api.CreateDynamicFrictionAttr(contact.lateral_friction)
    if contact.restitution is not None:
        api.CreateRestitutionAttr(contact.restitution)
    for prim in colliders:
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(
            material, UsdShade.Tokens.weakerThanDescendants, "physics"
        )

"""Colours and images of USD prims: of their materials, else their display colours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard.description.model import RGBA
from roboyard.description.usd.library import Ar, UsdGeom, UsdShade
from roboyard.shapes.readers.external_files import decode_image
from roboyard.transforms import Array

GREY: RGBA = (0.7, 0.7, 0.7, 1.0)
MAX_IMAGE_BYTES = 64 * 1024 * 1024
_COLORS = ("diffuseColor", "diffuse_color_constant", "base_color", "diffuse_tint")
"""Inputs of UsdPreviewSurface, and of the MDL materials that Isaac Sim writes."""
_OPACITIES = ("opacity", "opacity_constant")
_IMAGES = ("diffuseColor", "diffuse_texture", "base_color_texture")


def color_of(prim: Any) -> RGBA:
    """Return the colour of the bound material, else the first display colour, else grey."""
    bound = material_color(prim)
    if bound is not None:
        return bound
    shown = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("displayColor")
    values: Any = shown.Get() if shown and shown.HasValue() else None
    if np.ndim(values) == 2 and np.shape(values)[0] and np.shape(values)[1] == 3:
        r, g, b = _clipped(values[0])
        return (r, g, b, 1.0)
    return GREY


def material_name(prim: Any) -> str | None:
    """Return the name of the bound material; None without one."""
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    return str(material.GetPrim().GetName()) if material else None


def material_color(prim: Any) -> RGBA | None:
    """Return the colour of the bound material; None where none is bound or it states none."""
    value = _value(_input(prim, _COLORS))
    if value is None or not hasattr(value, "__len__") or len(value) < 3:
        return None
    alpha = _value(_input(prim, _OPACITIES))
    r, g, b = _clipped(value)
    return (r, g, b, _clipped([1.0 if not isinstance(alpha, float) else alpha])[0])


def face_colors(prim: Any, count: int) -> np.ndarray | None:
    """Return (count, 4) uint8 if faces differ: by subsets with materials, or one display colour per face."""
    subsets = [s for s in UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Imageable(prim)) if s]
    colored = [(s, c) for s in subsets if (c := material_color(s.GetPrim())) is not None]
    shown = UsdGeom.PrimvarsAPI(prim).GetPrimvar("displayColor")
    values: Any = shown.Get() if shown and shown.HasValue() else None
    if colored:
        out = np.tile(np.array(color_of(prim)), (count, 1))
        for subset, color in colored:
            given = subset.GetIndicesAttr().Get()
            indices = np.array(given if hasattr(given, "__len__") else [], dtype=np.int64)
            out[indices[(indices >= 0) & (indices < count)]] = color
    elif np.shape(values) == (count, 3) and str(shown.GetInterpolation()) == "uniform":
        out = np.column_stack([np.array(values, dtype=float), np.ones(count)])
    else:
        return None
    return np.round(255 * np.clip(np.nan_to_num(out), 0, 1)).astype(np.uint8)


def texture_of(prim: Any) -> np.ndarray | None:
    """Return (h, w, 4) RGBA of the image of the bound material; None without one that can be read.

    It has to be below the folder above that of the stage's root layer, or inside a package.
    """
    asset = _asset(_input(prim, _IMAGES))
    if asset is None or not asset.resolvedPath:
        return None
    outer = Path(str(asset.resolvedPath).partition("[")[0])
    root = Path(prim.GetStage().GetRootLayer().realPath).resolve().parent
    try:
        if not outer.resolve().is_relative_to(root.parent) or not outer.is_file():
            return None
    except (OSError, RuntimeError):
        return None
    opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(str(asset.resolvedPath)))
    if not opened or opened.GetSize() > MAX_IMAGE_BYTES:
        return None
    return decode_image(bytes(opened.GetBuffer()), outer.name)


def texture_coordinates(
    prim: Any, corners: NDArray[np.int64], places: NDArray[np.int64], points: int
) -> tuple[Array, NDArray[np.int64]] | None:
    """Return (k, 2) texture coordinates and their (m, 3) indices; None where a mesh has none.

    Args:
        prim: the mesh.
        corners: (n,) point of each corner.
        places: (m, 3) corners of the triangles.
        points: number of points.
    """
    for name in ("st", "st_0", "st0", "UVMap", "st1"):
        primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar(name)
        if not primvar or not primvar.HasValue():
            continue
        try:
            flat = np.array(primvar.ComputeFlattened(), dtype=float)
        except (TypeError, ValueError):
            continue
        if flat.ndim != 2 or flat.shape[1] != 2 or not np.isfinite(flat).all():
            continue
        interpolation = str(primvar.GetInterpolation())
        if interpolation == "faceVarying" and len(flat) == len(corners):
            return flat, places
        if interpolation in ("vertex", "varying") and len(flat) == points:
            return flat, corners[places]
    return None


def _surface(prim: Any) -> Any | None:
    """Return the shader of the bound material's surface: UsdPreviewSurface first, else MDL."""
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    if not material:
        return None
    for context in ("", "mdl"):
        source = material.ComputeSurfaceSource(context)[0]
        if source:
            return source
    return None


def _input(prim: Any, names: tuple[str, ...]) -> Any | None:
    """Return the first of these inputs that the surface of the bound material has."""
    source = _surface(prim)
    if source is None:
        return None
    for name in names:
        found = source.GetInput(name)
        if found:
            return found
    return None


def _value(given: Any | None) -> Any | None:
    """Return the value of an input, through the inputs that it is connected to; None without one."""
    if given is None:
        return None
    attributes = UsdShade.Utils.GetValueProducingAttributes(given)
    attribute = attributes[0] if attributes else None
    return None if attribute is None or not attribute else attribute.Get()


def _asset(given: Any | None) -> Any | None:
    """Return the asset path of an image: the input's own, or that of the texture it is connected to."""
    value = _value(given)
    if value is not None and hasattr(value, "resolvedPath"):
        return value
    connected = given.GetConnectedSource() if given is not None else None
    if not connected:
        return None
    file = UsdShade.Shader(connected[0].GetPrim()).GetInput("file")
    found = _value(file) if file else None
    return found if hasattr(found, "resolvedPath") else None


def _clipped(values: Any) -> list[float]:
    """Return three numbers between 0 and 1; zeros where they are none."""
    if not all(isinstance(value, int | float) for value in list(values)[:3]):
        return [0.0, 0.0, 0.0]
    return [min(max(float(value), 0.0), 1.0) if np.isfinite(value) else 0.0 for value in list(values)[:3]]

"""Conversions of numbers to OpenUSD types; quaternions are given as (x, y, z, w)."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.export.usd.library import Gf, Sdf, UsdGeom, Vt
from roboyard.transforms import Array, quaternion_from_matrix


def vec3f(values: ArrayLike) -> Any:
    """Return (3,) numbers as a single-precision Gf vector."""
    x, y, z = (float(v) for v in np.asarray(values, dtype=float))
    return Gf.Vec3f(x, y, z)


def vec3d(values: ArrayLike) -> Any:
    """Return (3,) numbers as a double-precision Gf vector."""
    x, y, z = (float(v) for v in np.asarray(values, dtype=float))
    return Gf.Vec3d(x, y, z)


def quatf(quaternion: ArrayLike) -> Any:
    """Return a (4,) quaternion (x, y, z, w) as a single-precision Gf quaternion."""
    x, y, z, w = (float(v) for v in np.asarray(quaternion, dtype=float))
    return Gf.Quatf(w, x, y, z)


def quatd(quaternion: ArrayLike) -> Any:
    """Return a (4,) quaternion (x, y, z, w) as a double-precision Gf quaternion."""
    x, y, z, w = (float(v) for v in np.asarray(quaternion, dtype=float))
    return Gf.Quatd(w, x, y, z)


def place(prim: Any, position: ArrayLike, quaternion: ArrayLike, scale: ArrayLike = (1, 1, 1)) -> None:
    """Author translate (3,) (m), orient (4,) (x, y, z, w) and scale (3,) in double precision, in this order.

    Works also on prims of unknown type.
    """
    names = ["xformOp:translate", "xformOp:orient", "xformOp:scale"]
    kinds = (Sdf.ValueTypeNames.Double3, Sdf.ValueTypeNames.Quatd, Sdf.ValueTypeNames.Double3)
    values = (vec3d(position), quatd(quaternion), vec3d(scale))
    for name, kind, value in zip(names, kinds, values, strict=True):
        prim.CreateAttribute(name, kind, custom=False).Set(value)
    order = prim.CreateAttribute(
        UsdGeom.Tokens.xformOpOrder,
        Sdf.ValueTypeNames.TokenArray,
        custom=False,
        variability=Sdf.VariabilityUniform,
    )
    order.Set(Vt.TokenArray(names))


def place_at(prim: Any, matrix: Array) -> None:
    """Author a rigid (4, 4) transform as translate, orient, scale."""
    place(prim, matrix[:3, 3], quaternion_from_matrix(matrix[:3, :3]))


def set_attribute(prim: Any, name: str, kind: Any, value: Any, *, uniform: bool = False) -> None:
    """Author an attribute of a schema that OpenUSD does not ship."""
    variability = Sdf.VariabilityUniform if uniform else Sdf.VariabilityVarying
    prim.CreateAttribute(name, kind, custom=False, variability=variability).Set(value)


def apply_by_name(prim: Any, schema: str) -> None:
    """Apply an API schema that OpenUSD does not ship, by its name."""
    prim.AddAppliedSchema(schema)

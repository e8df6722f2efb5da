"""OpenUSD's modules; an optional dependency without type hints."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from roboyard.errors import MissingExtraError

try:
    Gf: Any = import_module("pxr.Gf")
    Sdf: Any = import_module("pxr.Sdf")
    Usd: Any = import_module("pxr.Usd")
    UsdGeom: Any = import_module("pxr.UsdGeom")
    UsdPhysics: Any = import_module("pxr.UsdPhysics")
    UsdShade: Any = import_module("pxr.UsdShade")
    Vt: Any = import_module("pxr.Vt")
except ImportError:
    raise MissingExtraError("OpenUSD", "usd", "writing USD") from None

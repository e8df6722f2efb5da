"""OpenUSD's modules for reading; an optional dependency without type hints."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from roboyard.errors import MissingExtraError

try:
    Ar: Any = import_module("pxr.Ar")
    Gf: Any = import_module("pxr.Gf")
    Tf: Any = import_module("pxr.Tf")
    Usd: Any = import_module("pxr.Usd")
    UsdGeom: Any = import_module("pxr.UsdGeom")
    UsdPhysics: Any = import_module("pxr.UsdPhysics")
    UsdShade: Any = import_module("pxr.UsdShade")
    UsdUtils: Any = import_module("pxr.UsdUtils")
except ImportError:
    raise MissingExtraError("OpenUSD", "usd", "reading USD") from None

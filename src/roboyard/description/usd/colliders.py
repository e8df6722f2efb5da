"""Which geometric prims are shown and which collide, and as what."""

from __future__ import annotations

from typing import Any

from roboyard.description.usd.library import UsdGeom, UsdPhysics


def is_shown(prim: Any) -> bool:
    """Return whether a prim is rendered: visible, and neither a guide nor a proxy."""
    imageable = UsdGeom.Imageable(prim)
    if imageable.ComputeVisibility() == UsdGeom.Tokens.invisible:
        return False
    return imageable.ComputePurpose() not in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy)


def collider_of(prim: Any, below: Any = None) -> Any | None:
    """Return the prim whose CollisionAPI applies to this one; None if it does not collide.

    Args:
        prim: a geometric prim.
        below: the prim at which the search upwards ends, itself included; the root by default.
    """
    above = prim
    while above and not above.IsPseudoRoot():
        if above.HasAPI(UsdPhysics.CollisionAPI):
            enabled = UsdPhysics.CollisionAPI(above).GetCollisionEnabledAttr().Get()
            return above if enabled is not False else None
        if below is not None and above == below:
            break
        above = above.GetParent()
    return None


def approximation_of(prim: Any) -> str:
    """Return how a mesh collides: UsdPhysics' word, "none" for its triangles."""
    if not prim.HasAPI(UsdPhysics.MeshCollisionAPI):
        return "none"
    return str(UsdPhysics.MeshCollisionAPI(prim).GetApproximationAttr().Get())

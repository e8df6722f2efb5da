"""Mass, centre of mass and inertia of a body, as MassAPI states them; what it does not state is computed.

A body without a mass has that of its colliders: their own, or that of their volume at their density, the
body's, their material's, or that of water. The tensor of NewtonMassAPI comes before principal moments, which
a stage states beside it in single precision. A computed inertia is taken about the centre of mass that is
stated, as OpenUSD's own computation does.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard.description.geometry import geometry_mesh, pose_from_matrix
from roboyard.description.model import Box, Capsule, Cylinder, Geometry, Inertial, Sphere
from roboyard.description.usd.frames import Frames, quaternion_of, vector_of
from roboyard.description.usd.library import UsdPhysics, UsdShade
from roboyard.description.usd.shapes import BodyShapes
from roboyard.shapes import inertia
from roboyard.shapes.inertia import DEFAULT_DENSITY, SolidInertia
from roboyard.transforms import Array, matrix_from_quaternion


def inertial_of(body: Any, shapes: BodyShapes, frames: Frames) -> Inertial | None:
    """Return the inertial of a body in its frame (kg, m); None where it has neither mass nor shapes.

    Raises:
        MeshError: the mesh of a collider cannot be used.
    """
    if body.GetCustomDataByKey("urdf_massless"):
        return None
    opened = frames.opened
    scale = np.linalg.norm(frames.affine(body)[:3, :3], axis=0)
    mass = _positive(body, "physics:mass", opened.kilograms)
    center = _vector(body, "physics:centerOfMass")
    moments = _vector(body, "physics:diagonalInertia")
    has_moments = moments is not None and bool((moments != 0).any())
    stated = _tensor(body)
    solid = None
    if mass is None or center is None or not (has_moments or stated is not None):
        solid = _solid(body, shapes, frames)
    if mass is None:
        if solid is None:
            return None
        mass = solid.mass
    T = np.eye(4)
    if center is not None:
        T[:3, 3] = scale * center
    elif solid is not None:
        T[:3, 3] = solid.center
    if stated is not None:
        return _inertial(mass, T, stated * opened.kilograms * opened.metres**2)
    if has_moments:
        assert moments is not None
        turn = quaternion_of(body.GetAttribute("physics:principalAxes").Get())
        if turn is not None:
            T[:3, :3] = matrix_from_quaternion(turn)
        xx, yy, zz = (float(v) for v in moments * opened.kilograms * opened.metres**2)
        return Inertial(mass=mass, origin=pose_from_matrix(T), inertia=(xx, 0.0, 0.0, yy, 0.0, zz))
    if solid is None:
        return Inertial(mass=mass, origin=pose_from_matrix(T))
    return _inertial(mass, T, solid.scaled_to(mass).about(T[:3, 3]).inertia)


def _inertial(mass: float, T: Array, tensor: Array) -> Inertial:
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = ([float(v) for v in row] for row in tensor)
    return Inertial(mass=mass, origin=pose_from_matrix(T), inertia=(xx, xy, xz, yy, yz, zz))


def _tensor(body: Any) -> Array | None:
    """Return the (3, 3) tensor that NewtonMassAPI states as xx, yy, zz, xy, xz, yz, in the stage's units."""
    attribute = body.GetAttribute("newton:inertia")
    value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
    try:
        numbers = np.array([] if value is None else value, dtype=float)
    except (TypeError, ValueError):  # an attribute of another type than its schema says
        return None
    if numbers.shape != (6,) or not np.isfinite(numbers).all() or not numbers.any():
        return None
    xx, yy, zz, xy, xz, yz = numbers
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _solid(body: Any, shapes: BodyShapes, frames: Frames) -> SolidInertia | None:
    """Return the colliders of a body as one solid in its frame; None without."""
    volume = frames.opened.kilograms / frames.opened.metres**3
    given = _positive(body, "physics:density", volume)
    parts = []
    for collider, (geometry, pose) in shapes.solids:
        own = _positive(collider, "physics:density", volume)
        density = own or given or _material_density(collider, volume) or DEFAULT_DENSITY
        part = _solid_of(geometry, density)
        if part is None:
            continue
        stated = _positive(collider, "physics:mass", frames.opened.kilograms)
        if stated is not None:
            part = part.scaled_to(stated)
        part = part.moved(pose.position, matrix_from_quaternion(pose.quaternion))
        parts.append(_with_stated(part, collider, body, frames))
    return inertia.combined(parts) if parts else None


def _with_stated(part: SolidInertia, collider: Any, body: Any, frames: Frames) -> SolidInertia:
    """Return a collider as a solid in its body's frame, with the centre and the inertia that it states."""
    center = _vector(collider, "physics:centerOfMass")
    moments = _vector(collider, "physics:diagonalInertia")
    T = np.linalg.inv(frames.rigid(body)) @ frames.rigid(collider)
    if center is not None:
        scale = np.linalg.norm(frames.affine(collider)[:3, :3], axis=0)
        part = part.about((T @ [*(scale * center), 1.0])[:3])
    if moments is None or not moments.any():
        return part
    turn = quaternion_of(collider.GetAttribute("physics:principalAxes").Get())
    R = T[:3, :3] if turn is None else T[:3, :3] @ matrix_from_quaternion(turn)
    tensor = R @ np.diag(moments * frames.opened.kilograms * frames.opened.metres**2) @ R.T
    return SolidInertia(mass=part.mass, center=part.center, inertia=tensor, solid=part.solid)


def _solid_of(geometry: Geometry, density: float) -> SolidInertia | None:
    match geometry:
        case Box(size=size):
            return inertia.box(size, density)
        case Sphere(radius=radius):
            return inertia.sphere(radius, density)
        case Cylinder(radius=radius, length=length):
            return inertia.cylinder(radius, length, density)
        case Capsule(radius=radius, length=length):
            return inertia.capsule(radius, length, density)
    mesh = geometry_mesh(geometry)
    return None if mesh is None else inertia.mesh(mesh.vertices, mesh.faces, density)


def _material_density(collider: Any, unit: float) -> float | None:
    binding = UsdShade.MaterialBindingAPI(collider)
    for purpose in ("physics", ""):
        material, _ = binding.ComputeBoundMaterial(purpose)
        if material and material.GetPrim().HasAPI(UsdPhysics.MaterialAPI):
            return _positive(material.GetPrim(), "physics:density", unit)
    return None


def _positive(prim: Any, name: str, unit: float) -> float | None:
    attribute = prim.GetAttribute(name)
    value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
    if not isinstance(value, int | float) or not np.isfinite(value) or value <= 0:
        return None
    return float(value) * unit


def _vector(prim: Any, name: str) -> Array | None:
    """Return an authored, finite (3,) vector."""
    attribute = prim.GetAttribute(name)
    authored = attribute and attribute.HasAuthoredValue()
    return vector_of(attribute.Get()) if authored else None

"""Render shapes of a body that came from an MJCF file, read from the compiled model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from roboyard._mujoco import mujoco
from roboyard.description.model import (
    Box,
    Capsule,
    Cylinder,
    Geometry,
    Heightfield,
    Material,
    Mesh,
    Plane,
    Pose,
    Sphere,
)
from roboyard.rendering.scene import RenderShape
from roboyard.shapes import primitives
from roboyard.sim.appearance.mjcf_textures import TextureMaps, color_of, texture_maps_of
from roboyard.sim.appearance.shape_appearance import ShapeAppearance, render_shape
from roboyard.sim.body import Body


def shapes_of_model(body: Body) -> dict[int, list[ShapeAppearance]]:
    """Return the shapes of a body without description, by link index."""
    coats = texture_maps_of(body.world)
    model = coats.model
    found: dict[int, list[ShapeAppearance]] = {}
    shown_by = {int(row): index for index, row in enumerate(body.mujoco_ids)}  # last of links in one place
    for row, index in shown_by.items():
        geoms = np.flatnonzero(model.geom_bodyid == row)
        if body.built.is_ground:
            geoms = np.array([geom.id for geom in body.built.links[0].geoms], dtype=int)
        if (model.geom_group[geoms] < 3).any():
            geoms = geoms[model.geom_group[geoms] < 3]
        for geom in geoms:
            look = _look(coats, int(geom), (body.id, index))
            if look is not None:
                found.setdefault(index, []).append(look)
    return found


def _look(coats: TextureMaps, geom: int, owner: tuple[int, int]) -> ShapeAppearance | None:
    model = coats.model
    kinds = mujoco.mjtGeom
    size = [float(v) for v in model.geom_size[geom]]
    geometry: Geometry
    match int(model.geom_type[geom]):
        case int(kinds.mjGEOM_BOX):
            geometry = Box(size=(2 * size[0], 2 * size[1], 2 * size[2]))
        case int(kinds.mjGEOM_SPHERE):
            geometry = Sphere(radius=size[0])
        case int(kinds.mjGEOM_CAPSULE):
            geometry = Capsule(radius=size[0], length=2 * size[1])
        case int(kinds.mjGEOM_CYLINDER):
            geometry = Cylinder(radius=size[0], length=2 * size[1])
        case int(kinds.mjGEOM_PLANE):
            geometry = Plane()
        case int(kinds.mjGEOM_MESH) | int(kinds.mjGEOM_ELLIPSOID) | int(kinds.mjGEOM_HFIELD):
            geometry = Sphere(radius=0.5)
        case _:
            return None
    if int(model.geom_type[geom]) == int(kinds.mjGEOM_MESH):
        mesh_id = int(model.geom_dataid[geom])
        geometry = Mesh(
            uri="",
            path=None,
            data=coats.mesh(mesh_id),
        )
    elif int(model.geom_type[geom]) == int(kinds.mjGEOM_ELLIPSOID):
        geometry = Mesh(
            uri="", path=None, data=primitives.sphere(), scale=(2 * size[0], 2 * size[1], 2 * size[2])
        )
    elif int(model.geom_type[geom]) == int(kinds.mjGEOM_HFIELD):
        field = int(model.geom_dataid[geom])
        nrow, ncol = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
        start = int(model.hfield_adr[field])
        heights = model.hfield_data[start : start + nrow * ncol].reshape(nrow, ncol).T
        half_x, half_y, rise, _ = (float(v) for v in model.hfield_size[field])
        geometry = Heightfield(
            heights=np.asarray(heights, dtype=float) * rise,
            cell=(2 * half_x / (ncol - 1), 2 * half_y / (nrow - 1)),
        )
    w, x, y, z = (float(v) for v in model.geom_quat[geom])
    px, py, pz = (float(v) for v in model.geom_pos[geom])
    shape: RenderShape | None = render_shape(
        geometry,
        Pose(position=(px, py, pz), quaternion=(x, y, z, w)),
        Material(rgba=color_of(model, geom)),
        1.0,
        owner,
    )
    if shape is not None and (coated := coats.put_on(geom, shape.mesh, shape.scale)) is not None:
        shape = replace(shape, mesh=coated[0], texture=coated[1], checker=None)
    return None if shape is None else ShapeAppearance(geometry=geometry, shape=shape)

"""The visual shapes of all bodies of a world as render shapes, kept up to date."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._lazy import LazyLogger, lazy_module
from roboyard.description.model import RGBA, Geometry, Mesh
from roboyard.errors import MeshError
from roboyard.shapes.mesh import NO_TRIANGLES, TriangleMesh
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine

if TYPE_CHECKING:
    from roboyard.rendering.scene import RenderScene
    from roboyard.sim.appearance.shape_appearance import ShapeAppearance

_of_models = lazy_module("roboyard.sim.appearance.mjcf_shapes")
_of_descriptions = lazy_module("roboyard.sim.appearance.shape_appearance")
_log = LazyLogger("roboyard")
_PLAIN = (bool, int, float, str, tuple)


class RenderShapes:
    """Visual shapes by body and link; nothing is loaded before the first picture."""

    def __init__(self, world: Engine[Body]) -> None:
        self._world = world
        self._by_body: dict[int, dict[int, list[ShapeAppearance]]] = {}
        self._dirty = True
        self._changes: dict[tuple[int, int, int, str], tuple[Body, Any]] = {}
        """New values by body, link, shape (-1: all) and field."""
        self._are_in_order = False
        """Whether they are in the order in which they apply; it matters where one is of a single shape."""
        self.deforming: dict[int, Callable[[], TriangleMesh]] = {}
        """By body id: the mesh of a soft body as it is now; the same object while it keeps its shape."""

    @cached_property
    def _scene(self) -> RenderScene:
        from roboyard.rendering.scene import RenderScene

        return RenderScene()

    def add(self, body: Body) -> None:
        """Note a new body; its shapes are collected for the next picture."""
        self._by_body.pop(body.id, None)
        self._dirty = True

    def forget(self, body_id: int) -> None:
        """Remove the shapes of a body that is removed."""
        self._by_body.pop(body_id, None)
        self.deforming.pop(body_id, None)
        if self._changes:
            self._changes = {key: value for key, value in self._changes.items() if key[0] != body_id}
        self._dirty = True

    def invalidate(self) -> None:
        """Note that rows of MuJoCo's arrays changed."""
        self._dirty = True

    def of(self, body: Body) -> dict[int, list[ShapeAppearance]]:
        """Return the shapes of a body by link index."""
        if self._changes:
            self._apply_changes()
        return self.without_late_changes(body)

    def without_late_changes(self, body: Body) -> dict[int, list[ShapeAppearance]]:
        """Return the shapes of a body by link index, without changes that are still to come."""
        if body.id not in self._by_body:
            self._by_body[body.id] = self.of_removed(body)
        return self._by_body[body.id]

    def of_removed(self, body: Body) -> dict[int, list[ShapeAppearance]]:
        """Return the shapes of a body by link index as it had them first; it may have been removed."""
        looks = _gather(body)
        if self._world.profile.keeps_textures:
            _keep_textures(looks)
        return looks

    def change(self, body: Body, link_index: int, shape_index: int, **fields: Any) -> None:
        """Replace fields of one render shape (rgba, texture, ...)."""
        look = self.of(body)[link_index][shape_index]
        if all(_is_same(getattr(look.shape, name), value) for name, value in fields.items()):
            return
        look.shape = replace(look.shape, **fields)
        self._dirty = True

    def recolor(self, body: Body, link_index: int, shape_index: int, rgba: RGBA) -> None:
        """Replace the colour of a link's render shape, or of all with -1, and of their meshes.

        The shapes change when they are next looked at.
        """
        self.change_later(body, link_index, shape_index, "rgba", rgba)

    def change_later(self, body: Body, link_index: int, shape_index: int, name: str, value: Any) -> None:
        """Replace a field of a link's render shape, or of all with -1, when they are next looked at."""
        key = body.id, link_index, shape_index, name
        if shape_index >= 0:
            self._are_in_order = True
        if self._are_in_order:
            self._changes.pop(key, None)
        self._changes[key] = body, value

    def _apply_changes(self) -> None:
        waiting, self._changes = self._changes, {}
        self._are_in_order = False
        for (_, link, place, name), (body, value) in waiting.items():
            for index, look in enumerate(self.without_late_changes(body).get(link, ())):
                shape = look.shape
                is_painted = name == "rgba" and shape.use_mesh_colors
                if place in (-1, index) and (is_painted or not _is_same(getattr(shape, name), value)):
                    fields: dict[str, Any] = {name: value}
                    if name == "texture" and value is not None and shape.mesh.uv is None:
                        fields["mesh"] = _with_coordinates(shape.mesh, look.geometry, body.scale)
                    if name == "rgba":
                        fields["use_mesh_colors"] = False
                    look.shape = replace(shape, **fields)
                    self._dirty = True

    def reshape(self, body: Body, geometry: Geometry) -> None:
        """Update a body's shapes of a geometry whose numbers have changed."""
        for looks in self._by_body.get(body.id, {}).values():
            for look in looks:
                if look.geometry is geometry:
                    triangles = _of_descriptions().triangles_of(geometry, body.scale)
                    assert triangles is not None
                    look.shape = replace(look.shape, mesh=triangles[0], scale=triangles[1])
                    self._dirty = True

    def scene(self) -> RenderScene:
        """Return the scene with every shape on its present MuJoCo row."""
        self._world.ensure_compiled()
        self._apply_changes()
        for body_id, drawn in self.deforming.items():
            look, mesh = self.of(self._world.body_by_id[body_id])[0][0], drawn()
            if look.shape.mesh is not mesh:
                look.shape = replace(look.shape, mesh=mesh)
                self._dirty = True
        if self._dirty:
            shapes = []
            for body in self._world.body_by_id.values():
                for link_index, looks in self.of(body).items():
                    row = int(body.mujoco_ids[link_index])
                    for look in looks:
                        if look.shape.frame != row:
                            look.shape = replace(look.shape, frame=row)
                        shapes.append(look.shape)
            self._scene.shapes = tuple(shapes)
            self._scene.revision += 1
            self._dirty = False
        return self._scene


def _is_same(old: Any, new: Any) -> bool:
    """Return whether a field keeps its value; arrays and meshes do only where they are the same object."""
    return old is new or (isinstance(new, _PLAIN) and type(old) is type(new) and old == new)


def _with_coordinates(mesh: TriangleMesh, geometry: Geometry, scale: float) -> TriangleMesh:
    """Return a mesh with the texture coordinates of its file, else with an image's centre, as in Bullet.

    Args:
        mesh: of a geometry, without texture coordinates (m).
        geometry: from which file and with which scale it is.
        scale: of the body.
    """
    from roboyard.shapes.load import load_for_texture, scaled

    if isinstance(geometry, Mesh) and geometry.path is not None and geometry.data is None:
        found = load_for_texture(geometry.path)
        if found is not None:
            x, y, z = geometry.scale
            return scaled(found, (x * scale, y * scale, z * scale))
    return replace(mesh, uv=np.full((len(mesh.vertices), 2), 0.5))


def _keep_textures(looks: dict[int, list[ShapeAppearance]]) -> None:
    for look in (look for of_link in looks.values() for look in of_link):
        shape, geometry = look.shape, look.geometry
        path = geometry.path if isinstance(geometry, Mesh) else None
        if path is not None and path.suffix.lower() != ".obj":
            continue  # Bullet reads images of no other file
        if shape.texture is None and shape.mesh.texture is not None:
            look.shape = replace(shape, texture=shape.mesh.texture)


def _gather(body: Body) -> dict[int, list[ShapeAppearance]]:
    if body.description is None:
        return _of_models().shapes_of_model(body)
    found: dict[int, list[ShapeAppearance]] = {}
    one = _of_descriptions()
    links = [record.link for record in body.form.links]
    draw_collisions = not any(link.visuals for link in links if link is not None)
    for index, link in enumerate(links):
        assert link is not None
        shapes = link.collisions if draw_collisions else link.visuals
        for shape in shapes:
            material = None if draw_collisions else getattr(shape, "material", None)
            geometry, origin, owner = shape.geometry, shape.origin, (body.id, index)
            try:
                render = one.render_shape(geometry, origin, material, body.scale, owner)
            except MeshError as problem:
                _log.warning("%s: %s; shown as nothing", body.name, problem)
                geometry = replace(geometry, data=NO_TRIANGLES)
                render = one.render_shape(geometry, origin, material, body.scale, owner)
            if render is not None:
                found.setdefault(index, []).append(one.ShapeAppearance(geometry=geometry, shape=render))
    return found

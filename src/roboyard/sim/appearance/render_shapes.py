"""What a world looks like: the visual shapes of its bodies as render shapes, kept up to date."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.model import (
    RGBA,
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
from roboyard.rendering.scene import RenderScene, RenderShape
from roboyard.transforms import matrix_from_quaternion

if TYPE_CHECKING:
    from roboyard.shapes.mesh import TriangleMesh
    from roboyard.sim.body import Body
    from roboyard.sim.world import World

DEFAULT_RGBA: RGBA = (0.7, 0.7, 0.7, 1.0)
PLANE_HALF_SIZE = 50.0
"""m: the piece of an endless plane that is a mesh; cameras draw the rest to the horizon."""
CHECKER_SQUARE = 1.0
"""m"""


@dataclass(kw_only=True, slots=True)
class ShapeAppearance:
    """One visual shape of a link; change its fields through `RenderShapes.change`."""

    geometry: Geometry
    shape: RenderShape


class RenderShapes:
    """Visual shapes by body and link. Nothing is loaded before the first picture."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._by_body: dict[int, dict[int, list[ShapeAppearance]]] = {}
        self._scene = RenderScene()
        self._dirty = True

    def add(self, body: Body) -> None:
        """A body came; its shapes are gathered when a picture is taken."""
        self._by_body.pop(body.id, None)
        self._dirty = True

    def forget(self, body_id: int) -> None:
        self._by_body.pop(body_id, None)
        self._dirty = True

    def invalidate(self) -> None:
        """MuJoCo's rows moved."""
        self._dirty = True

    def of(self, body: Body) -> dict[int, list[ShapeAppearance]]:
        """Shapes of a body by link index."""
        if body.id not in self._by_body:
            looks = _gather(body)
            if self._world.profile.keeps_textures:
                _keep_textures(looks)
            self._by_body[body.id] = looks
        return self._by_body[body.id]

    def change(self, body: Body, link_index: int, shape_index: int, **fields: Any) -> None:
        """Replace fields of one render shape (rgba, texture, ...)."""
        look = self.of(body)[link_index][shape_index]
        look.shape = replace(look.shape, **fields)
        self._dirty = True

    def reshape(self, body: Body, geometry: Geometry) -> None:
        """Draw a body's shapes of this geometry anew; its numbers have changed."""
        for looks in self._by_body.get(body.id, {}).values():
            for look in looks:
                if look.geometry is geometry:
                    triangles = triangles_of(geometry, body.scale)
                    assert triangles is not None
                    look.shape = replace(look.shape, mesh=triangles[0], scale=triangles[1])
                    self._dirty = True

    def scene(self) -> RenderScene:
        """The scene with every shape on its present MuJoCo row."""
        self._world.ensure_compiled()
        if self._dirty:
            shapes = []
            for body in self._world.bodies:
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


def _keep_textures(looks: dict[int, list[ShapeAppearance]]) -> None:
    for look in (look for of_link in looks.values() for look in of_link):
        shape = look.shape
        if shape.texture is None and shape.mesh.texture is not None:
            look.shape = replace(shape, texture=shape.mesh.texture)


def _gather(body: Body) -> dict[int, list[ShapeAppearance]]:
    if body.description is None:
        from roboyard.sim.mjcf import looks_of_model

        return looks_of_model(body)
    found: dict[int, list[ShapeAppearance]] = {}
    links = [record.link for record in body.built.links]
    draw_collisions = not any(link.visuals for link in links if link is not None)
    for index, link in enumerate(links):
        assert link is not None
        shapes = link.collisions if draw_collisions else link.visuals
        for shape in shapes:
            material = None if draw_collisions else getattr(shape, "material", None)
            render = render_shape(shape.geometry, shape.origin, material, body.scale, (body.id, index))
            if render is not None:
                found.setdefault(index, []).append(ShapeAppearance(geometry=shape.geometry, shape=render))
    return found


def render_shape(
    geometry: Geometry, origin: Pose, material: Material | None, scale: float, owner: tuple[int, int]
) -> RenderShape | None:
    """A geometry with its material as a render shape, frame 0 until placed; None: nothing to draw."""
    triangles = triangles_of(geometry, scale)
    if triangles is None:
        return None
    mesh, factors = triangles
    rotation = matrix_from_quaternion(origin.quaternion)
    rgba = material.rgba if material is not None and material.rgba is not None else None
    extra: dict[str, Any] = {}
    if isinstance(geometry, Plane):
        from roboyard.sim.build.geoms import turn_z_to

        rotation = rotation @ matrix_from_quaternion(turn_z_to(np.asarray(geometry.normal, dtype=float)))
        base = rgba or DEFAULT_RGBA
        extra["checker"] = ((base[0] * 0.82, base[1] * 0.84, base[2] * 0.88), CHECKER_SQUARE)
        extra["infinite"] = True
    if material is not None and material.texture is not None:
        extra["texture"] = load_texture(material.texture)
    return RenderShape(
        mesh=mesh,
        scale=factors,
        position=np.asarray(origin.position, dtype=float) * scale,
        rotation=rotation,
        frame=0,
        owner=owner,
        rgba=rgba or ((1.0, 1.0, 1.0, 1.0) if has_own_colors(mesh) else DEFAULT_RGBA),
        use_mesh_colors=rgba is None,
        **extra,
    )


def has_own_colors(mesh: TriangleMesh) -> bool:
    """Whether the mesh file says what colour it has."""
    return mesh.colors is not None or mesh.texture is not None


def triangles_of(geometry: Geometry, scale: float) -> tuple[TriangleMesh, tuple[float, float, float]] | None:
    """A mesh and the factors that stretch it to this geometry; None for a mesh that was not found."""
    from roboyard.shapes import primitives
    from roboyard.sim.build.geoms import load_scaled

    one = (1.0, 1.0, 1.0)
    match geometry:
        case Box(size=(x, y, z)):
            return primitives.box(), (x * scale, y * scale, z * scale)
        case Sphere(radius=radius):
            d = 2 * radius * scale
            return primitives.sphere(), (d, d, d)
        case Cylinder(radius=radius, length=length):
            return primitives.cylinder(), (2 * radius * scale, 2 * radius * scale, length * scale)
        case Capsule(radius=radius, length=length):
            if length < 1e-6:
                d = 2 * radius * scale
                return primitives.sphere(), (d, d, d)
            return primitives.capsule(radius * scale, length * scale), one
        case Plane():
            return primitives.plane(PLANE_HALF_SIZE, PLANE_HALF_SIZE), one
        case Mesh():
            mesh = load_scaled(geometry, scale)
            return None if mesh is None else (mesh, one)
        case Heightfield(heights=heights, cell=(dx, dy)):
            nx, ny = heights.shape
            mesh = primitives.heightfield(
                np.asarray(heights).T * scale, (nx - 1) * dx * scale, (ny - 1) * dy * scale
            )
            return mesh, one


def load_texture(path: Path) -> np.ndarray | None:
    """(h, w, 4) RGBA of an image file, the same array for the same file; None where it cannot be read."""
    from roboyard.shapes.readers.external_files import load_image_file

    try:
        return load_image_file(path, path.name)
    except OSError:
        return None

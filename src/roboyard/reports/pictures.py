"""Pictures of a robot description, right or wrong, with some links picked out."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from roboyard.description.urdf.elements import LinkElement, ShapeElement
from roboyard.description.urdf.parse import UrdfElements
from roboyard.errors import MeshError
from roboyard.rendering import STUDIO, Camera, RenderScene, RenderShape, png_bytes, render
from roboyard.shapes import primitives
from roboyard.shapes.load import load_mesh, scaled
from roboyard.shapes.mesh import TriangleMesh, bounding_box
from roboyard.shapes.simplify import for_small_pictures
from roboyard.transforms import Array

Kind = Literal["visual", "collision"]
RGBA = tuple[float, float, float, float]

PLAIN: RGBA = (0.62, 0.65, 0.70, 1.0)
FADED: RGBA = (0.55, 0.58, 0.63, 0.28)
EVEN = (0.94, 0.95, 0.96)
"""Background of small pictures."""
FOVY = math.radians(32.0)
VIEW = np.array([0.72, -1.0, 0.55])
"""From the robot towards the camera."""
_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])


@dataclass(frozen=True, kw_only=True, eq=False)
class SceneView:
    """A robot ready to be photographed; shapes of known size only."""

    scene: RenderScene
    positions: Array
    rotations: Array
    bounds: dict[str, Array]
    """Link to the (2, 3) box round its shapes in the root frame; m."""

    @property
    def is_empty(self) -> bool:
        """True where there is nothing to see."""
        return not self.scene.shapes

    def points(self) -> Array:
        """(n, 3) vertices of all shapes in the root frame; m."""
        clouds = [
            ((s.mesh.vertices * s.scale) @ s.rotation.T + s.position) @ self.rotations[s.frame].T
            + self.positions[s.frame]
            for s in self.scene.shapes
        ]
        return np.concatenate(clouds) if clouds else np.zeros((0, 3))

    def picture(
        self,
        focus: Collection[str] = (),
        *,
        around: Array | None = None,
        width: int = 640,
        height: int = 480,
        plain: bool = False,
    ) -> bytes:
        """PNG of the whole robot.

        Args:
            focus: links to go up to, with some room around.
            around: (n, 3) points to have just in view instead; m.
            width: pixels.
            height: pixels.
            plain: on an even background, for many small pictures.
        """
        boxes = [self.bounds[name] for name in focus if name in self.bounds] or list(self.bounds.values())
        lower = np.min([box[0] for box in boxes], axis=0)
        upper = np.max([box[1] for box in boxes], axis=0)
        seen = _corners(lower, upper) if around is None else around
        target = bounding_box(seen).sum(axis=0) / 2.0
        back = VIEW / np.linalg.norm(VIEW)
        room = 2.0 if focus and around is None else 1.1
        distance = _distance(seen - target, back, width / height) * room
        camera = Camera.look_at(
            eye=target + distance * back,
            target=target,
            width=width,
            height=height,
            fovy=FOVY,
            near=distance / 200.0,
            far=distance * 20.0,
        )
        image = render(
            self.scene,
            self.positions,
            self.rotations,
            camera,
            background=EVEN if plain else STUDIO,
            samples=4,
            shadow=False,
        )
        return png_bytes(image, colors=255)


def _corners(lower: Array, upper: Array) -> Array:
    """(8, 3) corners of a box."""
    ends = np.stack([lower, upper])
    return np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])


def _distance(points: Array, back: Array, aspect: float) -> float:
    """How far along `back` a camera must stand to see all points, which lie round what it looks at."""
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    half = math.tan(FOVY / 2.0)
    needed = np.maximum(np.abs(points @ up) / half, np.abs(points @ right) / (half * aspect)) + points @ back
    return max(float(needed.max()), 1e-3)


def view_of(
    draft: UrdfElements,
    *,
    kind: Kind = "visual",
    marked: Collection[str] = (),
    color: RGBA = PLAIN,
    strict: bool = False,
) -> SceneView:
    """The robot at rest, in its own colours; where links are `marked`, those in `color` and the others faded.

    A link without shapes of the `kind` shows its others, unless `strict`.
    """

    def drawn(link: LinkElement, frame: int) -> Iterator[RenderShape]:
        rgba = None if not marked else (color if link.name in marked else FADED)
        for shape in _shown(link, kind, strict):
            if (found := _render_shape(shape, draft, frame, rgba)) is not None:
                yield found

    frames = draft.tree.frames
    return gathered(
        (link.name, frames[link.name], partial(drawn, link))
        for link in draft.link_by_name.values()
        if link.name in frames and np.isfinite(frames[link.name]).all()
    )


def gathered(links: Iterable[tuple[str, Array, Callable[[int], Iterable[RenderShape]]]]) -> SceneView:
    """Sight of links, each with its name, its (4, 4) pose in the root's frame and what gives its shapes.

    The last is called with the number that the link's frame has in the sight.
    """
    shapes: list[RenderShape] = []
    positions: list[Array] = []
    rotations: list[Array] = []
    bounds: dict[str, Array] = {}
    for name, pose, shapes_in in links:
        drawn = list(shapes_in(len(positions)))
        if not drawn:
            continue
        positions.append(pose[:3, 3])
        rotations.append(pose[:3, :3])
        shapes += drawn
        bounds[name] = _bounds(drawn, pose)
    return SceneView(
        scene=RenderScene(shapes=shapes),
        positions=np.array(positions).reshape(-1, 3),
        rotations=np.array(rotations).reshape(-1, 3, 3),
        bounds=bounds,
    )


def _shown(link: LinkElement, kind: Kind, strict: bool) -> list[ShapeElement]:
    first, second = (link.visuals, link.collisions) if kind == "visual" else (link.collisions, link.visuals)
    return first or ([] if strict else second)


def _render_shape(
    shape: ShapeElement, draft: UrdfElements, frame: int, rgba: RGBA | None
) -> RenderShape | None:
    mesh = _triangles(shape)
    if mesh is None or not np.isfinite(shape.origin).all():
        return None
    own = None if rgba is not None else _color(shape, draft)
    plain = (1.0, 1.0, 1.0, 1.0) if mesh.colors is not None or mesh.texture is not None else PLAIN
    return RenderShape(
        mesh=for_small_pictures(mesh),
        position=shape.origin[:3, 3],
        rotation=shape.origin[:3, :3],
        frame=frame,
        owner=(0, frame),
        rgba=rgba or own or plain,
        use_mesh_colors=rgba is None and own is None,
    )


def _triangles(shape: ShapeElement) -> TriangleMesh | None:
    if shape.mesh is not None:
        path = shape.mesh.found.path
        if path is None or shape.mesh.stats is None or not all(shape.mesh.scale):
            return None
        try:
            return scaled(load_mesh(path), shape.mesh.scale)
        except (MeshError, ValueError):
            return None
    if shape.size is None or shape.geometry is None or not 0 < min(shape.size) <= max(shape.size) < 1e4:
        return None
    match shape.geometry.tag:
        case "box":
            x, y, z = shape.size
            return primitives.box(x / 2.0, y / 2.0, z / 2.0)
        case "sphere":
            return primitives.sphere(shape.size[0])
        case "cylinder":
            return primitives.cylinder(*shape.size)
        case "capsule":
            return primitives.capsule(*shape.size)
    return None


def _color(shape: ShapeElement, draft: UrdfElements) -> RGBA | None:
    element = shape.element.find("material")
    if element is None:
        return None
    named = [m for m in draft.materials if m.element is element]
    named += [m for m in draft.materials if m.name and m.name == element.get("name") and m.rgba is not None]
    for material in named:
        if material.rgba is not None:
            red, green, blue, *alpha = (min(max(value, 0.0), 1.0) for value in material.rgba)
            return red, green, blue, alpha[0] if alpha else 1.0
    return None


def _bounds(drawn: list[RenderShape], pose: Array) -> Array:
    """(2, 3) box in the root frame round the shapes' own boxes."""
    boxes = [s.mesh.bounds[_CORNERS, (0, 1, 2)] for s in drawn]
    clouds = [(b * s.scale) @ s.rotation.T + s.position for b, s in zip(boxes, drawn, strict=True)]
    points = np.concatenate(clouds) @ pose[:3, :3].T + pose[:3, 3]
    return bounding_box(points)

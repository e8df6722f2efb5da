"""Nodes of the page's scene: one frame for each link, with the link's shapes below it."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from time import monotonic
from typing import Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard.rendering.scene import RenderShape
from roboyard.transforms import quaternion_from_matrix, to_wxyz
from roboyard.viewer.scene.coarse import CoarseMeshes
from roboyard.viewer.scene.drags import Drag, drag_of
from roboyard.viewer.scene.glb import glb, triangles
from roboyard.viewer.scene.snapshot import Links

log = logging.getLogger(__name__)

STILL = 1e-6
"""Smallest motion that is sent: position (m) and quaternion component."""

SHEET = 1e-4
"""Thickness below which a shape casts no shadow (m)."""
GROUND, FLATNESS = 5.0, 0.05
"""Width (m) and thickness over width: wider and flatter shapes (terrain) cast no shadow either, as they
would shade themselves."""

HIGHLIGHT = (1.0, 0.45, 0.05, 1.0)
"""RGBA of the selected link."""

OVERLAP = 1.0
"""Time for which a coarse mesh stays after the full one was sent, which pages decode meanwhile (s)."""

Look = tuple[Any, ...]


class SceneNodes:
    """Updates the nodes of a viser scene to shapes and poses."""

    def __init__(self, scene: Any) -> None:
        """Start without nodes; `scene` is a `viser.SceneApi`."""
        self._scene = scene
        self._frames: dict[str, Any] = {}
        self._shapes: dict[Look, tuple[Any, RenderShape]] = {}
        self._shown: Sequence[RenderShape] | None = None
        self._links: Links | None = None
        self._rows = np.zeros(0, dtype=np.intp)
        self._positions = np.zeros((0, 3))
        self._quaternions = np.zeros((0, 4))
        self._count = 0
        self.on_click: Callable[[tuple[int, int]], None] | None = None
        """Called with body id and link index of a clicked shape; set it before `show`."""
        self._on_drag: Callable[[Drag], None] | None = None
        self._drag_keys: tuple[Any, ...] = ()
        self._visible = True
        self._wireframe = False
        self._tinted: tuple[int, int] | None = None
        self._hidden: set[tuple[int, int]] = set()
        self._opacity: dict[tuple[int, int], float] = {}
        self.is_detailed = False
        """Whether new shapes are sent with all their triangles, and `refine` replaces coarse ones."""
        self._coarse = CoarseMeshes()
        self._rough: set[Look] = set()
        """Shapes that were sent coarse."""
        self._replaced: list[tuple[float, Any]] = []
        """Time and handle of coarse meshes that were replaced."""

    def show(self, shapes: Sequence[RenderShape], links: Links) -> None:
        """Replace the nodes by those of these links and shapes; unchanged ones are not sent again."""
        if shapes is self._shown and links is self._links:
            return
        self._show_links(links)
        needed: dict[Look, RenderShape] = {}
        for shape in shapes:
            if shape.owner in links.paths:
                drawn = self._painted(shape)
                needed[_look(links.paths[shape.owner], drawn)] = drawn
        for look in [look for look in self._shapes if look not in needed]:
            handle, _ = self._shapes.pop(look)
            self._rough.discard(look)
            if look[0] in self._frames:
                handle.remove()
        if not self.is_detailed:
            self._coarse.prepare(needed.values())
        for look, shape in needed.items():
            if look not in self._shapes:
                drawn = shape if self.is_detailed else self._coarse.of(shape)
                handle = self._add(look[0], drawn)
                if handle is not None:
                    self._shapes[look] = handle, shape
                    if drawn is not shape:
                        self._rough.add(look)
        self._shown = shapes

    def refine(self) -> None:
        """Replace one coarse mesh by the full one, once shapes are detailed; call it for each update."""
        now = monotonic()
        while self._replaced and now - self._replaced[0][0] > OVERLAP:
            self._replaced.pop(0)[1].remove()
        if self.is_detailed and self._rough:
            look = self._rough.pop()
            coarse, shape = self._shapes[look]
            handle = self._add(look[0], shape)
            if handle is not None:
                self._shapes[look] = handle, shape
                self._replaced.append((monotonic(), coarse))

    def _drop_replaced(self) -> None:
        for _, handle in self._replaced:
            handle.remove()
        self._replaced.clear()

    def _show_links(self, links: Links) -> None:
        if links is self._links:
            return
        self._drop_replaced()
        for path in [path for path in self._frames if path not in links.rows]:
            for look in [look for look in self._shapes if look[0] == path]:
                self._shapes.pop(look)[0].remove()
                self._rough.discard(look)
            self._frames.pop(path).remove()
        for path in links.rows:
            if path not in self._frames:
                self._frames[path] = self._scene.add_frame(path, show_axes=False)
        self._drop_empty_bodies(links)
        self._links = links
        paths = list(self._frames)
        self._rows = np.array([links.rows[path] for path in paths], dtype=np.intp)
        self._positions = np.array([self._frames[path].position for path in paths]).reshape(-1, 3)
        self._quaternions = np.array([self._frames[path].wxyz for path in paths]).reshape(-1, 4)

    def _drop_empty_bodies(self, links: Links) -> None:
        kept = {path.split("/")[1] for path in links.rows}
        bodies = {path.split("/")[1] for path in (self._links.rows if self._links is not None else ())}
        for body in bodies - kept:
            self._scene.remove_by_name(f"/{body}")

    def _add(self, path: str, shape: RenderShape) -> Any:
        try:
            if self._wireframe and not shape.infinite:
                color = tuple(round(255 * value) for value in shape.rgba[:3])
                data: tuple[Any, ...] = triangles(shape)
                opacity = shape.rgba[3] if shape.rgba[3] < 1.0 else None
                add = partial(self._scene.add_mesh_simple, color=color, wireframe=True, opacity=opacity)
            else:
                data = (glb(shape),)
                add = self._scene.add_glb
        except (ValueError, OSError) as error:
            log.warning("a shape of %s cannot be shown: %s", path, error)
            return None
        self._count += 1
        handle = add(
            f"{path}/visual {self._count}",
            *data,
            position=tuple(float(v) for v in shape.position),
            wxyz=tuple(to_wxyz(quaternion_from_matrix(np.asarray(shape.rotation, dtype=float)))),
            cast_shadow=not _is_ground(shape),
            visible=self._is_visible(shape),
        )
        if self.on_click is not None:
            click, owner = self.on_click, shape.owner
            handle.on_click(lambda _: click(owner))
        self._listen(handle, shape)
        return handle

    def set_wireframe(self, wireframe: bool) -> None:
        """Draw only the edges of triangles, except of floors."""
        if wireframe != self._wireframe:
            self._wireframe = wireframe
            self._redraw()

    def set_drag(self, on_drag: Callable[[Drag], None] | None, keys: Sequence[str | None] = (None,)) -> None:
        """Call `on_drag` while the left button drags a movable link; None: dragging turns the camera.

        It is called in the thread of the server's event loop.

        Args:
            on_drag: receives the drags.
            keys: held keys with which the mouse drags, such as "cmd/ctrl"; None: without a key.
        """
        if on_drag == self._on_drag and tuple(keys) == self._drag_keys:
            return
        self._on_drag, self._drag_keys = on_drag, tuple(keys)
        self._drop_replaced()
        for handle, shape in self._shapes.values():
            handle.remove_drag_callback()
            self._listen(handle, shape)

    def _listen(self, handle: Any, shape: RenderShape) -> None:
        on_drag = self._on_drag
        if on_drag is None or self._links is None or shape.owner in self._links.fixed:
            return

        async def on_event(event: Any) -> None:
            # a coroutine runs in the event loop, in order
            on_drag(drag_of(event, shape.owner))

        for key in self._drag_keys:
            handle.on_drag("left", modifier=key)(on_event)

    def _redraw(self) -> None:
        """Create all shapes again."""
        self._drop_replaced()
        for handle, _ in self._shapes.values():
            handle.remove()
        self._shapes.clear()
        self._rough.clear()
        shapes, self._shown = self._shown, None
        if shapes is not None and self._links is not None:
            self.show(shapes, self._links)

    def set_visible(self, visible: bool) -> None:
        """Show or hide all shapes except floors."""
        self._visible = visible
        self._drop_replaced()
        for handle, shape in self._shapes.values():
            handle.visible = self._is_visible(shape)

    def _is_visible(self, shape: RenderShape) -> bool:
        return shape.infinite or (self._visible and shape.owner not in self._hidden)

    def hide(self, owner: tuple[int, int], hidden: bool) -> None:
        """Hide the shapes of a link (body id, link index), or show them again."""
        (self._hidden.add if hidden else self._hidden.discard)(owner)
        self._drop_replaced()
        for handle, shape in self._shapes.values():
            if shape.owner == owner:
                handle.visible = self._is_visible(shape)

    def fade(self, owner: tuple[int, int], opacity: float) -> None:
        """Multiply the opacity of the shapes of a link (body id, link index) by a factor up to 1."""
        if opacity != self._opacity.get(owner, 1.0):
            self._opacity[owner] = opacity
            self._repaint()

    def _painted(self, shape: RenderShape) -> RenderShape:
        """Return a shape in the colour and opacity in which it is drawn."""
        drawn = _tinted(shape) if shape.owner == self._tinted else shape
        opacity = self._opacity.get(shape.owner, 1.0)
        if opacity == 1.0:
            return drawn
        r, g, b, alpha = drawn.rgba
        return replace(drawn, rgba=(r, g, b, alpha * opacity))

    def _repaint(self) -> None:
        """Send the shapes whose colour or opacity changed."""
        shapes, self._shown = self._shown, None
        if shapes is not None and self._links is not None:
            self.show(shapes, self._links)

    def tint(self, owner: tuple[int, int] | None) -> None:
        """Draw the shapes of a link (body id, link index) in `HIGHLIGHT`; None: of no link."""
        if owner == self._tinted:
            return
        self._tinted = owner
        self._repaint()

    def move(self, positions: NDArray, quaternions: NDArray) -> int:
        """Send the poses of links that moved; returns their number.

        Args:
            positions: (nbody, 3) positions in the world frame (m), rows as in MuJoCo.
            quaternions: (nbody, 4) orientations w, x, y, z in the world frame.
        """
        if not len(self._rows):
            return 0
        places, turns = positions[self._rows], quaternions[self._rows]
        shifted = np.abs(places - self._positions).max(axis=1) > STILL
        turned = np.abs(turns - self._quaternions).max(axis=1) > STILL
        frames = list(self._frames.values())
        for k in np.flatnonzero(shifted):
            frames[k].position = places[k]
        for k in np.flatnonzero(turned):
            frames[k].wxyz = turns[k]
        self._positions[shifted], self._quaternions[turned] = places[shifted], turns[turned]
        return int((shifted | turned).sum())


def _is_ground(shape: RenderShape) -> bool:
    """Return whether a shape is a floor, terrain or another flat piece, which would shade itself in spots."""
    if shape.infinite:
        return True
    thin, wide, _ = sorted(np.ptp(shape.mesh.vertices, axis=0) * np.abs(shape.scale))
    return bool(thin < SHEET or (wide > GROUND and thin < FLATNESS * wide))


def _tinted(shape: RenderShape) -> RenderShape:
    return replace(shape, rgba=HIGHLIGHT, use_mesh_colors=False, texture=None, checker=None)


def _look(path: str, shape: RenderShape) -> Look:
    """Return the identity of a drawn shape: its node's path and all properties that change its appearance."""
    return (
        path,
        id(shape.mesh),
        shape.scale,
        tuple(shape.rgba),
        shape.use_mesh_colors,
        shape.checker,
        id(shape.texture),
        shape.specular,
        shape.infinite,
        np.asarray(shape.position, dtype=float).tobytes(),
        np.asarray(shape.rotation, dtype=float).tobytes(),
    )

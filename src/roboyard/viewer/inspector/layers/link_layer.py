"""Layers of a robot that are shown and faded link by link: its visual meshes and its collision shapes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.transforms import quaternion_from_matrix, to_wxyz
from roboyard.viewer.scene.glb import glb

if TYPE_CHECKING:
    from roboyard.description.model import Geometry, Pose
    from roboyard.sim.body import Body
    from roboyard.sim.link import Link
    from roboyard.viewer.viewer import Viewer

Drawn = tuple["Geometry", "Pose"]
FAINTEST = 0.05
"""Least opacity of a link that is shown."""


class LinkLayer:
    """Which links a layer shows, and how opaque; a subclass draws them."""

    def __init__(self, viewer: Viewer, body: Body, opacity: float) -> None:
        """Start with no link shown; `opacity` is that of links that were not faded."""
        self._viewer, self._body, self._default = viewer, body, opacity
        self._opacity: dict[str, float] = {}
        self.shown: set[str] = set()
        """Names of the links that are shown."""

    @property
    def is_on(self) -> bool:
        """Whether any link is shown."""
        return bool(self.shown)

    @property
    def all_nodes(self) -> list[Any]:
        """The scene nodes that the layer has made."""
        return []

    def has(self, name: str) -> bool:
        """Return whether a link has anything to show in this layer."""
        raise NotImplementedError

    def opacity_of(self, name: str) -> float:
        """Return the opacity of a link, up to 1."""
        return self._opacity.get(name, self._default)

    def show(self, on: bool) -> None:
        """Show or hide all links."""
        with self._viewer.server.atomic():
            for link in self._body.links:
                self.show_link(link.name, on)

    def show_link(self, name: str, on: bool) -> None:
        """Show or hide one link."""
        if on != (name in self.shown):
            (self.shown.add if on else self.shown.discard)(name)
            self._show(name, on)

    def fade(self, name: str, opacity: float) -> None:
        """Set the opacity of a link, up to 1; it is at least `FAINTEST`."""
        opacity = float(np.clip(opacity, FAINTEST, 1.0))
        if opacity != self.opacity_of(name):
            self._opacity[name] = opacity
            self._fade(name, opacity)

    def _show(self, name: str, on: bool) -> None:
        raise NotImplementedError

    def _fade(self, name: str, opacity: float) -> None:
        raise NotImplementedError


class VisualLayer(LinkLayer):
    """The visual meshes, which the viewer draws."""

    def __init__(self, viewer: Viewer, body: Body) -> None:
        """Start with all links shown."""
        super().__init__(viewer, body, 1.0)
        self.shown = {link.name for link in body.links}
        owners = {shape.owner for shape in viewer.world.render_scene().shapes}
        self._with_shapes = {link.name for link in body.links if (body.id, link.index) in owners}

    def has(self, name: str) -> bool:
        """Return whether a link has such shapes."""
        return name in self._with_shapes

    def _show(self, name: str, on: bool) -> None:
        self._viewer.show_link(self._body.link(name), on)

    def _fade(self, name: str, opacity: float) -> None:
        self._viewer.fade_link(self._body.link(name), opacity)


class ShapeLayer(LinkLayer):
    """Shapes of the description in a colour of their own; nodes are created when a link is first shown."""

    def __init__(
        self,
        viewer: Viewer,
        body: Body,
        label: str,
        opacity: float,
        shapes_of: Callable[[Link], Sequence[Drawn]],
        colour_of: Callable[[str], Sequence[float]],
    ) -> None:
        """Start hidden.

        Args:
            viewer: the page.
            body: the robot.
            label: name of the nodes.
            opacity: opacity of links that were not faded.
            shapes_of: returns the geometries of a link, with their poses there.
            colour_of: returns the RGB colour of the link of a name.
        """
        super().__init__(viewer, body, opacity)
        self._label, self._shapes_of, self._colour_of = label, shapes_of, colour_of
        self.nodes: dict[str, list[Any]] = {}
        """Name of a link to its nodes."""
        self._count = 0

    @property
    def all_nodes(self) -> list[Any]:
        """The scene nodes that the layer has made."""
        return [node for nodes in self.nodes.values() for node in nodes]

    def has(self, name: str) -> bool:
        """Return whether a link has such shapes."""
        return bool(self._shapes_of(self._body.link(name)))

    def _show(self, name: str, on: bool) -> None:
        if on and name not in self.nodes:
            self.nodes[name] = self._draw(self._body.link(name))
        for node in self.nodes.get(name, ()):
            node.visible = on

    def _fade(self, name: str, opacity: float) -> None:
        old = self.nodes.pop(name, [])
        with self._viewer.server.atomic():
            if name in self.shown:
                self._show(name, True)
            for node in old:
                node.remove()

    def clear(self) -> None:
        """Remove all nodes from the scene."""
        for nodes in self.nodes.values():
            for node in nodes:
                node.remove()
        self.nodes.clear()
        self.shown.clear()

    def _draw(self, link: Link) -> list[Any]:
        from roboyard.description.model import Material
        from roboyard.sim.appearance.shape_appearance import render_shape

        made, click = [], self._viewer.nodes.on_click
        r, g, b = (float(value) for value in self._colour_of(link.name))
        paint = Material(rgba=(r, g, b, self.opacity_of(link.name)))
        for geometry, origin in self._shapes_of(link):
            shape = render_shape(geometry, origin, paint, self._body.scale, (0, 0))
            if shape is None:
                continue
            self._count += 1
            node = self._viewer.server.scene.add_glb(
                f"{self._viewer.path_of(link)}/{self._label} {self._count}",
                glb(shape),
                position=np.asarray(shape.position, dtype=float),
                wxyz=to_wxyz(quaternion_from_matrix(np.asarray(shape.rotation, dtype=float))),
                cast_shadow=False,
                receive_shadow=False,
            )
            if click is not None:
                node.on_click(lambda _: click((self._body.id, link.index)))
            made.append(node)
        return made

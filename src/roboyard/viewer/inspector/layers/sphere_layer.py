"""Planning spheres in the scene; a click picks one."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.viewer.inspector.edits.edit_state import EditedSphere, EditState
from roboyard.viewer.inspector.layers.link_layer import LinkLayer

if TYPE_CHECKING:
    from roboyard.sim.body import Body
    from roboyard.viewer.viewer import Viewer

BLUE, PICKED = (40, 110, 230), (250, 120, 10)


OPACITY = 0.4


class SphereLayer(LinkLayer):
    """One node for each link with spheres."""

    def __init__(
        self, viewer: Viewer, body: Body, edits: EditState, on_pick: Callable[[str, int], None]
    ) -> None:
        """Start hidden; `on_pick` is called in any thread with link name and index of a clicked sphere."""
        super().__init__(viewer, body, OPACITY)
        self._edits, self._on_pick = edits, on_pick
        self.nodes: dict[str, Any] = {}
        """Name of a link to the node of its spheres."""
        self.picked: EditedSphere | None = None

    @property
    def all_nodes(self) -> list[Any]:
        """The scene nodes that the layer has made."""
        return list(self.nodes.values())

    def path_of(self, name: str) -> str:
        """Return the path of a link's node."""
        return self._viewer.path_of(self._body.link(name))

    def has(self, name: str) -> bool:
        """Return whether a link has such shapes."""
        return bool(self._edits.spheres.get(name))

    def _show(self, name: str, on: bool) -> None:
        if name in self.nodes:
            self.nodes[name].visible = on
        self.draw(name)

    def _fade(self, name: str, opacity: float) -> None:
        if name in self.nodes:
            self.nodes[name].opacity = opacity

    def redraw(self) -> None:
        """Update the spheres of all links that are shown."""
        with self._viewer.server.atomic():
            for link in self._body.links:  # also those without spheres now
                self.draw(link.name)

    def clear(self) -> None:
        """Remove all nodes from the scene."""
        for node in self.nodes.values():
            node.remove()
        self.nodes.clear()
        self.shown.clear()

    def draw(self, name: str) -> None:
        """Update the spheres of one link."""
        from roboyard.shapes import primitives

        if name not in self.shown:
            return
        old = self.nodes.pop(name, None)
        if old is not None:
            old.remove()
        spheres = self._edits.spheres.get(name)
        if not spheres:
            return
        unit = primitives.sphere(1.0, 20)
        node = self._viewer.server.scene.add_batched_meshes_simple(
            f"{self.path_of(name)}/planning spheres",
            unit.vertices,
            unit.faces,
            np.tile([1.0, 0.0, 0.0, 0.0], (len(spheres), 1)),
            np.array([sphere.center for sphere in spheres]),
            batched_scales=np.array([sphere.radius for sphere in spheres]),
            batched_colors=np.array(
                [PICKED if sphere is self.picked else BLUE for sphere in spheres], dtype=np.uint8
            ),
            opacity=self.opacity_of(name),
            cast_shadow=False,
            receive_shadow=False,
        )
        node.on_click(lambda event: self._on_pick(name, int(event.instance_index or 0)))
        self.nodes[name] = node

"""Planning spheres in the scene; a click picks one."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.viewer.inspector.edits.edit_state import EditedSphere, EditState

if TYPE_CHECKING:
    from roboyard.sim.body import Body
    from roboyard.viewer.viewer import Viewer

BLUE, PICKED = (40, 110, 230), (250, 120, 10)


class SphereLayer:
    """One node for each link with spheres."""

    def __init__(
        self, viewer: Viewer, body: Body, edits: EditState, on_pick: Callable[[str, int], None]
    ) -> None:
        """Start hidden; `on_pick` is called in any thread with link name and index of a clicked sphere."""
        self._viewer, self._body, self._edits, self._on_pick = viewer, body, edits, on_pick
        self.nodes: dict[str, Any] = {}
        self.is_on = False
        self.picked: EditedSphere | None = None

    def path_of(self, name: str) -> str:
        """Return the path of a link's node."""
        return self._viewer.path_of(self._body.link(name))

    def show(self, on: bool) -> None:
        """Show or hide all spheres."""
        self.is_on = on
        with self._viewer.server.atomic():
            for node in self.nodes.values():
                node.visible = on
            for link in self._body.links if on else ():  # also those without spheres now
                self.draw(link.name)

    def clear(self) -> None:
        """Remove all nodes from the scene."""
        for node in self.nodes.values():
            node.remove()
        self.nodes.clear()

    def draw(self, name: str) -> None:
        """Update the spheres of one link."""
        from roboyard.shapes import primitives

        if not self.is_on:
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
            opacity=0.4,
            cast_shadow=False,
            receive_shadow=False,
        )
        node.on_click(lambda event: self._on_pick(name, int(event.instance_index or 0)))
        self.nodes[name] = node

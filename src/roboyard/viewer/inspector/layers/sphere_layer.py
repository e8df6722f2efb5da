"""Planning spheres, drawn where the notes say; a click picks one."""

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
        self, viewer: Viewer, body: Body, notes: EditState, on_pick: Callable[[str, int], None]
    ) -> None:
        """Begin with nothing shown; `on_pick` is told link and number of a clicked sphere, in any thread."""
        self._viewer, self._body, self._notes, self._on_pick = viewer, body, notes, on_pick
        self.nodes: dict[str, Any] = {}
        self.is_on = False
        self.picked: EditedSphere | None = None

    def path_of(self, name: str) -> str:
        """Node of a link."""
        return self._viewer.path_of(self._body.link(name))

    def show(self, on: bool) -> None:
        """Draw them all, or none."""
        self.is_on = on
        with self._viewer.server.atomic():
            for node in self.nodes.values():
                node.visible = on
            for link in self._body.links if on else ():
                self.draw(link.name)

    def clear(self) -> None:
        """Take all nodes out of the scene."""
        for node in self.nodes.values():
            node.remove()
        self.nodes.clear()

    def draw(self, name: str) -> None:
        """Draw the spheres of one link anew."""
        from roboyard.shapes import primitives

        if not self.is_on:
            return
        old = self.nodes.pop(name, None)
        if old is not None:
            old.remove()
        balls = self._notes.balls.get(name)
        if not balls:
            return
        unit = primitives.sphere(1.0, 20)
        node = self._viewer.server.scene.add_batched_meshes_simple(
            f"{self.path_of(name)}/planning spheres",
            unit.vertices,
            unit.faces,
            np.tile([1.0, 0.0, 0.0, 0.0], (len(balls), 1)),
            np.array([ball.center for ball in balls]),
            batched_scales=np.array([ball.radius for ball in balls]),
            batched_colors=np.array(
                [PICKED if ball is self.picked else BLUE for ball in balls], dtype=np.uint8
            ),
            opacity=0.4,
            cast_shadow=False,
            receive_shadow=False,
        )
        node.on_click(lambda event: self._on_pick(name, int(event.instance_index or 0)))
        self.nodes[name] = node

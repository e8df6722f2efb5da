"""Panel to move, resize, add and delete planning spheres."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.viewer.inspector.edits.edit_state import EditedSphere, EditState
from roboyard.viewer.inspector.layers.gizmo import Gizmo
from roboyard.viewer.inspector.layers.sphere_layer import SphereLayer
from roboyard.viewer.page.callbacks import carried_out_by, in_order

if TYPE_CHECKING:
    from roboyard.sim.body import Body

NONE = "(none)"
MIN_RADIUS = 0.001
"""Least radius (m)."""


class SpherePanel:
    """Select a sphere here or on the robot; type its values or drag its handle."""

    def __init__(
        self,
        gui: Any,
        body: Body,
        edits: EditState,
        layer: SphereLayer,
        gizmo: Gizmo,
        do: Callable[[Callable[[], None]], None],
        reveal: Callable[[str], None],
    ) -> None:
        """Add the panel's elements; `reveal` shows the spheres of a link."""
        self._reveal = reveal
        self._body, self._edits, self._layer, self._gizmo, self._do = body, edits, layer, gizmo, do
        links = tuple(link.name for link in body.links)
        self.message = gui.add_markdown("")
        first = next((name for name in links if edits.spheres.get(name)), links[0])
        self.link_choice = gui.add_dropdown("link", links, initial_value=first)
        self.sphere_choice = gui.add_dropdown("sphere", (NONE,), initial_value=NONE)
        self.center = gui.add_vector3("centre (m)", (0.0, 0.0, 0.0), step=0.001)
        self.radius = gui.add_number("radius (m)", 0.05, min=MIN_RADIUS, step=0.001)
        self.handle_box = gui.add_checkbox("handle in the scene", True)
        self.add_button = gui.add_button(
            "Add a sphere", hint="to this link, beside the selected sphere and as large"
        )
        self.delete_button = gui.add_button("Delete the selected one")

        by_user = carried_out_by(self._do)
        self.link_choice.on_update(by_user(lambda: self.pick(self.link, 0 if self._spheres() else None)))
        self.sphere_choice.on_update(by_user(self._chosen))
        self.center.on_update(by_user(self._typed))
        self.radius.on_update(by_user(self._typed))
        self.handle_box.on_update(by_user(self._show_handle))
        self.add_button.on_click(in_order(lambda _: self._do(self.add)))
        self.delete_button.on_click(in_order(lambda _: self._do(self.delete)))
        self._index: int | None = None
        self._count()

    @property
    def link(self) -> str:
        """Name of the link whose spheres are listed."""
        return str(self.link_choice.value)

    def _spheres(self) -> list[EditedSphere]:
        return self._edits.spheres.get(self.link, [])

    @property
    def picked(self) -> EditedSphere | None:
        """The selected sphere."""
        spheres = self._spheres()
        return spheres[self._index] if self._index is not None and self._index < len(spheres) else None

    def pick(self, link: str, index: int | None) -> None:
        """Select a sphere of a link by index; None: select the link alone."""
        if link not in self.link_choice.options:
            return
        before = self.link
        if index is not None:
            self._reveal(link)
        self.link_choice.value = link
        self._index = index
        self._layer.picked = sphere = self.picked
        spheres = self._spheres()
        self.sphere_choice.options = tuple(str(k + 1) for k in range(len(spheres))) or (NONE,)
        self.sphere_choice.value = self.sphere_choice.options[index or 0]
        if sphere is not None:
            self.center.value, self.radius.value = sphere.center, sphere.radius
        for name in {before, link}:
            self._layer.draw(name)
        self._show_handle()
        self._count()

    def refresh(self) -> None:
        """Show the spheres again after any of them changed."""
        spheres = self._spheres()
        self.pick(
            self.link, min(self._index or 0, len(spheres) - 1) if spheres and self._layer.is_on else None
        )
        self._layer.redraw()

    def _chosen(self) -> None:
        value = str(self.sphere_choice.value)
        self.pick(self.link, int(value) - 1 if value.isdecimal() else None)

    def _typed(self) -> None:
        sphere = self.picked
        numbers = [*self.center.value, self.radius.value]
        if sphere is None or not np.isfinite(numbers).all():
            return
        x, y, z, radius = (float(v) for v in numbers)
        sphere.center, sphere.radius = (x, y, z), max(radius, MIN_RADIUS)
        self._layer.draw(self.link)
        self._gizmo.put(sphere.center)

    def move(self, sphere: EditedSphere, position: Any) -> None:
        """Set the centre of a sphere in its link frame (m)."""
        x, y, z = (round(float(v), 6) for v in position)
        sphere.center = (x, y, z)
        if sphere is self.picked:
            self.center.value = sphere.center
        self._layer.draw(self.link)

    def add(self) -> None:
        """Add a sphere to the link: beside the selected one, else at its centre of mass."""
        near = self.picked
        if near is not None:
            center = (near.center[0], near.center[1], near.center[2] + near.radius)
            new = EditedSphere(center=center, radius=near.radius)
        else:
            new = EditedSphere(center=self._middle(), radius=max(float(self.radius.value), MIN_RADIUS))
        spheres = self._edits.spheres.setdefault(self.link, [])
        spheres.append(new)
        self.pick(self.link, len(spheres) - 1)

    def _middle(self) -> tuple[float, float, float]:
        """Return the centre of mass of the link in its frame (m); the origin if it has no mass."""
        link = self._body.link(self.link)
        place = self._body.world.model.body_ipos[link.mujoco_id] if link.mass > 0 else np.zeros(3)
        x, y, z = (round(float(v), 6) for v in place)
        return x, y, z

    def delete(self) -> None:
        """Delete the selected sphere."""
        sphere = self.picked
        if sphere is None:
            return
        spheres = [one for one in self._spheres() if one is not sphere]
        if spheres:
            self._edits.spheres[self.link] = spheres
        else:
            del self._edits.spheres[self.link]
        self.pick(self.link, min(self._index or 0, len(spheres) - 1) if spheres else None)

    def _show_handle(self) -> None:
        sphere = self.picked
        if sphere is None or not (self.handle_box.value and self.link in self._layer.shown):
            self._gizmo.release()
            return
        path = self._layer.path_of(self.link)
        self._gizmo.hold(
            path, sphere.center, turns=False, on_move=lambda p, _, sphere=sphere: self.move(sphere, p)
        )

    def _count(self) -> None:
        count = sum(map(len, self._edits.spheres.values()))
        self.message.content = (
            f"**{count} spheres on {len(self._edits.spheres)} links.** Select one here or on the robot."
        )

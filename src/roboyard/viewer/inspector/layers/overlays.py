"""Overlays of the inspector: collision shapes, inertias, frames, axes, contacts, spheres, sensors."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard.transforms import Array
from roboyard.viewer.inspector.edits.edit_state import EditState
from roboyard.viewer.inspector.layers.link_layer import Drawn, LinkLayer, ShapeLayer
from roboyard.viewer.inspector.layers.sensor_layer import SensorLayer
from roboyard.viewer.inspector.layers.sphere_layer import SphereLayer

if TYPE_CHECKING:
    from roboyard.description.model import Link as LinkDescription
    from roboyard.description.semantic import SemanticDescription
    from roboyard.sim.body import Body
    from roboyard.sim.link import Link
    from roboyard.viewer.viewer import Viewer

GREEN, GREEN_OPACITY = (0.15, 0.85, 0.25), 0.45
VIOLET = (150, 70, 200)
YELLOW = (250, 200, 40)
BLUE = (40, 110, 230)
RED = (230, 40, 30)
ORANGE = (250, 140, 20)
PARTS = "understood parts"
"""Overlay of the parts that the robot was understood to have, such as arms, legs and wheels, in colours."""
COM_DENSITY = 8000.0
"""Density of the sphere that shows a link's mass (kg/m³)."""
FORCE_LENGTH = 0.2
"""Length of the arrow of a force equal to the robot's weight, as a fraction of the robot's size."""


class Overlays:
    """One switch per overlay; nodes are created when an overlay is first shown and move with their links."""

    def __init__(
        self, viewer: Viewer, body: Body, edits: EditState, on_pick: Callable[[str, int], None]
    ) -> None:
        """Start hidden; `on_pick` is called with link name and index of a clicked planning sphere."""
        self._viewer = viewer
        self._scene = viewer.server.scene
        self._body = body
        self._made: dict[str, list[Any]] = {}
        self._on: set[str] = set()
        self.size = float(np.clip(np.linalg.norm(np.ptp(body.bounds, axis=0)), 0.1, 5.0))
        """Size of the robot (m), which scales the overlays."""
        self._makers: dict[str, Callable[[], list[Any]]] = {
            "inertia boxes": self._inertias,
            "centres of mass": self._centres,
            "frames": self._frames,
            "joint axes": self._axes,
            "contacts": self._contacts,
        }
        self.collisions = ShapeLayer(
            viewer, body, "collision", GREEN_OPACITY, self._collisions_of, lambda _: GREEN
        )
        self.parts = ShapeLayer(
            viewer, body, "part", 1.0, self._drawn_of, lambda name: self._part_colours[name][:3]
        )
        self.spheres = SphereLayer(viewer, body, edits, on_pick)
        self.sensors = SensorLayer(viewer, body, edits, self.size)
        self._layers: dict[str, LinkLayer | SensorLayer] = {
            "collision shapes": self.collisions,
            PARTS: self.parts,
            "planning spheres": self.spheres,
            "sensors and tools": self.sensors,
        }

    @property
    def kinds(self) -> tuple[str, ...]:
        """Names of the overlays."""
        first, *rest = self._layers
        return (first, *self._makers, *rest)

    def nodes(self, kind: str) -> list[Any]:
        """Return the scene nodes of an overlay; none before it was first shown."""
        if kind in self._layers:
            return self._layers[kind].all_nodes
        return self._made.get(kind, [])

    def switch(self, kind: str, on: bool) -> None:
        """Show or hide an overlay; call it from the simulation thread."""
        if kind in self._layers:
            self._layers[kind].show(on)
            return
        if on and kind not in self._made:
            with self._viewer.server.atomic():
                self._made[kind] = self._makers[kind]()
        (self._on.add if on else self._on.discard)(kind)
        for node in self.nodes(kind):
            node.visible = on
        if on:
            self.update()

    def is_on(self, kind: str) -> bool:
        """Return whether an overlay is shown."""
        return self._layers[kind].is_on if kind in self._layers else kind in self._on

    def remove(self) -> None:
        """Remove all overlays from the scene."""
        with self._viewer.server.atomic():
            for layer in (self.collisions, self.parts, self.spheres, self.sensors):
                layer.clear()
            self.sensors.scans.clear()
            for nodes in self._made.values():
                for node in nodes:
                    node.remove()
        self._made.clear()
        self._on.clear()

    def update(self) -> None:
        """Update the overlays that do not move with a link."""
        if "centres of mass" in self._on:
            self._made["centres of mass"][-1].position = self._body.center_of_mass
        if "contacts" in self._on:
            points, forces = self._made["contacts"]
            points.points, forces.points = self._contact_geometry()

    # ------------------------------------------------------------------------------------------------ kinds

    def _collisions_of(self, link: Link) -> list[Drawn]:
        source = self._source_of(link)
        return [] if source is None else [(one.geometry, one.origin) for one in source.collisions]

    def _drawn_of(self, link: Link) -> list[Drawn]:
        """Return the visual shapes of a link; its collision shapes if the robot has no visual ones."""
        source = self._source_of(link)
        if source is None:
            return []
        return [
            (one.geometry, one.origin) for one in (source.visuals if self._has_visuals else source.collisions)
        ]

    def _source_of(self, link: Link) -> LinkDescription | None:
        description = self._body.description
        return None if description is None else description.link_by_name.get(link.name)

    @cached_property
    def _has_visuals(self) -> bool:
        description = self._body.description
        return description is not None and any(link.visuals for link in description.links)

    @cached_property
    def semantic(self) -> SemanticDescription | None:
        """The kind, base and parts of the robot, as inferred; None without a description."""
        from roboyard.morphology.analyze import infer_semantics

        description = self._body.description
        return None if description is None else infer_semantics(description)

    @cached_property
    def _part_colours(self) -> dict[str, tuple[float, float, float, float]]:
        from roboyard.morphology.part_colours import colours_of_links

        description, semantic = self._body.description, self.semantic
        return {} if description is None or semantic is None else colours_of_links(description, semantic)

    def _inertias(self) -> list[Any]:
        model = self._body.world.model
        made = []
        for link in self._body.links:
            if link.mass <= 0:
                continue
            row = link.mujoco_id
            made.append(
                self._scene.add_box(
                    f"{self._viewer.path_of(link)}/inertia",
                    color=VIOLET,
                    dimensions=tuple(inertia_box(model.body_mass[row], model.body_inertia[row])),
                    opacity=0.45,
                    position=model.body_ipos[row],
                    wxyz=model.body_iquat[row],
                    cast_shadow=False,
                    receive_shadow=False,
                )
            )
        return made

    def _centres(self) -> list[Any]:
        model = self._body.world.model
        made = []
        for link in self._body.links:
            if link.mass > 0:
                radius = float(np.cbrt(link.mass / COM_DENSITY * 3 / (4 * np.pi)))
                made.append(
                    self._sphere(
                        f"{self._viewer.path_of(link)}/centre of mass",
                        radius,
                        YELLOW,
                        model.body_ipos[link.mujoco_id],
                    )
                )
        made.append(
            self._sphere("/inspector/centre of mass", 0.02 * self.size, RED, self._body.center_of_mass)
        )
        return made

    def _sphere(self, name: str, radius: float, color: tuple[int, int, int], position: Array) -> Any:
        return self._scene.add_icosphere(
            name,
            radius=radius,
            color=color,
            subdivisions=2,
            position=position,
            cast_shadow=False,
            receive_shadow=False,
        )

    def _frames(self) -> list[Any]:
        length = 0.06 * self.size
        return [
            self._scene.add_frame(
                f"{self._viewer.path_of(link)}/frame", axes_length=length, axes_radius=0.04 * length
            )
            for link in self._body.links
        ]

    def _axes(self) -> list[Any]:
        half = 0.07 * self.size
        made = []
        for joint in self._body.joints:
            if joint.type not in ("revolute", "continuous", "prismatic"):
                continue
            axis = joint.axis / np.linalg.norm(joint.axis)
            made.append(
                self._scene.add_arrows(
                    f"{self._viewer.path_of(joint.child)}/axis",
                    points=np.array([[-half * axis, half * axis]]),
                    colors=BLUE if joint.type != "prismatic" else ORANGE,
                    shaft_radius=0.05 * half,
                    head_radius=0.15 * half,
                    head_length=0.4 * half,
                )
            )
        return made

    def _contacts(self) -> list[Any]:
        points, forces = self._contact_geometry()
        radius = 0.004 * self.size
        return [
            self._scene.add_point_cloud(
                "/inspector/contacts", points, RED, point_size=2.5 * radius, point_shape="circle"
            ),
            self._scene.add_arrows(
                "/inspector/forces",
                forces,
                RED,
                shaft_radius=radius,
                head_radius=2.5 * radius,
                head_length=5 * radius,
            ),
        ]

    def _contact_geometry(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return (k, 3) points and (k, 2, 3) force arrows of the robot's contacts in the world frame (m)."""
        from roboyard.sim.world import World

        contacts = World.of(self._body).contacts(self._body)
        if not contacts:
            return np.zeros((0, 3), dtype=np.float32), np.zeros((0, 2, 3), dtype=np.float32)
        points = np.array([contact.position for contact in contacts], dtype=np.float32)
        weight = max(self._body.mass * 9.81, 1e-9)
        pushes = np.array([-c.normal * c.normal_force + c.friction_force for c in contacts])
        ends = points + FORCE_LENGTH * self.size / weight * pushes
        return points, np.stack([points, ends], axis=1).astype(np.float32)


def inertia_box(mass: float, moments: Array) -> Array:
    """Return the (3,) edges (m) of the uniform box of a mass (kg) and (3,) principal moments (kg m²).

    From I_x = m (y² + z²) / 12, likewise y and z; impossible moments (one above the sum of the others) give
    an edge near zero.
    """
    squares = 6.0 / mass * (np.sum(moments) - 2.0 * np.asarray(moments))
    return np.sqrt(np.maximum(squares, 1e-8))

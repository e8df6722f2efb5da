"""All elements of the page that belong to one robot; replaced as a whole with the robot."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.audit import Audit
from roboyard.sim import World
from roboyard.sim.body import Body
from roboyard.viewer.inspector.checks import CheckContext
from roboyard.viewer.inspector.edits.edit_state import EditState
from roboyard.viewer.inspector.edits.history import History
from roboyard.viewer.inspector.layers.gizmo import Gizmo
from roboyard.viewer.inspector.layers.link_layer import VisualLayer
from roboyard.viewer.inspector.layers.overlays import PARTS, Overlays
from roboyard.viewer.inspector.overlaps import overlaps
from roboyard.viewer.inspector.panels.camera_panel import CameraPanel
from roboyard.viewer.inspector.panels.check_panel import CheckPanel
from roboyard.viewer.inspector.panels.findings import findings_text
from roboyard.viewer.inspector.panels.joint_panel import JointPanel
from roboyard.viewer.inspector.panels.legend import legend
from roboyard.viewer.inspector.panels.link_panel import LinkPanel
from roboyard.viewer.inspector.panels.pair_panel import PairPanel
from roboyard.viewer.inspector.panels.save_panel import SavePanel
from roboyard.viewer.inspector.panels.sensor_panel import SensorPanel
from roboyard.viewer.inspector.panels.sphere_panel import SpherePanel
from roboyard.viewer.inspector.panels.velocity_plot import VelocityPlot
from roboyard.viewer.inspector.robot_source import RobotSource
from roboyard.viewer.page.callbacks import in_order, of_pages
from roboyard.viewer.viewer import Viewer

if TYPE_CHECKING:
    from roboyard.robots.definition.schema import RobotDefinition

Do = Callable[[Callable[[], None]], None]
VISUALS = "visual meshes"
COLLISIONS, SPHERES, SENSORS = "collision shapes", "planning spheres", "sensors and tools"
HANDLE = 0.12
"""Size of a handle, as a fraction of the robot's size."""
NEAREST, TIMES = 0.25, 3.0
"""Least distance of the camera from a link: in m, and in sizes of the link."""


class Panels:
    """The four tabs (Look, Move, Check, Edit) and overlays of one robot."""

    def __init__(
        self,
        *,
        viewer: Viewer,
        world: World,
        body: Body,
        source: RobotSource,
        audit: Audit,
        edits: EditState,
        do: Do,
        wiggle: Callable[[], None],
        reload: Callable[[RobotSource, str], None],
    ) -> None:
        """Add everything to the page.

        Args:
            viewer: the page.
            world: world of the robot.
            body: the robot.
            source: its files.
            audit: findings of its URDF.
            edits: its edits; the panels change them in place.
            do: queues a request for the simulation thread.
            wiggle: starts or stops the motion of all joints.
            reload: shows another robot, and a message about it.
        """
        self._viewer, self._world, self._body, self._audit = viewer, world, body, audit
        self._source, self.edits = source, edits
        self._definition = _definition_of(source)
        self._do = do
        self.overlays = Overlays(viewer, body, edits, self._pick_sphere)
        self.visuals = VisualLayer(viewer, body)
        self._gizmo = Gizmo(viewer, do, HANDLE * self.overlays.size)
        self.switches: dict[str, Any] = {}
        self._on_switch: dict[str, Callable[[bool], None]] = {}
        gui = viewer.server.gui
        self._tabs = gui.add_tab_group()
        with self._tabs.add_tab("Look"):
            self._add_switch(VISUALS, True, self._show_visuals)
            for kind in self.overlays.kinds:
                self._add_switch(kind, False, lambda on, kind=kind: self._show(kind, on))
            self.legend = gui.add_html("", visible=False)
            layers = {
                VISUALS: self.visuals,
                COLLISIONS: self.overlays.collisions,
                SPHERES: self.overlays.spheres,
            }
            with gui.add_folder("Links"):
                self.links = LinkPanel(
                    viewer.server,
                    body,
                    audit,
                    layers,
                    do,
                    viewer.highlight,
                    self._after_tree,
                )
            with gui.add_folder("Picture", expand_by_default=False):
                self.camera = CameraPanel(gui, world, do)
        with self._tabs.add_tab("Move"):
            self.wiggle_button = gui.add_button("Wiggle every joint")
            with gui.add_folder("Joints"):
                self.joints = JointPanel(gui, body, do)
            with gui.add_folder("Velocities"):
                self.plot = VelocityPlot(gui, body.joint_names)
        with self._tabs.add_tab("Check"):
            self.checks = CheckPanel(gui, self.context, do, self.point)
            with gui.add_folder(f"Findings in the file ({len(audit.findings)})"):
                gui.add_markdown(findings_text(audit))
        with self._tabs.add_tab("Edit"):
            self.undo_buttons = gui.add_button_group("edits", ("Undo", "Redo"))
            with gui.add_folder("Save"):
                self.save = SavePanel(gui, source, edits, do, reload)
            with gui.add_folder("Sensors"):
                self.sensors = SensorPanel(
                    gui, body, edits, self.overlays.sensors, self._gizmo, do, lambda: self._reveal(SENSORS)
                )
            with gui.add_folder("Spheres", expand_by_default=False):
                self.spheres = SpherePanel(
                    gui, body, edits, self.overlays.spheres, self._gizmo, do, self._reveal_spheres
                )
            with gui.add_folder("Pairs", expand_by_default=False):
                self.pairs = PairPanel(gui, body, edits, do, viewer.highlight, lambda: overlaps(body))
        self.wiggle_button.on_click(in_order(lambda _: do(wiggle)))
        self.history = History(edits)
        self.undo_buttons.on_click(
            in_order(lambda event: do(lambda undone=event.target.value == "Undo": self.restore(undo=undone)))
        )

    def _add_switch(self, label: str, on: bool, switch: Callable[[bool], None]) -> None:
        box = self.switches[label] = self._viewer.server.gui.add_checkbox(label, on)
        self._on_switch[label] = switch

        def ticked(event: Any) -> None:
            on = event.target.value
            self._do(lambda: switch(on))

        box.on_update(of_pages(ticked))

    def switch(self, label: str, on: bool) -> None:
        """Switch an overlay of the tab Look."""
        self._on_switch[label](on)

    def _show(self, kind: str, on: bool) -> None:
        self.overlays.switch(kind, on)
        if kind == PARTS:
            self.legend.content = legend(self.overlays.semantic) if on else ""
            self.legend.visible = on
            self._viewer.show_visuals(not on)  # the coloured parts take their place
            if on and self.visuals.is_on:
                self._show_parts()
        self.links.tree.update()

    def _show_visuals(self, on: bool) -> None:
        self.visuals.show(on)
        self.links.tree.update()

    def _show_parts(self) -> None:
        """Show the coloured parts of the links whose visual meshes are switched on."""
        for link in self._body.links:
            self.overlays.parts.show_link(link.name, link.name in self.visuals.shown)
            self.overlays.parts.fade(link.name, self.visuals.opacity_of(link.name))

    def _after_tree(self) -> None:
        """Make the switches agree with the tree of links."""
        for kind, layer in self.links.tree.layers.items():
            self.switches[kind].value = layer.is_on
        if self.switches[PARTS].value:
            self._show_parts()
        self.links.tree.update()

    def _reveal(self, kind: str) -> None:
        if not self.overlays.is_on(kind):
            self.switches[kind].value = True
            self.overlays.switch(kind, True)

    def _reveal_spheres(self, link: str) -> None:
        self._reveal(SPHERES)
        self.overlays.spheres.show_link(link, True)

    def _pick_sphere(self, link: str, index: int) -> None:
        self._do(lambda: self.spheres.pick(link, index))

    def restore(self, *, undo: bool) -> None:
        """Undo the last step of the edits, or redo the last undone one; nothing without one."""
        sensors = self.edits.sensors
        index = next((k for k, one in enumerate(sensors) if one is self.sensors.picked), 0)
        if not (self.history.undo() if undo else self.history.redo()):
            return
        self.overlays.sensors.picked = sensors[min(index, len(sensors) - 1)] if sensors else None
        self.sensors.refresh()
        self.spheres.refresh()
        self.pairs.refresh()

    def context(self) -> CheckContext:
        """Return the robot's current state for the checks."""
        definition = self._definition
        wheels: list[str] = []
        fingers: list[str] = []
        if definition is not None:
            wheels = list(
                definition.locomotion.floor_touching_base_link_names if definition.locomotion else ()
            )
            named = definition.manipulation.finger_joint_names if definition.manipulation else {}
            fingers = [name for names in named.values() for name in names]
        names = {link.name for link in self._body.links}
        return CheckContext(
            body=self._body,
            audit=self._audit,
            edits=self.edits,
            definition=definition,
            wheels=[name for name in wheels if name in names],
            fingers=fingers,
        )

    def point(self, name: str) -> None:
        """Select a link and aim the cameras of all pages at it."""
        link = self._body.link(name)
        self.links.pick(link)
        bounds = self._world.bounds_of(np.array([link.mujoco_id]))
        if not np.isfinite(bounds).all() or np.ptp(bounds, axis=0).max() <= 0:
            bounds = np.array([link.pose[0], link.pose[0]])
        size = float(np.linalg.norm(np.ptp(bounds, axis=0)))
        self._viewer.look_at(bounds.mean(axis=0), max(NEAREST, TIMES * size))

    def remove(self) -> None:
        """Remove all elements."""
        self._gizmo.release()
        self.links.tree.remove()
        self.overlays.remove()
        self._tabs.remove()
        self._viewer.highlight(None)


def _definition_of(source: RobotSource) -> RobotDefinition | None:
    """Load the definition of a robot; None: it has none."""
    if source.definition is None:
        return None
    from roboyard.robots.definition.load import load_definition

    return load_definition(source.definition)

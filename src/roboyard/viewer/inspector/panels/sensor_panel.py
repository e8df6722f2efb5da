"""Sensors and end effector frames: live pictures and scans, and their poses."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.errors import ConfigError
from roboyard.transforms import matrix_from_quaternion, quaternion_from_rpy, rpy_from_matrix
from roboyard.viewer.inspector.edits.edit_state import KINDS, EditState, SensorKind, SensorPose
from roboyard.viewer.inspector.layers.gizmo import Gizmo
from roboyard.viewer.inspector.layers.sensor_layer import SensorLayer
from roboyard.viewer.inspector.panels.camera_panel import HEIGHT, WIDTH, blank
from roboyard.viewer.inspector.panels.camera_panel import KINDS as PICTURES
from roboyard.viewer.page.callbacks import carried_out_by, in_order

if TYPE_CHECKING:
    from roboyard.sim.body import Body

NONE = "(none)"
PERIOD = 0.2
"""Period of live pictures and scans (s)."""


class SensorPanel:
    """Select, view, move, add and delete sensors and end effector frames."""

    def __init__(
        self,
        gui: Any,
        body: Body,
        edits: EditState,
        layer: SensorLayer,
        gizmo: Gizmo,
        do: Callable[[Callable[[], None]], None],
        reveal: Callable[[], None],
    ) -> None:
        """Add the panel's elements; `reveal` shows the layer."""
        self._reveal = reveal
        self._body, self._edits, self._layer, self._gizmo, self._do = body, edits, layer, gizmo, do
        self._last_picture = 0.0
        links = tuple(link.name for link in body.links)
        self.choice = gui.add_dropdown("sensor or end effector", (NONE,), initial_value=NONE)
        self.live_box = gui.add_checkbox(
            "live picture", True, hint="the camera's picture, five times a second"
        )
        self.scan_box = gui.add_checkbox(
            "live scan",
            False,
            hint="points hit by the lidar, five times a second; pink: on the robot itself",
        )
        self.kind = gui.add_dropdown("shows", PICTURES, initial_value=PICTURES[0])
        self.picture = gui.add_image(blank(), format="jpeg")
        with gui.add_folder("Offset"):
            self.handle_box = gui.add_checkbox("handle in the scene", False)
            self.position = gui.add_vector3("position (m)", (0.0, 0.0, 0.0), step=0.0001)
            self.turn = gui.add_vector3(
                "rotation (degrees)",
                (0.0, 0.0, 0.0),
                step=1.0,
                hint="about the fixed x, y, z axes, in this order",
            )
        with gui.add_folder("Another", expand_by_default=False):
            self.new_kind = gui.add_dropdown("kind", tuple(KINDS.values()))
            self.new_parent = gui.add_dropdown("on link", links)
            self.new_link = gui.add_text(
                "new link", "", hint="its name; empty: the sensor is on the link itself"
            )
            self.add_button = gui.add_button("Add")
            self.delete_button = gui.add_button("Delete the selected one")
        self._listen()
        self.refresh()

    def _listen(self) -> None:
        by_user = carried_out_by(self._do)
        self.choice.on_update(by_user(lambda: self.pick(self.named(self.choice.value))))
        self.position.on_update(by_user(self._typed))
        self.turn.on_update(by_user(self._typed))
        self.handle_box.on_update(by_user(self._handle_ticked))
        self.add_button.on_click(in_order(lambda _: self._do(self._add)))
        self.delete_button.on_click(in_order(lambda _: self._do(self._delete)))

    @property
    def picked(self) -> SensorPose | None:
        """The selected sensor."""
        return self._layer.picked

    def labels(self) -> list[str]:
        """Return a unique label of each sensor."""
        labels: list[str] = []
        for sensor in self._edits.sensors:
            on = sensor.link if sensor.parent is None else f"{sensor.link}, on {sensor.parent}"
            label = base = f"{KINDS[sensor.kind]} {on}"
            while label in labels:
                label = f"{base} ({labels.count(label) + 2})"
            labels.append(label)
        return labels

    def named(self, label: str) -> SensorPose | None:
        """Return the sensor of a label; None: there is none."""
        return dict(zip(self.labels(), self._edits.sensors, strict=True)).get(label)

    def refresh(self) -> None:
        """Update the list; selects the first sensor if none is selected."""
        labels = tuple(self.labels()) or (NONE,)
        if self.choice.options != labels:
            self.choice.options = labels
        if self.picked is None and self._edits.sensors:
            self._layer.picked = self._edits.sensors[0]
        self.pick(self.picked)

    def pick(self, sensor: SensorPose | None) -> None:
        """Select another sensor."""
        self._layer.picked = sensor
        if sensor is None:
            self.choice.value = self.choice.options[0]
        else:
            index = next(k for k, one in enumerate(self._edits.sensors) if one is sensor)
            self.choice.value = self.choice.options[index]
            self._show_numbers(sensor)
        is_camera = sensor is not None and sensor.kind == "camera_links"
        for element in (self.live_box, self.kind, self.picture):
            element.visible = is_camera
        self.scan_box.visible = sensor is not None and sensor.kind == "lidar_links"
        self._layer.draw()
        self._show_handle()
        self._last_picture = 0.0

    def _show_numbers(self, sensor: SensorPose) -> None:
        self.position.value = tuple(round(v, 6) for v in sensor.position)
        rpy = np.degrees(rpy_from_matrix(matrix_from_quaternion(sensor.quaternion)))
        self.turn.value = tuple(round(float(v), 4) for v in rpy)

    def _typed(self) -> None:
        sensor = self.picked
        if sensor is None or not np.isfinite([*self.position.value, *self.turn.value]).all():
            return
        x, y, z = (float(v) for v in self.position.value)
        sensor.position = (x, y, z)
        quaternion = quaternion_from_rpy(np.radians(self.turn.value))
        sensor.quaternion = tuple(float(v) for v in quaternion)  # type: ignore[assignment]
        self._moved(sensor)
        self._gizmo.put(*self._anchored(sensor)[1:])

    def move(self, sensor: SensorPose, position: Any, quaternion: Any) -> None:
        """Set the offset of a sensor: position (m) and quaternion x, y, z, w."""
        sensor.position = tuple(float(v) for v in position)  # type: ignore[assignment]
        sensor.quaternion = tuple(float(v) for v in quaternion)  # type: ignore[assignment]
        if sensor is self.picked:
            self._show_numbers(sensor)
        self._moved(sensor)

    def _moved(self, _: SensorPose) -> None:
        self._layer.draw()
        self._last_picture = 0.0

    def _anchored(self, sensor: SensorPose) -> tuple[str, Any, Any]:
        """Return the parent link of a sensor and its offset: position (m), quaternion x, y, z, w."""
        own = sensor.link if sensor.parent is None else sensor.parent
        return own, sensor.position, sensor.quaternion

    def _handle_ticked(self) -> None:
        if self.handle_box.value:
            self._reveal()
        self._show_handle()

    def _show_handle(self) -> None:
        sensor = self.picked
        if sensor is None or not self.handle_box.value:
            self._gizmo.release()
            return
        name, position, quaternion = self._anchored(sensor)
        path = self._layer.node_of(name)
        if path is not None:
            self._gizmo.hold(
                path, position, quaternion, on_move=lambda p, q, sensor=sensor: self.move(sensor, p, q)
            )

    def _add(self) -> None:
        kind: SensorKind = next(key for key, word in KINDS.items() if word == self.new_kind.value)
        name, on = self.new_link.value.strip(), str(self.new_parent.value)
        taken = {link.name for link in self._body.links} | {sensor.link for sensor in self._edits.sensors}
        if name in taken:
            raise ConfigError(f"there is a link {name!r} already; choose another name")
        sensor = SensorPose(kind=kind, link=name or on, parent=on if name else None)
        self._edits.sensors.append(sensor)
        self._layer.picked = sensor
        self._reveal()
        self.refresh()

    def _delete(self) -> None:
        if self.picked is not None:
            self._edits.sensors[:] = [one for one in self._edits.sensors if one is not self.picked]
            self._layer.picked = None
            self.refresh()

    def update(self, *, watched: bool) -> None:
        """Update the live picture or scan if one is due and a page is open (`watched`)."""
        sensor, now = self.picked, perf_counter()
        is_lidar = sensor is not None and sensor.kind == "lidar_links"
        if not (is_lidar and self.scan_box.value):
            self._layer.scans.clear()
        if sensor is None or not watched or now - self._last_picture < PERIOD:
            return
        if is_lidar and self.scan_box.value:
            self._last_picture = now
            self._layer.scan(sensor)
        if sensor.kind != "camera_links" or not self.live_box.value:
            return
        self._last_picture = now
        picture = self._layer.picture(sensor, WIDTH, HEIGHT, str(self.kind.value))
        if picture is not None and not np.array_equal(picture, self.picture.image):
            self.picture.image = picture

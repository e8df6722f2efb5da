"""Pictures of the driven robot's cameras and lidars, in the corner of each page."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard.rendering import Camera
from roboyard.viewer.page.page_script import PageScript
from roboyard.viewer.scene.scans import scan_colors

if TYPE_CHECKING:
    from roboyard.robots import Robot
    from roboyard.sensors import CameraSensor, Lidar, Scan

WIDTH, SIDE = 240, 180
"""Width of a camera's picture, and width and height of a lidar's (pixels)."""
PERIOD = 0.2
"""Least period of the pictures (s)."""
SHARE = 0.12
"""Largest share of the time of the simulation thread that the pictures take."""
RADIUS, RING = 6.0, 2.0
"""Distance of the edge of a lidar's picture from its middle, and of its rings from each other (m)."""
DARK, LINE = (28, 32, 38), (70, 78, 88)


class Insets:
    """Which sensors of a robot have a picture on the pages; all pages show the same."""

    def __init__(self, server: Any, do: Callable[[Callable[[], None]], None]) -> None:
        """Start without sensors; `do` queues a request for the simulation thread."""
        self._do = do
        self._sensors: dict[str, CameraSensor | Lidar] = {}
        self._labels: dict[str, str] = {}
        self.pictures: dict[str, bytes] = {}
        """Name of each sensor that is shown to its last picture (JPEG); empty: not yet taken."""
        self._due = 0.0
        source = (Path(__file__).parent / "insets.js").read_text(encoding="utf-8")
        self._script = PageScript(server, "insets", source, self._on_message)

    @property
    def labels(self) -> dict[str, str]:
        """Name of each sensor to the text of its button."""
        return dict(self._labels)

    def show_robot(self, robot: Robot) -> None:
        """Offer the sensors of a robot; those of the same names stay shown."""
        from roboyard.sensors import CameraSensor, Lidar

        sensors = robot.sensors
        self._sensors = {
            name: sensor
            for name in sensors.names
            if isinstance(sensor := sensors[name], CameraSensor | Lidar)
        }
        self._labels = {}
        for name, sensor in self._sensors.items():
            label = base = sensor.link.name.replace("_", " ")
            while label in self._labels.values():
                label = f"{base} {sum(one.startswith(base) for one in self._labels.values()) + 1}"
            self._labels[name] = label
        self.pictures = {name: data for name, data in self.pictures.items() if name in self._sensors}
        self._due = 0.0
        self._send()

    def switch(self, name: str, on: bool) -> None:
        """Show or hide the picture of a sensor; an unknown name is ignored."""
        if on and name in self._sensors:
            self.pictures.setdefault(name, b"")
            self._due = 0.0
        else:
            self.pictures.pop(name, None)
        self._send()

    def update(self) -> None:
        """Take the pictures that are shown, if they are due; call it from the simulation thread."""
        start = perf_counter()
        if not self.pictures or start < self._due:
            return
        for name in self.pictures:
            self.pictures[name] = _jpeg(picture_of(self._sensors[name]))
        self._send()
        end = perf_counter()
        self._due = end + max(PERIOD, (end - start) * (1.0 / SHARE - 1.0))

    def _send(self) -> None:
        self._script.send(
            {
                "sensors": [{"name": name, "label": label} for name, label in self._labels.items()],
                "pictures": {name: base64.b64encode(data).decode() for name, data in self.pictures.items()},
            }
        )

    def _on_message(self, client: int, value: Any) -> None:
        del client
        match value:
            case [str(name), bool(on)]:
                self._do(lambda: self.switch(name, on))
            case _:
                pass


def picture_of(sensor: CameraSensor | Lidar) -> NDArray[np.uint8]:
    """Return what a sensor measures now as (h, w, 3) uint8.

    A camera's picture has its field of view and proportions, a lidar's is `scan_picture`.
    """
    from roboyard.sensors import CameraSensor

    if not isinstance(sensor, CameraSensor):
        return scan_picture(sensor.scan(), sensor.link.body.id)
    own = sensor.camera()
    camera = Camera(WIDTH, max(round(WIDTH * own.height / own.width), 1), own.view, own.projection)
    return np.ascontiguousarray(sensor.world.render(camera, backend=sensor.backend).rgb[..., :3])


def scan_picture(scan: Scan, carrier: int) -> NDArray[np.uint8]:
    """Return the hits of a scan from above, (SIDE, SIDE, 3) uint8.

    x of the lidar is upwards in the picture and y to the left. Colours are those of `scan_colors`; the rings
    are 2 m apart. `carrier` is the body of the lidar.
    """
    picture = np.empty((SIDE, SIDE, 3), dtype=np.uint8)
    picture[:] = DARK
    rows, columns = np.mgrid[:SIDE, :SIDE]
    scale = 2.0 * RADIUS / SIDE
    distance = scale * np.hypot(rows - (SIDE - 1) / 2, columns - (SIDE - 1) / 2)
    picture[np.abs((distance + RING / 2) % RING - RING / 2) < 0.5 * scale] = LINE
    points = scan.points(world=False)
    at = np.round((SIDE - 1) / 2 - points[:, :2] / scale).astype(int)
    shown = ((at >= 0) & (at < SIDE)).all(axis=1)
    order = np.argsort(-points[shown][:, 2], kind="stable")[::-1]  # the highest last: seen from above
    at, colors = at[shown][order], scan_colors(scan, carrier)[shown][order]
    for down, right in ((0, 0), (1, 0), (0, 1), (1, 1)):
        picture[np.minimum(at[:, 0] + down, SIDE - 1), np.minimum(at[:, 1] + right, SIDE - 1)] = colors
    return picture


def _jpeg(picture: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="JPEG", quality=80)
    return file.getvalue()

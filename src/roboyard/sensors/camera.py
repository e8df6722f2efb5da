"""A camera on a link: colour, depth and segmentation images."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from roboyard._arrays import ArrayLike, NDArray
from roboyard.errors import RoboyardError
from roboyard.rendering import Camera, Image
from roboyard.rendering.matrices import perspective
from roboyard.sensors.base import Observation, Sensor
from roboyard.transforms import IDENTITY_QUATERNION

if TYPE_CHECKING:
    from roboyard.sim import Link, World

HORIZONTAL_APERTURE, FOCAL_LENGTH = 20.955, 17.0
"""Of OmniGibson's cameras (mm)."""
FOVX = 2.0 * math.atan(HORIZONTAL_APERTURE / (2.0 * FOCAL_LENGTH))
"""Default horizontal field of view (rad): 63.3 degrees."""


class CameraSensor(Sensor):
    """A camera that looks along -z of its frame, with +y up."""

    kind: ClassVar[str] = "Camera"
    modalities: ClassVar[tuple[str, ...]] = ("rgb", "depth", "seg", "points")

    def __init__(
        self,
        link: Link,
        *,
        position: ArrayLike = (0, 0, 0),
        orientation: ArrayLike = IDENTITY_QUATERNION,
        width: int = 128,
        height: int = 128,
        fovx: float = FOVX,
        near: float = 0.01,
        far: float = 100.0,
        outputs: tuple[str, ...] = ("rgb", "depth", "seg"),
        shadow: bool = False,
        backend: Literal["auto", "software", "gl"] = "auto",
        rate: float | None = None,
    ) -> None:
        """Fix a camera to a link.

        Args:
            link: the link that the sensor is fixed to.
            position: (3,) position in the link's frame (m).
            orientation: (4,) quaternion x, y, z, w in the link's frame.
            width: image width (pixels).
            height: image height (pixels).
            fovx: horizontal field of view (rad).
            near: distance of the near clipping plane (m).
            far: distance of the far clipping plane (m).
            outputs: modalities of an observation.
            shadow: whether the sun casts shadows.
            backend: see `roboyard.rendering.render`.
            rate: images per second of simulated time (Hz); None: one at every call.

        Raises:
            RoboyardError: an unknown modality, or a rate that is not above 0.
            ValueError: a size, field of view or clipping distance out of range.
        """
        super().__init__(link, position=position, orientation=orientation, rate=rate)
        unknown = [name for name in outputs if name not in self.modalities]
        if unknown:
            raise RoboyardError(
                f"camera on {link.name!r}: output {unknown[0]!r} is none of {', '.join(self.modalities)}"
            )
        self.width, self.height = width, height
        self.outputs = outputs
        self.shadow = shadow
        self.backend: Literal["auto", "software", "gl"] = backend
        if not 0.0 < fovx < math.pi:
            raise ValueError(f"fovx must be between 0 and pi (rad), got {fovx}")
        fovy = 2.0 * math.atan(math.tan(fovx / 2.0) * height / width)
        self._projection = perspective(fovy, width / height, near, far)

    def camera(self) -> Camera:
        """Return the camera at its present pose."""
        return self.camera_at(*self.mount.in_world())

    def camera_at(self, position: ArrayLike, rotation: ArrayLike) -> Camera:
        """Return the camera as if its frame were elsewhere.

        Args:
            position: (3,) in the world frame (m).
            rotation: (3, 3) rotation of the frame in the world.
        """
        turn = np.asarray(rotation, dtype=float)
        view = np.eye(4)
        view[:3, :3] = turn.T
        view[:3, 3] = -turn.T @ np.asarray(position, dtype=float)
        return Camera(self.width, self.height, view, self._projection)

    def image(self) -> Image:
        """Render and return the present image."""
        return self.world.render(self.camera(), shadow=self.shadow, backend=self.backend)

    def observe(self) -> Observation:
        """Return the chosen modalities.

        "rgb" (h, w, 3) uint8; "depth" (h, w) along the camera's axis (m), inf where nothing is visible; "seg"
        (h, w, 2) body id and link index, -1 where nothing is; "points" (h, w, 3) in the world frame (m), NaN
        where nothing is.
        """
        return self.measured(self.image())

    def measured(self, image: Image) -> Observation:
        """Return the chosen modalities of a picture of this camera, as `observe` does."""
        made = {
            "rgb": lambda: image.rgb,
            "depth": lambda: image.depth,
            "seg": lambda: image.segmentation,
            "points": image.points,
        }
        return {name: made[name]() for name in self.outputs}


def link_names(world: World, segmentation: NDArray[np.int32]) -> dict[tuple[int, int], str]:
    """Return the names in a (..., 2) segmentation: (body id, link index) to "body/link"."""
    pairs = np.unique(np.asarray(segmentation).reshape(-1, 2), axis=0)
    return {
        (
            int(body),
            int(link),
        ): f"{world.body_by_id[int(body)].name}/{world.body_by_id[int(body)].links[link].name}"
        for body, link in pairs
        if body >= 0
    }

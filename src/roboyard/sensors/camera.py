"""A camera on a link: colours, depth and who is seen, as the robot sees it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roboyard.errors import RoboyardError
from roboyard.rendering import Camera, Image
from roboyard.rendering.matrices import perspective
from roboyard.sensors.base import Observation, Sensor
from roboyard.transforms import IDENTITY_QUATERNION

if TYPE_CHECKING:
    from roboyard.sim import Link, World

HORIZONTAL_APERTURE, FOCAL_LENGTH = 20.955, 17.0
"""mm, of OmniGibson's cameras"""
FOVX = 2.0 * math.atan(HORIZONTAL_APERTURE / (2.0 * FOCAL_LENGTH))
"""rad: 63.3 degrees"""


class CameraSensor(Sensor):
    """A camera whose frame looks along its own -z with +y up."""

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
        wants: tuple[str, ...] = ("rgb", "depth", "seg"),
        shadow: bool = False,
        backend: Literal["auto", "software", "gl"] = "auto",
        rate: float | None = None,
    ) -> None:
        """Mount a camera.

        Args:
            link: what it is fixed to.
            position: (3,) in the link's frame; m.
            orientation: (4,) x, y, z, w in the link's frame.
            width: pixels.
            height: pixels.
            fovx: horizontal opening angle; rad.
            near: nearest depth seen; m.
            far: farthest depth seen; m.
            wants: which modalities an observation has.
            shadow: whether the sun throws shadows.
            backend: see `roboyard.rendering.render`.
            rate: pictures a second; None: one whenever asked.

        Raises:
            RoboyardError: an unknown modality.
            ValueError: a size, angle or depth that no camera has.
        """
        super().__init__(link, position=position, orientation=orientation, rate=rate)
        strange = [name for name in wants if name not in self.modalities]
        if strange:
            raise RoboyardError(
                f"camera on {link.name!r}: {strange[0]!r} is none of {', '.join(self.modalities)}"
            )
        self.width, self.height = width, height
        self.wants = wants
        self.shadow = shadow
        self.backend: Literal["auto", "software", "gl"] = backend
        if not 0.0 < fovx < math.pi:
            raise ValueError(f"fovx must lie between 0 and pi (rad), got {fovx}")
        fovy = 2.0 * math.atan(math.tan(fovx / 2.0) * height / width)
        self._projection = perspective(fovy, width / height, near, far)

    def camera(self) -> Camera:
        """Where it is now."""
        position, rotation = self.mount.in_world()
        view = np.eye(4)
        view[:3, :3] = rotation.T
        view[:3, 3] = -rotation.T @ position
        return Camera(self.width, self.height, view, self._projection)

    def image(self) -> Image:
        """What it sees now."""
        return self.world.render(self.camera(), shadow=self.shadow, backend=self.backend)

    def observe(self) -> Observation:
        """The modalities that are wanted.

        "rgb" (h, w, 3) uint8; "depth" (h, w) m along the camera's axis, inf for nothing; "seg" (h, w, 2)
        body id and link index, -1 for nothing; "points" (h, w, 3) m in the world, NaN for nothing.
        """
        image = self.image()
        made = {
            "rgb": lambda: image.rgb,
            "depth": lambda: image.depth,
            "seg": lambda: image.segmentation,
            "points": image.points,
        }
        return {name: made[name]() for name in self.wants}


def link_names(world: World, segmentation: NDArray[np.int32]) -> dict[tuple[int, int], str]:
    """Who is in a (..., 2) segmentation: (body id, link index) to "body/link"."""
    pairs = np.unique(np.asarray(segmentation).reshape(-1, 2), axis=0)
    return {
        (
            int(body),
            int(link),
        ): f"{world.body_by_id[int(body)].name}/{world.body_by_id[int(body)].links[link].name}"
        for body, link in pairs
        if body >= 0
    }

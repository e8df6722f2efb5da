"""`Camera`: the pose and projection of a picture, and the conversions between pixels and world points."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from roboyard import transforms
from roboyard._arrays import ArrayLike, NDArray
from roboyard._records import dataclass
from roboyard.rendering.buffers import result
from roboyard.rendering.matrices import check_range, is_rotation, look_at_view, orbit_view, perspective

Array = NDArray[np.float64]

MAX_SIDE = 16384
FITTED_NEAR, FITTED_FAR = 0.02, 60.0
"""Distances of the clipping planes of `Camera.fitted`, as multiples of its distance from the points."""
_FLIP_YZ = np.diag([1.0, -1.0, -1.0])


def fitted_viewpoint(
    points: ArrayLike,
    direction: ArrayLike,
    up: ArrayLike = (0.0, 0.0, 1.0),
    *,
    aspect: float,
    fovy: float,
    fill: float,
) -> tuple[Array, Array]:
    """Return position and target, each (3,) m, of the nearest camera that has all points in its picture.

    Args:
        points: (n, 3) points in the world frame (m).
        direction: (3,) from the points to the camera, in the world frame.
        up: (3,) direction in the world frame that points up in the picture; where `direction` is along it,
            world y (or x) replaces it.
        aspect: width of the picture as a multiple of its height.
        fovy: vertical opening angle (rad).
        fill: share of the picture's width and height that the points may cover.

    Raises:
        ValueError: there are no points, or the direction has no length.
    """
    given = np.asarray(points, dtype=float)
    if given.ndim != 2 or given.shape[1:] != (3,) or not len(given):
        raise ValueError(f"points must have the shape (n, 3) with n > 0, got {given.shape}")
    if not np.linalg.norm(np.asarray(direction, dtype=float)) > 0:
        raise ValueError(f"direction must be a finite vector of any length above zero, got {direction}")
    axes = look_at_view(direction, (0.0, 0.0, 0.0), up)[:3, :3]
    in_view = given @ axes.T
    middle = 0.5 * (in_view.min(axis=0) + in_view.max(axis=0))
    x, y, z = (in_view - middle).T
    half_height = fill * math.tan(0.5 * fovy)
    half_width = half_height * aspect
    distance = float(max((np.abs(x) / half_width + z).max(), (np.abs(y) / half_height + z).max(), 1e-3))
    centre = middle @ axes
    return centre + distance * axes[2], centre


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A camera in the OpenGL convention: -z is the viewing direction, +y is up, clip depth is -1 to 1.

    Pixel (0, 0) is the top left one; the centre of pixel (column, row) is at (column + 0.5, row + 0.5).
    Matrices are row-major: a world point `p` has the clip coordinates `projection @ view @ (p, 1)`.

    Raises ValueError for a size outside 1 to 16384, matrices that are not (4, 4) and finite, a view that is
    not a rigid transform, and a projection that is neither perspective nor orthographic.
    """

    width: int
    """Width (pixels)."""
    height: int
    """Height (pixels)."""
    view: Array
    """(4, 4) transform from the world to the camera frame."""
    projection: Array
    """(4, 4) projection from the camera frame to clip coordinates."""

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            size = getattr(self, name)
            if int(size) != size or not 1 <= size <= MAX_SIDE:
                raise ValueError(f"{name} is {size}; give a whole number of pixels from 1 to {MAX_SIDE}")
            object.__setattr__(self, name, int(size))
        for name in ("view", "projection"):
            matrix = np.array(getattr(self, name), dtype=float, order="C")
            if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
                raise ValueError(f"{name} must be a finite (4, 4) matrix, got shape {matrix.shape}")
            matrix.setflags(write=False)
            object.__setattr__(self, name, matrix)
        turn = self.view[:3, :3]
        if not is_rotation(turn):
            raise ValueError(
                f"view must be a rotation and a translation, without scale or mirror, got {turn.tolist()}"
            )
        if not _nearly(self.view[3], (0.0, 0.0, 0.0, 1.0)):
            raise ValueError(f"the last row of view must be (0, 0, 0, 1), got {tuple(self.view[3])}")
        last = self.projection[3]
        if not (_nearly(last, (0.0, 0.0, -1.0, 0.0)) or _nearly(last, (0.0, 0.0, 0.0, 1.0))):
            raise ValueError(
                "the last row of projection must be (0, 0, -1, 0) for a perspective camera or (0, 0, 0, 1) "
                f"for an orthographic one, got {tuple(last)}; is the matrix transposed?"
            )
        if abs(np.linalg.det(self.projection[:2, :2])) < 1e-12:
            raise ValueError(
                f"projection flattens the picture to a line, got {self.projection[:2, :2].tolist()} in its "
                "first rows; give a field of view above zero"
            )

    @classmethod
    def look_at(
        cls,
        eye: ArrayLike,
        target: ArrayLike,
        up: ArrayLike = (0.0, 0.0, 1.0),
        *,
        width: int = 640,
        height: int = 480,
        fovy: float = math.radians(50.0),
        near: float = 0.01,
        far: float = 100.0,
    ) -> Camera:
        """Return a perspective camera at `eye` aimed at `target`.

        Args:
            eye: (3,) camera position in the world frame (m).
            target: (3,) point in the world frame at the centre of the picture (m).
            up: (3,) direction in the world frame that points up in the picture; world y (or x) replaces it
                where it is parallel to the viewing direction.
            width: width of the picture (pixels).
            height: height of the picture (pixels).
            fovy: vertical opening angle (rad).
            near: depth of the near clipping plane (m).
            far: depth of the far clipping plane (m).
        """
        projection = perspective(fovy, width / height, near, far)
        return cls(width, height, look_at_view(eye, target, up), projection)

    @classmethod
    def fitted(
        cls,
        points: ArrayLike,
        direction: ArrayLike,
        up: ArrayLike = (0.0, 0.0, 1.0),
        *,
        width: int = 640,
        height: int = 480,
        fovy: float = math.radians(30.0),
        fill: float = 0.9,
    ) -> Camera:
        """Return the nearest perspective camera in a direction that has all points in its picture.

        Its near and far planes are `FITTED_NEAR` and `FITTED_FAR` times its distance from the points' centre.

        Args:
            points: (n, 3) points in the world frame (m).
            direction: (3,) from the points to the camera, in the world frame.
            up: (3,) direction in the world frame that points up in the picture; where `direction` is along
                it, world y (or x) replaces it.
            width: width of the picture (pixels).
            height: height of the picture (pixels).
            fovy: vertical opening angle (rad).
            fill: share of the picture's width and height that the points may cover.
        """
        eye, centre = fitted_viewpoint(points, direction, up, aspect=width / height, fovy=fovy, fill=fill)
        distance = float(np.linalg.norm(eye - centre))
        return cls.look_at(
            eye,
            centre,
            up,
            width=width,
            height=height,
            fovy=fovy,
            near=FITTED_NEAR * distance,
            far=FITTED_FAR * distance,
        )

    @classmethod
    def orthographic(
        cls,
        eye: ArrayLike,
        target: ArrayLike,
        up: ArrayLike = (0.0, 0.0, 1.0),
        *,
        width: int = 640,
        height: int = 480,
        extent: float = 2.0,
        near: float = 0.01,
        far: float = 100.0,
    ) -> Camera:
        """Return an orthographic camera at `eye` aimed at `target`, both (3,) in the world frame (m).

        The picture covers `extent` metres from bottom to top; `near` and `far` are the depths of the clipping
        planes (m), `up` a (3,) direction in the world frame that points up in the picture.

        Raises ValueError unless `extent` is positive and `far` above `near`.
        """
        if not extent > 0 or not far > near:
            raise ValueError(f"extent must be positive and far above near, got {extent=}, {near=}, {far=}")
        projection = np.eye(4)
        projection[0, 0] = 2.0 * height / (extent * width)
        projection[1, 1] = 2.0 / extent
        projection[2, 2] = -2.0 / (far - near)
        projection[2, 3] = -(far + near) / (far - near)
        return cls(width, height, look_at_view(eye, target, up), projection)

    @classmethod
    def pinhole(
        cls,
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        *,
        width: int,
        height: int,
        position: ArrayLike = (0.0, 0.0, 0.0),
        orientation: ArrayLike = transforms.IDENTITY_QUATERNION,
        convention: Literal["gl", "optical"] = "gl",
        near: float = 0.01,
        far: float = 100.0,
    ) -> Camera:
        """Return a camera with calibrated intrinsics (pixels) at a pose in the world.

        Args:
            fx: focal length in x (pixels).
            fy: focal length in y (pixels).
            cx: column of the principal point, from the left edge (pixels); width / 2 is the centre.
            cy: row of the principal point, from the top edge (pixels).
            width: width of the picture (pixels).
            height: height of the picture (pixels).
            position: (3,) camera position in the world frame (m).
            orientation: (4,) quaternion x, y, z, w of the camera frame in the world frame.
            convention: axes of the camera frame: "gl" has the viewing direction -z and y up, "optical" +z
                and y down, as calibration tools and ROS's optical frames define it.
            near: depth of the near clipping plane (m).
            far: depth of the far clipping plane (m).

        Raises ValueError for focal lengths that are not positive and for an unknown convention.
        """
        check_range(near, far)
        if not (fx > 0 and fy > 0):
            raise ValueError(f"fx and fy must be positive, got {fx} and {fy}")
        projection = np.zeros((4, 4))
        projection[0, 0] = 2.0 * fx / width
        projection[0, 2] = 1.0 - 2.0 * cx / width
        projection[1, 1] = 2.0 * fy / height
        projection[1, 2] = 2.0 * cy / height - 1.0
        projection[2:] = perspective(1.0, 1.0, near, far)[2:]
        pose = transforms.pose_matrix(position, transforms.normalized(orientation))
        if convention == "optical":
            pose[:3, :3] = pose[:3, :3] @ _FLIP_YZ
        elif convention != "gl":
            raise ValueError(f'convention must be "gl" or "optical", got {convention!r}')
        return cls(width, height, transforms.inverse_pose(pose), projection)

    @classmethod
    def from_yaw_pitch(
        cls,
        target: ArrayLike = (0.0, 0.0, 0.0),
        distance: float = 3.0,
        yaw: float = math.radians(50.0),
        pitch: float = math.radians(-30.0),
        roll: float = 0.0,
        *,
        width: int = 640,
        height: int = 480,
        fovy: float = math.radians(50.0),
        near: float = 0.01,
        far: float = 100.0,
    ) -> Camera:
        """Return a camera on an orbit around `target`, (3,) in the world frame (m), at `distance` (m).

        Angles are in rad, z is up. At yaw 0 the camera is at -y of the target and the viewing direction is
        +y; positive yaw moves it counter-clockwise seen from above; negative pitch raises it above the
        target; roll rotates it about its viewing direction.
        """
        view = orbit_view(target, distance, yaw, pitch, roll)
        return cls(width, height, view, perspective(fovy, width / height, near, far))

    def resized(self, width: int, height: int) -> Camera:
        """Return the same view of the same part of the world with another number of pixels."""
        return Camera(width, height, self.view, self.projection)

    @property
    def is_perspective(self) -> bool:
        """Whether the projection is perspective; False for an orthographic one."""
        return bool(self.projection[3, 3] == 0.0 or abs(self.projection[3, 2]) > 0.5)

    @property
    def near(self) -> float:
        """Depth of the near clipping plane (m), computed from the projection."""
        a, b = self.projection[2, 2], self.projection[2, 3]
        return float(b / (a - 1.0)) if self.is_perspective else float((b + 1.0) / a)

    @property
    def far(self) -> float:
        """Depth of the far clipping plane (m), computed from the projection; inf where it has none."""
        a, b = self.projection[2, 2], self.projection[2, 3]
        if self.is_perspective:
            return float(b / (a + 1.0)) if a + 1.0 < 0.0 else math.inf
        return float((b - 1.0) / a)

    @property
    def intrinsics(self) -> Array:
        """(3, 3) pinhole matrix (pixels) for the optical convention: x right, y down, z forward.

        Raises ValueError for an orthographic camera.
        """
        if not self.is_perspective:
            raise ValueError(
                f"an orthographic camera has no pinhole matrix, got projection {self.projection.tolist()}; "
                "use pixel_matrix"
            )
        p = self.projection
        w, h = self.width / 2.0, self.height / 2.0
        return np.array(
            [
                [w * p[0, 0], -w * p[0, 1], w * (1.0 - p[0, 2])],
                [-h * p[1, 0], h * p[1, 1], h * (1.0 + p[1, 2])],
                [0.0, 0.0, 1.0],
            ]
        )

    @property
    def pixel_matrix(self) -> Array:
        """(3, 4) projection of world points (m) to pixels: (column · d, row · d, d).

        Here d is the depth (m). For an orthographic camera the result is (column, row, d).
        """
        p, v = self.projection, self.view
        clip = p @ v
        depth = -v[2]
        one = depth if self.is_perspective else np.array([0.0, 0.0, 0.0, 1.0])
        column = 0.5 * self.width * (clip[0] + one)
        row = 0.5 * self.height * (one - clip[1])
        return np.stack([column, row, depth])

    @property
    def T_world_camera(self) -> Array:
        """(4, 4) pose of the camera frame (viewing direction -z, +y up) in the world frame (m)."""
        return transforms.inverse_pose(self.view)

    @property
    def position(self) -> Array:
        """(3,) camera position in the world frame (m)."""
        return self.T_world_camera[:3, 3]

    @property
    def orientation(self) -> Array:
        """(4,) quaternion x, y, z, w of the camera frame (viewing direction -z, +y up) in the world frame."""
        return transforms.quaternion_from_matrix(self.T_world_camera[:3, :3])

    def project(self, points: ArrayLike) -> Array:
        """Return (..., 3) column and row (pixels, fractional) and depth (m) of (..., 3) world points (m)."""
        p = np.asarray(points, dtype=float)
        m = self.pixel_matrix
        out = p @ m[:, :3].T + m[:, 3]
        if self.is_perspective:
            with np.errstate(divide="ignore", invalid="ignore"):
                out[..., :2] /= out[..., 2:]
        return out

    def rays(self) -> tuple[Array, Array]:
        """Return (height, width, 3) origins (m) and directions of the pixels' rays in the world frame.

        The component of a direction along the camera's axis is 1: `origin + depth * direction` is the point
        at that depth.
        """
        m = self.pixel_matrix
        inverse = np.linalg.inv(m[:, :3])
        row, column = np.mgrid[0 : self.height, 0 : self.width] + 0.5
        one = np.ones_like(row)
        if self.is_perspective:
            directions = np.stack([column, row, one], axis=-1) @ inverse.T
            origins = np.broadcast_to(-inverse @ m[:, 3], directions.shape)
        else:
            pixels = np.stack([column, row, 0.0 * one], axis=-1)
            origins = (pixels - m[:, 3]) @ inverse.T
            directions = np.broadcast_to(inverse[:, 2], origins.shape)
        return np.asarray(origins, dtype=float), np.asarray(directions, dtype=float)

    def deproject(self, depth: ArrayLike) -> Array:
        """Return (height, width, 3) world points (m) of a (height, width) depth image (m).

        Pixels whose depth is not finite give NaN. Raises ValueError for a depth image of another size.
        """
        d = np.asarray(depth, dtype=float)
        if d.shape != (self.height, self.width):
            raise ValueError(f"depth must have shape {(self.height, self.width)}, got {d.shape}")
        origins, directions = self.rays()
        d = np.where(np.isfinite(d), d, np.nan)
        return origins + d[..., None] * directions

    def depth_to_buffer(self, depth: ArrayLike) -> NDArray[np.float32]:
        """Return the OpenGL depth buffer, 0 (near) to 1 (far and misses), of (..., n) depths (m)."""
        from roboyard.rendering.kernels.depth import to_buffer  # on first use only

        z = np.asarray(depth, dtype=np.float32)
        p = self.projection
        out = result("depth buffer", z.shape, np.float32)
        flat = np.ascontiguousarray(z).reshape(-1)
        to_buffer(flat, p[2, 2], p[2, 3], p[3, 2], p[3, 3], out.reshape(-1))
        return out


def _nearly(row: Array, expected: tuple[float, float, float, float]) -> bool:
    return all(abs(a - b) <= 1e-5 for a, b in zip(row.tolist(), expected, strict=True))

"""Arguments of the shading kernels: arrays in named groups, with their layouts."""

from __future__ import annotations

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import NamedTuple
from roboyard.native import record

Array = NDArray[np.float64]


class View(NamedTuple):
    """Size of a picture and the rays of its pixels.

    The ray of the picture position (x, y) is `origin(x, y) + depth * direction(x, y)`, where
    `origin(x, y) = origins[0] + x * origins[1] + y * origins[2]`, and `direction` likewise.
    """

    width: int
    """Pixels."""
    height: int
    """Pixels."""
    perspective: bool
    """Whether nearness is 1 / depth; otherwise it is -depth."""
    origins: Array
    """(3, 3) in the world frame (m)."""
    directions: Array
    """(3, 3) in the world frame, per metre of depth."""


class Instances(NamedTuple):
    """The shapes of a scene at one moment, row by row."""

    to_world: Array
    """(n, 3, 4) mesh to world (m)."""
    to_local: Array
    """(n, 3, 3) world to mesh, rotation and scale."""
    materials: Array
    """(n, 11): RGBA, specular, second RGB and square size of the checkerboard (0: none), scale along x
    and y."""
    links: NDArray[np.int32]
    """(n, 7): body id, link index, texture, first mesh colour, first texture coordinate (-1: none each),
    first face and first vertex of the mesh."""


class Meshes(NamedTuple):
    """The distinct meshes of a scene, concatenated."""

    faces: NDArray[np.int32]
    """(m, 3) vertex indices inside the face's own mesh."""
    vertices: NDArray[np.float32]
    """(k, 3) in the mesh frame."""
    normals: NDArray[np.float32]
    """(m, 3, 3) unit normal at each corner, in the mesh frame."""
    colors: NDArray[np.uint8]
    """(c, 4) RGBA of the faces of coloured meshes."""


class Sunlight(NamedTuple):
    """The light and its shadow map."""

    light: Array
    """(13,): unit vector to the sun, RGB, ambient, diffuse, specular, sky fraction, shadow leak, gloss, and
    what is added to levels before they are cut."""
    nearness: NDArray[np.float32]
    """(size * size,) shadow map: nearness to the sun of the first surface."""
    tiles: NDArray[np.float32]
    """Largest nearness of each tile of the map."""
    size: int
    """Texels along a side of the map; 0: no shadow."""
    matrix: Array
    """(3, 4) from the world to column, row and depth (m) of the map."""
    texel: float
    """Side of a texel (m)."""
    shaded: NDArray[np.int64]
    """(4,) first and last column, first and last row of the picture that shadows may reach."""


class Background(NamedTuple):
    """The picture behind the scene."""

    gradient: Array
    """(2, 4) RGBA at the top and at the bottom."""
    fade: Array
    """(2,) depths between which infinite planes fade into the background (m)."""


VIEW = record(View, "i8 i8 i8 f8[:,:] f8[:,:]")
INSTANCES = record(Instances, "f8[:,:,::1] f8[:,:,::1] f8[:,::1] i4[:,::1]")
MESHES = record(Meshes, "i4[:,::1] f4[:,::1] f4[:,:,::1] u1[:,::1]")
SUNLIGHT = record(Sunlight, "f8[::1] f4[::1] f4[::1] i8 f8[:,:] f8 i8[::1]")
BACKGROUND = record(Background, "f8[:,:] f8[::1]")

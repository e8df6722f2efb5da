"""Checkerboards and the background gradient."""

from __future__ import annotations

import numpy as np

from roboyard.rendering.kernels.vectors import along, dot, product, row_of


def checker_share(x, y, wide_x, wide_y):
    """Return the fraction of the second colour in a footprint around (x, y), in squares.

    It is the exact mean over a footprint of size (wide_x, wide_y), one axis at a time, so that the board
    becomes an even mix towards the horizon.
    """
    wide_x, wide_y = max(wide_x, 1e-4), max(wide_y, 1e-4)
    # integral of the square wave that is +1 on even squares and -1 on odd ones is a triangle wave
    a, b = 0.5 * (x - 0.5 * wide_x), 0.5 * (x + 0.5 * wide_x)
    wave_x = abs(a - np.floor(a) - 0.5) - abs(b - np.floor(b) - 0.5)
    a, b = 0.5 * (y - 0.5 * wide_y), 0.5 * (y + 0.5 * wide_y)
    wave_y = abs(a - np.floor(a) - 0.5) - abs(b - np.floor(b) - 0.5)
    return 0.5 - 2.0 * wave_x * wave_y / (wide_x * wide_y)


def checker_at(point, normal, to_mesh, direction, depth, origins, directions, per_x, per_y):
    """Return the fraction of the second colour in the pixel that shows a point of a face.

    Args:
        point: point in the mesh frame.
        normal: normal of the face in the mesh frame, of any length.
        to_mesh: world to mesh, a tuple of three rows.
        direction: direction of the pixel's ray in the world frame.
        depth: depth of the point (m).
        origins: (3, 3) ray origins, see `View`.
        directions: (3, 3) ray directions, see `View`.
        per_x: squares per unit along x of the mesh frame.
        per_y: squares per unit along y of the mesh frame.
    """
    ray = product(to_mesh, direction)
    slant = dot(normal, ray)
    slant = 1.0 / slant if abs(slant) > 1e-300 else 0.0
    wide_x, wide_y = 0.0, 0.0
    for k in range(1, 3):
        # movement on the plane of the face from one pixel to the next column (row)
        step = product(to_mesh, along(row_of(origins, k), depth, row_of(directions, k)))
        step = along(step, -dot(normal, step) * slant, ray)
        wide_x += abs(step[0])
        wide_y += abs(step[1])
    return checker_share(point[0] * per_x, point[1] * per_y, wide_x * per_x, wide_y * per_y)


def background_color(gradient, row, height):
    """Return the RGBA of a row of a vertical gradient (2, 4)."""
    share = (row + 0.5) / height
    rest = 1.0 - share
    return (
        gradient[0, 0] * rest + gradient[1, 0] * share,
        gradient[0, 1] * rest + gradient[1, 1] * share,
        gradient[0, 2] * rest + gradient[1, 2] * share,
        gradient[0, 3] * rest + gradient[1, 3] * share,
    )

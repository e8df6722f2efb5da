"""Colour of each pixel from the surface that it shows, once visibility is known."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled
from roboyard.rendering.kernels.arrays import BACKGROUND, INSTANCES, MESHES, SUNLIGHT, VIEW
from roboyard.rendering.kernels.faces import lay_face
from roboyard.rendering.kernels.indices import I
from roboyard.rendering.kernels.patterns import background_color
from roboyard.rendering.kernels.runs import (
    ALPHA,
    BLUE,
    GREEN,
    ONE,
    RED,
    RUN,
    cast_shadows,
    fade_out,
    lay_light,
    lay_points,
    light_evenly,
    light_up,
    write_run,
)


@compiled(
    "i8[::1] f4[::1] i8 i8",
    *(VIEW, INSTANCES, MESHES, "u4[::1]", SUNLIGHT, BACKGROUND),
    "f4[:,::1] i8 i8 f4[::1] u4[::1]",
    fast_math=True,
    releases_gil=True,
)
def shade(
    seen, nearness, first_row, end_row, view, instances, meshes, paint, sun, background, front, layered,
    final, work, out,
):  # fmt: skip
    """Shade the surfaces of one layer.

    Args:
        seen: (pixels,) instance << 32 | face of each pixel; -1: none.
        nearness: (pixels,) nearness of the surface, see `raster`.
        first_row: first row to shade.
        end_row: last row to shade + 1.
        view: `View`.
        instances: `Instances`.
        meshes: `Meshes`.
        paint: (pixels,) colours of textures, from `sample_textures`.
        sun: `Sunlight`.
        background: `Background`.
        front: (pixels, 4) premultiplied RGBA of the layers in front; one row unless `layered`.
        layered: whether there are layers in front.
        final: True writes the picture, over the background and under `front`, to `out`; False adds the
            layer under `front`.
        work: (WORK,) float32 scratch.
        out: (pixels,) uint32 RGBA with red in the low byte, written if `final`.
    """
    for row in range(first_row, end_row):
        behind = background_color(background.gradient, row, view.height)
        plain = packed(behind)
        line, column = row * view.width, 0
        while column < view.width:
            first = column
            column += 1
            if seen[I(line + first)] < 0:
                while column < view.width and seen[I(line + column)] < 0:
                    column += 1
                if final:
                    for p in range(I(line + first), I(line + column)):
                        out[p] = blended(front, p, behind) if layered else plain
                continue
            end = min(first + RUN, view.width)
            while column < end and seen[I(line + column)] >= 0:
                column += 1
            lay_points(work, nearness, row, first, column, view)
            start = first
            while start < column:
                # one stretch that shows one face
                code, end = seen[I(line + start)], start + 1
                while end < column and seen[I(line + end)] == code:
                    end += 1
                lay_face(
                    work, code, row, start, end, first, view, instances, meshes, paint, sun, background.fade
                )
                start = end
            if sun.light[7] > 0.0 or sun.light[8] > 0.0 or sun.light[11] > 0.0:
                lay_light(work, row, first, column, view, sun)
                reach = sun.shaded
                if reach[2] <= row <= reach[3]:
                    cast_shadows(work, max(first, reach[0]) - first, min(column, reach[1] + 1) - first, sun)
                light_up(work, row, first, column, view, sun)
            else:
                light_evenly(work, column - first, sun.light[6])
            if background.fade[0] < np.inf:
                fade_out(work, column - first, behind)
            p = I(line + first)
            if not final:
                for k in range(I(column - first)):
                    add_behind(front, p + k, work, k)
            elif layered:
                for k in range(I(column - first)):
                    out[p + k] = blended(front, p + k, (*color_of(work, k), ONE))
            else:
                write_run(work, column - first, sun.light[12], out, p)


def packed(rgba):
    """Return a colour as bytes, red in the low one."""
    red, green = np.uint32(rgba[0] * 255.0 + 0.5), np.uint32(rgba[1] * 255.0 + 0.5)
    blue, alpha = np.uint32(rgba[2] * 255.0 + 0.5), np.uint32(min(rgba[3], 1.0) * 255.0 + 0.5)
    return np.uint32(red | (green << np.uint32(8)) | (blue << np.uint32(16)) | (alpha << np.uint32(24)))


def blended(front, p, rgba):
    """Return a colour under the layers in front of pixel p, as bytes."""
    rest = 1.0 - front[p, 3]
    return packed(
        (
            front[p, 0] + rest * rgba[0],
            front[p, 1] + rest * rgba[1],
            front[p, 2] + rest * rgba[2],
            front[p, 3] + rest * rgba[3],
        )
    )


def color_of(work, k):
    """Return the RGB of pixel k of a run."""
    return min(work[RED + k], ONE), min(work[GREEN + k], ONE), min(work[BLUE + k], ONE)


def add_behind(front, p, work, k):
    """Add the transparent surface of pixel k of a run behind the layers in front of pixel p."""
    weight = (1.0 - front[p, 3]) * work[ALPHA + k]
    red, green, blue = color_of(work, k)
    front[p, 0] += weight * red
    front[p, 1] += weight * green
    front[p, 2] += weight * blue
    front[p, 3] += weight


@compiled("i8[::1] f4[::1] i4[:,::1] i8 f4[::1] i4[:,::1]", fast_math=True, releases_gil=True)
def describe(seen, nearness, links, perspective, depth, segmentation):
    """Write the depth (m; inf: none) and the owner ids (-1: none) of each pixel.

    Args:
        seen: (pixels,) instance << 32 | face; -1: none.
        nearness: (pixels,) nearness, see `raster`.
        links: (n, 7), see `Instances`.
        perspective: whether nearness is 1 / depth; otherwise it is -depth.
        depth: (pixels,) float32, written.
        segmentation: (pixels, 2) int32, written: body id and link index.
    """
    for p in range(len(seen)):
        if seen[p] < 0:
            depth[p] = np.inf
            segmentation[p, 0] = -1
            segmentation[p, 1] = -1
        else:
            instance = seen[p] >> 32
            depth[p] = np.float32(1.0) / nearness[p] if perspective else -nearness[p]
            segmentation[p, 0] = links[instance, 0]
            segmentation[p, 1] = links[instance, 1]

"""Texture colours of the pixels of a picture, packed into 32 bits each, before lighting."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled
from roboyard.rendering.kernels.indices import I
from roboyard.rendering.kernels.raster import PLANE

F, U = np.float32, np.uint32
LANES, ROUND = U(0x00FF00FF), U(0x00800080)
"""Every other byte of a colour, in 16 bits each, so that one product weights two."""
EIGHT, FULL = U(8), U(256)
ONE, QUARTER, MIDDLE, WIDEST = F(1.0), F(0.25), F(128.0), F(1e6)

RUN = 256
"""Most pixels sampled at a time: their arrays stay in the processor's first cache."""
DEPTH, TURN, RIGHT, DOWN, SIDE = (I(RUN * k) for k in range(5))
SINGLE = 5 * RUN
LEVEL, PART, WEIGHT_X, WEIGHT_Y = (I(RUN * k) for k in range(4))
WHOLE = 4 * RUN
EVEN, ODD, EVEN_2, ODD_2, C00, C10, C01, C11 = (I(RUN * k) for k in range(8))
COLORS = 8 * RUN
"""Places of a run's arrays in one array each of single precision, whole numbers and colours."""


def texture_gradients(
    out, uvs, face_uv, vertices, i0, i1, i2, to_world, to_local, instance, origins, directions, perspective
):
    """Write the texture coordinates of a triangle as functions of the pixel to `out` (3, 6).

    A pixel's ray is o(x, y) + depth * d(x, y) with o and d affine in the pixel (x, y), and texture
    coordinates are affine in the point. So each is b(x, y) + depth * g(x, y): rows 0 (u) and 1 (v) hold
    the value at pixel (0, 0) and the change per column and row of b, then of g. Row 2 holds the change of
    1 / depth (perspective) or depth (parallel) per column and row.
    """
    ax, ay, az = np.float64(vertices[i0, 0]), np.float64(vertices[i0, 1]), np.float64(vertices[i0, 2])
    ux, uy, uz = vertices[i1, 0] - ax, vertices[i1, 1] - ay, vertices[i1, 2] - az
    vx, vy, vz = vertices[i2, 0] - ax, vertices[i2, 1] - ay, vertices[i2, 2] - az
    gx, gy, gz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    uu = ux * ux + uy * uy + uz * uz
    uv = ux * vx + uy * vy + uz * vz
    vv = vx * vx + vy * vy + vz * vz
    spread = uu * vv - uv * uv
    spread = 1.0 / spread if spread > 0.0 else 0.0
    # barycentric coordinates at corners 1 and 2: products of a point's offset from corner 0 with these
    t1x, t1y, t1z = (vv * ux - uv * vx) * spread, (vv * uy - uv * vy) * spread, (vv * uz - uv * vz) * spread
    t2x, t2y, t2z = (uu * vx - uv * ux) * spread, (uu * vy - uv * uy) * spread, (uu * vz - uv * uz) * spread
    for k in range(2):
        start = np.float64(uvs[face_uv, 0, k])
        first, second = uvs[face_uv, 1, k] - start, uvs[face_uv, 2, k] - start
        px, py, pz = first * t1x + second * t2x, first * t1y + second * t2y, first * t1z + second * t2z
        start -= px * ax + py * ay + pz * az
        for j in range(3):
            out[k, j], out[k, 3 + j] = 0.0, 0.0
        for i in range(3):
            # the slope along a world axis
            slope = px * to_local[instance, 0, i] + py * to_local[instance, 1, i]
            slope += pz * to_local[instance, 2, i]
            start -= slope * to_world[instance, i, 3]
            for j in range(3):
                out[k, j] += slope * origins[j, i]
                out[k, 3 + j] += slope * directions[j, i]
        out[k, 0] += start
    # the plane's normal n in the world, and the change of the depth at which a ray meets the plane
    height, along = -(gx * ax + gy * ay + gz * az), 0.0
    column, row = 0.0, 0.0
    for i in range(3):
        n = gx * to_local[instance, 0, i] + gy * to_local[instance, 1, i] + gz * to_local[instance, 2, i]
        height += n * (origins[0, i] - to_world[instance, i, 3])
        along += n * directions[0, i]
        column += n * (directions[1, i] if perspective else origins[1, i])
        row += n * (directions[2, i] if perspective else origins[2, i])
    scale = height if perspective else along
    scale = -1.0 / scale if abs(scale) > 1e-300 else 0.0
    out[2, 0], out[2, 1] = column * scale, row * scale


@compiled(
    "i8[::1] f4[::1] i8 i8 i8 i8 f8[:,:] f8[:,:] f8[:,:,::1] f8[:,:,::1] i4[:,::1] i4[:,::1] f4[:,::1]",
    "f4[:,:,::1] u4[::1] i4[:,:,::1] f8[:,::1] f4[::1] i4[::1] u4[::1] u4[::1]",
    fast_math=True,
    releases_gil=True,
)
def sample_textures(
    seen, nearness, first_row, end_row, width, perspective, origins, directions, to_world, to_local, links,
    faces, vertices, uvs, texels, textures, laid, single, whole, colors, out,
):  # fmt: skip
    """Write the texture colour of each textured pixel to `out` (pixels,) uint32, red in the low byte.

    Args:
        seen: (pixels,) instance << 32 | face of each pixel; -1: none.
        nearness: (pixels,) nearness of the surface, see `raster`.
        first_row: first row to sample.
        end_row: last row to sample + 1.
        width: columns of the picture.
        perspective: whether nearness is 1 / depth; otherwise it is -depth.
        origins: (3, 3) ray origins, see `View`.
        directions: (3, 3) ray directions, see `View`.
        to_world: (n, 3, 4), see `Instances`.
        to_local: (n, 3, 3), see `Instances`.
        links: (n, 7), see `Instances`.
        faces: (m, 3), see `Meshes`.
        vertices: (k, 3), see `Meshes`.
        uvs: (t, 3, 2) texture coordinates of the corners of textured meshes' faces.
        texels: packed colours of all levels of all textures.
        textures: (textures, levels, 3) first texel, columns and rows of each level.
        laid: (3, 6) float64 scratch.
        single: (SINGLE,) float32 scratch.
        whole: (WHOLE,) int32 scratch.
        colors: (COLORS,) uint32 scratch.
        out: written.
    """
    last = np.int64(-1)
    row, column = np.int64(first_row), np.int64(0)
    while row < end_row:
        # one stretch of a row that shows one triangle after another
        line = row * width
        code = seen[I(line + column)]
        first = column
        column += 1
        most = min(first + RUN, width)
        while column < most and seen[I(line + column)] == code:
            column += 1
        end, y = column, row + 0.5
        if column == width:
            row, column = row + 1, np.int64(0)
        if code < 0:
            continue
        instance = np.int64(code >> 32)
        texture = np.int64(links[instance, 2])
        if texture < 0:
            continue
        if code != last:
            last = code
            face, first_face = np.int64(code & 0x7FFFFFFF), np.int64(links[instance, 5])
            face = first_face if face == PLANE else face
            vertex = np.int64(links[instance, 6])
            texture_gradients(
                laid, uvs, links[instance, 4] + face - first_face, vertices, vertex + faces[face, 0],
                vertex + faces[face, 1], vertex + faces[face, 2], to_world, to_local,
                instance, origins, directions, perspective,
            )  # fmt: skip
        p, count = I(line + first), I(end - first)
        lay_coordinates(
            single, nearness, p, count, first + 0.5, y, laid, perspective, textures[texture, 0, 1],
            textures[texture, 0, 2],
        )  # fmt: skip
        choose_levels(single, whole, count, np.int32(textures.shape[1] - 2))
        k = I(0)
        while k < count:
            # one stretch within a level, or between two of them
            start, level, is_mixed = k, whole[LEVEL + k], whole[PART + k] > 0
            k += I(1)
            while k < count and whole[LEVEL + k] == level and (whole[PART + k] > 0) == is_mixed:
                k += I(1)
            sample_level(single, whole, colors, start, k, texels, textures, texture, level)
            if is_mixed:
                for i in range(start, k):
                    colors[EVEN_2 + i], colors[ODD_2 + i] = colors[EVEN + i], colors[ODD + i]
                sample_level(single, whole, colors, start, k, texels, textures, texture, level + 1)
                for i in range(start, k):
                    part = U(whole[PART + i])
                    share = U(FULL - part)
                    even = U(share * colors[EVEN_2 + i] + part * colors[EVEN + i] + ROUND)
                    odd = U(share * colors[ODD_2 + i] + part * colors[ODD + i] + ROUND)
                    colors[EVEN + i], colors[ODD + i] = U(even >> EIGHT) & LANES, U(odd >> EIGHT) & LANES
            for i in range(start, k):
                out[p + i] = colors[EVEN + i] | U(colors[ODD + i] << EIGHT)


def lay_coordinates(single, nearness, p, count, x, y, laid, perspective, columns, rows):
    """Write texture coordinates, from 0 to 1 with v downward, and the footprint's side in texels.

    Args:
        single: scratch.
        nearness: (pixels,) nearness of the surface.
        p: first pixel.
        count: pixels.
        x: middle of the first pixel.
        y: middle of the row.
        laid: (3, 6) from `texture_gradients`.
        perspective: whether nearness is 1 / depth; otherwise it is -depth.
        columns: of the full picture.
        rows: of the full picture.
    """
    bu1, bv1, gu1, gv1, z1 = laid[0, 1], laid[1, 1], laid[0, 4], laid[1, 4], laid[2, 0]
    bu2, bv2, gu2, gv2, z2 = laid[0, 2], laid[1, 2], laid[0, 5], laid[1, 5], laid[2, 1]
    bu, bv = laid[0, 0] + bu1 * x + bu2 * y, laid[1, 0] + bv1 * x + bv2 * y
    gu, gv = laid[0, 3] + gu1 * x + gu2 * y, laid[1, 3] + gv1 * x + gv2 * y
    if perspective:
        for k in range(count):
            single[DEPTH + k] = ONE / nearness[p + k]
            single[TURN + k] = -single[DEPTH + k] * single[DEPTH + k]
    else:
        for k in range(count):
            single[DEPTH + k] = -nearness[p + k]
            single[TURN + k] = ONE
    for k in range(count):
        t, depth = np.float64(np.int32(k)), np.float64(single[DEPTH + k])
        u, v = bu + bu1 * t + depth * (gu + gu1 * t), bv + bv1 * t + depth * (gv + gv1 * t)
        single[RIGHT + k], single[DOWN + k] = u - np.floor(u), np.ceil(v) - v
    # footprints need less precision
    wide, high = F(columns), F(rows)
    gu, gv, bu1, gu1, bv1, gv1, z1 = F(gu), F(gv), F(bu1), F(gu1), F(bv1), F(gv1), F(z1)
    bu2, gu2, bv2, gv2, z2 = F(bu2), F(gu2), F(bv2), F(gv2), F(z2)
    for k in range(count):
        t, depth, turn = F(np.int32(k)), single[DEPTH + k], single[TURN + k]
        slope_u, slope_v = turn * (gu + gu1 * t), turn * (gv + gv1 * t)
        du, dv = wide * (bu1 + depth * gu1 + z1 * slope_u), high * (bv1 + depth * gv1 + z1 * slope_v)
        across = du * du + dv * dv
        du, dv = wide * (bu2 + depth * gu2 + z2 * slope_u), high * (bv2 + depth * gv2 + z2 * slope_v)
        down = du * du + dv * dv
        # a slanted view may use up to one level more than its longer side allows
        square = max(np.sqrt(across) * np.sqrt(down), QUARTER * max(across, down))
        single[SIDE + k] = min(np.sqrt(square), WIDEST)


def choose_levels(single, whole, count, deepest):
    """Write the level of each pixel and how much the next one counts, in 256ths.

    The level is the one whose texels are about as large as the footprint, blended with the next over the
    middle third between them.
    """
    for k in range(count):
        # the side as a power of two, rounded down, by its bits; 2 and 4 themselves count as below
        side = single[SIDE + k]
        level = np.int32(0)
        for power in range(1, 15):
            level += np.int32(side > F(1 << power))
        level = min(level, deepest)
        whole[LEVEL + k] = level
    for k in range(count):
        level = whole[LEVEL + k]
        side = single[SIDE + k] / F(np.int32(1) << level)
        part = np.int32(min(max(F(768.0) * side - F(1023.5), F(0.0)), F(256.0)))
        part = min(max(part, np.int32(0)), np.int32(256))
        is_next = np.int32(part == 256)
        whole[LEVEL + k] = level + is_next
        whole[PART + k] = part - (is_next << np.int32(8))


def sample_level(single, whole, colors, start, end, texels, textures, texture, level):
    """Write the bilinear samples of one level of a texture: the even bytes of a colour, and its odd ones."""
    base = np.int32(textures[texture, level, 0])
    columns, rows = np.int32(textures[texture, level, 1]), np.int32(textures[texture, level, 2])
    wide, high = F(np.int32(256) * columns), F(np.int32(256) * rows)
    for k in range(start, end):
        # 256ths of a texel from the centre of the last one
        fx, fy = np.int32(single[RIGHT + k] * wide + MIDDLE), np.int32(single[DOWN + k] * high + MIDDLE)
        # all four are within half a texel of the picture: one step around its rim brings them in
        x1, y1 = np.int32(fx >> np.int32(8)), np.int32(fy >> np.int32(8))
        x0 = np.int32(x1 - 1 if (x1 > 0) & (x1 <= columns) else columns - 1)
        y0 = np.int32(y1 - 1 if (y1 > 0) & (y1 <= rows) else rows - 1)
        x1 = np.int32(x1 if (x1 > 0) & (x1 < columns) else 0)
        y1 = np.int32(y1 if (y1 > 0) & (y1 < rows) else 0)
        a, b = np.int32(base + y0 * columns), np.int32(base + y1 * columns)
        colors[C00 + k], colors[C10 + k] = U(a + x0), U(a + x1)
        colors[C01 + k], colors[C11 + k] = U(b + x0), U(b + x1)
        whole[WEIGHT_X + k], whole[WEIGHT_Y + k] = fx & np.int32(255), fy & np.int32(255)
    look_up(colors, C00 + start, C00 + end, texels)
    look_up(colors, C10 + start, C10 + end, texels)
    look_up(colors, C01 + start, C01 + end, texels)
    look_up(colors, C11 + start, C11 + end, texels)
    for k in range(start, end):
        c00, c10, c01, c11 = colors[C00 + k], colors[C10 + k], colors[C01 + k], colors[C11 + k]
        # one product weights two channels
        right, below = U(whole[WEIGHT_X + k]), U(whole[WEIGHT_Y + k])
        w11 = U(U(right * below + U(128)) >> EIGHT)
        w10, w01 = U(right - w11), U(below - w11)
        w00 = U(FULL - right - w01)
        even = U((c00 & LANES) * w00 + (c10 & LANES) * w10 + (c01 & LANES) * w01 + (c11 & LANES) * w11)
        c00, c10, c01, c11 = U(c00 >> EIGHT), U(c10 >> EIGHT), U(c01 >> EIGHT), U(c11 >> EIGHT)
        odd = U((c00 & LANES) * w00 + (c10 & LANES) * w10 + (c01 & LANES) * w01 + (c11 & LANES) * w11)
        colors[EVEN + k] = U(U(even + ROUND) >> EIGHT) & LANES
        colors[ODD + k] = U(U(odd + ROUND) >> EIGHT) & LANES


def look_up(colors, first, end, texels):
    """Replace places of texels by their colours.

    One loop over all four corners' arrays would take LLVM's code five times as long.
    """
    for k in range(first, end):
        colors[k] = texels[colors[k]]

"""Texture colours of the pixels of a picture, packed into 32 bits each, before lighting."""

from __future__ import annotations

import math

import numpy as np

from roboyard.rendering.kernels.options import compiled, inlined
from roboyard.rendering.kernels.raster import PLANE

LANES = np.uint64(0x00FF00FF00FF00FF)
"""The bytes of a colour in 16 bits each, so that one product weights all four."""
ROUND = np.uint64(0x0080008000800080)
EIGHT, SPREAD, FULL = np.uint64(8), np.uint64(24), np.uint64(256)


@compiled
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


@compiled
def sample_textures(
    seen, nearness, width, height, perspective, origins, directions, to_world, to_local, links,
    faces, vertices, uvs, texels, textures, out,
):  # fmt: skip
    """Write the texture colour of each textured pixel to `out` (pixels,) uint32, red in the low byte.

    Args:
        seen: (pixels,) instance << 32 | face of each pixel; -1: none.
        nearness: (pixels,) nearness of the surface, see `raster`.
        width: columns of the picture.
        height: rows of the picture.
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
        out: written.
    """
    laid, last = np.empty((3, 6)), np.int64(-1)
    us, vs, roots = np.empty(width), np.empty(width), np.empty(width)
    row, column = np.int64(0), np.int64(0)
    while row < height:
        # one stretch of a row that shows one triangle after another
        p = row * width + column
        code = seen[p]
        first = column
        column += 1
        while column < width and seen[row * width + column] == code:
            column += 1
        end, line, y = column, row * width, row + 0.5
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
        which = np.uint64(texture)
        wide, high = np.float64(textures[texture, 0, 1]), np.float64(textures[texture, 0, 2])
        # texture coordinates and the footprint's side in texels of the full picture
        bu, bv = laid[0, 0] + laid[0, 2] * y, laid[1, 0] + laid[1, 2] * y
        gu, gv = laid[0, 3] + laid[0, 5] * y, laid[1, 3] + laid[1, 5] * y
        bu1, bv1, gu1, gv1, z1 = laid[0, 1], laid[1, 1], laid[0, 4], laid[1, 4], laid[2, 0]
        bu2, bv2, gu2, gv2, z2 = laid[0, 2], laid[1, 2], laid[0, 5], laid[1, 5], laid[2, 1]
        for k in range(first, end):
            x = k + 0.5
            q = np.float64(nearness[line + k])
            depth = 1.0 / q if perspective else -q
            turn = -depth * depth if perspective else 1.0
            slope_u, slope_v = gu + gu1 * x, gv + gv1 * x
            u, v = bu + bu1 * x + depth * slope_u, bv + bv1 * x + depth * slope_v
            us[k], vs[k] = u - np.floor(u), np.ceil(v) - v
            du = wide * (bu1 + depth * gu1 + turn * z1 * slope_u)
            dv = high * (bv1 + depth * gv1 + turn * z1 * slope_v)
            across = du * du + dv * dv
            du = wide * (bu2 + depth * gu2 + turn * z2 * slope_u)
            dv = high * (bv2 + depth * gv2 + turn * z2 * slope_v)
            down = du * du + dv * dv
            # a slanted view may use up to one level more than its longer side allows
            roots[k] = math.sqrt(max(math.sqrt(across * down), 0.25 * max(across, down)))
        for k in range(first, end):
            i = np.uint64(k)
            out[np.uint64(line + k)] = filtered_texel(texels, textures, which, us[i], vs[i], roots[i])


@inlined
def filtered_texel(texels, textures, texture, u, v, side):
    """Return the packed RGBA of a texture at (u, v), each from 0 to 1, over a footprint of `side` texels.

    Bilinear in the level whose texels are about as large as the footprint, and blended with the next level
    over the middle third between them.
    """
    deepest = textures.shape[1] - 2
    level = np.int64(0)
    while side > 2.0 and level < deepest:
        side *= 0.5
        level += 1
    part = np.uint64(min(max(768.0 * side - 1023.5, 0.0), 256.0))
    share = FULL - part
    if part == FULL:
        level += 1
        share, part = FULL, np.uint64(0)
    total = ROUND + share * bilinear_texel(texels, textures, texture, np.uint64(level), u, v)
    if part != 0:
        total += part * bilinear_texel(texels, textures, texture, np.uint64(level + 1), u, v)
    total = (total >> EIGHT) & LANES
    return np.uint32(total | (total >> SPREAD))


@inlined
def bilinear_texel(texels, textures, texture, level, u, v):
    """Return the bilinear sample of one level of a texture at (u, v), four channels in 16 bits each."""
    start = np.int64(textures[texture, level, 0])
    columns, rows = np.int64(textures[texture, level, 1]), np.int64(textures[texture, level, 2])
    # 256ths of a texel from the centre of the last one
    fx, fy = np.int64(u * (256.0 * columns) + 128.0), np.int64(v * (256.0 * rows) + 128.0)
    # all four are within half a texel of the picture: one step around its rim brings them in
    x1, y1 = fx >> 8, fy >> 8
    x0 = x1 - 1 if 0 < x1 <= columns else columns - 1
    y0 = y1 - 1 if 0 < y1 <= rows else rows - 1
    x1 = x1 if 0 < x1 < columns else 0
    y1 = y1 if 0 < y1 < rows else 0
    a, b = start + y0 * columns, start + y1 * columns
    c00, c10 = np.uint64(texels[np.uint64(a + x0)]), np.uint64(texels[np.uint64(a + x1)])
    c01, c11 = np.uint64(texels[np.uint64(b + x0)]), np.uint64(texels[np.uint64(b + x1)])
    if c00 == c10 and c00 == c01 and c00 == c11:
        return (c00 | (c00 << SPREAD)) & LANES
    # one product weights all four channels
    right, below = np.uint64(fx & 255), np.uint64(fy & 255)
    w11 = (right * below + np.uint64(128)) >> EIGHT
    w10, w01 = right - w11, below - w11
    w00 = FULL - right - w01
    mixed = w00 * ((c00 | (c00 << SPREAD)) & LANES) + w10 * ((c10 | (c10 << SPREAD)) & LANES)
    mixed += w01 * ((c01 | (c01 << SPREAD)) & LANES) + w11 * ((c11 | (c11 << SPREAD)) & LANES)
    return ((mixed + ROUND) >> EIGHT) & LANES

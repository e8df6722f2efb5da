"""Colour of each pixel, once what it sees is known: shaded once, however much lies behind."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from roboyard.rendering.kernels.options import FAST
from roboyard.rendering.kernels.patterns import backdrop_color, checker_share
from roboyard.rendering.kernels.raster import PLANE
from roboyard.rendering.kernels.shadow import sunlight

BYTE = np.uint32(255)


@njit(cache=True, error_model="numpy", fastmath=FAST)
def shade(
    seen, nearness, width, height, perspective, origins, directions, to_world, to_local, looks, links,
    faces, vertices, normals, colors, paint, light, shadow, tiles, shadow_size,
    shadow_matrix, shadow_texel, shaded, backdrop, fade, front, layered, final, out,
):  # fmt: skip
    """Shade what `seen` says. final: write uint8 (pixels, 4) `out`, over the backdrop and under `front`;
    else lay the colours under what `front` (pixels, 4; premultiplied) already holds.

    origins, directions (3, 3): rows constant, per column, per row of the pixels' lines of sight.
    to_world (n, 3, 4), to_local (n, 3, 3). paint (pixels,): textures' colours.
    light (11,): direction, colour, ambient, diffuse, specular, sky, leak.
    shaded (4,): first and last column and row where a shadow may fall. backdrop (2, 4): top and bottom.
    fade (2,): depths between which endless planes dissolve.
    """
    behind = np.empty(4)
    plain = np.empty(4, dtype=np.uint8)
    foot = np.empty((2, 3))
    step = np.empty((4, 3))  # of the line of sight per column and row, in mesh coordinates
    lx, ly, lz = light[0], light[1], light[2]
    ambient, diffuse, gloss, sky, leak = light[6], light[7], light[8], light[9], light[10]
    shade_left, shade_right, shade_top, shade_bottom = shaded[0], shaded[1], shaded[2], shaded[3]
    lit = diffuse > 0.0 or gloss > 0.0
    ox, oy, oz = origins[0, 0], origins[0, 1], origins[0, 2]
    last, last_instance = np.int64(-1), np.int64(-1)
    instance, face, endless = np.int64(0), np.int64(0), False
    h00 = h01 = h02 = h10 = h11 = h12 = h20 = h21 = h22 = 0.0
    wx = wy = wz = 0.0
    ax = ay = az = ux = uy = uz = vx = vy = vz = 0.0
    gx = gy = gz = uu = uv = vv = spread = 0.0
    ex = ey = ez = face_lift = 0.0
    fx = fy = fz = 0.0
    t1x = t1y = t1z = t2x = t2y = t2z = 0.0
    flat = False
    texture, first_color, first_face, first_vertex = -1, -1, 0, 0
    base_r = base_g = base_b = base_a = shininess = 0.0
    square, per_x, per_y = 0.0, 0.0, 0.0
    for row in range(height):
        backdrop_color(backdrop, row, height, behind)
        for k in range(4):
            plain[k] = np.uint8(behind[k] * 255.0 + 0.5)
        py = row + 0.5
        for column in range(width):
            p = np.uint64(row * width + column)  # unsigned: no look for negative numbers at each access
            code = seen[p]
            red, green, blue, alpha = 0.0, 0.0, 0.0, 0.0
            if code < 0:
                if not final:
                    continue
                if not layered:
                    for k in range(4):
                        out[p, k] = plain[k]
                    continue
            else:
                if code != last:
                    # neighbours often share the face: what depends on it alone is worked out once
                    last = code
                    instance = np.int64(code >> 32)
                    if instance != last_instance:
                        last_instance = instance
                        h = to_local[instance]
                        h00, h01, h02 = h[0, 0], h[0, 1], h[0, 2]
                        h10, h11, h12 = h[1, 0], h[1, 1], h[1, 2]
                        h20, h21, h22 = h[2, 0], h[2, 1], h[2, 2]
                        place = to_world[instance]
                        wx, wy, wz = place[0, 3], place[1, 3], place[2, 3]
                        base_r, base_g = looks[instance, 0], looks[instance, 1]
                        base_b, base_a = looks[instance, 2], looks[instance, 3]
                        shininess = gloss * looks[instance, 4]
                        square = looks[instance, 8]
                        if square > 0.0:
                            per_x, per_y = looks[instance, 9] / square, looks[instance, 10] / square
                        for k in range(2):
                            for j in range(3):
                                step[k, j], step[k + 2, j] = 0.0, 0.0
                                for i in range(3):
                                    step[k, j] += to_local[instance, j, i] * origins[k + 1, i]
                                    step[k + 2, j] += to_local[instance, j, i] * directions[k + 1, i]
                        texture, first_color = links[instance, 2], links[instance, 3]
                        first_face, first_vertex = links[instance, 5], links[instance, 6]
                    face = np.int64(code & 0x7FFFFFFF)
                    endless = face == PLANE
                    if endless:
                        face = np.int64(first_face)
                    i0 = first_vertex + faces[face, 0]
                    i1 = first_vertex + faces[face, 1]
                    i2 = first_vertex + faces[face, 2]
                    ax, ay = np.float64(vertices[i0, 0]), np.float64(vertices[i0, 1])
                    az = np.float64(vertices[i0, 2])
                    ux, uy, uz = vertices[i1, 0] - ax, vertices[i1, 1] - ay, vertices[i1, 2] - az
                    vx, vy, vz = vertices[i2, 0] - ax, vertices[i2, 1] - ay, vertices[i2, 2] - az
                    gx, gy, gz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
                    uu = ux * ux + uy * uy + uz * uz
                    uv = ux * vx + uy * vy + uz * vz
                    vv = vx * vx + vy * vy + vz * vz
                    spread = uu * vv - uv * uv
                    spread = 1.0 / spread if spread > 0.0 else 0.0
                    # a point's share of corners 1 and 2: products with these
                    t1x, t1y, t1z = vv * ux - uv * vx, vv * uy - uv * vy, vv * uz - uv * vz
                    t2x, t2y, t2z = uu * vx - uv * ux, uu * vy - uv * uy, uu * vz - uv * uz
                    t1x, t1y, t1z = t1x * spread, t1y * spread, t1z * spread
                    t2x, t2y, t2z = t2x * spread, t2y * spread, t2z * spread
                    flat = endless
                    if not endless:
                        flat = True
                        for j in range(3):
                            flat &= normals[face, 0, j] == normals[face, 1, j]
                            flat &= normals[face, 0, j] == normals[face, 2, j]
                    # normals turn with the transposed inverse
                    ex = h00 * gx + h10 * gy + h20 * gz
                    ey = h01 * gx + h11 * gy + h21 * gz
                    ez = h02 * gx + h12 * gy + h22 * gz
                    scale = 1.0 / math.sqrt(ex * ex + ey * ey + ez * ez + 1e-300)
                    ex, ey, ez = ex * scale, ey * scale, ez * scale
                    fx, fy, fz = ex, ey, ez
                    if flat and not endless:
                        mx, my, mz = normals[face, 0, 0], normals[face, 0, 1], normals[face, 0, 2]
                        fx = h00 * mx + h10 * my + h20 * mz
                        fy = h01 * mx + h11 * my + h21 * mz
                        fz = h02 * mx + h12 * my + h22 * mz
                        scale = 1.0 / math.sqrt(fx * fx + fy * fy + fz * fz + 1e-300)
                        fx, fy, fz = fx * scale, fy * scale, fz * scale
                    cosine = ex * lx + ey * ly + ez * lz
                    # lift a point by the slope of its face across the shadow filter's reach
                    face_lift = shadow_texel * (0.3 + 2.2 * math.sqrt(max(1.0 - cosine * cosine, 0.0)))
                px = column + 0.5
                depth = 1.0 / np.float64(nearness[p]) if perspective else -np.float64(nearness[p])
                dx = directions[0, 0] + directions[1, 0] * px + directions[2, 0] * py
                dy = directions[0, 1] + directions[1, 1] * px + directions[2, 1] * py
                dz = directions[0, 2] + directions[1, 2] * px + directions[2, 2] * py
                if not perspective:
                    ox = origins[0, 0] + origins[1, 0] * px + origins[2, 0] * py
                    oy = origins[0, 1] + origins[1, 1] * px + origins[2, 1] * py
                    oz = origins[0, 2] + origins[1, 2] * px + origins[2, 2] * py
                x, y, z = ox + depth * dx, oy + depth * dy, oz + depth * dz
                # the point in mesh coordinates
                tx, ty, tz = x - wx, y - wy, z - wz
                hx = h00 * tx + h01 * ty + h02 * tz
                hy = h10 * tx + h11 * ty + h12 * tz
                hz = h20 * tx + h21 * ty + h22 * tz
                # colour
                red, green, blue, alpha = base_r, base_g, base_b, base_a
                if first_color >= 0:
                    k = first_color + face - first_face
                    red *= colors[k, 0] / 255.0
                    green *= colors[k, 1] / 255.0
                    blue *= colors[k, 2] / 255.0
                    alpha *= colors[k, 3] / 255.0
                if texture >= 0:
                    word = paint[p]
                    red *= (word & BYTE) * (1.0 / 255.0)
                    green *= ((word >> np.uint32(8)) & BYTE) * (1.0 / 255.0)
                    blue *= ((word >> np.uint32(16)) & BYTE) * (1.0 / 255.0)
                    alpha *= ((word >> np.uint32(24)) & BYTE) * (1.0 / 255.0)
                if square > 0.0:
                    # how far the point moves on the face's plane from one pixel to the next
                    sx = h00 * dx + h01 * dy + h02 * dz
                    sy = h10 * dx + h11 * dy + h12 * dz
                    sz = h20 * dx + h21 * dy + h22 * dz
                    slant = gx * sx + gy * sy + gz * sz
                    slant = 1.0 / slant if abs(slant) > 1e-300 else 0.0
                    for k in range(2):
                        qx = step[k, 0] + depth * step[k + 2, 0]
                        qy = step[k, 1] + depth * step[k + 2, 1]
                        qz = step[k, 2] + depth * step[k + 2, 2]
                        along = (gx * qx + gy * qy + gz * qz) * slant
                        foot[k, 0] = qx - along * sx
                        foot[k, 1] = qy - along * sy
                        foot[k, 2] = qz - along * sz
                    share = checker_share(
                        hx * per_x,
                        hy * per_y,
                        (abs(foot[0, 0]) + abs(foot[1, 0])) * per_x,
                        (abs(foot[0, 1]) + abs(foot[1, 1])) * per_y,
                    )
                    red += share * (looks[instance, 5] - red)
                    green += share * (looks[instance, 6] - green)
                    blue += share * (looks[instance, 7] - blue)
                # light
                level_r = level_g = level_b = ambient
                shine = 0.0
                if lit:
                    side = -1.0 if ex * dx + ey * dy + ez * dz > 0.0 else 1.0
                    if flat:
                        nx, ny, nz = side * fx, side * fy, side * fz
                    else:
                        rx, ry, rz = hx - ax, hy - ay, hz - az
                        b1 = min(max(t1x * rx + t1y * ry + t1z * rz, 0.0), 1.0)
                        b2 = min(max(t2x * rx + t2y * ry + t2z * rz, 0.0), 1.0 - b1)
                        b0 = 1.0 - b1 - b2
                        mx = b0 * normals[face, 0, 0] + b1 * normals[face, 1, 0] + b2 * normals[face, 2, 0]
                        my = b0 * normals[face, 0, 1] + b1 * normals[face, 1, 1] + b2 * normals[face, 2, 1]
                        mz = b0 * normals[face, 0, 2] + b1 * normals[face, 1, 2] + b2 * normals[face, 2, 2]
                        nx = h00 * mx + h10 * my + h20 * mz
                        ny = h01 * mx + h11 * my + h21 * mz
                        nz = h02 * mx + h12 * my + h22 * mz
                        scale = side / math.sqrt(nx * nx + ny * ny + nz * nz + 1e-300)
                        nx, ny, nz = nx * scale, ny * scale, nz * scale
                    facing = nx * lx + ny * ly + nz * lz
                    sun = 0.0
                    if facing > 0.0:
                        sun = 1.0
                        if (
                            column >= shade_left
                            and column <= shade_right
                            and row >= shade_top
                            and row <= shade_bottom
                        ):
                            lift = side * face_lift
                            cx, cy, cz = x + lift * ex, y + lift * ey, z + lift * ez
                            sun = sunlight(shadow, tiles, shadow_size, shadow_matrix, cx, cy, cz)
                            sun += leak * (1.0 - sun)
                    amount = diffuse * ((1.0 - sky) * sun * max(facing, 0.0) + sky * (0.5 + 0.5 * nz))
                    level_r += amount * light[3]
                    level_g += amount * light[4]
                    level_b += amount * light[5]
                    if sun > 0.0 and shininess > 0.0:
                        far = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
                        cx, cy, cz = lx - dx * far, ly - dy * far, lz - dz * far
                        half = nx * cx + ny * cy + nz * cz
                        if half > 0.0:
                            half = half * half / (cx * cx + cy * cy + cz * cz)
                            half *= half
                            half *= half
                            half *= half
                            shine = half * half * shininess * sun
                red = red * level_r + shine * light[3]
                green = green * level_g + shine * light[4]
                blue = blue * level_b + shine * light[5]
                if endless and depth > fade[0]:
                    share = min((depth - fade[0]) / (fade[1] - fade[0]), 1.0)
                    share = share * share * (3.0 - 2.0 * share)
                    red += share * (behind[0] - red)
                    green += share * (behind[1] - green)
                    blue += share * (behind[2] - blue)
                red, green, blue = min(red, 1.0), min(green, 1.0), min(blue, 1.0)
            if final:
                if code < 0:
                    red, green, blue, alpha = behind[0], behind[1], behind[2], behind[3]
                else:
                    alpha = 1.0
                if layered:
                    rest = 1.0 - front[p, 3]
                    alpha = front[p, 3] + rest * alpha
                    red = front[p, 0] + rest * red
                    green = front[p, 1] + rest * green
                    blue = front[p, 2] + rest * blue
                out[p, 0] = np.uint8(red * 255.0 + 0.5)
                out[p, 1] = np.uint8(green * 255.0 + 0.5)
                out[p, 2] = np.uint8(blue * 255.0 + 0.5)
                out[p, 3] = np.uint8(min(alpha, 1.0) * 255.0 + 0.5)
            else:
                weight = (1.0 - front[p, 3]) * alpha
                front[p, 0] += weight * red
                front[p, 1] += weight * green
                front[p, 2] += weight * blue
                front[p, 3] += weight


@njit(cache=True, error_model="numpy", fastmath=FAST)
def describe(seen, nearness, links, perspective, depth, segmentation):
    """Depth in metres (inf for none) and owner ids (-1 for none) of what each pixel sees."""
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

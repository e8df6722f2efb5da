"""Colour of each pixel from the surface that it shows, once visibility is known."""

from __future__ import annotations

import math

import numpy as np

from roboyard.rendering.kernels.options import compiled, inlined, without_refcounts
from roboyard.rendering.kernels.patterns import background_color, checker_at
from roboyard.rendering.kernels.raster import PLANE
from roboyard.rendering.kernels.shadow import sunlight
from roboyard.rendering.kernels.vectors import (
    along,
    at_pixel,
    cross,
    dot,
    product,
    row3_of,
    row_of,
    scaled,
    subtract,
    transposed_product,
    unit,
)

BYTE = np.uint32(255)


@compiled
def shade(seen, nearness, view, instances, meshes, paint, sun, background, front, layered, final, out):
    """Shade the surfaces of one layer.

    Args:
        seen: (pixels,) instance << 32 | face of each pixel; -1: none.
        nearness: (pixels,) nearness of the surface, see `raster`.
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
        out: (pixels, 4) uint8 RGBA, written if `final`.
    """
    for row in range(view.height):
        behind = background_color(background.gradient, row, view.height)
        line = row * view.width
        column = 0
        while column < view.width:
            # one stretch of a row that shows one face
            first, code = column, seen[line + column]
            column += 1
            while column < view.width and seen[line + column] == code:
                column += 1
            if code >= 0:
                shade_face(
                    code, row, first, column, nearness, view, instances, meshes, paint, sun, behind,
                    background.fade, front, layered, final, out,
                )  # fmt: skip
            elif final and layered:
                for k in range(first, column):
                    write_pixel(out, front, True, np.uint64(line + k), behind[:3], behind[3])
            elif final:
                fill(out, line + first, line + column, behind)


@inlined
def shade_face(
    code, row, first, end, nearness, view, instances, meshes, paint, sun,
    behind, fade, front, layered, final, out,
):  # fmt: skip
    """Shade columns `first` to `end` of a row, which all show the same face; arguments as of `shade`."""
    instance, face = np.int64(code >> 32), np.int64(code & 0x7FFFFFFF)
    infinite = face == PLANE
    if infinite:
        face = np.int64(instances.links[instance, 5])
    to_local, to_world, materials = instances.to_local, instances.to_world, instances.materials
    to_mesh = row3_of(to_local, instance, 0), row3_of(to_local, instance, 1), row3_of(to_local, instance, 2)
    place = to_world[instance, 0, 3], to_world[instance, 1, 3], to_world[instance, 2, 3]
    corner, edge_1, edge_2 = triangle(meshes.vertices, meshes.faces, face, instances.links[instance, 6])
    across = cross(edge_1, edge_2)
    # normals transform with the transposed inverse
    face_normal = unit(transposed_product(to_mesh, across))
    share_1, share_2 = barycentric_vectors(edge_1, edge_2)
    flat, flat_normal = infinite or is_flat(meshes.normals, face), face_normal
    if flat and not infinite:
        flat_normal = unit(transposed_product(to_mesh, row3_of(meshes.normals, face, 0)))
    light = sun.light
    to_sun = light[0], light[1], light[2]
    cosine = dot(face_normal, to_sun)
    # lift a point by the slope of its face across the reach of the shadow filter
    lift = sun.texel * (0.3 + 2.2 * math.sqrt(max(1.0 - cosine * cosine, 0.0)))
    shadowed_row = sun.shaded[2] <= row <= sun.shaded[3]
    lit = light[7] > 0.0 or light[8] > 0.0
    shininess, square = light[8] * materials[instance, 4], materials[instance, 8]
    for column in range(first, end):
        p = np.uint64(row * view.width + column)  # unsigned: no check for negative indices at each access
        x, y = column + 0.5, row + 0.5
        depth = 1.0 / np.float64(nearness[p]) if view.perspective else -np.float64(nearness[p])
        direction = at_pixel(view.directions, x, y)
        point = along(at_pixel(view.origins, x, y), depth, direction)
        local = product(to_mesh, subtract(point, place))
        color, alpha = base_color(materials, instances.links, instance, face, meshes.colors, paint, p)
        if square > 0.0:
            per_x, per_y = materials[instance, 9] / square, materials[instance, 10] / square
            share = checker_at(
                local, across, to_mesh, direction, depth, view.origins, view.directions, per_x, per_y
            )
            second = materials[instance, 5], materials[instance, 6], materials[instance, 7]
            color = mixed(color, second, share)
        if lit:
            side = -1.0 if dot(face_normal, direction) > 0.0 else 1.0
            if flat:
                normal = scaled(flat_normal, side)
            else:
                offset = subtract(local, corner)
                normal = smooth_normal(meshes.normals, face, dot(share_1, offset), dot(share_2, offset))
                normal = scaled(unit(transposed_product(to_mesh, normal)), side)
            sun_share = 1.0 if dot(normal, to_sun) > 0.0 else 0.0
            if sun_share > 0.0 and shadowed_row and sun.shaded[0] <= column <= sun.shaded[1]:
                px, py, pz = along(point, side * lift, face_normal)
                sun_share = sunlight(sun.nearness, sun.tiles, sun.size, sun.matrix, px, py, pz)
                sun_share += light[10] * (1.0 - sun_share)
            color = lit_color(color, normal, direction, sun_share, shininess, light)
        else:
            color = scaled(color, light[6])
        if infinite and depth > fade[0]:
            share = min((depth - fade[0]) / (fade[1] - fade[0]), 1.0)
            color = mixed(color, behind[:3], share * share * (3.0 - 2.0 * share))
        color = min(color[0], 1.0), min(color[1], 1.0), min(color[2], 1.0)
        if final:
            write_pixel(out, front, layered, p, color, 1.0)
        else:
            add_behind(front, p, color, alpha)


@without_refcounts
def triangle(vertices, faces, face, first_vertex):
    """Return the first corner of a face and the edges from it to the other two, in the mesh frame."""
    i = first_vertex + faces[face, 0]
    a = np.float64(vertices[i, 0]), np.float64(vertices[i, 1]), np.float64(vertices[i, 2])
    b = subtract(row_of(vertices, first_vertex + faces[face, 1]), a)
    c = subtract(row_of(vertices, first_vertex + faces[face, 2]), a)
    return a, b, c


@compiled
def barycentric_vectors(u, v):
    """Return two vectors whose dot products with a point's offset from corner 0 are its barycentric
    coordinates at corners 1 and 2; u and v are the edges from corner 0 to them.
    """
    uu, uv, vv = dot(u, u), dot(u, v), dot(v, v)
    spread = uu * vv - uv * uv
    spread = 1.0 / spread if spread > 0.0 else 0.0
    first = scaled(subtract(scaled(u, vv), scaled(v, uv)), spread)
    return first, scaled(subtract(scaled(v, uu), scaled(u, uv)), spread)


@without_refcounts
def is_flat(normals, face):
    """Return whether all corners of a face have the same normal."""
    a, b, c = row3_of(normals, face, 0), row3_of(normals, face, 1), row3_of(normals, face, 2)
    return a[0] == b[0] and a[1] == b[1] and a[2] == b[2] and a[0] == c[0] and a[1] == c[1] and a[2] == c[2]


@without_refcounts
def smooth_normal(normals, face, share_1, share_2):
    """Return the corners' normals interpolated at barycentric coordinates, of any length."""
    share_1 = min(max(share_1, 0.0), 1.0)
    share_2 = min(max(share_2, 0.0), 1.0 - share_1)
    normal = scaled(row3_of(normals, face, 0), 1.0 - share_1 - share_2)
    normal = along(normal, share_1, row3_of(normals, face, 1))
    return along(normal, share_2, row3_of(normals, face, 2))


@without_refcounts
def base_color(materials, links, instance, face, colors, paint, p):
    """Return RGB and alpha of a pixel's surface before light: material times mesh colour times texture."""
    red, green, blue = materials[instance, 0], materials[instance, 1], materials[instance, 2]
    alpha = materials[instance, 3]
    if links[instance, 3] >= 0:
        k = links[instance, 3] + face - links[instance, 5]
        red *= colors[k, 0] / 255.0
        green *= colors[k, 1] / 255.0
        blue *= colors[k, 2] / 255.0
        alpha *= colors[k, 3] / 255.0
    if links[instance, 2] >= 0:
        texel = paint[p]
        red *= (texel & BYTE) * (1.0 / 255.0)
        green *= ((texel >> np.uint32(8)) & BYTE) * (1.0 / 255.0)
        blue *= ((texel >> np.uint32(16)) & BYTE) * (1.0 / 255.0)
        alpha *= ((texel >> np.uint32(24)) & BYTE) * (1.0 / 255.0)
    return (red, green, blue), alpha


@without_refcounts
def lit_color(color, normal, direction, sun_share, shininess, light):
    """Return a colour under the light: ambient, sun, sky and Blinn's highlight with exponent 32.

    Args:
        color: RGB of the surface.
        normal: unit normal towards the camera, world frame.
        direction: direction of the pixel's ray, world frame.
        sun_share: fraction of the sun that reaches the point.
        shininess: strength of the highlight.
        light: (11,) as of `Sunlight`.
    """
    to_sun = light[0], light[1], light[2]
    sky = light[9]
    facing = max(dot(normal, to_sun), 0.0)
    amount = light[7] * ((1.0 - sky) * sun_share * facing + sky * (0.5 + 0.5 * normal[2]))
    shine = 0.0
    if sun_share > 0.0 and shininess > 0.0:
        middle = subtract(to_sun, unit(direction))
        half = dot(normal, middle)
        if half > 0.0:
            half = half * half / dot(middle, middle)
            half *= half
            half *= half
            half *= half
            shine = half * half * shininess * sun_share
    return (
        color[0] * (light[6] + amount * light[3]) + shine * light[3],
        color[1] * (light[6] + amount * light[4]) + shine * light[4],
        color[2] * (light[6] + amount * light[5]) + shine * light[5],
    )


@compiled
def mixed(a, b, share):
    """Return `a + share * (b - a)` of two RGB colours."""
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2])


@without_refcounts
def write_pixel(out, front, layered, p, color, alpha):
    """Write the colour of pixel p, under the layers in front of it, as uint8."""
    if layered:
        rest = 1.0 - front[p, 3]
        alpha = front[p, 3] + rest * alpha
        color = front[p, 0] + rest * color[0], front[p, 1] + rest * color[1], front[p, 2] + rest * color[2]
    out[p, 0] = np.uint8(color[0] * 255.0 + 0.5)
    out[p, 1] = np.uint8(color[1] * 255.0 + 0.5)
    out[p, 2] = np.uint8(color[2] * 255.0 + 0.5)
    out[p, 3] = np.uint8(min(alpha, 1.0) * 255.0 + 0.5)


@without_refcounts
def fill(out, first, end, rgba):
    """Write one colour to pixels `first` to `end`, as uint8."""
    red, green = np.uint8(rgba[0] * 255.0 + 0.5), np.uint8(rgba[1] * 255.0 + 0.5)
    blue, alpha = np.uint8(rgba[2] * 255.0 + 0.5), np.uint8(rgba[3] * 255.0 + 0.5)
    for p in range(first, end):
        out[p, 0], out[p, 1], out[p, 2], out[p, 3] = red, green, blue, alpha


@without_refcounts
def add_behind(front, p, color, alpha):
    """Add a transparent surface behind the layers in front of pixel p (premultiplied RGBA)."""
    weight = (1.0 - front[p, 3]) * alpha
    front[p, 0] += weight * color[0]
    front[p, 1] += weight * color[1]
    front[p, 2] += weight * color[2]
    front[p, 3] += weight


@compiled
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

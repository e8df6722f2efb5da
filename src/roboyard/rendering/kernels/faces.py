"""Colours, normals and shadow offsets of pixels that show one face."""

from __future__ import annotations

import math

import numpy as np

from roboyard.rendering.kernels.indices import I
from roboyard.rendering.kernels.patterns import checker_at
from roboyard.rendering.kernels.raster import PLANE
from roboyard.rendering.kernels.runs import (
    ALPHA,
    BLUE,
    BYTE,
    DEPTH,
    FADE,
    GREEN,
    NX,
    NY,
    NZ,
    ONE,
    PER_BYTE,
    PX,
    PY,
    PZ,
    RED,
    SHINE,
    THREE,
    ZERO,
    F,
    Q,
    U,
    V,
)
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


def lay_face(work, code, row, first, end, run, view, instances, meshes, paint, sun, fade):
    """Write colour, normal and shadow offset of columns `first` to `end`, which all show the same face.

    Args:
        work: arrays of a run of pixels.
        code: instance << 32 | face.
        row: row of the picture.
        first: first column.
        end: last column + 1.
        run: column of the run's first pixel.
        view: `View`.
        instances: `Instances`.
        meshes: `Meshes`.
        paint: (pixels,) colours of textures.
        sun: `Sunlight`.
        fade: (2,) depths between which infinite planes fade (m).
    """
    instance, face = np.int64(code >> 32), np.int64(code & 0x7FFFFFFF)
    infinite = face == PLANE
    if infinite:
        face = np.int64(instances.links[instance, 5])
    to_local, materials, links = instances.to_local, instances.materials, instances.links
    to_mesh = row3_of(to_local, instance, 0), row3_of(to_local, instance, 1), row3_of(to_local, instance, 2)
    corner, edge_1, edge_2 = triangle(meshes.vertices, meshes.faces, face, links[instance, 6])
    across = cross(edge_1, edge_2)
    # normals transform with the transposed inverse
    face_normal = unit(transposed_product(to_mesh, across))
    a, b = first - run, end - run
    seen_along = at_pixel(view.directions, first + 0.5, row + 0.5)
    side = -1.0 if dot(face_normal, seen_along) > 0.0 else 1.0
    if infinite or is_flat(meshes.normals, face):
        normal = face_normal
        if not infinite:
            normal = unit(transposed_product(to_mesh, row3_of(meshes.normals, face, 0)))
        nx, ny, nz = F(side * normal[0]), F(side * normal[1]), F(side * normal[2])
        for k in range(I(a), I(b)):
            work[NX + k], work[NY + k], work[NZ + k] = nx, ny, nz
    else:
        place = instances.to_world
        eye = view.origins[0, 0], view.origins[0, 1], view.origins[0, 2]
        eye = subtract(eye, (place[instance, 0, 3], place[instance, 1, 3], place[instance, 2, 3]))
        offset = subtract(product(to_mesh, eye), corner)
        share_1, share_2 = barycentric_vectors(edge_1, edge_2)
        start_1, start_2 = dot(share_1, offset), dot(share_2, offset)
        share_1, share_2 = transposed_product(to_mesh, share_1), transposed_product(to_mesh, share_2)
        for k in range(I(a), I(b)):
            point = work[PX + k], work[PY + k], work[PZ + k]
            normal = smooth_normal(
                meshes.normals, face, start_1 + dot(share_1, point), start_2 + dot(share_2, point)
            )
            normal = transposed_product(to_mesh, normal)
            work[NX + k], work[NY + k], work[NZ + k] = side * normal[0], side * normal[1], side * normal[2]
    if sun.size > 0:
        light = sun.light
        cosine = dot(face_normal, (light[0], light[1], light[2]))
        # lift a point by the slope of its face across the reach of the shadow filter
        lift = side * sun.texel * (0.3 + 2.2 * math.sqrt(max(1.0 - cosine * cosine, 0.0)))
        m = sun.matrix
        u, v, q = (
            F(lift * dot(row_of(m, 0), face_normal)),
            F(lift * dot(row_of(m, 1), face_normal)),
            F(-lift * dot(row_of(m, 2), face_normal)),
        )
        for k in range(I(a), I(b)):
            work[U + k], work[V + k], work[Q + k] = u, v, q
    lay_color(work, instance, face, across, to_mesh, row, first, end, run, view, instances, meshes, paint)
    shine = F(sun.light[8] * materials[instance, 4])
    for k in range(I(a), I(b)):
        work[SHINE + k] = shine
    if fade[0] < np.inf and infinite:
        near, scale = F(fade[0]), F(1.0 / (fade[1] - fade[0]))
        for k in range(I(a), I(b)):
            share = min(max((work[DEPTH + k] - near) * scale, ZERO), ONE)
            work[FADE + k] = share * share * (THREE - (share + share))
    elif fade[0] < np.inf:
        for k in range(I(a), I(b)):
            work[FADE + k] = ZERO


def lay_color(
    work, instance, face, across, to_mesh, row, first, end, run, view, instances, meshes, paint
):  # fmt: skip
    """Write the colours before light of columns `first` to `end`: material times mesh colour times texture.

    `across` is the face's normal in the mesh frame, of any length, and `to_mesh` the rows of the world's turn
    to that frame; the others are those of `lay_face`.
    """
    materials, links, colors = instances.materials, instances.links, meshes.colors
    tint = materials[instance, 0], materials[instance, 1], materials[instance, 2]
    alpha, square = materials[instance, 3], materials[instance, 8]
    factor = 1.0, 1.0, 1.0
    if links[instance, 3] >= 0:
        k = links[instance, 3] + face - links[instance, 5]
        factor = colors[k, 0] / 255.0, colors[k, 1] / 255.0, colors[k, 2] / 255.0
        alpha *= colors[k, 3] / 255.0
    red, green, blue = F(tint[0] * factor[0]), F(tint[1] * factor[1]), F(tint[2] * factor[2])
    opacity = F(alpha)
    a, b = first - run, end - run
    if links[instance, 2] >= 0:
        p = row * view.width + run
        for k in range(I(a), I(b)):
            texel = np.int32(paint[I(p) + k])
            work[RED + k] = red * (F(texel & BYTE) * PER_BYTE)
            work[GREEN + k] = green * (F((texel >> np.int32(8)) & BYTE) * PER_BYTE)
            work[BLUE + k] = blue * (F((texel >> np.int32(16)) & BYTE) * PER_BYTE)
            work[ALPHA + k] = opacity * (F((texel >> np.int32(24)) & BYTE) * PER_BYTE)
    else:
        for k in range(I(a), I(b)):
            work[RED + k], work[GREEN + k], work[BLUE + k], work[ALPHA + k] = red, green, blue, opacity
    if square > 0.0:
        place = instances.to_world
        place = place[instance, 0, 3], place[instance, 1, 3], place[instance, 2, 3]
        per_x, per_y = materials[instance, 9] / square, materials[instance, 10] / square
        for k in range(I(a), I(b)):
            x, y, depth = run + np.int64(k) + 0.5, row + 0.5, np.float64(work[DEPTH + k])
            direction = at_pixel(view.directions, x, y)
            point = along(at_pixel(view.origins, x, y), depth, direction)
            share = checker_at(
                product(to_mesh, subtract(point, place)), across, to_mesh, direction, depth, view.origins,
                view.directions, per_x, per_y,
            )  # fmt: skip
            work[RED + k] += share * (materials[instance, 5] - work[RED + k])
            work[GREEN + k] += share * (materials[instance, 6] - work[GREEN + k])
            work[BLUE + k] += share * (materials[instance, 7] - work[BLUE + k])


def triangle(vertices, faces, face, first_vertex):
    """Return the first corner of a face and the edges from it to the other two, in the mesh frame."""
    i = first_vertex + faces[face, 0]
    a = np.float64(vertices[i, 0]), np.float64(vertices[i, 1]), np.float64(vertices[i, 2])
    b = subtract(row_of(vertices, first_vertex + faces[face, 1]), a)
    c = subtract(row_of(vertices, first_vertex + faces[face, 2]), a)
    return a, b, c


def barycentric_vectors(u, v):
    """Return two vectors whose dot products with a point's offset from corner 0 are its barycentric
    coordinates at corners 1 and 2; u and v are the edges from corner 0 to them.
    """
    uu, uv, vv = dot(u, u), dot(u, v), dot(v, v)
    spread = uu * vv - uv * uv
    spread = 1.0 / spread if spread > 0.0 else 0.0
    first = scaled(subtract(scaled(u, vv), scaled(v, uv)), spread)
    return first, scaled(subtract(scaled(v, uu), scaled(u, uv)), spread)


def is_flat(normals, face):
    """Return whether all corners of a face have the same normal."""
    a, b, c = row3_of(normals, face, 0), row3_of(normals, face, 1), row3_of(normals, face, 2)
    return a[0] == b[0] and a[1] == b[1] and a[2] == b[2] and a[0] == c[0] and a[1] == c[1] and a[2] == c[2]


def smooth_normal(normals, face, share_1, share_2):
    """Return the corners' normals interpolated at barycentric coordinates, of any length."""
    share_1 = min(max(share_1, 0.0), 1.0)
    share_2 = min(max(share_2, 0.0), 1.0 - share_1)
    normal = scaled(row3_of(normals, face, 0), 1.0 - share_1 - share_2)
    normal = along(normal, share_1, row3_of(normals, face, 1))
    return along(normal, share_2, row3_of(normals, face, 2))

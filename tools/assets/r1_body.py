"""Shapes of R1's base, wheels, torso and head, each in its link's frame. Lengths in metres."""

from __future__ import annotations

from math import pi

import numpy as np

from assets.mesh import Array, Mesh, merge
from assets.solids import arrayed, disc, drum, hoop, loft, mirrored, plate, ring, rounded_box, tube

HIP = (-0.03, 0.064, 0.31)
"""torso_joint1 in base_link."""
THIGH, SHIN, WAIST = 0.42, 0.36, 0.09
"""Distances torso_joint1-2, 2-3 and 3-4."""
SIDE = -0.064
"""The torso links' middle plane along their joint axes."""
WHEEL_RADIUS, WHEEL_WIDTH = 0.06, 0.036
SHOULDER_TILT = pi / 6
"""Angle of the arms' first axes from straight down."""
SHOULDER = (0.002, 0.1635, 0.24)
"""left_arm_joint1 in torso_link4."""


def upright(mesh: Mesh) -> Mesh:
    """From x forward, y left, z up about the middle plane to the frame of torso links 1 to 3."""
    return mesh.moved((0, 0, SIDE), (pi / 2, 0, 0))


def across(mesh: Mesh, x: float = 0.0, z: float = 0.0) -> Mesh:
    """A solid about z turned to lie about y, at `x` and `z`."""
    return mesh.moved((x, 0, z), (-pi / 2, 0, 0))


# ------------------------------------------------------------------------------------------------ base


def _hull(grow: float, low: float, high: float, fillet: float = 0.0) -> Mesh:
    row = (0.0, 0.0, 0.25 + grow, 0.24 + grow, 0.16 + grow)
    return loft([(low, *row), (high, *row)], 8, fillet, 2)


def base_shell() -> Mesh:
    """Painted covers."""
    sections = [
        (0.055, 0.225, 0.215, 0.14),
        (0.085, 0.248, 0.238, 0.158),
        (0.11, 0.25, 0.24, 0.16),
        (0.2, 0.25, 0.24, 0.16),
        (0.235, 0.24, 0.23, 0.152),
        (0.262, 0.2, 0.19, 0.13),
    ]
    return loft([(z, 0, 0, x, y, r) for z, x, y, r in sections], 8, 0.012, 3)


def base_trim() -> Mesh:
    """Bumper, scanner slit, deck and the hip's bracket."""
    hip_x, _, hip_z = HIP
    deck = loft([(0.25, -0.03, 0, 0.14, 0.13, 0.07), (0.274, -0.03, 0, 0.135, 0.125, 0.07)], 6, 0.006)
    outline = [(-0.085, 0.255), (0.085, 0.255)]
    outline += [(0.066 * np.cos(t), hip_z + 0.066 * np.sin(t)) for t in np.linspace(-0.2, pi + 0.2, 17)]
    cheek = plate(outline, 0.06, 0.082, 0.005)
    cheeks = merge(cheek, cheek.scaled(1, 1, -1)).moved((hip_x, 0, 0), (pi / 2, 0, 0))
    skirt = loft([(0.045, 0, 0, 0.2, 0.19, 0.12), (0.07, 0, 0, 0.22, 0.21, 0.135)], 6)
    return merge(_hull(0.004, 0.098, 0.122, 0.005), _hull(0.0015, 0.203, 0.216), deck, cheeks, skirt)


def base_accent() -> Mesh:
    """Caps of the hip and a line round the hull."""
    hip_x, _, hip_z = HIP
    caps = across(
        merge(drum(0.046, -0.09, -0.078, 0.004, 28), drum(0.046, 0.078, 0.09, 0.004, 28)), hip_x, hip_z
    )
    return merge(_hull(0.0012, 0.158, 0.166), caps)


def base_lights() -> Mesh:
    """Two lamps at the front and one strip at the back."""
    lamp = rounded_box((0.006, 0.034, 0.007), 0.005, 2).moved((0.248, 0.062, 0.182))
    strip = rounded_box((0.006, 0.06, 0.006), 0.005, 2).moved((-0.248, 0, 0.182))
    return merge(mirrored(lamp), strip)


def stop_button() -> Mesh:
    """Emergency stop on the rear deck."""
    return merge(drum(0.022, 0.0, 0.012, 0.003, 20), drum(0.012, 0.0, 0.018, 0.002, 16)).moved(
        (-0.19, 0, 0.256)
    )


def base_proxy() -> Mesh:
    """Collision: the hull above the wheels in few triangles."""
    return loft([(0.12, 0, 0, 0.252, 0.242, 0.16), (0.21, 0, 0, 0.252, 0.242, 0.16),
                 (0.274, 0, 0, 0.2, 0.19, 0.13)], 3)  # fmt: skip


# ---------------------------------------------------------------------------------------------- wheels

SERVO_HEIGHT = 0.14
WHEEL_DROP = 0.09
"""Steering frame above the floor-side wheel axle."""


def servo() -> Mesh:
    """Steering head with a one-sided fork; its joint turns about z."""
    head = drum(0.034, -0.035, 0.0, 0.005, 24)
    arm = plate([(-0.016, -0.105), (0.016, -0.105), (0.024, -0.02), (-0.024, -0.02)], 0.021, 0.03, 0.003)
    axle = drum(0.012, 0.0, 0.03, 0.002, 16).moved((0, 0, -WHEEL_DROP), (-pi / 2, 0, 0))
    return merge(head, arm.moved(rpy=(pi / 2, 0, 0)).scaled(1, -1, 1), axle)


def wheel() -> Mesh:
    """Tyre and rim about z, centred."""
    r, w = WHEEL_RADIUS, WHEEL_WIDTH / 2
    side = [(0.04, -w + 0.003), (0.044, -w), (0.052, -w), (r - 0.0015, -w + 0.005), (r, -w * 0.3)]
    tyre = hoop(side + [(radius, -z) for radius, z in reversed(side)], 40).named("rubber")
    rim = merge(drum(0.041, -w + 0.007, w - 0.007, 0.002, 32, 1), drum(0.015, -w, w, 0.003, 20))
    spokes = arrayed(
        mirrored(rounded_box((0.011, 0.005, 0.004), 0.002, 1).moved((0.025, 0, w - 0.007)), "z"), 5
    )
    return merge(tyre, merge(rim, spokes).named("metal"))


# ----------------------------------------------------------------------------------------------- torso


def _fork(height: float, drop: float, radius: float, inner: float, outer: float) -> Mesh:
    """Two cheeks at the top of a column, round about the joint at `height`."""
    outline = [(-0.034, height - drop), (0.034, height - drop)]
    outline += [(radius * np.cos(t), height + radius * np.sin(t)) for t in np.linspace(-0.4, pi + 0.4, 17)]
    cheek = plate(outline, inner, outer, 0.004)
    return merge(cheek, cheek.scaled(1, 1, -1)).moved(rpy=(pi / 2, 0, 0))


def _caps(radius: float, at: float, height: float) -> Mesh:
    cap = drum(radius, at - 0.006, at + 0.005, 0.004, 28)
    return across(merge(cap, cap.scaled(1, 1, -1)), 0.0, height)


def thigh_shell() -> Mesh:
    """Lower column of the torso."""
    sections = [
        (0.025, 0.055, 0.046, 0.03),
        (0.08, 0.062, 0.052, 0.034),
        (0.2, 0.058, 0.051, 0.034),
        (0.33, 0.05, 0.047, 0.03),
        (0.375, 0.046, 0.044, 0.028),
    ]
    return upright(loft([(z, 0, 0, x, y, r) for z, x, y, r in sections], 5, 0.012, 3))


def thigh_trim() -> Mesh:
    """Hip drum, knee fork, rear cover."""
    hub = across(drum(0.058, -0.057, 0.057, 0.006, 36))
    cover = loft([(0.1, -0.056, 0, 0.008, 0.026, 0.006), (0.3, -0.048, 0, 0.008, 0.022, 0.006)], 3, 0.004, 2)
    return upright(merge(hub, _fork(THIGH, 0.12, 0.052, 0.05, 0.066), cover))


def thigh_accent() -> Mesh:
    """Caps of the knee and a line down the front."""
    line = loft([(0.11, 0.0575, 0, 0.006, 0.007, 0.003), (0.33, 0.0485, 0, 0.006, 0.006, 0.003)], 2, 0.002, 1)
    return upright(merge(_caps(0.036, 0.066, THIGH), line))


def shin_shell() -> Mesh:
    """Upper column of the torso."""
    sections = [
        (0.04, 0.042, 0.043, 0.026),
        (0.09, 0.052, 0.049, 0.032),
        (0.2, 0.05, 0.048, 0.032),
        (0.28, 0.045, 0.045, 0.028),
        (0.315, 0.042, 0.043, 0.026),
    ]
    return upright(loft([(z, 0, 0, x, y, r) for z, x, y, r in sections], 5, 0.012, 3))


def shin_trim() -> Mesh:
    """Knee drum and waist fork."""
    hub = across(drum(0.05, -0.048, 0.048, 0.006, 36))
    return upright(merge(hub, _fork(SHIN, 0.11, 0.05, 0.05, 0.066)))


def shin_accent() -> Mesh:
    """Caps of the waist and a line down the front."""
    line = loft([(0.11, 0.05, 0, 0.005, 0.006, 0.003), (0.27, 0.0445, 0, 0.005, 0.006, 0.003)], 2, 0.002, 1)
    return upright(merge(_caps(0.034, 0.066, SHIN), line))


def waist() -> Mesh:
    """Drum of torso_joint3 with the flange that torso_joint4 turns on."""
    hub = across(drum(0.047, -0.048, 0.048, 0.006, 32))
    neck = loft([(0.0, 0, 0, 0.04, 0.04, 0.03), disc(0.05, 0.05), disc(0.086, 0.062)], 6)
    return upright(merge(hub, neck))


def chest_shell() -> Mesh:
    """Upper body: narrow at the waist, broad at the shoulders."""
    sections = [
        (0.028, 0.004, 0.062, 0.066, 0.05),
        (0.07, 0.005, 0.078, 0.088, 0.055),
        (0.14, 0.008, 0.094, 0.112, 0.06),
        (0.22, 0.01, 0.1, 0.128, 0.064),
        (0.29, 0.007, 0.098, 0.132, 0.066),
        (0.335, 0.003, 0.086, 0.118, 0.06),
        (0.368, 0.0, 0.06, 0.08, 0.045),
    ]
    return loft([(z, x, 0, hx, hy, r) for z, x, hx, hy, r in sections], 7, 0.014, 3)


def chest_trim() -> Mesh:
    """Turntable, neck, back pack and vents."""
    turntable = drum(0.066, 0.002, 0.034, 0.006, 40)
    neck = merge(
        drum(0.036, 0.355, 0.408, 0.004, 28),
        hoop([(0.036, 0.372), (0.043, 0.374), (0.043, 0.386), (0.036, 0.388)], 28),
    )
    pack = loft([(0.1, -0.088, 0, 0.02, 0.07, 0.015), (0.2, -0.094, 0, 0.024, 0.082, 0.018),
                 (0.31, -0.088, 0, 0.018, 0.078, 0.014)], 3, 0.01, 2)  # fmt: skip
    vents = [
        rounded_box((0.004, 0.04, 0.004), 0.003, 1).moved(
            (0.1 + 0.003 * i, 0, 0.115 + 0.016 * i), (0, 0.1, 0)
        )
        for i in range(3)
    ]
    return merge(turntable, neck, pack, *vents)


def chest_accent() -> Mesh:
    """Collar and a line round the waist."""
    collar = loft([(0.362, 0.0, 0, 0.052, 0.07, 0.04), (0.374, 0.0, 0, 0.05, 0.068, 0.038)], 6, 0.004, 2)
    return merge(collar, ring(0.0685, 0.01, 0.012, 0.02, 40))


def chest_proxy() -> Mesh:
    """Collision: the upper body in few triangles."""
    sections = [
        (0.0, 0.0, 0.068, 0.07, 0.05),
        (0.13, -0.01, 0.112, 0.11, 0.05),
        (0.22, -0.008, 0.12, 0.13, 0.06),
        (0.31, -0.002, 0.108, 0.13, 0.06),
        (0.374, 0.0, 0.06, 0.08, 0.045),
    ]
    return loft([(z, x, 0, hx, hy, r) for z, x, hx, hy, r in sections], 2)


def badge() -> Mesh:
    """Textured plate on the chest, 72 by 36 mm."""
    half_y, half_z = 0.036, 0.018
    solid = rounded_box((0.004, half_y, half_z), 0.002, 1)
    p = solid.vertices[solid.faces]
    uv = np.stack([0.5 + p[:, :, 1] / (2 * half_y), 0.5 + p[:, :, 2] / (2 * half_z)], axis=2)
    moved = solid.moved((0.107, 0, 0.268))
    return Mesh(vertices=moved.vertices, faces=moved.faces, parts=("badge",), uv=np.clip(uv, 0.0, 1.0))


def badge_pixels() -> np.ndarray:
    """(32, 64) palette indices: R1 in block letters over hazard stripes."""
    letters = ["11100010", "10010110", "11100010", "10100010", "10010111"]
    pixels = np.zeros((32, 64), dtype=np.uint8)
    for row, bits in enumerate(letters):
        for column, bit in enumerate(bits):
            if bit == "1":
                pixels[4 + 4 * row : 8 + 4 * row, 16 + 4 * column : 20 + 4 * column] = 1
    y, x = np.mgrid[27:31, 4:60]
    pixels[27:31, 4:60] = np.where((x + y) // 4 % 2 == 0, 2, 0)
    return pixels


def shoulder_pod(side: int) -> Mesh:
    """Housing of the arm's first drive; `side` is +1 for left, -1 for right."""
    dome = loft([disc(-0.11, 0.03), disc(-0.085, 0.05), disc(-0.05, 0.056), disc(-0.02, 0.056)], 7, 0.008, 3)
    pod = merge(drum(0.055, -0.06, -0.004, 0.008, 32), dome)
    x, y, z = SHOULDER
    return pod.moved((x, side * y, z), (side * (SHOULDER_TILT - pi), 0, 0))


def _head(grow: float, low: float, high: float, fillet: float) -> Mesh:
    """The helmet between two heights: an egg with a flattened front, rounded rectangles in plan."""
    half_height, middle, power = 0.062, 0.459, 2.4

    def at(height: float) -> tuple[float, ...]:
        t = min(abs(height - middle) / half_height, 0.995)
        size = (1.0 - t**power) ** (1.0 / power)
        return (height, 0.0, 0.0, 0.068 * size + grow, 0.083 * size + grow, 0.052 * size + grow)

    rows = [at(float(h)) for h in np.linspace(low, high, max(4, round((high - low) / 0.009)))]
    return loft(rows, 7, fillet, 2)


def head_shell() -> Mesh:
    """Helmet."""
    return _head(0.0, 0.404, 0.5205, 0.0)


def head_visor() -> Mesh:
    """Dark band round the helmet; its front stays behind the camera frame at x = 0.0732."""
    return _head(0.0025, 0.435, 0.481, 0.002)


def head_eyes() -> Mesh:
    """Two bright eyes on the visor."""
    eye = loft([(-0.002, 0, 0, 0.0075, 0.013, 0.007), (0.0015, 0, 0, 0.0075, 0.013, 0.007)], 5, 0.001, 1)
    return mirrored(eye.moved((0.0702, 0.027, 0.457), (0, pi / 2, 0)))


def head_ears() -> Mesh:
    """Discs at the temples and an aerial."""
    cap = drum(0.022, 0.074, 0.09, 0.004, 24)
    aerial = tube([(-0.012, 0.086, 0.456), (-0.03, 0.088, 0.54)], 0.003, 8, 1)
    return merge(across(merge(cap, cap.scaled(1, 1, -1)), 0.0, 0.456), aerial)


def directions() -> Array:
    """(3,) unit vector of the left arm's first axis in torso_link4: down and outwards."""
    return np.array([0.0, np.sin(SHOULDER_TILT), -np.cos(SHOULDER_TILT)])

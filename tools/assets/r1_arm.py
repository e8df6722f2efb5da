"""Shapes of one R1 arm, each in its link's frame; both arms use the same parts. Lengths in metres."""

from __future__ import annotations

from math import pi

import numpy as np

from assets.mesh import Mesh, merge
from assets.solids import arrayed, disc, drum, loft, mirrored, plate, ring, rounded_box

ELBOW = (-0.35, -0.04, 0.014)
"""arm_joint3 in arm_link2."""
FOREARM = (0.01, -0.08, -0.0435)
"""arm_joint4 in arm_link3; its axis runs along the forearm."""
WRIST = 0.276
"""arm_joint5 along the forearm."""
HAND = 0.092
"""arm_joint6 beyond arm_joint5."""
UPPER_PLANE, FORE_PLANE, WRIST_PLANE = -0.03, -0.0435, -0.021
"""Middle planes of links 2, 3 and 5 along their joint axes."""
FINGER_PAD = -0.01
"""Inner face of a finger along its sliding axis."""


def _capped_drum(radius: float, half: float, middle: float) -> Mesh:
    return drum(radius, middle - half, middle + half, 0.006, 32)


def _caps(radius: float, half: float, middle: float) -> Mesh:
    cap = drum(radius, half - 0.005, half + 0.004, 0.003, 28)
    return merge(cap, cap.scaled(1, 1, -1)).moved((0, 0, middle))


def shoulder_shell() -> Mesh:
    """Link 1: turns about z on the shoulder pod, carries the second drive."""
    return loft([disc(0.002, 0.055), disc(0.03, 0.056), (0.06, 0, 0, 0.05, 0.044, 0.044),
                 (0.11, 0, 0, 0.042, 0.036, 0.036)], 7, 0.01, 3)  # fmt: skip


def shoulder_accent() -> Mesh:
    """Link 1: line at the turning joint."""
    return ring(0.0565, 0.006, 0.004, 0.01, 32)


def upper_shell() -> Mesh:
    """Link 2: from the shoulder towards -x, its outer end dropping to the elbow."""
    sections = [
        (0.0, 0.0, 0.042, 0.044),
        (0.05, -0.006, 0.046, 0.046),
        (0.12, -0.014, 0.044, 0.044),
        (0.22, -0.022, 0.038, 0.04),
        (0.3, -0.032, 0.036, 0.039),
        (0.355, -0.04, 0.037, 0.04),
    ]
    limb = loft([(d, UPPER_PLANE, y, hz, hy, 0.034) for d, y, hz, hy in sections], 5, 0.014, 3)
    return limb.moved(rpy=(0, -pi / 2, 0))


def upper_trim() -> Mesh:
    """Link 2: shoulder drum and a rubber pad along the outside."""
    pad = loft(
        [(0.09, UPPER_PLANE, 0.03, 0.02, 0.008, 0.006), (0.25, UPPER_PLANE, 0.016, 0.018, 0.008, 0.006)],
        3,
        0.004,
        2,
    )
    return merge(_capped_drum(0.05, 0.052, UPPER_PLANE), pad.moved(rpy=(0, -pi / 2, 0)))


def upper_accent() -> Mesh:
    """Link 2: caps of the shoulder drum, a line down the front of the limb."""
    rows = [(0.09, -0.054), (0.2, -0.0585), (0.29, -0.0685)]
    line = loft([(d, UPPER_PLANE, y, 0.006, 0.0035, 0.003) for d, y in rows], 2, 0.002, 1)
    return merge(_caps(0.034, 0.052, UPPER_PLANE), line.moved(rpy=(0, -pi / 2, 0)))


def fore_shell() -> Mesh:
    """Link 3: from the elbow across to the forearm, which runs along +x."""
    across = [(0.0, 0.0, 0.034, 0.034), (0.045, 0.012, 0.036, 0.035), (0.104, 0.026, 0.03, 0.03)]
    bridge = loft([(d, x, FORE_PLANE, hx, hz, 0.03) for d, x, hx, hz in across], 5, 0.012, 3)
    along = [(-0.006, -0.078, 0.028), (0.03, -0.079, 0.035), (0.09, -0.08, 0.034), (0.246, -0.08, 0.029)]
    limb = loft([(d, -FORE_PLANE, y, r, r, r) for d, y, r in along], 7, 0.01, 3)
    return merge(bridge.moved(rpy=(pi / 2, 0, 0)), limb.moved(rpy=(0, pi / 2, 0)))


def fore_trim() -> Mesh:
    """Link 3: elbow drum and the cuff of the rolling wrist."""
    cuff = drum(0.0305, 0.226, 0.25, 0.003, 32).moved((0, -0.08, FORE_PLANE), (0, pi / 2, 0))
    return merge(_capped_drum(0.045, 0.048, FORE_PLANE), cuff)


def fore_accent() -> Mesh:
    """Link 3: caps of the elbow drum."""
    return _caps(0.03, 0.048, FORE_PLANE)


def roll_shell() -> Mesh:
    """Link 4: neck of the rolling wrist; its frame is at the elbow end of the forearm."""
    sections = [disc(0.243, 0.028), (0.256, 0, 0, 0.028, 0.026, 0.026), (0.276, 0, 0, 0.024, 0.02, 0.02)]
    hub = drum(0.031, -0.024, 0.024, 0.005, 28).moved((0, 0, WRIST), (pi / 2, 0, 0))
    return merge(loft(sections, 6, 0.003, 2), hub)


def wrist_shell() -> Mesh:
    """Link 5: fork round link 4's hub, closing to a barrel along +x."""
    outline = [(0.05, -0.03), (0.056, 0.0), (0.05, 0.03)]
    angles = np.linspace(pi / 2 - 0.2, 3 * pi / 2 + 0.2, 15)
    outline += [(0.029 * float(np.cos(t)), 0.029 * float(np.sin(t))) for t in angles]
    cheek = plate(outline, 0.0255, 0.034, 0.003)
    barrel = loft([(0.038, 0, 0, 0.03, 0.032, 0.024), disc(0.06, 0.034), disc(0.09, 0.033)], 6, 0.006, 2)
    fork = merge(cheek, cheek.scaled(1, 1, -1))
    return merge(fork, barrel.moved(rpy=(0, pi / 2, 0))).moved((0, 0, WRIST_PLANE))


def wrist_accent() -> Mesh:
    """Link 5: caps of the fork."""
    return _caps(0.02, 0.033, WRIST_PLANE)


def palm_shell() -> Mesh:
    """Link 6: flange and the housing that the fingers slide on; z points out of the hand, x to its camera."""
    flange = drum(0.032, 0.001, 0.02, 0.004, 32)
    sections = [
        (0.014, 0, 0, 0.024, 0.062, 0.012),
        (0.024, 0, 0, 0.027, 0.07, 0.014),
        (0.036, 0, 0, 0.025, 0.07, 0.012),
    ]
    return merge(flange, loft(sections, 4, 0.003, 2))


def palm_trim() -> Mesh:
    """Link 6: finger rails and wrist camera."""
    rails = mirrored(rounded_box((0.003, 0.064, 0.003), 0.002, 1).moved((0.012, 0, 0.0375)), "x")
    stalk = rounded_box((0.012, 0.012, 0.006), 0.004, 2).moved((0.034, 0, 0.012))
    lens = drum(0.006, 0.004, 0.0125, 0.001, 16).moved((0.001, 0, 0))
    eye = merge(rounded_box((0.009, 0.02, 0.01), 0.004, 2), lens)
    return merge(rails, stalk, eye.moved((0.048, 0, -0.004), (0, -0.26, 0)))


def palm_proxy() -> Mesh:
    """Collision: the housing and the flange in few triangles."""
    housing = loft([(0.012, 0, 0, 0.027, 0.07, 0.008), (0.037, 0, 0, 0.027, 0.07, 0.008)], 1)
    return merge(housing, drum(0.033, 0.0, 0.014, 0.001, 12, 1))


def finger() -> Mesh:
    """Finger along +x, sliding along z; its pad looks towards -z, its back slopes to the tip."""
    sections = [
        (-0.038, 0.002, 0.012, 0.012),
        (-0.026, 0.0025, 0.0125, 0.011),
        (-0.01, 0.0008, 0.0108, 0.0095),
        (0.008, -0.0028, 0.0072, 0.0085),
        (0.024, -0.0056, 0.0044, 0.0075),
    ]
    body = loft([(d, -z, 0, half, hy, 0.003) for d, z, half, hy in sections], 2, 0.0015, 1)
    return body.moved(rpy=(0, pi / 2, 0))


def finger_pad() -> Mesh:
    """Rubber pad with ridges on the finger's inner face."""
    pad = rounded_box((0.024, 0.0075, 0.0012), 0.0008, 1).moved((-0.002, 0, FINGER_PAD + 0.0012))
    ridges = [
        rounded_box((0.0012, 0.007, 0.0008), 0.0004, 1).moved((-0.02 + 0.006 * i, 0, FINGER_PAD + 0.0006))
        for i in range(7)
    ]
    return merge(pad, *ridges)


def finger_proxy() -> Mesh:
    """Collision: a wedge."""
    sections = [
        (-0.038, 0.0015, 0.0115, 0.011),
        (-0.02, 0.0015, 0.0115, 0.011),
        (0.024, -0.0058, 0.0042, 0.008),
    ]
    return loft([(d, -z, 0, half, hy, 0.002) for d, z, half, hy in sections], 1).moved(rpy=(0, pi / 2, 0))


def bolts() -> Mesh:
    """Ring of screws on the flange of link 6."""
    return arrayed(drum(0.003, 0.0, 0.003, 0.001, 8, 1).moved((0.026, 0, 0.0)), 6)

"""Compiled loops over the pixels of a camera image."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled


@compiled("i4[:,::1] i4[::1] i8 i4[::1]")
def segmentation_ids(owners, numbers, with_links, out):  # pragma: no cover
    """Write the ids of a segmentation mask to `out` (n,) int32; -1 for the background and unknown bodies.

    owners (n, 2) int32: World's body and link of each pixel, -1 for the background. numbers (bodies,) int32:
    body id of each of World's bodies. with_links: add World's link (0 for the base) above the lowest 24 bits.
    """
    for k in range(len(owners)):
        body = owners[k, 0]
        number = np.int32(-1)
        if 0 <= body < len(numbers):
            number = numbers[body]
        if with_links and number >= 0:
            number += (owners[k, 1]) << 24
        out[k] = number

"""Conversion of depth (m) to the non-linear depth buffer of OpenGL."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled


@compiled("f4[::1] f8 f8 f8 f8 f4[::1]", releases_gil=True)
def to_buffer(depth, z_scale, z_offset, w_scale, w_offset, out):
    """Write 0 (near) to 1 (far, infinite or NaN) of depths (n,) (m) to `out` (n,) float32.

    z and w in clip space are affine in minus the depth, with the projection's third and fourth row.
    """
    for k in range(len(depth)):
        z = -np.float64(depth[k])
        buffer = 0.5 * (z_scale * z + z_offset) / (w_scale * z + w_offset) + 0.5
        buffer = min(max(buffer, 0.0), 1.0)
        out[k] = np.float32(buffer if np.isfinite(z) and buffer == buffer else 1.0)

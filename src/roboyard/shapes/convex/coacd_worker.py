"""Run CoACD on one mesh in a process of its own: `python coacd_worker.py INPUT.npz OUTPUT.npz`.

It imports nothing of Roboyard; `roboyard.shapes.convex.coacd_process` starts it.
"""

from __future__ import annotations

import json
import sys

import numpy as np


def main(source: str, target: str) -> None:
    """Read vertices, faces and settings; write the concatenated vertices of the hulls and their counts."""
    import coacd

    coacd.set_log_level("error")
    with np.load(source) as given:
        mesh = coacd.Mesh(given["vertices"], given["faces"])
        settings = json.loads(str(given["settings"]))
    hulls = [np.asarray(vertices, dtype=float) for vertices, _ in coacd.run_coacd(mesh, **settings)]
    np.savez(target, points=np.concatenate(hulls), counts=np.array([len(hull) for hull in hulls]))


if __name__ == "__main__":
    main(*sys.argv[1:3])

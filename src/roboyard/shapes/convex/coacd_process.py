"""Run CoACD in a child process with a time limit, since it can abort or run for minutes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from roboyard._arrays import NDArray
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.voxels.grid import triangles

SETTINGS = {
    "threshold": 0.05,
    "preprocess_resolution": 30,
    "resolution": 1000,
    "mcts_nodes": 10,
    "mcts_iterations": 60,
    "mcts_max_depth": 2,
    "seed": 0,
}
"""Arguments of CoACD: a fifth of the defaults' time at nearly their quality.

On seven links of go2 and tiago a threshold of 0.1 halves the time again, but gives two of them 25 % and 50 %
more excess volume; a coarser remesh (20) or fewer iterations save less and lose more.
"""


class CoacdFailedError(Exception):
    """CoACD returned no hulls; the message gives the cause."""


def is_installed() -> bool:
    """Whether the coacd package is installed."""
    return find_spec("coacd") is not None


def run_coacd(
    mesh: TriangleMesh,
    hull_count: int,
    time_limit: float,
    stop: Callable[[], bool] = lambda: False,
    worker: Path | None = None,
) -> list[NDArray[np.float64]]:
    """Return the (n, 3) vertices of each convex part (m).

    Args:
        mesh: any triangles (m).
        hull_count: most parts.
        time_limit: time after which the process is killed (s).
        stop: called ten times per second; True kills the process.
        worker: another script to run (for tests).

    Raises:
        CoacdFailedError: it crashed, exceeded the time limit, was stopped or returned nothing.
    """
    if time_limit <= 0:
        raise CoacdFailedError(f"no time was left ({time_limit:.3g} s)")
    soups = triangles(mesh)
    vertices = np.concatenate([v for v, _ in soups])
    faces = np.concatenate([f for _, f in soups])
    script = worker or Path(__file__).with_name("coacd_worker.py")
    with tempfile.TemporaryDirectory(prefix="roboyard-coacd-") as folder:
        source, target = Path(folder, "in.npz"), Path(folder, "out.npz")
        settings = json.dumps({**SETTINGS, "max_convex_hull": hull_count})
        np.savez(source, vertices=vertices, faces=faces, settings=np.array(settings))
        path = os.pathsep.join(entry for entry in sys.path if entry)
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": path}
        process = subprocess.Popen(  # noqa: S603 - our own script, our own interpreter
            [sys.executable, "-P", str(script), str(source), str(target)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=environment,
        )
        try:
            _wait(process, time_limit, stop)
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()
        if process.returncode != 0:
            raise CoacdFailedError(f"coacd exited with status {process.returncode}")
        try:
            with np.load(target) as result:
                points, counts = result["points"], result["counts"]
        except (OSError, ValueError, KeyError) as error:
            raise CoacdFailedError(f"coacd returned no readable file: {error}") from error
    hulls = np.split(points, np.cumsum(counts)[:-1])
    hulls = [hull for hull in hulls if len(hull) >= 4 and np.isfinite(hull).all()]
    if not hulls:
        raise CoacdFailedError(f"coacd returned no hull with volume ({len(counts)} parts)")
    return hulls


def _wait(process: subprocess.Popen[bytes], time_limit: float, stop: Callable[[], bool]) -> None:
    end = time.monotonic() + time_limit
    while True:
        try:
            process.wait(timeout=0.1)
        except subprocess.TimeoutExpired:
            if time.monotonic() > end:
                raise CoacdFailedError(f"coacd ran longer than {time_limit:g} s") from None
            if stop():
                raise CoacdFailedError("stopped") from None
        else:
            return

"""SciPy's qhull, alone and beside programs that use the packages around it."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

ALONE = """
import sys
import numpy as np
from roboyard._qhull import qhull
ConvexHull, QhullError = qhull()
corners = np.array(np.meshgrid([0.0, 1.0], [0.0, 2.0], [0.0, 3.0])).T.reshape(-1, 3)
assert abs(ConvexHull(corners).volume - 6.0) < 1e-12
try:
    ConvexHull(corners[:4])
except QhullError:
    pass
else:
    raise AssertionError
"""
LIGHT = "assert not {'scipy.sparse', 'scipy.special', 'scipy.linalg._basic'} & set(sys.modules)"
LATER = """
import scipy
import scipy.linalg.cython_lapack
import scipy.spatial.transform
from scipy.spatial import ConvexHull as Whole, cKDTree
assert Whole is ConvexHull and qhull()[0] is ConvexHull
assert cKDTree(corners).query([0.9, 0.1, 0.1])[0] < 0.2
assert np.allclose(scipy.linalg.solve(2.0 * np.eye(2), np.ones(2)), 0.5)
assert scipy.linalg.cython_lapack.__pyx_capi__ and "distance" in dir(scipy.spatial)
assert scipy.spatial._qhull.ConvexHull is ConvexHull
try:
    scipy.spatial.nothing
except AttributeError as error:
    assert "'scipy.spatial' has no attribute 'nothing'" in str(error)
else:
    raise AssertionError
import scipy.interpolate, scipy.optimize, scipy.stats
"""
TOGETHER = """
from concurrent.futures import ThreadPoolExecutor
import scipy.spatial
with ThreadPoolExecutor(8) as pool:
    found = list(pool.map(lambda name: getattr(scipy.spatial, name), ["cKDTree", "Voronoi", "distance"] * 20))
assert found[0] is scipy.spatial.cKDTree
"""
BROKEN = """
import builtins
import scipy.spatial
spec = scipy.spatial.__spec__
kept, spec.loader = spec.loader, None
try:
    scipy.spatial.cKDTree
except AssertionError:
    spec.loader = kept
assert scipy.spatial.cKDTree(corners).n == 8
"""


def run(*parts: str) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", "\n".join(parts)], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr


def test_the_packages_around_it_are_not_executed() -> None:
    run(ALONE, LIGHT)


def test_a_program_gets_the_packages_whole() -> None:
    run(ALONE, LATER)


def test_threads_wait_for_the_one_that_executes_a_package() -> None:
    run(ALONE, TOGETHER)


def test_a_package_that_could_not_be_executed_is_tried_again() -> None:
    run(ALONE, BROKEN)


@pytest.mark.parametrize("first", ["scipy.linalg", "scipy.spatial", "scipy.optimize"])
def test_packages_that_are_there_stay(first: str) -> None:
    run(f"import {first}", f"before = {first}", ALONE, f"assert {first} is before", LATER)


def test_another_place_of_the_module_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    from scipy import spatial

    from roboyard import _qhull

    monkeypatch.setattr(_qhull, "_QHULL", "scipy.spatial._elsewhere")
    assert _qhull._alone() is spatial
    assert _qhull.qhull()[0](np.eye(3)[:, :2]).volume == pytest.approx(0.5)

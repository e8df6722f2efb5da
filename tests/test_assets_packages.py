"""The finished packages among the bundled robots are those that a fresh import makes."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from roboyard.assets import SOURCE_CONFIGS, asset_path, assets_root
from roboyard.description import load_description
from roboyard.importer.pipeline import import_robot
from roboyard.shapes import load_mesh

NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
FOLDERS = ("curobo", "mjcf", "urdf")
TOLERANCE = 1e-6
"""Relative, and of 1 (m, kg, rad): compilers and processors round differently."""
HULL = 2e-3
"""m: how far the convex parts of a link may reach beyond those of another machine's decomposition."""


def is_hull(name: str) -> bool:
    """CoACD's parts, whose number and corners may differ between machines."""
    return "_col_" in name


def texts_agree(made: str, shipped: str) -> bool:
    """Equal texts, numbers within the tolerance."""
    made, shipped = ("\n".join(x for x in t.splitlines() if not is_hull(x)) for t in (made, shipped))
    if NUMBER.sub("#", made) != NUMBER.sub("#", shipped):
        return False
    a, b = (np.array([float(x) for x in NUMBER.findall(t)]) for t in (made, shipped))
    return bool(np.allclose(a, b, rtol=TOLERANCE, atol=TOLERANCE))


def files_of(root: Path) -> dict[str, Path]:
    return {
        path.relative_to(root).as_posix(): path
        for folder in FOLDERS
        for path in (root / folder).rglob("*")
        if path.is_file()
    }


@pytest.fixture(scope="module", params=sorted(SOURCE_CONFIGS))
def packages(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A fresh import of a robot's source, and the shipped package."""
    if importlib.util.find_spec("coacd") is None:
        pytest.skip("the shipped collision shapes were made with CoACD (extra `convex`)")
    made = import_robot(
        asset_path(SOURCE_CONFIGS[request.param]),
        out=tmp_path_factory.mktemp("data"),
        validate=False,
        report=False,
    )
    return made.folder, assets_root() / request.param


@pytest.mark.slow
def test_shipped_files_are_those_of_a_fresh_import(packages: tuple[Path, Path]) -> None:
    made, shipped = (files_of(root) for root in packages)
    names = {name for name in made if not is_hull(name)}
    assert names == {name for name in shipped if not is_hull(name)}
    different = []
    for name in sorted(names):
        a, b = made[name].read_bytes(), shipped[name].read_bytes()
        if a == b:
            continue
        if name.endswith((".stl", ".png")) or not texts_agree(a.decode(), b.decode()):
            different.append(name)
    assert different == []


@pytest.mark.slow
def test_shipped_collision_shapes_enclose_as_a_fresh_import_does(packages: tuple[Path, Path]) -> None:
    made, shipped = (load_description(root / "urdf" / f"{packages[1].name}.urdf") for root in packages)
    assert [link.name for link in made.links] == [link.name for link in shipped.links]
    for a, b in zip(made.links, shipped.links, strict=True):
        boxes = []
        for link in (a, b):
            parts = [c for c in link.collisions if is_hull(c.name or "")]
            corners = [
                load_mesh(c.geometry.path).vertices @ c.origin.matrix()[:3, :3].T + c.origin.matrix()[:3, 3]
                for c in parts
            ]
            points = np.concatenate([np.zeros((1, 3)), *corners])
            boxes.append(np.stack([points.min(axis=0), points.max(axis=0)]))
        np.testing.assert_allclose(boxes[0], boxes[1], atol=HULL, err_msg=a.name)


@pytest.mark.parametrize("name", sorted(SOURCE_CONFIGS))
def test_shipped_packages_need_no_import_and_no_write_access(name: str, tmp_path: Path) -> None:
    blocked = tmp_path / "blocked"
    blocked.write_text("a file where the data folder would be")
    code = (
        "import sys; from roboyard.robots import add_robot; from roboyard.sim import World\n"
        f"robot = add_robot(World(), {name!r})\n"
        "print(len(robot.sensors.names) > 0, [m for m in sys.modules if m.startswith('roboyard.importer')])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "ROBOYARD_DATA": str(blocked / "data")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.stdout.strip(), done.stderr) == ("True []", "")

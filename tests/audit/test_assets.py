"""The bundled robots: what is wrong with them is meant, and after repair they load and settle."""

from pathlib import Path

import numpy as np
import pytest

import roboyard
from roboyard.audit import audit_urdf
from roboyard.description import load_description
from roboyard.repair import repair_urdf

FOLDER = Path(roboyard.__file__).parent / "assets"
ROBOTS = sorted(FOLDER.rglob("*.urdf"))


def name_of(file: Path) -> str:
    return str(file.relative_to(FOLDER))


@pytest.mark.parametrize("file", ROBOTS, ids=name_of)
def test_every_bundled_robot_is_usable(file: Path) -> None:
    assert audit_urdf(file).is_usable


def test_the_vendor_robot_has_its_vendor_faults() -> None:
    result = audit_urdf(next(file for file in ROBOTS if file.parent.name == "urdf" and "r1" in file.name))
    assert {"inertial-missing", "limit-effort-zero", "mesh-reference", "mesh-file-name"} <= set(result.codes)


@pytest.mark.parametrize("file", [file for file in ROBOTS if "plane" not in file.name], ids=name_of)
def test_repaired_bundled_robots_are_read_strictly_and_settle(file: Path, tmp_path: Path) -> None:
    from roboyard.sim import World

    result = repair_urdf(file, tmp_path / "out")
    robot = load_description(result.urdf, strict=True)
    assert "inertial-missing" not in result.after.codes
    world = World()
    world.add_plane()
    world.add_urdf(robot, position=(0, 0, 1.0))
    world.step(240)
    assert np.isfinite(world.data.qpos).all()
    assert np.isfinite(world.data.qvel).all()

"""A mesh scaled to almost no size is reported, and the robot can still be added to a world."""

from pathlib import Path

import numpy as np
from audit_cases import CUBE, INERTIAL, arm, both, mesh, stl, write_case

from roboyard.audit import audit_urdf
from roboyard.sim import World


def test_a_robot_with_a_mesh_of_nothing_loads(tmp_path: Path) -> None:
    def write(folder: Path) -> str:
        (folder / "part.stl").write_bytes(stl(0.1 * CUBE))
        return arm(tip=INERTIAL + both(mesh("part.stl", "1e-6 1e-6 1e-6")))

    file = write_case(write, tmp_path)
    assert "mesh-tiny" in audit_urdf(file).codes
    world = World()
    body = world.add_urdf(file, (0, 0, 1))
    world.step(10)
    assert np.isfinite(world.data.qpos).all()
    assert any("skipped" in note for note in body.notes)

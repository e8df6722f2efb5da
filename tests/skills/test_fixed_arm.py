"""An arm that stands still works within its reach: it puts a cube onto a block."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from roboyard.assets import assets_root
from roboyard.robots import add_robot
from roboyard.scenes import household_objects
from roboyard.sim import World
from roboyard.skills import Skills, placing
from roboyard.skills.tracks import Track
from roboyard.skills.worker import Worker


@pytest.mark.slow
def test_a_fixed_arm_puts_a_cube_onto_a_block() -> None:
    world = World()
    world.add_plane()
    robot = add_robot(world, str(assets_root() / "franka_panda" / "panda.urdf"), self_collision=False)
    cube = world.add_description(household_objects.cube("cube"), (0.5, 0.1, 0.01), drives=False)
    skills = Skills(robot)
    assert skills.grasp("cube"), skills.log[-1]
    world.add_box((0.2, 0.2, 0.1), (0.45, -0.3, 0.05), mass=0.0, name="block")  # contacts are forgotten
    assert skills.holds("cube")
    assert skills.lift("cube"), skills.log[-1]
    assert skills.place("cube", on="block"), skills.log[-1]
    assert np.abs(cube.position[:2] - (0.45, -0.3)).max() < 0.1
    assert cube.position[2] == pytest.approx(0.1, abs=0.005)
    assert not skills.navigate_to("block")
    assert "no holonomic base" in skills.log[-1].text


@pytest.mark.slow
def test_an_object_that_slid_in_the_gripper_is_placed_on_its_spot() -> None:
    world = World()
    world.add_plane()
    robot = add_robot(world, str(assets_root() / "franka_panda" / "panda.urdf"), self_collision=False)
    cube = world.add_description(household_objects.cube("cube"), (0.5, 0.1, 0.01), drives=False)
    world.add_box((0.3, 0.3, 0.1), (0.45, -0.3, 0.05), mass=0.0, name="block")
    skills = Skills(robot)
    assert skills.grasp("cube"), skills.log[-1]
    assert skills.lift("cube"), skills.log[-1]
    spot = np.array([0.45, -0.3])
    follow, slid = placing.run, []

    def run(worker: Worker, track: Track, first: int, last: int, model: Any) -> None:
        follow(worker, track, first, last, model)
        if not slid:  # above the spot, by one centimetre between the fingers
            slid.append(worker.grip_pose(track.arm)[:3, 0] * 0.01)
            cube.set_pose(cube.position + slid[0], cube.orientation)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(placing, "run", run)
        assert skills.place("cube", on="block", at=spot), skills.log[-1]
    assert np.linalg.norm(cube.position[:2] - spot) < 0.004

"""Obstacles from a depth picture that also shows the robot; meshes and fields that MuJoCo cannot judge."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.description.model import Mesh, Pose
from roboyard.errors import ConfigError
from roboyard.planning import Obstacle, Planner, SphereModel, planner_for
from roboyard.rendering import Camera
from roboyard.robots import add_robot
from roboyard.shapes import primitives
from roboyard.shapes.mesh import TriangleMesh
from roboyard.sim import World


def test_the_robot_in_the_picture_is_no_obstacle_and_the_table_is() -> None:
    world = World()
    world.add_box((0.5, 1.4, 0.05), (0.75, 0.0, 0.75), mass=0.0, name="table")
    robot = add_robot(world, "r1")
    camera = Camera.look_at((1.8, 0.6, 2.2), (0.4, 0.0, 0.8), width=320, height=240)
    picture = world.render(camera)
    assert (picture.segmentation[..., 0] == robot.body.id).sum() > 500
    planner = planner_for(robot, "left")
    seen = planner.see(picture.depth, camera)
    here = planner.start()
    assert planner.plan(here).solved, planner.plan(here).reason
    made = planner.planner()
    assert [o.name for o in made.obstacles.items] == ["seen"]
    point = np.array([0.75, 0.3, 0.79])  # just above the table
    field = seen.shape
    inside = [np.linalg.norm(point - (0.75, 0.3, z)) for z in (0.775,)]
    from roboyard.planning import Obstacles
    from roboyard.planning.kernels.distances import obstacle_distance

    arrays = Obstacles([seen]).arrays
    assert abs(obstacle_distance(arrays, 0, *point)[0] - inside[0]) < 0.025
    assert obstacle_distance(arrays, 0, 0.75, 0.3, 1.2)[0] > 0.2
    assert field is seen.shape
    robot.world.remove(robot.world.body("table"))
    planner.seen = None
    assert "table" not in [o.name for o in planner.planner().obstacles.items]


def test_a_picture_of_another_size_is_refused() -> None:
    world = World()
    robot = add_robot(world, "r1")
    camera = Camera.look_at((1.8, 0.6, 2.2), (0.4, 0.0, 0.8), width=32, height=24)
    with pytest.raises(ConfigError, match="shape"):
        planner_for(robot, "left").see(np.ones((2, 2)), camera)


def test_inside_a_concave_mesh_is_free_and_its_walls_are_not(arm: SphereModel) -> None:
    walls = [
        (primitives.box(0.02, 0.7, 0.4), (0.8, 0.0, 0.6)),
        (primitives.box(0.4, 0.02, 0.4), (0.4, 0.7, 0.6)),
        (primitives.box(0.4, 0.02, 0.4), (0.4, -0.7, 0.6)),
    ]
    vertices = np.concatenate([np.add(mesh.vertices, at) for mesh, at in walls])
    faces = np.concatenate([mesh.faces + 8 * k for k, (mesh, _) in enumerate(walls)]).astype(np.int32)
    bay = Obstacle(
        name="bay",
        shape=Mesh(uri="", path=None, data=TriangleMesh(vertices=vertices, faces=faces)),
        pose=Pose(),
    )
    planner = Planner(arm, [f"joint{k}" for k in range(1, 8)], [bay])
    start, goal = (0.4, 0.2, 0, 1.9, 0, 0.5, 0), (-0.4, 0.2, 0, 1.9, 0, 0.5, 0)
    plan = planner.plan(start, goal)
    assert plan.solved, plan.reason
    through = planner.plan(start, (0.0, 1.3, 0, 0.1, 0, 0.0, 0))
    assert through.outcome == "goal in collision"
    assert '"bay"' in through.reason

"""Looks that differ from episode to episode, seen in pictures; pictures of many environments on threads."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from roboyard import Camera, add_robot
from roboyard.assets import asset_path
from roboyard.envs import BatchEnv, CameraPose, Color, JointDelta, Lighting, Task, TaskEnv
from roboyard.envs.pictures.picture_arrays import VIEW_SIZE
from roboyard.errors import ConfigError
from roboyard.rendering.light import UNLIT
from roboyard.sensors import CameraSensor


def box_task(*randomize: Any, camera: bool = False) -> Task:
    """An arm and a box in front of it that fill much of the view."""

    def build(world: Any) -> Any:
        world.add_plane()
        robot = add_robot(world, str(asset_path("arm7")))
        robot.joint_positions = [0.0, 0.6, 0.0, -1.2, 0.0, 0.8, 0.0]
        if camera:
            sensor = CameraSensor(robot.link("link4"), position=(0.3, 0.1, 0.1), width=40, height=30)
            robot.sensors.add(sensor, "eye")
        return {"robot": robot, "box": world.add_box((0.6, 0.6, 0.6), (0.9, -0.9, 0.3), rgba=(1, 1, 1, 1))}

    return Task(
        build=build,
        actions={"arm_0": JointDelta(0.1)},
        observations={"q": lambda env: env.robot.q},
        randomize=randomize,
        limit=5,
    )


def pictures(task: Task, count: int, threads: int = 1, steps: int = 0) -> dict[str, Any]:
    envs = BatchEnv(task, count, obs_modalities=["state", "rgb", "depth", "seg"], threads=threads)
    seen, _ = envs.reset(seed=0)
    for _ in range(steps):
        seen = envs.step(np.full((count, 7), 0.7))[0]
    envs.close()
    return seen


@pytest.mark.parametrize("camera", [False, True])
def test_pictures_are_those_of_the_world_one_by_one(camera: bool) -> None:
    task = box_task(camera=camera)
    envs = BatchEnv(task, 3, obs_modalities=["state", "rgb", "depth", "seg"], threads=2)
    envs.reset(seed=0)
    random = np.random.default_rng(0)
    seen = envs.step(random.uniform(-1, 1, envs.action_space.shape))[0]
    name = "link4" if camera else "view"
    for row in range(3):
        world, robot = envs.runner.show(row), envs.runner.robot(row)
        if camera:
            image = robot.sensors["eye"].image()  # type: ignore[attr-defined]
        else:
            eye, target = task.view
            image = world.render(
                Camera.look_at(eye, target, width=VIEW_SIZE[0], height=VIEW_SIZE[1]), shadow=False
            )
        assert np.array_equal(seen[f"{name}/rgb"][row], image.rgb)
        assert np.array_equal(seen[f"{name}/depth"][row], image.depth)
        assert np.array_equal(seen[f"{name}/seg"][row], image.segmentation)
    assert not np.array_equal(seen[f"{name}/depth"][0], seen[f"{name}/depth"][1])
    envs.close()


def test_pictures_do_not_depend_on_threads_or_on_other_environments() -> None:
    task = box_task(Color(), Lighting(), CameraPose())
    one, many = pictures(task, 6, threads=1, steps=7), pictures(task, 6, threads=3, steps=7)
    for name, values in one.items():
        assert np.array_equal(values, many[name])
    alone = TaskEnv(task, obs_modalities=["state", "rgb", "depth", "seg"])
    seen = alone.reset(seed=4)[0]
    assert np.array_equal(seen["view/rgb"], pictures(task, 6)["view/rgb"][4])


def box_pixels(seen: dict[str, Any], row: int) -> np.ndarray:
    """RGB (k, 3) of the box, which was added last and has the largest body id."""
    ids = seen["view/seg"][row, :, :, 0]
    return seen["view/rgb"][row][ids == ids.max()].astype(float)


def test_colors_are_drawn_between_their_bounds_and_change_nothing_else() -> None:
    plain = pictures(box_task(), 4)
    red = pictures(box_task(Color("box", low=(0.8, 0.0, 0.0), high=(0.9, 0.1, 0.1))), 4)
    for name in ("view/depth", "view/seg", "state"):
        assert np.array_equal(plain[name], red[name])
    means = []
    for row in range(4):
        r, g, b = box_pixels(red, row).mean(axis=0)
        assert r > 5.0 * max(g, b)
        others = red["view/seg"][row, :, :, 0] != red["view/seg"][row, :, :, 0].max()
        assert np.array_equal(red["view/rgb"][row][others], plain["view/rgb"][row][others])
        means.append(r)
    assert len({round(mean, 3) for mean in means}) == 4


def test_the_color_of_a_pixel_is_the_drawn_one_where_light_does_not_shade() -> None:
    envs = BatchEnv(box_task(Color(share=0.5)), 2, obs_modalities=["state", "rgb", "seg"])
    looks = envs.runner.env.appearance
    looks.lights = [UNLIT, UNLIT]
    seen, _ = envs.reset(seed=0)
    for row in range(2):
        shapes = np.flatnonzero(looks.owners[:, 0] == looks.owners[:, 0].max())
        expected = looks.colors[row, shapes[0]]
        assert (expected >= 0.55).all()  # half of white and half of at least 0.1
        np.testing.assert_allclose(
            box_pixels(seen, row), np.tile(255 * expected, (len(box_pixels(seen, row)), 1)), atol=1.0
        )
    envs.close()


def test_lights_and_camera_poses_differ_from_episode_to_episode() -> None:
    plain = pictures(box_task(), 3)
    lit = pictures(box_task(Lighting()), 3)
    assert np.array_equal(plain["view/depth"], lit["view/depth"])
    assert not np.array_equal(lit["view/rgb"][0], lit["view/rgb"][1])
    moved = pictures(box_task(CameraPose(position=0.1, angle=0.1)), 3)
    assert not np.array_equal(moved["view/depth"][0], moved["view/depth"][1])
    assert np.array_equal(moved["state"], plain["state"])
    task = box_task(CameraPose(position=0.1, angle=0.0))
    envs = BatchEnv(task, 3, obs_modalities=["state", "rgb"])
    before = envs.reset(seed=0)[0]["view/rgb"]
    after = envs.reset()[0]["view/rgb"]
    assert not np.array_equal(before, after)
    assert np.array_equal(envs.reset(seed=0)[0]["view/rgb"], before)
    camera = envs._pictures._cameras[0]  # type: ignore[union-attr]
    frames = envs.runner.physics.field("xpos")[0], envs.runner.physics.field("xmat")[0].reshape(-1, 3, 3)
    own = Camera.look_at(*task.view, width=VIEW_SIZE[0], height=VIEW_SIZE[1])
    shift = np.linalg.inv(camera.camera(0, *frames).view)[:3, 3] - np.linalg.inv(own.view)[:3, 3]
    assert 0.01 < np.abs(shift).max() < 0.1 * np.sqrt(3)
    np.testing.assert_allclose(camera.camera(0, *frames).view[:3, :3], own.view[:3, :3], atol=1e-12)
    envs.close()


def test_a_mounted_camera_is_moved_in_its_own_frame() -> None:
    task = box_task(CameraPose(position=0.05, angle=0.0), camera=True)
    envs = BatchEnv(task, 2, obs_modalities=["state", "depth"])
    envs.reset(seed=1)
    looks = envs.runner.env.appearance
    source = envs._pictures._cameras[0]  # type: ignore[union-attr]
    for row in range(2):
        robot = envs.runner.robot(row)
        own = np.linalg.inv(robot.sensors["eye"].camera().view)  # type: ignore[attr-defined]
        frames = (
            envs.runner.physics.field("xpos")[row],
            envs.runner.physics.field("xmat")[row].reshape(-1, 3, 3),
        )
        found = np.linalg.inv(source.camera(row, *frames).view)
        np.testing.assert_allclose(
            own[:3, :3].T @ (found[:3, 3] - own[:3, 3]), looks.camera_shifts["link4"][row], atol=1e-9
        )
    envs.close()


def test_errors_name_the_value() -> None:
    for wrong, text in (
        (Color("bix"), "box"),
        (Color(low=(0.5, 0.5, 1.5)), "blue"),
        (Color(share=2.0), "share"),
        (Lighting(ambient=(0.5, 0.1)), "ambient"),
        (CameraPose("eye"), "view"),
        (CameraPose(angle=-1.0), "angle"),
    ):
        with pytest.raises(ConfigError, match=text):
            TaskEnv(box_task(wrong))

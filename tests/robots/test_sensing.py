"""Sensors of an import are mounted automatically, each at its own rate and in its own frame."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard import import_robot
from roboyard.errors import ConfigError
from roboyard.robots import add_robot
from roboyard.robots.registry import Registry
from roboyard.sensors import CameraSensor, Lidar, ScanPattern
from roboyard.sim import World

CONFIG = """
urdf_path: mast.urdf
name: mast
headless: true
camera_links:
  - link: eye
    parent_link: head
    offset: {position: [0.1, 0, 0.05], orientation: [0.5, -0.5, -0.5, 0.5]}
lidar_links:
  - link: head
    parent_link: null
    offset: {position: [0, 0, 0.2], orientation: [0, 0, 0.7071067811865476, 0.7071067811865476]}
"""
SOLID = """
  <link name="{name}"><inertial><mass value="2"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0"
  iyz="0"/></inertial><visual><geometry><box size="0.1 0.1 {high}"/></geometry></visual>
  <collision><geometry><box size="0.1 0.1 {high}"/></geometry></collision></link>
"""


@pytest.fixture(scope="module")
def registry(tmp_path_factory: pytest.TempPathFactory) -> Registry:
    folder = tmp_path_factory.mktemp("mast")
    (folder / "mast.urdf").write_text(
        f'<robot name="mast">{SOLID.format(name="foot", high=0.2)}{SOLID.format(name="head", high=0.1)}'
        '<joint name="neck" type="revolute"><parent link="foot"/><child link="head"/>'
        '<origin xyz="0 0 0.5"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="10" velocity="2"/>'
        "</joint></robot>"
    )
    (folder / "config.yaml").write_text(CONFIG)
    import_robot(folder / "config.yaml", out=folder / "data", report=False)
    return Registry(folder / "data", with_bundled=False)


@pytest.fixture
def world() -> World:
    world = World()
    world.add_plane()
    world.add_box((0.2, 4, 4), (2.1, 0, 0), mass=0, name="wall")
    return world


def test_cameras_and_lidars_of_the_import_are_mounted_automatically(registry: Registry, world: World) -> None:
    robot = add_robot(world, registry["mast"])
    assert robot.sensors.names == ("mast:eye:Camera:0", "mast:head:Lidar:0")
    seen, info = robot.observe()
    camera, lidar = seen["mast:eye:Camera:0"], seen["mast:head:Lidar:0"]
    assert camera["rgb"].shape == (128, 128, 3) and camera["points"].shape == (128, 128, 3)
    x, _, z = robot.body.link("head").pose[0]
    assert camera["depth"][64, 64] == pytest.approx(2.0 - (x + 0.1), abs=0.01)
    assert info["mast:eye:Camera:0"]["seg"][tuple(camera["seg"][64, 64])] == "wall/base"
    # the lidar is turned by a quarter to the left, so that the wall ahead is at -90 degrees
    assert lidar["scan"].shape == (1, 360)
    assert lidar["scan"][0, 90] == pytest.approx(2.0 - x)
    assert np.allclose(lidar["points"][:, 2], z + 0.2)
    assert np.array_equal(seen["proprio"], robot.proprioception()[0])


def test_each_sensor_observes_at_its_own_rate(registry: Registry, world: World) -> None:
    robot = add_robot(world, registry["mast"], sensor_options={"Camera": {"width": 8, "height": 8}})
    robot.sensors["mast:head:Lidar:0"].rate = 5.0
    looks = dict.fromkeys(robot.sensors.names, 0)
    last: dict[str, object] = {}
    for _ in range(240):
        seen, _ = robot.observe()
        for name in looks:
            key = "depth" if "Camera" in name else "scan"
            looks[name] += seen[name][key] is not last.get(name)
            last[name] = seen[name][key]
        world.step()
    assert looks == {"mast:eye:Camera:0": 30, "mast:head:Lidar:0": 5}


def test_sensor_options_apply_to_kinds_and_links(registry: Registry, world: World) -> None:
    pattern = ScanPattern(max_range=3.0)
    robot = add_robot(
        world,
        registry["mast"],
        scale=2.0,
        sensor_options={
            "Camera": {"width": 32, "rate": 10},
            "eye": {"rate": 20},
            "head": {"pattern": pattern},
        },
    )
    camera, lidar = (robot.sensors[name] for name in robot.sensors.names)
    assert isinstance(camera, CameraSensor) and isinstance(lidar, Lidar)
    assert (camera.width, camera.rate, lidar.pattern, lidar.rate) == (32, 20, pattern, 10)
    assert np.allclose(lidar.mount.position, (0, 0, 0.4))
    for wrong, message in (({"nose": {}}, "nose"), ({"Lidar": {"colour": 1}}, "colour")):
        with pytest.raises(ConfigError, match=message):
            add_robot(world, registry["mast"], sensor_options=wrong)


def test_r1_has_its_three_cameras(world: World) -> None:
    robot = add_robot(world, "r1")
    links = [robot.sensors[name].link.name for name in robot.sensors.names]
    assert sorted(links) == ["eyes", "left_eef_link", "right_eef_link"]
    seen, info = robot.observe()
    assert "wall/base" in info["r1:eyes:Camera:0"]["seg"].values()
    assert np.isfinite(seen["r1:eyes:Camera:0"]["depth"]).any()


def test_only_the_chosen_modalities_are_observed(registry: Registry, world: World) -> None:
    robot = add_robot(world, registry["mast"], obs_modalities=["depth_linear", "scan"])
    seen, info = robot.observe()
    assert {name: set(arrays) for name, arrays in seen.items()} == {
        "mast:eye:Camera:0": {"depth"},
        "mast:head:Lidar:0": {"scan"},
    }
    assert info == {}
    own = add_robot(world, registry["mast"], (3, 0, 0), obs_modalities=("proprio",), name="own")
    assert own.sensors.names == () and list(own.observe()[0]) == ["proprio"]
    with pytest.raises(ConfigError, match=r"obs_modalities.*'rbg'.*rgb"):
        add_robot(world, registry["mast"], (6, 0, 0), obs_modalities=["rbg"], name="wrong")

"""Cameras, lidars and IMUs from names, frame trees and simulator blocks: one of each physical sensor."""

from __future__ import annotations

import pytest

from roboyard.description.evidence.read import read_evidence
from roboyard.description.loader import load_description
from roboyard.morphology.sensors.find import FoundSensor, find_sensors


def _robot(links: dict[str, tuple[str, str]], extra: str = "") -> str:
    """Return a URDF of links on fixed joints: name to parent and origin; a moving wheel is there too."""
    parts = ['<robot name="r"><link name="base"/><link name="wheel"/>']
    parts.append('<joint name="w" type="continuous"><parent link="base"/><child link="wheel"/></joint>')
    for name, (parent, origin) in links.items():
        parts.append(f'<link name="{name}"/><joint name="{name}_joint" type="fixed"><origin {origin}/>')
        parts.append(f'<parent link="{parent}"/><child link="{name}"/></joint>')
    return "".join([*parts, extra, "</robot>"])


def _find(text: str) -> dict[str, FoundSensor]:
    description = load_description(text)
    return {found.sensor.link: found for found in find_sensors(description, read_evidence(description))}


NEAR = 'xyz="0.01 0 0"'
OPTICAL = 'xyz="0 0 0" rpy="-1.5708 0 -1.5708"'


def test_the_frames_of_a_depth_camera_are_one_camera_with_its_colour_optical_frame():
    found = _find(
        _robot(
            {
                "head_camera_bottom_screw_frame": ("base", NEAR),
                "head_camera_link": ("head_camera_bottom_screw_frame", NEAR),
                "head_camera_depth_frame": ("head_camera_link", NEAR),
                "head_camera_depth_optical_frame": ("head_camera_depth_frame", OPTICAL),
                "head_camera_color_frame": ("head_camera_link", NEAR),
                "head_camera_color_optical_frame": ("head_camera_color_frame", OPTICAL),
                "head_camera_gyro_frame": ("head_camera_link", NEAR),
            }
        )
    )
    assert list(found) == ["head_camera_link"]
    camera = found["head_camera_link"]
    assert (camera.sensor.kind, camera.sensor.optical_link) == ("camera", "head_camera_color_optical_frame")
    assert camera.confidence > 0.85 and any("optical" in reason for reason in camera.evidence)


def test_the_camera_of_an_arm_is_a_camera_and_the_arm_of_a_camera_is_none():
    assert list(
        _find(_robot({"arm_camera_mount": ("base", NEAR), "arm_camera": ("arm_camera_mount", NEAR)}))
    ) == ["arm_camera"]
    assert not _find(_robot({"camera_arm": ("base", NEAR)}))


def test_short_names_of_depth_and_optical_cameras_count_beside_a_place_only():
    links = {"f_dc_link": ("base", NEAR), "r_oc_link": ("base", 'xyz="-0.3 0 0"')}
    assert list(_find(_robot(links))) == ["f_dc_link", "r_oc_link"]
    assert not _find(_robot({"dc_motor_link": ("base", NEAR), "front_motor": ("base", NEAR)}))


def test_cameras_in_different_places_are_different_cameras():
    found = _find(
        _robot(
            {
                "camera_left": ("base", 'xyz="0 0.1 0"'),
                "camera_optical_left": ("camera_left", OPTICAL),
                "camera_right": ("base", 'xyz="0 -0.1 0"'),
                "d435_link": ("base", 'xyz="0.2 0 0.3"'),
            }
        )
    )
    assert list(found) == ["camera_left", "camera_right", "d435_link"]
    assert found["camera_left"].sensor.optical_link == "camera_optical_left"
    assert len({camera.sensor.name for camera in found.values()}) == 3


def test_imagers_side_by_side_are_one_stereo_camera_and_two_on_one_carrier_are_two():
    stereo = {
        "double_stereo_link": ("base", NEAR),
        "wide_stereo_link": ("double_stereo_link", NEAR),
        "wide_stereo_optical_frame": ("wide_stereo_link", OPTICAL),
        "narrow_stereo_link": ("double_stereo_link", 'xyz="0 0.1 0"'),
    }
    assert list(_find(_robot(stereo))) == ["wide_stereo_link", "narrow_stereo_link"]
    pair = {"d435_left_imager_link": ("base", NEAR), "d435_rgb_module_link": ("base", 'xyz="0 0.03 0"')}
    assert list(_find(_robot(pair))) == ["d435_left_imager_link"]


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("laser", "lidar"),
        ("base_scan", "lidar"),
        ("front_hokuyo_link", "lidar"),
        ("velodyne", "lidar"),
        ("mid360_link", "lidar"),
        ("os1_sensor", "lidar"),
        ("rplidar_a2", "lidar"),
        ("imu_in_torso", "imu"),
        ("TorsoIMULink", "imu"),
        ("base_imu", "imu"),
        ("zed2i_camera_center", "camera"),
        ("oak_d_lite", "camera"),
        ("wrist_cam", "camera"),
        ("left_realsense_link", "camera"),
    ],
)
def test_products_and_words_of_several_vendors(name: str, kind: str):
    assert [found.sensor.kind for found in _find(_robot({name: ("base", NEAR)})).values()] == [kind]


@pytest.mark.parametrize(
    "name",
    [
        "camera_mount",
        "lidar_support_link",
        "panda_rightfinger",
        "virtual_laser_link",
        "camera_aruco",
        "rgbd_laser_link",
        "FT_sensor_R",
        "sonar_front",
        "left_eye_target",
        "simulation_frame",
        "gripper_accelerometer_link",
        "torso_link",
        "tcp",
    ],
)
def test_carriers_markers_computed_scans_and_other_sensors_are_none(name: str):
    assert _find(_robot({name: ("base", NEAR)})) == {}


def test_a_camera_named_link_that_carries_a_joint_is_none():
    text = _robot({"camera_pan_link": ("base", NEAR)}).replace(
        "</robot>",
        '<link name="tip"/><joint name="tilt" type="continuous"><parent link="camera_pan_link"/>'
        '<child link="tip"/></joint></robot>',
    )
    assert _find(text) == {}


def test_stated_sensors_join_the_frames_they_belong_to_or_stand_alone():
    block = (
        '<gazebo reference="base"><sensor name="imu_sensor" type="imu"/><sensor name="again" type="imu"/>'
        '</gazebo><gazebo reference="eye"><sensor name="e" type="depth"><camera_name>x</camera_name>'
        "<frame_name>eye_optical_frame</frame_name></sensor></gazebo>"
        '<gazebo reference="base"><sensor name="sonar_1" type="ray"/></gazebo>'
    )
    found = _find(_robot({"eye": ("base", NEAR), "eye_optical_frame": ("eye", OPTICAL)}, block))
    assert {link: item.sensor.kind for link, item in found.items()} == {"eye": "camera", "base": "imu"}
    assert found["eye"].sensor.optical_link == "eye_optical_frame"
    assert any("states sensor" in reason for reason in found["base"].evidence)


def test_an_inertial_sensor_inside_a_camera_is_part_of_it():
    frames = {"zed_camera_link": ("base", NEAR), "zed_imu_link": ("zed_camera_link", NEAR)}
    assert [item.sensor.kind for item in _find(_robot(frames)).values()] == ["camera"]


def test_a_sweep_of_many_rays_is_a_lidar_whatever_its_name():
    block = (
        '<gazebo reference="{0}"><sensor name="{0}" type="ray"><ray><scan><horizontal><samples>{1}</samples>'
        "</horizontal></scan></ray></sensor></gazebo>"
    )
    links = {"base_range_sensor": ("base", NEAR), "left_cliff_sensor": ("base", 'xyz="0 0.1 0"')}
    extra = block.format("base_range_sensor", 721) + block.format("left_cliff_sensor", 3)
    assert list(_find(_robot(links, extra))) == ["base_range_sensor"]


def test_cameras_at_the_bottom_and_elsewhere_of_one_head_are_two():
    found = _find(
        _robot(
            {
                "CameraDepth_frame": ("base", 'xyz="0.05 0.04 0.12"'),
                "CameraDepth_optical_frame": ("CameraDepth_frame", OPTICAL),
                "CameraBottom_frame": ("base", 'xyz="0.09 0 0.06"'),
                "CameraBottom_optical_frame": ("CameraBottom_frame", OPTICAL),
            }
        )
    )
    assert list(found) == ["CameraDepth_frame", "CameraBottom_frame"]

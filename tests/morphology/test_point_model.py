"""The point model's centre of mass, extent and inertias against closed forms and MuJoCo."""

from __future__ import annotations

import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from small_robots import joint, link, robot

from roboyard.assets import asset_path
from roboyard.description import load_description
from roboyard.morphology.point_model import PointModel, extreme_points


def pendulum() -> PointModel:
    """Two links of 1 m in the x-z plane, hinges about y; 2 kg and 3 kg at their ends, 5 kg at the root."""
    return PointModel(
        robot(
            link("base", "box 0.2 0.2 0.2", 5),
            link("upper", "sphere 0.05", 2, centre="1 0 0", origin="1 0 0"),
            link("lower", "sphere 0.05", 3, centre="1 0 0", origin="1 0 0"),
            joint("shoulder", "base", "upper", axis="0 1 0", limits=(-3, 3)),
            joint("elbow", "upper", "lower", xyz="1 0 0", axis="0 1 0", limits=(-3, 3)),
        )
    )


def ends(shoulder: np.ndarray, elbow: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Planar forward kinematics; a positive turn about y moves +x towards -z."""
    both, flat = shoulder + elbow, np.zeros_like(shoulder)
    first = np.stack([np.cos(shoulder), flat, -np.sin(shoulder)], axis=-1)
    return first, first + np.stack([np.cos(both), flat, -np.sin(both)], axis=-1)


def test_the_centre_of_mass_of_a_batch_of_postures_is_the_weighted_mean() -> None:
    model = pendulum()
    shoulder, elbow = np.random.default_rng(0).uniform(-2, 2, (2, 7))
    found = model.centre_of_mass(model.poses({"shoulder": shoulder, "elbow": elbow}))
    first, second = ends(shoulder, elbow)
    assert found == pytest.approx((2 * first + 3 * second) / 10)
    assert model.mass == 10.0
    assert model.base_mass == 5.0


def test_the_lowest_point_is_below_the_lowest_sphere_or_the_base() -> None:
    model = pendulum()
    shoulder, elbow = np.linspace(-2, 2, 9), np.linspace(1, -1, 9)
    found = model.lowest(model.poses({"shoulder": shoulder, "elbow": elbow}))
    first, second = ends(shoulder, elbow)
    expected = np.minimum(np.minimum(first[:, 2], second[:, 2]) - 0.05, -0.1)
    assert found == pytest.approx(expected, abs=1e-3)
    poses = model.poses({"shoulder": shoulder, "elbow": elbow})
    assert model.lowest(poses, ["base"]) == pytest.approx(-0.1)
    assert model.lowest(poses, ["absent"]).tolist() == [np.inf] * 9
    points = model.lowest_points(poses)
    assert points.shape == (9, 3)
    assert points[:, 2].tolist() == found.tolist()
    ball = np.where((first[:, 2] < second[:, 2])[:, None], first, second)
    beside = expected < -0.1 - 1e-9  # a sphere is lowest, not the base
    assert beside.any()
    assert points[beside, :2] == pytest.approx(ball[beside][:, :2], abs=0.05 * 0.13)  # 256 directions


def test_the_largest_inertia_about_each_joint_nears_its_closed_form() -> None:
    found = pendulum().moved_inertias()
    assert found["elbow"] == pytest.approx(3.0)  # 3 kg at 1 m in every posture
    # 2 kg at 1 m and 3 kg at 2 m when stretched, which is the home posture
    assert found["shoulder"] == pytest.approx(2 + 3 * 4)


def test_a_bent_posture_counts_where_home_is_in_line_with_the_axis() -> None:
    model = PointModel(
        robot(
            link("base", "box 0.1 0.1 0.1", 1),
            link("mast", "box 0.1 0.1 0.1"),
            link("boom", "box 0.1 0.1 0.1", 2, centre="0 0 1"),
            joint("yaw", "base", "mast", axis="0 0 1"),
            joint("pitch", "mast", "boom", axis="0 1 0", limits=(-1.5707963, 1.5707963)),
        )
    )
    inertia = model.moved_inertias()["yaw"]  # 2 kg at sin(pitch) m from the axis: 0 at home, 2 when level
    assert 1.8 < inertia <= 2.0


def test_a_slide_moves_the_mass_of_everything_behind_it() -> None:
    model = PointModel(
        robot(
            link("base", "box 0.1 0.1 0.1", 1),
            link("slide", mass=2, centre="5 5 5"),
            link("tip", mass=0.5),
            joint("z", "base", "slide", kind="prismatic"),
            joint("spin", "slide", "tip"),
        )
    )
    assert model.moved_inertias() == {"z": 2.5, "spin": 0.0}


def mimicking() -> PointModel:
    """A hinge that starts at 0.5 rad, a follower of it, and a follower of that follower."""
    return PointModel(
        robot(
            *(link(name, "box 0.1 0.1 0.1", 1) for name in ("base", "a", "b", "c", "d")),
            joint("lead", "base", "a", limits=(0.25, 0.75)),
            joint("half", "base", "b", mimic='<mimic joint="lead" multiplier="0.5" offset="0.1"/>'),
            joint("back", "b", "c", mimic='<mimic joint="half" multiplier="-2" offset="1"/>'),
            joint("stick", "c", "d", kind="fixed"),
        )
    )


def test_followers_move_with_their_leader_through_one_another() -> None:
    model = mimicking()
    assert [j.name for j in model.joints] == ["lead"]
    lead = model.description.joint_by_name["lead"]
    assert {j.name for j in model.followers(lead)} == {"lead", "half", "back"}
    assert set(model.moved_links(lead)) == {"a", "b", "c", "d"}
    assert [j.name for j in model.path("d")] == ["back", "half"]


def test_home_gives_followers_the_position_that_their_leader_implies() -> None:
    model = mimicking()
    assert model.home == {"lead": 0.5}  # the middle of limits that exclude zero
    half = 0.5 * 0.5 + 0.1
    assert model.posture_with_followers() == pytest.approx({"lead": 0.5, "half": half, "back": -2 * half + 1})
    turn = model.poses({})["c"][:3, :3]
    assert np.arctan2(turn[1, 0], turn[0, 0]) == pytest.approx(half + (-2 * half + 1))


def test_base_links_are_the_root_and_those_fixed_to_it() -> None:
    model = PointModel(
        robot(
            *(link(name, "box 0.1 0.1 0.1", mass) for name, mass in (("a", 1), ("b", 2), ("c", 4), ("d", 8))),
            joint("ab", "a", "b", kind="fixed"),
            joint("bc", "b", "c", kind="fixed"),
            joint("cd", "c", "d"),
        )
    )
    assert model.base_links == ["a", "b", "c"]
    assert model.base_mass == 7.0


def test_a_robot_without_mass_has_its_centre_at_the_origin() -> None:
    model = PointModel(robot(link("a", "box 1 1 1", origin="3 0 0")))
    assert model.mass == 0.0
    assert model.centre_of_mass(model.poses({})).tolist() == [0, 0, 0]


@pytest.mark.parametrize("name", ["arm7", "r2d2", "husky"])
def test_centre_of_mass_equals_the_one_mujoco_computes(name: str) -> None:
    description = load_description(asset_path(name))
    model = PointModel(description)
    rng = np.random.default_rng(3)
    posture = {}
    for one in model.joints:
        lower, upper = one.position_limits() or (-1.0, 1.0)
        posture[one.name] = float(rng.uniform(lower, upper))
    found = model.centre_of_mass(model.poses(posture))
    bodies = "".join(
        f'<body pos="{" ".join(map(str, frame[:3, 3]))}" quat="{" ".join(map(str, quaternion(frame)))}">'
        f'<inertial pos="{" ".join(map(str, inertial.origin.position))}" mass="{inertial.mass}" '
        'diaginertia="1 1 1"/></body>'
        for one in description.links
        if (inertial := one.inertial) is not None and inertial.mass > 0
        for frame in [model.poses(posture)[one.name]]
    )
    compiled = mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody><body>{bodies}</body></worldbody></mujoco>"
    )
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    assert found == pytest.approx(data.subtree_com[1], abs=1e-9)


def quaternion(frame: np.ndarray) -> np.ndarray:
    out = np.zeros(4)
    mujoco.mju_mat2Quat(out, frame[:3, :3].ravel().copy())
    return out


def test_extreme_points_keep_the_extent_in_every_direction() -> None:
    rng = np.random.default_rng(5)
    points = rng.normal(size=(4000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    kept = extreme_points(points)
    assert len(kept) <= 262
    directions = rng.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    whole, part = (points @ directions.T).max(axis=0), (kept @ directions.T).max(axis=0)
    assert (part <= whole).all()
    assert (whole - part < 0.02).all()  # 1 % of a size of 2
    assert np.array_equal(kept.max(axis=0), points.max(axis=0))
    assert extreme_points(points[:100]) is not None and len(extreme_points(points[:100])) == 100

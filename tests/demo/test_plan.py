"""Support and ranges of motion, compared with figures computed by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from roboyard.demo.plan import make_plan
from roboyard.demo.sweep import Sweep, first_sweep
from roboyard.description import Joint, Limit, RobotDescription, load_description
from roboyard.morphology.joint_ranges import full_range
from roboyard.morphology.point_model import PointModel, extreme_points
from roboyard.morphology.support_mode import decide


def sweep(lower: float, upper: float, home: float = 0.0) -> Sweep:
    return Sweep(
        joint="j", home=home, lower=lower, upper=upper, full=(lower, upper), speed=1.5, acceleration=4.0
    )


@pytest.mark.parametrize("ends", [(-1.0, 2.0), (0.0, 6.28), (-0.3, 0.0)])
def test_a_sweep_visits_both_ends_and_comes_home_within_its_speed_and_acceleration(
    ends: tuple[float, float],
) -> None:
    s = sweep(*ends)
    phase = np.linspace(0.0, 1.0, 20001)
    position, slope = s.at(phase)
    assert position[0] == pytest.approx(0.0, abs=1e-12)
    assert position[-1] == pytest.approx(0.0, abs=1e-12)
    assert position.min() == pytest.approx(ends[0], abs=1e-6)
    assert position.max() == pytest.approx(ends[1], abs=1e-6)
    time = phase * s.duration
    assert slope / s.duration == pytest.approx(np.gradient(position, time), abs=1e-2)
    assert np.abs(slope).max() / s.duration <= 1.5 * (1 + 1e-9)
    acceleration = np.gradient(slope / s.duration, time)
    assert np.quantile(np.abs(acceleration), 0.999) <= 4.0 * (1 + 1e-3)


def test_full_range_is_at_most_a_turn() -> None:
    def joint(kind: str, limit: Limit | None = None) -> Joint:
        return Joint(name="j", type=kind, parent="a", child="b", limit=limit)  # type: ignore[arg-type]

    assert full_range(joint("continuous"), 0.0) == pytest.approx((0.0, 2 * np.pi))
    assert full_range(joint("revolute", Limit(lower=-6.28, upper=6.28)), 0.0) == pytest.approx(
        (-np.pi, np.pi)
    )
    assert full_range(joint("revolute", Limit(lower=-1.0, upper=2.0)), 0.0) == (-1.0, 2.0)
    assert full_range(joint("prismatic"), 0.0) == (-0.1, 0.1)


def test_a_heavy_joint_is_accelerated_gently() -> None:
    joint = Joint(name="j", type="revolute", parent="a", child="b", limit=Limit(effort=10.0, velocity=1.0))
    light, heavy = first_sweep(joint, 0.0, 0.01), first_sweep(joint, 0.0, 20.0)
    assert light.speed == heavy.speed == pytest.approx(0.8)
    assert heavy.acceleration == pytest.approx(0.2 * 10.0 / 20.0)
    assert heavy.duration > light.duration


def test_extreme_points_of_a_cube_of_points_are_its_corners() -> None:
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 9)] * 3), axis=-1).reshape(-1, 3)
    kept = extreme_points(grid)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    assert all((kept == corner).all(axis=1).any() for corner in corners)
    assert len(kept) < len(grid)


def test_centre_of_mass_and_inertia(arm: RobotDescription) -> None:
    model = PointModel(arm)
    posture = {"shoulder": 0.0, "elbow": np.pi / 2, "grip": 0.0}
    centre = model.centre_of_mass(model.poses(posture))
    # foot 2 kg at z 0.05, upper 1 kg at z 0.3, lower 1 kg at x 0.2, z 0.5, finger 0.1 kg at x 0.45, z 0.5
    assert centre == pytest.approx(np.array([0.245, 0.0, 0.1 + 0.3 + 0.5 + 0.05]) / 4.1)
    # stretched straight, which the elbow's range does not quite allow, the shoulder would move this much
    straight = 1.0 * 0.2**2 + 1.0 * 0.6**2 + 0.1 * 0.9**2
    inertia = model.moved_inertias()["shoulder"]
    assert 0.8 * straight < inertia < straight


def test_home_is_zero_or_the_middle_of_the_range(arm: RobotDescription) -> None:
    assert PointModel(arm).home == {"shoulder": 0.0, "elbow": 1.0, "grip": 0.0}


def test_followers_are_at_home_too(cart: RobotDescription) -> None:
    posture = PointModel(cart).posture_with_followers()
    assert posture["wave"] == pytest.approx(0.1)


def test_a_cart_stands_on_its_wheels(cart: RobotDescription) -> None:
    support = decide(PointModel(cart))
    assert support.kind == "free"
    assert set(support.feet) == {"wheel_fl", "wheel_fr", "wheel_bl", "wheel_br"}
    assert support.lowest == pytest.approx(-0.15, abs=1e-3)
    # wheels touch at x = ±0.2, y = ±0.25; the weight is in the middle
    assert support.margin == pytest.approx(0.2, abs=0.02)
    assert support.levers["roll_fl"] == pytest.approx(0.1, rel=0.02)
    assert "lean" not in support.levers


def test_a_walker_is_supported_and_an_arm_mounted(walker: RobotDescription, arm: RobotDescription) -> None:
    assert decide(PointModel(walker)).kind == "supported"
    support = decide(PointModel(arm))
    assert support.kind == "mounted"
    assert make_plan(PointModel(walker)).stand >= 0.05


def test_a_robot_without_base_mass_is_mounted(cart: RobotDescription) -> None:
    links = tuple(replace(link, inertial=None) if link.name == "base" else link for link in cart.links)
    support = decide(PointModel(replace(cart, links=links)))
    assert (support.kind, support.reason) == ("mounted", "its base has no mass in its file")


def test_an_arm_whose_gripper_hangs_below_its_base_is_mounted() -> None:
    """A robot whose only limb on the floor does not carry its weight is not a walker."""
    box = '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'
    mass = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    links = "".join(f'<link name="{name}">{mass}{box}</link>' for name in ("base", "elbow", "left", "right"))
    joints = "".join(
        f'<joint name="{child}_joint" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{place}"/><axis xyz="0 1 0"/>'
        '<limit lower="-1" upper="1" effort="9" velocity="1"/></joint>'
        for parent, child, place in (
            ("base", "elbow", "0.5 0 0"),
            ("elbow", "left", "0.4 0.1 -0.2"),
            ("elbow", "right", "0.4 -0.1 -0.2"),
        )
    )
    support = decide(PointModel(load_description(f'<robot name="arm">{links}{joints}</robot>')))
    assert support.kind == "mounted"
    assert "reaches the floor" in support.reason


def test_a_root_called_world_is_the_world() -> None:
    text = """<robot name="r"><link name="world"/>
      <link name="box"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
      <joint name="j" type="fixed"><parent link="world"/><child link="box"/></joint>
    </robot>"""
    assert decide(PointModel(load_description(text))).kind == "mounted"


def test_a_free_robot_keeps_its_balance_at_every_moment(cart: RobotDescription) -> None:
    model = PointModel(cart)
    plan = make_plan(model)
    lean = plan.sweeps["lean"]
    assert "a wider sweep would tip the robot" in lean.reasons
    assert 0.0 < lean.share < 1.0
    # 8 kg on a mast at 0.5 m of 20.1 kg in all: the weight is out by 8 * 0.5 sin(lean) / 20.1 m
    assert 8 * 0.5 * np.sin(lean.upper) / 20.1 < plan.support.margin
    for group in plan.groups:
        phase = np.linspace(0, 1, 101)
        poses = model.poses({s.joint: s.at(phase)[0] for s in group.sweeps})
        assert plan.support.margin_at(model.centre_of_mass(poses)).min() > 0.0


def test_a_mounted_robot_clears_the_floor_through_its_whole_range(arm: RobotDescription) -> None:
    model = PointModel(arm)
    plan = make_plan(model)
    assert all(s.share == 1.0 for s in plan.sweeps.values())
    base = -plan.support.lowest + plan.stand
    for group in plan.groups:
        poses = model.poses({s.joint: s.at(np.linspace(0, 1, 201))[0] for s in group.sweeps})
        assert model.lowest(poses).min() + base > 0.0


def test_every_joint_is_moved_or_explained(cart: RobotDescription) -> None:
    plan = make_plan(PointModel(cart))
    moving = {joint.name for joint in cart.joints if joint.is_moving}
    assert set(plan.sweeps) | set(plan.still) == moving
    assert plan.still == {"wave": 'follows "lean"'}
    assert sum(len(group.sweeps) for group in plan.groups) == len(plan.sweeps)

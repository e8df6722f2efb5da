"""How hand-made robots meet the floor: free, supported by legs, or mounted, with hand-computed margins."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from small_robots import joint, link, robot

from roboyard.morphology.point_model import PointModel
from roboyard.morphology.support_mode import SupportMode, decide


def mode(*parts: str) -> SupportMode:
    return decide(PointModel(robot(*parts)))


def table(*parts: str, mass: float = 5.0, centre: str = "0 0 0") -> tuple[str, ...]:
    """A box of 0.4 by 0.2 by 0.1 m around the root frame, with what is added."""
    return (link("base", "box 0.4 0.2 0.1", mass, centre), *parts)


def legged(*, foot: str = "box 0.1 0.1 0.02", legs: int = 4) -> tuple[str, ...]:
    """A trunk 0.5 m above the floor on legs that a hip joint swings."""
    parts = [link("trunk", "box 0.4 0.3 0.1", 5)]
    corners = ((0.2, 0.15), (0.2, -0.15), (-0.2, 0.15), (-0.2, -0.15))[:legs]
    for k, (x, y) in enumerate(corners):
        parts += [
            link(f"foot{k}", foot, 0.1, origin="0 0 -0.5"),
            joint(f"hip{k}", "trunk", f"foot{k}", xyz=f"{x} {y} 0", axis="0 1 0"),
        ]
    return tuple(parts)


def test_a_box_without_joints_is_free_with_its_half_width_as_margin() -> None:
    found = mode(*table())
    assert (found.kind, found.feet) == ("free", ("base",))
    assert found.lowest == pytest.approx(-0.05)
    assert found.margin == pytest.approx(0.1)  # to the long sides at y = +-0.1
    assert "no joints" in found.reason


def test_margins_of_points_are_their_distances_to_the_nearest_side() -> None:
    found = mode(*table())
    points = np.array([[0.0, 0.0, 9.0], [0.15, 0.0, 0.0], [0.0, -0.08, 0.0], [0.25, 0.0, 0.0], [0.0, 0.3, 0]])
    assert found.margin_at(points) == pytest.approx([0.1, 0.05, 0.02, -0.05, -0.2])
    assert found.margin_at(points[None, :2]).shape == (1, 2)


def test_a_robot_without_shapes_is_mounted() -> None:
    found = mode(link("base", mass=1))
    assert (found.kind, found.polygon, found.lowest) == ("mounted", None, 0.0)
    assert found.margin == -np.inf
    assert (found.margin_at(np.zeros((4, 3))) == -np.inf).all()


@pytest.mark.parametrize("name", ["world", "MAP", "odom"])
def test_a_root_that_represents_the_world_is_mounted(name: str) -> None:
    found = mode(link(name), link("arm", "box 0.4 0.4 0.1", 5), joint("j", name, "arm"))
    assert found.kind == "mounted"
    assert f'"{name}"' in found.reason


def test_a_root_named_world_with_a_mass_of_its_own_is_part_of_the_robot() -> None:
    assert mode(link("world", "box 0.4 0.4 0.1", 5)).kind == "free"


def test_shapes_without_collision_cannot_support_a_robot() -> None:
    visual = '<link name="base"><visual><geometry><box size="1 1 1"/></geometry></visual></link>'
    found = mode(visual)
    assert found.kind == "mounted"
    assert "no collision shapes" in found.reason


def test_a_base_without_mass_is_mounted() -> None:
    arm = (link("arm", "box 0.1 0.1 0.1", 1, origin="0 0 0.2"), joint("j", "base", "arm"))
    found = mode(*table(*arm, mass=0.0))
    assert found.kind == "mounted"
    assert "no mass" in found.reason


def test_wheels_that_only_roll_keep_a_cart_free() -> None:
    parts = [link("base", "box 0.3 0.2 0.05", 5)]
    for x, y in ((0.2, 0.2), (0.2, -0.2), (-0.2, 0.2), (-0.2, -0.2)):
        name = f"w{x}{y}"
        parts += [
            link(name, "sphere 0.1", 0.2),
            joint(f"j{name}", "base", name, kind="continuous", xyz=f"{x} {y} 0", axis="0 1 0"),
        ]
    found = mode(*parts)
    assert found.kind == "free"
    assert len(found.feet) == 4
    assert found.lowest == pytest.approx(-0.1, abs=1e-3)
    assert found.margin == pytest.approx(0.2, abs=0.02)
    # the floor pushes at the rim, 10 cm below each axle
    assert all(lever == pytest.approx(0.1, abs=2e-3) for lever in found.levers.values())


def test_two_wheels_without_a_caster_tip_over() -> None:
    parts = [link("base", "box 0.1 0.1 0.1", 5)]
    for side, y in (("l", 0.2), ("r", -0.2)):
        parts += [
            link(side, "sphere 0.1", 0.2),
            joint(f"j{side}", "base", side, kind="continuous", xyz=f"0 {y} 0", axis="0 1 0"),
        ]
    found = mode(*parts)
    assert found.kind == "mounted"
    assert "not over its base" in found.reason


def test_hips_carry_a_robot_and_its_levers_are_its_legs() -> None:
    found = mode(*legged())
    assert found.kind == "supported"
    assert found.lowest == pytest.approx(-0.51)
    assert set(found.levers) == {"hip0", "hip1", "hip2", "hip3"}
    # a corner of the sole is 0.05 m ahead and 0.51 m below the hip's axis
    assert all(lever == pytest.approx(np.hypot(0.05, 0.51)) for lever in found.levers.values())
    assert found.margin == pytest.approx(0.2)
    assert '"hip0" and 3 more' in found.reason


def test_one_limb_that_hangs_below_its_base_is_an_arm_not_a_leg() -> None:
    found = mode(*legged(legs=1))
    assert found.kind == "mounted"
    assert '"foot0"' in found.reason


def test_vertical_slides_carry_a_robot_without_levers() -> None:
    parts = [link("trunk", "box 0.4 0.3 0.1", 5)]
    for k, (x, y) in enumerate(((0.2, 0.15), (0.2, -0.15), (-0.2, 0))):
        parts += [
            link(f"foot{k}", "box 0.1 0.1 0.02", 0.1, origin="0 0 -0.5"),
            joint(f"lift{k}", "trunk", f"foot{k}", kind="prismatic", xyz=f"{x} {y} 0", limits=(-0.2, 0.2)),
        ]
    found = mode(*parts)
    assert found.kind == "supported"
    assert found.levers == {}


def boom(mass: float) -> tuple[str, ...]:
    """A box with a mass on an upright boom of 1 m that a joint tips forward by up to a right angle."""
    return table(
        link("boom", "box 0.05 0.05 0.05", mass, centre="0 0 1", origin="0 0 1"),
        joint("shoulder", "base", "boom", axis="0 1 0", limits=(0.0, 1.5707963)),
    )


def test_an_arm_that_tips_its_base_over_mounts_the_robot() -> None:
    # level, it moves the centre of mass by mass / (5 + mass) metres, of 0.1 m to the side
    assert mode(*boom(0.2)).kind == "free"
    heavy = mode(*boom(3.0))
    assert heavy.kind == "mounted"
    assert '"shoulder" would tip it over' in heavy.reason


@pytest.mark.parametrize(("x", "kind"), [(0.15, "free"), (0.199, "mounted"), (0.5, "mounted")])
def test_the_centre_of_mass_has_to_be_inside_the_base(x: float, kind: str) -> None:
    wheel = (link("lamp", "sphere 0.01", 0.001, origin="0 0 0.3"), joint("j", "base", "lamp"))
    found = mode(*table(*wheel, centre=f"{x} 0 0"))
    assert found.kind == kind
    assert found.margin == pytest.approx(min(0.1, 0.2 - x), abs=1e-3)


def test_a_line_of_contact_has_no_support_polygon() -> None:
    found = mode(link("edge", "box 0.4 0.00001 0.2", 1), link("top"), joint("j", "edge", "top"))
    assert found.polygon is None
    assert found.kind == "mounted"

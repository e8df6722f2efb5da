"""Welds, points and gears hold; bounds let go; distances are those of the shapes."""

import numpy as np
import pytest
from sim_robots import arm, pendulum

from roboyard.errors import RoboyardError, StaleHandleError
from roboyard.sim import World
from roboyard.sim.physics_profile import BULLET, PLAIN
from roboyard.sim.queries.proximity import between_bodies, nearest

PROFILES = pytest.mark.parametrize("profile", [PLAIN, BULLET], ids=["plain", "bullet"])


@PROFILES
def test_a_weld_to_the_world_carries_a_box(profile):
    world = World(profile=profile)
    box = world.add_box((0.2, 0.2, 0.2), (0, 0, 1), mass=2.0)
    held = world.constraints.add_weld(box.links[0], None, position_a=(0.1, 0, 0), position_b=(0.1, 0, 1))
    world.step(240)
    np.testing.assert_allclose(box.position, [0, 0, 1], atol=2e-3)
    assert abs(box.orientation[3]) == pytest.approx(1.0, abs=1e-5)
    assert np.abs(world.constraints.rows.applied(held)[:3]).max() == pytest.approx(2 * 9.81, rel=1e-2)
    world.constraints.set_frame(held, "b", (0.4, 0, 1))
    world.step(480)
    np.testing.assert_allclose(box.position, [0.3, 0, 1], atol=5e-3)
    world.constraints.remove(held)
    world.step(60)
    assert box.position[2] < 0.8
    with pytest.raises(StaleHandleError):
        world.constraints.get(held.id)


@PROFILES
def test_a_point_lets_the_link_swing(profile):
    world = World(profile=profile)
    bar = world.add_box((1.0, 0.05, 0.05), (0.5, 0, 2))
    world.constraints.add_point(bar.links[0], None, position_a=(-0.5, 0, 0), position_b=(0, 0, 2))
    world.step(120)
    from roboyard.transforms import rotate

    end = bar.position + rotate(bar.orientation, np.array([-0.5, 0, 0]))
    np.testing.assert_allclose(end, [0, 0, 2], atol=5e-3)
    assert bar.position[2] < 1.9


@PROFILES
def test_links_of_two_bodies_stay_together(profile):
    world = World(gravity=(0, 0, 0), profile=profile)
    a = world.add_box((0.1, 0.1, 0.1), (0, 0, 1))
    b = world.add_box((0.1, 0.1, 0.1), (0.3, 0, 1))
    world.constraints.add_weld(a.links[0], b.links[0], position_a=(0.3, 0, 0))
    a.set_velocity((0, 0, 0), (0, 0, 1.0))
    world.step(240)
    assert np.linalg.norm(a.position - b.position) == pytest.approx(0.3, abs=5e-3)


def test_force_bounds_let_a_heavy_body_slip():
    world = World(profile=BULLET)
    box = world.add_box((0.2, 0.2, 0.2), (0, 0, 5), mass=2.0)
    held = world.constraints.add_point(box.links[0], None, position_b=(0, 0, 5), max_force=10.0)
    world.step(24)
    t = 24 / 240
    fallen = 0.5 * (9.81 - 5.0) * t * (t + 1 / 240)
    assert 5 - box.position[2] == pytest.approx(fallen, rel=0.03)
    assert np.abs(world.constraints.rows.applied(held)).max() == pytest.approx(10.0, rel=0.02)


@PROFILES
@pytest.mark.parametrize("ratio", [-1.0, 0.5])
def test_gears_couple_velocities(profile, ratio):
    world = World(gravity=(0, 0, 0), profile=profile)
    one = world.add_urdf(pendulum(), (0, 0, 2), fixed_base=True).joint("hinge")
    two = world.add_urdf(pendulum(), (5, 0, 2), fixed_base=True).joint("hinge")
    one.position = 0.4
    world.constraints.add_gear(one, two, ratio)
    two.velocity = 1.0
    world.step(24)
    assert one.velocity + ratio * two.velocity == pytest.approx(0.0, abs=5e-3)
    assert one.velocity != pytest.approx(0.0, abs=0.05)


def test_constraints_are_removed_with_their_body():
    world = World()
    box = world.add_box((0.2, 0.2, 0.2), (0, 0, 1))
    world.constraints.add_weld(box.links[0], None, position_b=(0, 0, 1))
    world.remove(box)
    world.step()
    assert len(world.constraints) == 0 and world.model.neq == 0 and world.model.nsite == 0


def test_nearest_points_of_boxes_and_spheres():
    world = World()
    box = world.add_box((0.2, 0.2, 0.2), (0, 0, 1))
    ball = world.add_sphere(0.1, (0.5, 0.03, 1.02))
    near = nearest(world, box.links[0], ball.links[0], 1.0)
    assert near.distance == pytest.approx(0.3, abs=1e-4)
    np.testing.assert_allclose(near.point_a, [0.1, 0.03, 1.02], atol=1e-3)
    np.testing.assert_allclose(near.point_b, [0.4, 0.03, 1.02], atol=1e-3)
    np.testing.assert_allclose(near.normal, [-1, 0, 0], atol=1e-3)
    assert nearest(world, box.links[0], ball.links[0], 0.2) is None
    ball.set_pose((0.15, 0, 1))
    assert nearest(world, box.links[0], ball.links[0], 1.0).distance == pytest.approx(-0.05, abs=1e-3)


def test_nearest_points_of_whole_bodies():
    world = World()
    robot = world.add_urdf(arm(), (0, 0, 3), fixed_base=True)
    floor = world.add_plane()
    (near,) = between_bodies(world, robot, floor, 5.0)
    assert near.link_a.name == "lower"
    assert near.distance == pytest.approx(2.0 - 0.45, abs=1e-3)


def test_a_constraint_that_is_removed_before_a_step_costs_no_compile():
    world = World(profile=BULLET)
    box = world.add_box((0.2, 0.2, 0.2), (0, 0, 1))
    kept = world.constraints.add_weld(box.links[0], None, position_b=(0, 0, 1))
    world.step()
    revision = world.revision
    for _ in range(3):
        a, b = (world.constraints.add_point(box.links[0], None, position_b=(0, 0, 1)) for _ in range(2))
        world.constraints.set_frame(a, "b", (0, 0, 2))
        assert world.is_stale
        world.constraints.remove(a)
        world.constraints.remove(b)
        world.step()
        assert world.revision == revision
    assert world.constraints.all == (kept,)
    np.testing.assert_allclose(box.position, [0, 0, 1], atol=1e-4)


@pytest.mark.parametrize(
    ("change", "speed"),
    [
        (lambda world, box: setattr(world, "gravity", (0, 0, -3.0)), -1.0 - 3.0 / 240),
        (lambda world, box: setattr(world, "timestep", 0.01), -1.0 - 0.0981),
        (lambda world, box: box.links[0].set_damping(linear=24.0), -1.0 - 9.81 / 240 + 0.1),
    ],
    ids=["gravity", "timestep", "damping"],
)
def test_numbers_that_change_before_a_new_constraint_is_removed_hold(change, speed):
    world = World(profile=BULLET)
    box, other = (world.add_box((0.2, 0.2, 0.2), (x, 0, 5)) for x in (0, 3))
    kept = world.constraints.add_weld(other.links[0], None, position_b=(3, 0, 5))
    world.step()
    constraint = world.constraints.add_point(box.links[0], None, position_b=(0, 0, 5))
    change(world, box)
    box.links[0].friction = 0.25
    world.constraints.set_frame(kept, "b", (3, 0, 5.1))
    world.constraints.remove(constraint)
    box.set_velocity((0, 0, -1))
    world.step()
    assert box.velocity[0][2] == pytest.approx(speed, rel=1e-9)
    assert world.live_model.geom_friction[box.links[0].geom_ids[0], 0] == 0.25
    assert other.velocity[0][2] > 0.1


def test_an_edit_before_or_after_a_constraint_that_is_removed_is_compiled():
    for order in ((0, 1), (1, 0)):
        world = World()
        box = world.add_box((0.2, 0.2, 0.2), (0, 0, 1))
        world.step()
        held = None
        for what in order:
            if what:
                world.add_box((0.2, 0.2, 0.2), (2, 0, 1), mass=3.0)
            else:
                held = world.constraints.add_weld(box.links[0], None)
        world.constraints.remove(held)
        assert world.model.nbody == 3
        assert world.model.neq == world.model.nsite == 0


def test_new_constraints_are_in_the_spec_when_it_is_read():
    world = World()
    a, b = (world.add_box((0.2, 0.2, 0.2), (x, 0, 1)) for x in (0, 2))
    place = np.array([0.0, 0.0, 0.1])
    world.constraints.add_weld(a.links[0], b.links[0], position_a=place)
    place[:] = 9.0  # the caller's own
    lost = world.constraints.add_point(b.links[0], None)
    assert [element.name for element in world.spec.equalities] == ["constraint1", "constraint2"]
    np.testing.assert_allclose(world.spec.site("constraint1/a").pos, [0, 0, 0.1])
    world.constraints.remove(lost)
    assert world.model.neq == 1
    world.constraints.add_point(b.links[0], None)
    world.remove(b)
    assert world.model.neq == 0


def test_constraints_between_gears_keep_the_order_of_their_ids():
    world = World()
    robot = world.add_description(arm(), fixed_base=True)
    first = world.constraints.add_point(robot.links[-1], None)
    gear = world.constraints.add_gear(robot.joints[0], robot.joints[1], 1.0)
    last = world.constraints.add_weld(robot.links[-1], None)
    world.step()
    assert [c.element.id for c in (first, gear, last)] == [1, 2, 3]  # after the mimic


def test_frames_of_new_constraints_are_checked():
    world = World()
    box = world.add_box((0.2, 0.2, 0.2))
    for position in ((0, 0), np.zeros((3, 1))):
        with pytest.raises(RoboyardError, match="three numbers"):
            world.constraints.add_point(box.links[0], None, position_a=position)
    with pytest.raises(RoboyardError, match="finite"):
        world.constraints.add_point(box.links[0], None, position_b=(0, 0, np.nan))
    with pytest.raises(ValueError, match="length above 0"):
        world.constraints.add_weld(box.links[0], None, orientation_a=(0, 0, 0, 0))
    assert not world.constraints.all


@PROFILES
def test_a_moved_frame_stays_where_it_is_through_compiles(profile):
    world = World(profile=profile)
    box = world.add_box((0.2, 0.2, 0.2), (0, 0, 1), mass=2.0)
    held = world.constraints.add_weld(box.links[0], None, position_b=(0, 0, 1))
    world.step()
    half = np.sin(np.pi / 8), np.cos(np.pi / 8)
    world.constraints.set_frame(held, "b", (0.0, 0.2, 1), (0, 0, *half))
    world.add_plane()
    world.step(480)
    np.testing.assert_allclose(box.position, [0, 0.2, 1], atol=5e-3)
    np.testing.assert_allclose(np.abs(box.orientation), [0, 0, *half], atol=1e-3)
    world.constraints.set_frame(held, "b", (0.1, 0.2, 1))
    site = world.spec.site(f"constraint{held.id}/b")
    np.testing.assert_allclose(site.pos, [0.1, 0.2, 1])
    np.testing.assert_allclose(site.quat, [half[1], 0, 0, half[0]])
    with pytest.raises(RoboyardError, match="finite"):
        world.constraints.set_frame(held, "b", (np.nan, 0, 0))
    world.step(480)
    np.testing.assert_allclose(box.position, [0.1, 0.2, 1], atol=5e-3)


@PROFILES
def test_rows_of_a_removed_constraint_serve_the_next_one_without_a_compile(profile):
    world = World(profile=profile)
    boxes = [world.add_box((0.2, 0.2, 0.2), (x, 0, 5), mass=1.0) for x in (0, 2, 4)]
    world.step()
    held = world.constraints.add_weld(boxes[0].links[0], None, position_b=(0, 0, 5))
    world.step(20)
    revision, model = world.revision, world.live_model
    for box in (boxes[1], boxes[2], boxes[0]):
        world.constraints.remove(held)
        start, speed = world.time, np.array([b.velocity[0][2] for b in boxes])
        world.step(24)
        fallen = np.array([b.velocity[0][2] for b in boxes]) - speed
        np.testing.assert_allclose(fallen, -9.81 * (world.time - start), rtol=2e-2)
        place, turn = box.pose
        held = world.constraints.add_weld(box.links[0], None, position_b=place, orientation_b=turn)
        assert not world.is_stale
        assert not np.any(world.constraints.rows.applied(held))
        world.step(240)
        np.testing.assert_allclose(box.position, place, atol=2e-2)
        assert world.constraints.rows.applied(held)[2] == pytest.approx(9.81, rel=1e-2)
    assert world.revision == revision and world.live_model is model
    assert [equality.name for equality in world.spec.equalities] == [f"constraint{held.id}"]
    assert world.spec.site(f"constraint{held.id}/a").parent.name == boxes[0].links[0]._built.element.name
    place = boxes[0].position
    world.step(24)
    np.testing.assert_allclose(boxes[0].position, place, atol=1e-3)
    world.constraints.remove(held)
    assert world.model.neq == world.model.nsite == 0


def test_a_restored_state_neither_brings_back_a_removed_constraint_nor_drops_a_new_one():
    world = World(profile=BULLET)
    boxes = [world.add_box((0.2, 0.2, 0.2), (x, 0, 5), mass=1.0) for x in (0, 2)]
    first, second = (
        world.constraints.add_point(box.links[0], None, position_b=(x, 0, 5))
        for box, x in zip(boxes, (0, 2), strict=True)
    )
    world.step()
    held = world.save_state()
    world.constraints.remove(first)
    free = world.save_state()
    world.restore_state(held)
    world.step(48)
    assert boxes[0].position[2] < 4.9 and boxes[1].position[2] == pytest.approx(5.0, abs=1e-3)
    world.restore_state(held)
    world.constraints.add_point(boxes[0].links[0], None, position_b=(0, 0, 5))
    world.restore_state(free)
    world.step(48)
    np.testing.assert_allclose([box.position[2] for box in boxes], 5.0, atol=1e-3)
    world.constraints.remove(second)
    world.step(48)
    assert boxes[1].position[2] < 4.9


def test_a_body_whose_constraint_ended_can_be_removed():
    for profile in (BULLET, None):
        world = World() if profile is None else World(profile=profile)
        a, b = (world.add_box((0.2, 0.2, 0.2), (x, 0, 5), mass=1.0) for x in (0, 2))
        held = world.constraints.add_point(a.links[0], None, position_b=(0, 0, 5))
        world.step()
        world.constraints.remove(held)
        world.remove(a)
        world.step()
        world.constraints.add_point(b.links[0], None, position_b=(2, 0, 5))
        world.step(48)
        np.testing.assert_allclose(b.position, [2, 0, 5], atol=1e-2)

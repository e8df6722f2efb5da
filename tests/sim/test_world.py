"""Bodies come, fall, rest, go; nothing else is disturbed."""

import numpy as np
import pytest
from sim_robots import arm, pendulum

from roboyard.description.model import Box, Link, Pose, RobotDescription, Visual
from roboyard.errors import ModelError, RoboyardError, StaleHandleError
from roboyard.sim import World
from roboyard.sim.physics_profile import BULLET, PLAIN


def test_free_fall_follows_semi_implicit_euler():
    world = World(timestep=0.01, gravity=(0, 0, -10))
    ball = world.add_sphere(0.1, (0, 0, 100))
    world.step(50)
    n = 50
    assert ball.position[2] == pytest.approx(100 - 10 * 0.01**2 * n * (n + 1) / 2, abs=1e-9)
    assert ball.velocity[0][2] == pytest.approx(-5.0)
    assert world.time == pytest.approx(0.5)


@pytest.mark.parametrize("solver", ["newton", "cg"])
def test_objects_rest_on_the_floor(solver):
    world = World(solver=solver)
    floor = world.add_plane()
    objects = {
        0.1: world.add_box((0.2, 0.2, 0.2), (0, 0, 0.15)),
        0.12: world.add_sphere(0.12, (1, 0, 0.2)),
        0.15: world.add_cylinder(0.1, 0.3, (2, 0, 0.2)),
        0.25: world.add_capsule(0.1, 0.3, (3, 0, 0.3)),
    }
    world.step(480)
    for height, item in objects.items():
        assert item.position[2] == pytest.approx(height, abs=1e-4 if solver == "newton" else 1e-3)
        assert np.linalg.norm(item.velocity[0]) < 1e-3
        weight = sum(contact.normal_force for contact in world.contacts(item, floor))
        assert weight == pytest.approx(9.81, rel=1e-3)


def test_contacts_name_both_sides_and_point_from_a_to_b():
    world = World()
    floor, box = world.add_plane(), world.add_box((0.2, 0.2, 0.2), (0, 0, 0.1))
    world.step(200)
    contacts = world.contacts(box)
    assert len(contacts) == 4
    for contact in contacts:
        assert contact.body_a is box and contact.body_b is floor
        np.testing.assert_allclose(contact.normal, [0, 0, -1], atol=1e-6)
        assert contact.distance < 0
    np.testing.assert_allclose(world.contacts(floor)[0].normal, [0, 0, 1], atol=1e-6)


def test_adding_and_removing_keeps_the_state_of_other_bodies():
    world = World()
    first = world.add_sphere(0.1, (0, 0, 10))
    second = world.add_sphere(0.1, (1, 0, 10))
    swing = world.add_urdf(pendulum(), (5, 0, 3), fixed_base=True)
    swing.joint("hinge").position = 0.7
    first.set_velocity((1, 2, 3), (0.1, 0.2, 0.3))
    world.step(7)
    before = (first.pose, first.velocity, swing.joint_positions, swing.joint_velocities, world.time)
    world.remove(second)
    third = world.add_box((0.1, 0.1, 0.1), (2, 0, 10))
    after = (first.pose, first.velocity, swing.joint_positions, swing.joint_velocities, world.time)
    for a, b in zip(before[:4], after[:4], strict=True):
        np.testing.assert_array_equal(np.hstack(a), np.hstack(b))
    assert before[4] == after[4]
    assert world.bodies == (first, swing, third)
    with pytest.raises(StaleHandleError, match="removed"):
        _ = second.pose
    with pytest.raises(StaleHandleError, match="not in this world"):
        world.remove(second)


def test_saved_states_come_back_bit_for_bit():
    world = World()
    world.add_plane()
    box = world.add_box((0.2, 0.2, 0.2), (0, 0, 0.5), (0.1, 0.2, 0.3, 0.9))
    swing = world.add_urdf(arm(), (3, 0, 3), fixed_base=True)
    swing.joint("elbow").drive_position(0.5)
    world.step(40)
    saved = world.save_state()

    def run():
        world.step(200)
        return np.hstack([*box.pose, swing.joint_positions, world.time])

    first = run()
    world.restore_state(saved)
    np.testing.assert_array_equal(run(), first)


def test_restoring_into_another_set_of_bodies_is_rejected():
    world = World()
    ball = world.add_sphere(0.1, (0, 0, 1))
    saved = world.save_state()
    world.remove(ball)
    world.add_sphere(0.1, (0, 0, 1))
    with pytest.raises(ModelError, match="other bodies"):
        world.restore_state(saved)


def test_two_equal_worlds_run_alike():
    def run():
        world = World()
        world.add_plane()
        boxes = [
            world.add_box((0.2, 0.2, 0.2), (0.03 * k, 0, 0.2 + 0.25 * k), (0, 0, 0.1 * k, 1))
            for k in range(6)
        ]
        world.step(240)
        return np.stack([box.position for box in boxes])

    np.testing.assert_array_equal(run(), run())


def test_worlds_are_independent():
    one, two = World(), World(gravity=(0, 0, 0))
    a, b = one.add_sphere(0.1, (0, 0, 5)), two.add_sphere(0.1, (0, 0, 5))
    one.step(100)
    two.step(1)
    assert a.position[2] < 4.5 and b.position[2] == 5.0


def test_moved_static_bodies_stay_after_a_recompile():
    world = World()
    table = world.add_box((1, 1, 0.1), (0, 0, 0.5), mass=0)
    world.step()
    table.set_pose((0, 0, 0.8))
    assert world.ray((0, 0, 2), (0, 0, 0)).position[2] == pytest.approx(0.85)
    world.add_sphere(0.1, (5, 0, 1))
    assert table.position[2] == pytest.approx(0.8)
    assert world.ray((0, 0, 2), (0, 0, 0)).position[2] == pytest.approx(0.85)


def test_unknown_names_list_the_known():
    world = World()
    robot = world.add_urdf(arm())
    with pytest.raises(RoboyardError, match="no joint named 'elbo'; did you mean 'elbow'"):
        robot.joint("elbo")
    with pytest.raises(RoboyardError, match="no link named 'x'"):
        robot.link("x")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda w: w.add_box((1, 0, 1)), "positive"),
        (lambda w: w.add_sphere(0.1, mass=float("nan")), "mass"),
        (lambda w: w.add_heightfield(np.zeros(4), (1, 1)), "2 by 2"),
        (lambda w: w.add_plane((0, 0, 0)), "normal"),
        (lambda w: setattr(w, "timestep", 0), "positive"),
        (lambda w: setattr(w, "gravity", (0, 0)), "three"),
        (lambda w: w.add_urdf(arm(), scale=0), "scale"),
    ],
)
def test_impossible_arguments_are_rejected_with_the_expected_values(call, message):
    with pytest.raises(RoboyardError, match=message):
        call(World())


def test_a_diverged_simulation_names_the_body():
    world = World()
    ball = world.add_sphere(0.1, (0, 0, 1), name="runaway")
    ball.set_velocity((1e200, 0, 0))
    with pytest.raises(ModelError, match="runaway"):
        world.step()


def test_a_failed_build_leaves_no_trace(tmp_path):
    from roboyard.description.model import Collision, Link, Mesh, RobotDescription

    world = World()
    ball = world.add_sphere(0.1, (0, 0, 5))
    broken = tmp_path / "broken.stl"
    broken.write_bytes(b"solid nothing")
    link = Link(name="base", collisions=(Collision(geometry=Mesh(uri="broken.stl", path=broken)),))
    with pytest.raises(RoboyardError):
        world.add_urdf(RobotDescription(name="bad", links=(link,)))
    world.step(10)
    assert world.bodies == (ball,) and world.model.nbody == 2


def test_many_cycles_leave_no_meshes_behind():
    from roboyard.shapes import primitives

    world = World()
    for _ in range(5):
        body = world.add_mesh(primitives.capsule(0.1, 0.3), (0, 0, 1))
        world.step()
        world.remove(body)
    world.step()
    assert world.model.nmesh == 0 and world.model.nbody == 1


@pytest.mark.parametrize("profile", [PLAIN, BULLET], ids=["plain", "bullet"])
def test_a_heap_of_boxes_comes_to_rest(profile):
    """Boxes dropped in leaning columns, some of them overlapping: no energy comes out of nothing."""
    rng = np.random.default_rng(4)
    world = World(profile=profile, visual_geoms=False)
    world.add_plane()
    boxes = [
        world.add_box(
            (0.2, 0.2, 0.2),
            (0.25 * (k % 4) + rng.uniform(-0.04, 0.04), 0.25 * (k // 4 % 4), 0.15 + 0.25 * (k // 16)),
        )
        for k in range(64)
    ]
    assert world.solver == ("cg" if profile is PLAIN else "newton")  # Bullet's rounds need no other
    fastest = 0.0
    for _ in range(24):
        world.step(30)
        fastest = max(fastest, float(np.abs(world.data.qvel[:3]).max()))
    speeds = np.array([np.linalg.norm(box.velocity[0]) for box in boxes])
    heights = np.array([box.position[2] for box in boxes])
    assert np.median(speeds) < 1e-3 and (speeds < 0.05).mean() > 0.9
    assert fastest < 8.0
    assert heights.min() > 0.097


LEGGED = """<robot name="legged"><link name="base"><inertial><mass value="5"/>
<inertia ixx="0.05" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial>
<collision><geometry><box size="0.4 0.2 0.1"/></geometry></collision></link>{}</robot>"""
LEG = """<link name="{0}a"><inertial><mass value="0.05"/>
<inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link>
<link name="{0}b"><inertial><mass value="0.05"/>
<inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial>
<collision><geometry><sphere radius="0.02"/></geometry></collision></link>
<joint name="{0}1" type="revolute"><parent link="base"/><child link="{0}a"/><origin xyz="{1} {2} -0.05"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="20" velocity="10"/></joint>
<joint name="{0}2" type="revolute"><parent link="{0}a"/><child link="{0}b"/><origin xyz="0 0 -0.1"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="20" velocity="10"/></joint>"""


@pytest.mark.parametrize("profile", [PLAIN, BULLET], ids=["plain", "bullet"])
def test_a_robot_stands_among_many_as_it_stands_alone(profile, tmp_path):
    """The contacts of a robot do not soften with the number of joints beside it."""
    feet = [("a", 0.2, 0.1), ("b", 0.2, -0.1), ("c", -0.2, 0.1), ("d", -0.2, -0.1)]
    file = tmp_path / "legged.urdf"
    file.write_text(LEGGED.format("".join(LEG.format(*foot) for foot in feet)))
    found = []
    for count in (1, 20):
        world = World(profile=profile, visual_geoms=False)
        world.add_plane()
        robots = [world.add_urdf(file, (k, 0, 0.18), fixed_base=False) for k in range(count)]
        for joint in (joint for robot in robots for joint in robot.joints):
            if profile.pid_drives:
                joint.drive_position(0.0)
            else:
                world.motors.set(joint, position=0.0, max_force=20.0)
        world.step(120)
        assert (world.live_model.nv >= 250) == (count == 20)
        assert world.solver == "newton"
        found.append(robots[0].position[2])
    assert found[1] == pytest.approx(found[0], abs=1e-6)


def test_colours_apply_in_the_order_in_which_they_were_given():
    world = World()
    description = RobotDescription(
        name="pair",
        links=(
            Link(
                name="base",
                visuals=tuple(
                    Visual(geometry=Box(size=(0.1, 0.1, 0.1)), origin=Pose(position=(x, 0, 0)))
                    for x in (0, 1)
                ),
            ),
        ),
    )
    body, lost = (world.add_description(description, fixed_base=True) for _ in range(2))
    red, green, blue = ((1.0, 0, 0, 1), (0, 1.0, 0, 1), (0, 0, 1.0, 0.5))
    shapes = world.render_shapes
    revision = world.render_scene().revision
    for given, expected in (
        (((-1, red),), [red, red]),
        (((-1, red), (0, blue)), [blue, red]),
        (((-1, red), (0, blue), (-1, red)), [red, red]),
        (((0, blue), (1, green), (7, green), (0, green)), [green, green]),
    ):
        for place, rgba in given:
            shapes.recolor(body, 0, place, rgba)
        shapes.recolor(lost, 0, -1, blue)
        assert [look.shape.rgba for look in shapes.of(body)[0]] == expected
        drawn = world.render_scene()
        assert [shape.rgba for shape in drawn.shapes[:2]] == expected
        assert drawn.revision > revision
        revision = drawn.revision
    shapes.recolor(body, 0, -1, green)
    assert world.render_scene().revision == revision
    shapes.recolor(lost, 0, -1, red)
    world.remove(lost)
    assert [shape.rgba for shape in world.render_scene().shapes] == [green, green]

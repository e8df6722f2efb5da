"""The flat: doors and drawers open, rooms are joined, nothing overlaps, idle costs nothing."""

from __future__ import annotations

import time

import numpy as np
import pytest

from roboyard.scenes import Scene, home


def test_doors_and_drawers_have_joints(flat: Scene) -> None:
    names = set(flat.joints)
    for door in ("front_door", "bedroom_door", "bathroom_door", "study_door"):
        assert f"{door}/hinge" in names
    assert sum("drawer" in name.split("/")[1] for name in names) >= 20
    assert "refrigerator/door_0" in names and "wardrobe/door_1" in names


def test_no_bodies_overlap_and_all_come_to_rest(flat: Scene) -> None:
    assert flat.world.data.ntree_awake == 0
    for name, joint in flat.joints.items():
        assert abs(joint.position) < 2e-3, name


def test_free_objects_stay_on_their_tables() -> None:
    scene = home()
    before = {name: body.position for name, body in scene.bodies.items() if not body.is_fixed}
    assert {"mug", "plate", "bowl", "apple", "chair_1", "novel"} <= set(before)
    scene.world.step(480)
    for name, was in before.items():
        assert np.linalg.norm(scene.body(name).position - was) < 0.04, name


@pytest.mark.parametrize("kind", ["hinge", "drawer", "door"])
def test_doors_and_drawers_open_under_a_small_force(kind: str) -> None:
    """Pulled along its way from outside, each gets to the end of its range with the others closed."""
    scene = home()
    world = scene.world
    stuck = []
    for name, joint in scene.joints.items():
        if not name.split("/")[1].startswith(kind):
            continue
        end = joint.limits[1]
        saved = world.save_state()
        torque = 30.0 if joint.type == "prismatic" else 8.0
        for _ in range(600):
            world.data.qfrc_applied[joint.dof_slice] = torque
            world.step()
            if joint.position > 0.97 * end:
                break
        reached = joint.position
        world.data.qfrc_applied[:] = 0.0
        world.restore_state(saved)
        if not reached > 0.97 * end:
            stuck.append(f"{name} stops at {reached:.3f} of {end:.3f}")
    assert not stuck


def test_a_closed_door_blocks_and_an_open_one_lets_through(flat: Scene) -> None:
    world, hinge = flat.world, flat.joints["bedroom_door/hinge"]
    y, z = flat.rooms["bedroom"][1], 0.8
    start, end = (-1.75, -0.4, z), (-1.75, y, z)
    hit = world.ray(start, end)
    assert hit is not None and hit.body is flat.body("bedroom_door")
    saved = world.save_state()
    hinge.position = hinge.limits[1]
    assert world.ray(start, end) is None
    world.restore_state(saved)


def test_a_robot_can_go_from_room_to_room(flat: Scene) -> None:
    """With every room door open, a disc of 0.3 m reaches all rooms on a grid of free places."""
    world = flat.world
    saved = world.save_state()
    for name, joint in flat.joints.items():
        if name.endswith("/hinge"):
            joint.position = joint.limits[1]
    cell, radius = 0.1, 0.3
    xs, ys = np.arange(-4.4, 4.45, cell), np.arange(-3.5, 3.55, cell)
    blocked = np.zeros((len(xs), len(ys)), dtype=bool)
    for z in (0.1, 0.4, 0.9):
        for k, y in enumerate(ys):
            hits = world.rays(np.array([[x, y, z] for x in xs]), np.array([[x + cell, y, z] for x in xs])).hit
            blocked[:, k] |= hits
        for i, x in enumerate(xs):
            hits = world.rays(np.array([[x, y, z] for y in ys]), np.array([[x, y + cell, z] for y in ys])).hit
            blocked[i] |= hits
    world.restore_state(saved)
    from scipy.ndimage import distance_transform_edt, label

    free = distance_transform_edt(~blocked) * cell > radius
    areas, _ = label(free)
    at = {
        room: areas[np.argmin(np.abs(xs - x)), np.argmin(np.abs(ys - y))]
        for room, (x, y) in flat.rooms.items()
    }
    assert 0 not in at.values(), at
    assert len(set(at.values())) == 1, at


def test_objects_in_a_drawer_move_with_it() -> None:
    scene = home()
    joint = scene.joints["dresser/drawer_3"]
    drawer = scene.body("dresser").link("drawer_3_box")
    joint.position = 0.23
    low, high = 0.62, 0.85
    x, y, _ = scene.body("dresser").position
    # the dresser's front faces +y: the open part of the drawer is beyond it
    ball = scene.world.add_sphere(0.03, (x, y + 0.18 + 0.12, high + 0.05), mass=0.1)
    scene.world.step(480)
    assert low < ball.position[2] < high
    was = ball.position[1]
    for _ in range(480):
        scene.world.data.qfrc_applied[joint.dof_slice] = -20.0
        scene.world.step()
    assert joint.position < 0.05
    assert ball.position[1] < was - 0.1
    assert drawer.pose[0][1] < was


def test_an_idle_flat_steps_far_faster_than_real_time(flat: Scene) -> None:
    start = time.process_time()
    flat.world.step(1200)
    assert time.process_time() - start < 1.0, "5 s of an idle flat; twenty times faster on a quiet machine"

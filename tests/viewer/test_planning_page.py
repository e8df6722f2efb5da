"""The page on which a goal is dragged: motions are planned again at once, shown, and taken."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from roboyard.assets import assets_root
from roboyard.description import load_description
from roboyard.kinematics import forward_kinematics
from roboyard.planning import PoseGoal, planner_for
from roboyard.planning.checking import CollisionChecker
from roboyard.robots import add_robot
from roboyard.sim import World

sys.path.insert(0, str(Path(__file__).parent))
import chromium

pytest.importorskip("viser")
from roboyard.viewer.planning import PlanningPage
from roboyard.viewer.planning.clearance_layer import nearest_links


@pytest.fixture
def page() -> Iterator[PlanningPage]:
    world = World()
    world.add_plane()
    world.add_box((0.1, 0.5, 0.8), (0.45, 0.0, 0.4), mass=0.0, name="wall")
    robot = add_robot(world, load_description(assets_root() / "arm7" / "arm7.urdf"))
    robot.reset()
    planner = planner_for(robot)
    made = PlanningPage(
        planner, goal=PoseGoal(link=planner.tool, position=(0.3, 0.45, 0.4)), port=0, quiet=True
    )
    yield made
    made.close()


def tool_place(page: PlanningPage) -> np.ndarray:
    return np.asarray(page.robot.body.link(page.link).pose[0])


def test_a_dragged_goal_is_planned_to_and_the_motion_is_shown(page: PlanningPage, browser, wait) -> None:
    tab = browser(page.viewer)
    page.tick(0.02)
    assert page.plan is not None
    assert page.plan.solved
    assert page.plans == 1
    page.tick(0.02)
    assert page.plans == 1  # nothing has moved
    copies = page.ghost.nodes
    assert len(copies) >= 6
    now = page._now
    last = now.vector(page.plan.path[-1])
    for link, node in copies.items():
        pose = now.obstacles.root @ forward_kinematics(now.robot.chain, last, link)
        np.testing.assert_allclose(node.batched_positions[-1], pose[:3, 3], atol=1e-5)
    tab.send(
        type="TransformControlsUpdateMessage",
        name=page.handle.name,
        wxyz=(1.0, 0.0, 0.0, 0.0),
        position=(0.3, -0.45, 0.5),
    )

    def planned_again() -> bool:
        page.tick(0.02)  # the browser's message arrives in another thread
        return page.plans == 2

    wait(planned_again)
    assert page.plan.solved
    end = now.obstacles.root @ forward_kinematics(now.robot.chain, now.vector(page.plan.path[-1]), page.link)
    np.testing.assert_allclose(end[:3, 3], (0.3, -0.45, 0.5), atol=2e-4)
    assert "planned in" in page.status.content


def test_the_robot_takes_the_motion_and_plans_from_where_it_is(page: PlanningPage) -> None:
    page.tick(0.02)
    page.move()
    for _ in range(1000):
        page.tick(0.02)
        if page.plans == 2:
            break
    np.testing.assert_allclose(tool_place(page), (0.3, 0.45, 0.4), atol=1e-3)
    assert page.plan is not None
    assert page.plan.trajectory is not None
    page.reset()
    page.tick(0.02)
    assert page.plans == 3
    assert page.plan.solved


def test_a_goal_that_is_out_of_reach_says_why_and_shows_nothing(page: PlanningPage) -> None:
    page.tick(0.02)
    page.set_goal((3.0, 0.0, 0.4))
    page.tick(0.02)
    assert page.plan is not None
    assert page.plan.outcome == "goal unreachable"
    assert "goal unreachable" in page.status.content
    assert not page.ghost.nodes
    page.set_goal((0.3, 0.45, 0.4))
    page.tick(0.02)
    assert page.ghost.nodes


def test_spheres_and_distances_are_those_of_the_planner(page: PlanningPage) -> None:
    page.spheres_box.value = True
    page.along_slider.value = 0.5
    page.tick(0.02)
    assert page.plan is not None
    assert page.plan.trajectory is not None
    now = page._now
    q = now.vector(page.plan.trajectory.at(0.5 * page.plan.trajectory.duration)[0])
    checker = CollisionChecker(now.robot, now.obstacles)
    found = checker.clearance(q)
    assert len(page.clearances.node.batched_positions) == len(found.radii)
    link, gap = nearest_links(found)[0]
    assert gap >= 0.0
    assert checker.distance(q)[0] <= gap + 1e-12
    assert f"{1e3 * gap:.0f} mm" in page.status.content
    floor = found.centers[:, 2] - found.radii  # the floor is at z = 0
    lowest = floor[found.of_link == found.links.index(link)].min()
    assert gap <= lowest + 1e-9
    page.spheres_box.value = page.ghost_box.value = False
    page.draw()
    assert page.clearances.node is None
    assert not page.ghost.nodes


@pytest.mark.slow
@pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium")
def test_in_chromium(page: PlanningPage, tmp_path: Path) -> None:
    shown = chromium.Page(page.viewer.url, tmp_path / "profile")
    try:
        tick = lambda: page.tick(0.02)  # noqa: E731
        chromium.until(lambda: page.viewer.watchers == 1, tick=tick)
        chromium.until(lambda: page.plans >= 1, tick=tick)
        chromium.until(lambda: shown.place_of(shown.with_text("Move")), tick=tick)
        chromium.until(lambda: shown.evaluate("document.body.textContent.includes('planned in')"), tick=tick)
        chromium.until(lambda: np.ptp(shown.picture()) > 100, tick=tick)

        def difference() -> float:
            return float((np.abs(shown.picture() - before).max(axis=2) > 8).mean())

        page.ghost_box.value = False
        page.draw()
        for _ in range(20):
            tick()
        before = shown.picture()
        shown.click_on(shown.with_text("swept ghost"), tick=tick)
        chromium.until(lambda: page.ghost.nodes and difference() > 0.004, tick=tick)
        place = tool_place(page)
        shown.click_on(shown.with_text("Move"), tick=tick)
        chromium.until(lambda: page.plans >= 2, tick=tick)
        assert np.linalg.norm(tool_place(page) - place) > 0.05
    finally:
        shown.close()

"""Handles that plan: an arm goes around what is between it and the place where its handle is let go."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from roboyard.viewer.driving import DrivingPage

pytest.importorskip("viser")
ARM = "arm_left"
DROP = np.array([0.0, 0.0, -0.30])
"""From the end effector to the goal, through the bar (m)."""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[DrivingPage, Any]]:
    """Return R1 with a bar below its left hand, and the bar."""
    page = DrivingPage(
        {"scene": "empty", "robot": "r1"}, port=0, folder=tmp_path_factory.mktemp("folder"), quiet=True
    )
    bar = page.world.add_box((0.5, 0.03, 0.03), (0.60, 0.28, 1.09), mass=0)
    page._start = page.world.save_state()
    yield page, bar
    page.close()


def run(page: DrivingPage, bar: Any, seconds: float) -> int:
    """Run a page; return in how many pictures the robot touched the bar."""
    touched = 0
    for _ in range(round(seconds * 30)):
        page.tick(1 / 30)
        touched += bool(page.world.contacts(bar))
    return touched


def begin(served: tuple[DrivingPage, Any], *, plans: bool) -> tuple[DrivingPage, Any]:
    """Put the robot back to its start; return the page and the bar."""
    page, bar = served
    page.reset()
    page.set_planning(plans)
    run(page, bar, 0.5)
    return page, bar


def drag(page: DrivingPage, tab: Any, wait: Any) -> np.ndarray:
    """Drag the handle below the bar and let it go; return its (4, 4) pose in the base frame."""
    handle = page.ik_handles.handles[ARM]
    goal = page.action_source.end_effector_pose(ARM)
    goal[:3, 3] += DROP
    tab.send(type="TransformControlsDragStartMessage", name=handle.name)
    tab.send(
        type="TransformControlsUpdateMessage",
        name=handle.name,
        position=tuple(goal[:3, 3].tolist()),
        wxyz=tuple(float(value) for value in handle.wxyz),
    )
    wait(lambda: np.allclose(handle.position, goal[:3, 3]))
    tab.send(type="TransformControlsDragEndMessage", name=handle.name)
    return goal


def error(page: DrivingPage, goal: np.ndarray) -> float:
    return float(np.abs(page.action_source.end_effector_pose(ARM) - goal).max())


def test_without_a_plan_the_arm_is_stopped_by_the_bar(served, browser, wait) -> None:
    page, bar = begin(served, plans=False)
    goal = drag(page, browser(page.viewer), wait)
    wait(lambda: ARM in page.action_source.targets)
    assert run(page, bar, 3.0) > 10
    assert error(page, goal) > 0.1


def test_with_a_plan_it_goes_around_and_arrives(served, browser, wait) -> None:
    page, bar = begin(served, plans=True)
    goal = drag(page, browser(page.viewer), wait)
    wait(lambda: page.requests.execute_all() >= 0 and page.planned_moves.moves(ARM))
    assert "planned in" in page.panel.status.content
    handle = page.ik_handles.handles[ARM]
    assert run(page, bar, 1.0) == 0
    np.testing.assert_allclose(handle.position, goal[:3, 3], atol=1e-6)  # it waits at the goal
    assert run(page, bar, 3.0) == 0
    assert error(page, goal) < 2e-3
    assert not page.planned_moves.moves(ARM)
    run(page, bar, 1.0)
    assert error(page, goal) < 2e-3  # and stays there


def test_what_cannot_be_reached_is_said_and_the_handle_returns(served) -> None:
    page, bar = begin(served, plans=True)
    before = page.action_source.end_effector_pose(ARM)
    far = before.copy()
    far[:3, 3] += (3.0, 0.0, 0.0)
    page._plan_move(ARM, far)
    assert "unreachable" in page.panel.status.content
    run(page, bar, 0.5)
    assert error(page, before) < 2e-3
    np.testing.assert_allclose(page.ik_handles.handles[ARM].position, before[:3, 3], atol=2e-3)


def test_keys_take_over_from_a_planned_motion(served) -> None:
    page, bar = begin(served, plans=True)
    goal = page.action_source.end_effector_pose(ARM)
    goal[:3, 3] += DROP
    page._plan_move(ARM, goal)
    run(page, bar, 0.3)
    assert page.planned_moves.moves(ARM)
    bindings = page.action_source.key_bindings
    bindings.arm = [name for name, *_ in bindings.arms].index(ARM)
    page.robot.apply_action(page.action_source.action(("ArrowUp",)))
    assert page.action_source.steered == ARM
    page.planned_moves.stop(page.action_source.steered)
    assert not page.planned_moves.moves(ARM)
    run(page, bar, 1.0)
    assert error(page, goal) > 0.1

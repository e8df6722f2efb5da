"""Undo and redo of edits: alone, and by the buttons of the page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from roboyard.viewer.inspector.edits import history
from roboyard.viewer.inspector.edits.edit_state import EditedSphere, EditState, SensorPose
from roboyard.viewer.inspector.edits.history import History


def test_steps_are_undone_and_redone_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(history, "PAUSE", -1.0)  # each change is a step
    edits = EditState(sensors=[SensorPose(kind="camera_links", link="eye")])
    states, kept = [edits.copy()], History(edits)
    changes: list[Callable[[], Any]] = [
        lambda: setattr(edits.sensors[0], "position", (0.1, 0.2, 0.3)),
        lambda: edits.spheres.setdefault("arm", []).append(EditedSphere(center=(0, 0, 0), radius=0.1)),
        lambda: edits.planner_pairs.add(("a", "b")),
        lambda: edits.physics_pairs.add(("a", "b")),
        lambda: edits.sensors.clear(),
    ]
    for change in changes:
        change()
        assert kept.note()
        assert not kept.note()
        states.append(edits.copy())
    for state in reversed(states[:-1]):
        assert kept.undo()
        assert edits == state
    assert not kept.undo()
    for state in states[1:]:
        assert kept.redo()
        assert edits == state
    assert not kept.redo()


def test_a_drag_is_one_step_and_a_new_change_ends_redo() -> None:
    edits = EditState(sensors=[SensorPose(kind="camera_links", link="eye")])
    kept = History(edits)
    for k in range(20):
        edits.sensors[0].position = (0.01 * k + 0.01, 0.0, 0.0)
        kept.note()
    assert kept.undo()
    assert edits.sensors[0].position == (0.0, 0.0, 0.0)
    assert kept.can_redo and not kept.can_undo
    edits.planner_pairs.add(("a", "b"))
    kept.note()
    assert not kept.can_redo


def test_the_page_undoes_what_its_panels_changed(gripper: Path) -> None:
    pytest.importorskip("viser")
    from roboyard.viewer.inspector import Inspector, RobotSource

    config = gripper.with_name("config.yaml")
    config.write_text(
        "urdf_path: gripper.urdf\nname: gripper\n"
        "camera_links: [{link: eye, parent_link: palm, offset: {position: [0, 0, 0.3]}}]\n"
        "curobo: {collision_spheres: {palm: [{center: [0, 0, 0], radius: 0.12}]}}\n"
    )
    page = Inspector(RobotSource(name="gripper", urdf=gripper, config=config), port=0, quiet=True)
    try:
        panels, edits = page.panels, page.panels.edits
        page.do(lambda: panels.sensors.move(edits.sensors[0], (0.0, 0.0, 0.5), (0.0, 0.0, 0.0, 1.0)))
        page.tick(0.0)
        assert panels.save.is_changed
        page.do(lambda: panels.restore(undo=True))
        page.tick(0.0)
        assert edits.sensors[0].position == (0.0, 0.0, 0.3)
        assert panels.sensors.position.value == (0.0, 0.0, 0.3)
        assert not panels.save.is_changed
        page.do(lambda: panels.spheres.pick("palm", 0))
        page.do(panels.spheres.delete)
        page.tick(0.0)
        assert not edits.spheres
        page.do(lambda: panels.restore(undo=True))
        page.tick(0.0)
        assert len(edits.spheres["palm"]) == 1
        assert "1 spheres" in panels.spheres.message.content
        assert "palm" in page.overlays.spheres.nodes  # drawn again
    finally:
        page.close()

"""The tree of links: what its messages show, hide and fade, and what it sends to pages."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboyard.viewer.inspector import Inspector, RobotSource
from roboyard.viewer.inspector.layers.link_layer import FAINTEST

pytest.importorskip("viser")
PLANNER = """
robot_cfg:
  kinematics:
    collision_spheres:
      palm: [{center: [0.0, 0.0, 0.01], radius: 0.06}]
      left: [{center: [0.1, 0, 0], radius: 0.02}]
"""
PALM, LEFT, NAIL, RIGHT = range(4)
VISUAL, COLLISION, SPHERES = range(3)


@pytest.fixture
def inspector(gripper: Path) -> Iterator[Inspector]:
    planner = gripper.with_name("planner.yaml")
    planner.write_text(PLANNER)
    opened = Inspector(RobotSource(name="gripper", urdf=gripper, planner_file=planner), port=0, quiet=True)
    yield opened
    opened.close()


def say(inspector: Inspector, *message: Any) -> None:
    """Execute a message as if a page had sent it."""
    inspector.links.tree._on_message(1, list(message))
    inspector.tick(0.01)


def visible(inspector: Inspector, kind: str) -> set[str]:
    """Return the links whose nodes of an overlay, or whose visual meshes, are visible in the scene."""
    nodes = inspector.viewer.server.scene._handle_from_node_name
    return {
        path.split("/")[2]
        for path, node in nodes.items()
        if path.startswith("/gripper/") and f"/{kind}" in path and node.visible
    }


def alphas(inspector: Inspector, link: int) -> set[float]:
    """Return the opacities with which the visual shapes of a link were sent."""
    nodes = inspector.viewer.nodes
    owner = inspector.body.id, link
    return {round(look[3][3], 3) for look, (_, shape) in nodes._shapes.items() if shape.owner == owner}


def test_pages_receive_all_links_with_parents_masses_and_layers(inspector: Inspector) -> None:
    sent = inspector.links.tree._sent
    assert [(one["name"], one["parent"], one["depth"], one["mass"]) for one in sent["links"]] == [
        ("palm", -1, 0, "2 kg"),
        ("left", 0, 1, "0.5 kg"),
        ("nail", 1, 2, ""),
        ("right", 0, 1, "0.5 kg"),
    ]
    assert sent["has"] == [[PALM, LEFT, RIGHT], [PALM, LEFT], [PALM, LEFT]]
    assert sent["shown"] == [[PALM, LEFT, RIGHT], [], []]
    assert sent["picked"] == -1


def test_links_with_findings_are_marked(gripper: Path) -> None:
    gripper.write_text(gripper.read_text().replace('<mass value="0.5"/>', '<mass value="-0.5"/>', 1))
    opened = Inspector(RobotSource(name="gripper", urdf=gripper), port=0, quiet=True)
    try:
        found = {one["name"]: one["found"] for one in opened.links.tree._sent["links"]}
    finally:
        opened.close()
    assert found["left"] == "error"
    assert found["nail"] == ""


def test_an_eye_hides_the_visual_meshes_of_one_link(inspector: Inspector) -> None:
    assert visible(inspector, "visual") == {"palm", "left", "right"}
    say(inspector, "show", VISUAL, LEFT, False, False)
    assert visible(inspector, "visual") == {"palm", "right"}
    assert inspector.switches["visual meshes"].value is True
    inspector.links.pick(inspector.body.link("left"))  # the highlighted mesh stays hidden
    assert visible(inspector, "visual") == {"palm", "right"}
    say(inspector, "show", VISUAL, LEFT, True, False)
    assert visible(inspector, "visual") == {"palm", "left", "right"}


@pytest.mark.parametrize(
    ("layer", "kind", "label"),
    [
        (COLLISION, "collision", "collision shapes"),
        (SPHERES, "planning spheres", "planning spheres"),
    ],
)
def test_a_layer_of_one_link_is_shown_and_its_switch_agrees(
    inspector: Inspector, layer: int, kind: str, label: str
) -> None:
    assert visible(inspector, kind) == set()
    say(inspector, "show", layer, LEFT, True, False)
    assert visible(inspector, kind) == {"left"}
    assert inspector.switches[label].value is True
    assert inspector.overlays.is_on(label)
    say(inspector, "show", layer, LEFT, False, False)
    assert visible(inspector, kind) == set()
    assert inspector.switches[label].value is False
    say(inspector, "show", layer, -1, True, False)
    assert visible(inspector, kind) == {"palm", "left"}
    inspector.panels.switch(label, False)
    assert visible(inspector, kind) == set()
    assert inspector.links.tree._sent["shown"][layer] == []


def test_the_links_below_follow_where_asked(inspector: Inspector) -> None:
    say(inspector, "show", VISUAL, PALM, False, True)
    assert visible(inspector, "visual") == set()
    assert inspector.switches["visual meshes"].value is False
    say(inspector, "show", VISUAL, PALM, True, False)
    assert visible(inspector, "visual") == {"palm"}
    say(inspector, "fade", VISUAL, PALM, 0.5, True)
    assert [alphas(inspector, link) for link in (PALM, LEFT, RIGHT)] == [{0.5}] * 3


def test_opacity_of_each_layer_is_sent_to_the_scene(inspector: Inspector) -> None:
    say(inspector, "fade", VISUAL, LEFT, 0.25, False)
    assert [alphas(inspector, link) for link in (PALM, LEFT, RIGHT)] == [{1.0}, {0.25}, {1.0}]
    say(inspector, "show", SPHERES, -1, True, False)
    say(inspector, "fade", SPHERES, LEFT, 0.9, False)
    assert inspector.overlays.spheres.nodes["left"].opacity == 0.9
    assert inspector.overlays.spheres.nodes["palm"].opacity == 0.4
    say(inspector, "show", COLLISION, -1, True, False)
    before = inspector.overlays.collisions.nodes["left"][0]
    say(inspector, "fade", COLLISION, LEFT, 0.8, False)
    after = inspector.overlays.collisions.nodes["left"]
    assert len(after) == 1 and after[0].name != before.name
    assert b'"baseColorFactor"' in after[0].glb_data and b",0.8]" in after[0].glb_data
    say(inspector, "fade", VISUAL, LEFT, -3.0, False)
    assert alphas(inspector, LEFT) == {FAINTEST}
    say(inspector, "fade", VISUAL, LEFT, 1.0, False)
    assert alphas(inspector, LEFT) == {1.0}


def test_coloured_parts_follow_the_eyes_of_visual_meshes(inspector: Inspector) -> None:
    say(inspector, "show", VISUAL, LEFT, False, False)
    inspector.panels.switch("understood parts", True)
    inspector.switches["understood parts"].value = True
    assert visible(inspector, "part") == {"palm", "right"}
    assert visible(inspector, "visual") == set()
    say(inspector, "show", VISUAL, LEFT, True, False)
    assert visible(inspector, "part") == {"palm", "left", "right"}
    inspector.panels.switch("understood parts", False)
    assert visible(inspector, "visual") == {"palm", "left", "right"}


@pytest.mark.parametrize("message", [
    ["show", 3, 0, True, False], ["show", 0, 4, True, False], ["show", 0, -2, True, False],
    ["fade", 0, 1, float("nan"), False], ["fade", 0, -1, 0.5, False], ["fade", 0, 0, "0.5", False],
    ["pick", 4], ["pick", "left"], ["pick"], {}, None, "show",
])  # fmt: skip
def test_senseless_messages_are_ignored(inspector: Inspector, message: Any) -> None:
    before = inspector.links.tree._sent
    inspector.links.tree._on_message(1, message)
    assert inspector._requests.qsize() == 0
    inspector.tick(0.01)
    assert inspector.links.tree._sent == before


def test_a_message_of_a_page_selects_and_deselects(
    inspector: Inspector, browser: Callable[..., Any], wait: Callable[..., None]
) -> None:
    page = browser(inspector.viewer)
    uuid = inspector.links.tree._script._uuid
    page.send(type="GuiUpdateMessage", uuid=uuid, updates={"value": '[1,["pick",3]]'})
    wait(lambda: inspector.tick(0.01) or inspector.links.picked is not None)
    assert inspector.links.picked is inspector.body.links[RIGHT]
    assert "0.5 kg at (0.1, 0, 0) m" in inspector.links.facts.content
    assert inspector.links.tree._sent["picked"] == RIGHT
    page.send(type="GuiUpdateMessage", uuid=uuid, updates={"value": '[2,["pick",-1]]'})
    wait(lambda: inspector.tick(0.01) or inspector.links.picked is None)


def test_what_is_shown_stays_when_the_robot_is_loaded_again(inspector: Inspector) -> None:
    say(inspector, "show", VISUAL, RIGHT, False, False)
    say(inspector, "show", COLLISION, LEFT, True, False)
    say(inspector, "fade", VISUAL, PALM, 0.5, False)
    inspector.load(inspector._robot.source)
    assert visible(inspector, "visual") == {"palm", "left"}
    assert visible(inspector, "collision") == {"left"}
    assert alphas(inspector, PALM) == {0.5}
    np.testing.assert_equal(inspector.links.tree._sent["shown"], [[PALM, LEFT], [LEFT], []])

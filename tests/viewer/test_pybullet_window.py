"""PyBullet's GUI as messages to pages; real browsers are tested in `test_pybullet_in_chromium.py`."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.window.options import parse_options
from roboyard.pybullet.window.sliders import step_of

pytest.importorskip("viser")


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Open the window of client 0."""
    monkeypatch.delenv("ROBOYARD_VIEWER", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    assert p.connect(p.GUI, options="--port=0") == 0
    yield CLIENTS[0].window
    for number in list(CLIENTS):
        p.disconnect(number)


@pytest.fixture
def watched(window: Any, browser: Any, wait: Any) -> tuple[Any, Any]:
    """Open a page of the window; returns both."""
    page = browser(window._viewer)
    wait(lambda: window._viewer.watchers == 1)
    return window, page


def box(height: float = 1.0, mass: float = 1.0) -> int:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    return p.createMultiBody(mass, shape, basePosition=[0, 0, height])


def lines(window: Any) -> dict[float, np.ndarray]:
    """Return the (k, 2, 3) ends (m) of the lines on the page, by width (pixels)."""
    return window._viewer.drawings._sent


def texts(window: Any) -> list[list[Any]]:
    shown = window._viewer.drawings._texts
    return [] if shown is None else shown._shown


def drawn_shapes(window: Any) -> int:
    return len(window._viewer.nodes._shapes)


def of_type(name: str, **properties: Any) -> Callable[[dict[str, Any]], bool]:
    return lambda m: m["type"] == name and all(m["props"].get(k) == v for k, v in properties.items())


def test_bodies_are_shown_without_a_step_and_worlds_can_change(watched: Any, wait: Any) -> None:
    window, _ = watched
    body = box()
    wait(lambda: drawn_shapes(window) == 1)
    p.resetBasePositionAndOrientation(body, [1, 2, 3], [0, 0, 0, 1])
    node = next(iter(window._viewer.nodes._frames.values()))
    wait(lambda: np.allclose(node.position, [1, 2, 3]))
    p.changeVisualShape(body, -1, rgbaColor=[1, 0, 0, 1])
    wait(lambda: [s.rgba for _, s in window._viewer.nodes._shapes.values()] == [(1.0, 0.0, 0.0, 1.0)])
    p.resetSimulation()
    wait(lambda: drawn_shapes(window) == 0)
    box(2.0)
    box(3.0)
    wait(lambda: drawn_shapes(window) == 2)
    p.removeBody(0)
    wait(lambda: drawn_shapes(window) == 1)


def test_a_page_receives_the_motion_of_the_world(watched: Any) -> None:
    _, page = watched
    p.setGravity(0, 0, -10)
    body = box(5.0)
    for _ in range(120):
        p.stepSimulation()
    height = p.getBasePositionAndOrientation(body)[0][2]
    assert height < 4.0
    page.listen(
        lambda m: m["type"] == "SetPositionMessage" and m["position"][2] == pytest.approx(height, abs=1e-4)
    )


def test_a_slider_is_moved_in_the_page(watched: Any, browser: Any, wait: Any) -> None:
    window, page = watched
    slider = p.addUserDebugParameter("knee", -2, 2, 0.5)
    made = page.listen(of_type("GuiSliderMessage", label="knee"))
    assert (made["props"]["min"], made["props"]["max"], made["value"]) == (-2, 2, 0.5)
    page.send(type="GuiUpdateMessage", uuid=made["uuid"], updates={"value": 1.25})
    wait(lambda: p.readUserDebugParameter(slider) == 1.25)
    other = browser(window._viewer)
    other.listen(
        lambda m: (
            m.get("uuid") == made["uuid"] and 1.25 in (m.get("value"), m.get("updates", {}).get("value"))
        )
    )
    for rubbish in ("far", None, [1], 99.0):
        page.send(type="GuiUpdateMessage", uuid=made["uuid"], updates={"value": rubbish})
    wait(lambda: p.readUserDebugParameter(slider) != 1.25)
    assert p.readUserDebugParameter(slider) == 2.0
    p.removeAllUserParameters()
    page.listen(lambda m: m["type"] == "GuiRemoveMessage" and m["uuid"] == made["uuid"])


def test_a_button_counts_its_clicks(watched: Any, wait: Any) -> None:
    _, page = watched
    button = p.addUserDebugParameter("go", 1, 0, 5)
    made = page.listen(of_type("GuiButtonMessage", label="go"))
    for _ in range(2):
        page.send(type="GuiUpdateMessage", uuid=made["uuid"], updates={"value": True})
    wait(lambda: p.readUserDebugParameter(button) == 7.0)


class SlowNumber(float):
    """A number whose sum lets another thread add to it first."""

    others: threading.Event

    def __add__(self, other: float) -> float:
        begun, self.others = self.others, threading.Event()
        begun.set()
        self.others.wait(0.3)  # never comes where clicks are counted one after the other
        return float(self) + other


def test_two_clicks_at_once_are_two(watched: Any, wait: Any) -> None:
    _, page = watched
    button = p.addUserDebugParameter("go", 1, 0, 5)
    made = page.listen(of_type("GuiButtonMessage", label="go"))
    parameter = CLIENTS[0].debug_items.parameters[button]
    parameter.value = SlowNumber(5.0)
    parameter.value.others = threading.Event()
    for _ in range(2):
        page.send(type="GuiUpdateMessage", uuid=made["uuid"], updates={"value": True})
    wait(lambda: p.readUserDebugParameter(button) == 7.0)


def test_a_click_right_after_a_button_appears_is_counted(
    watched: Any, wait: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A busy process may set the callback long after it has made the button."""
    import viser

    on_click = viser.GuiButtonHandle.on_click

    def late(handle: Any, callback: Any) -> Any:
        time.sleep(0.3)
        return on_click(handle, callback)

    monkeypatch.setattr(viser.GuiButtonHandle, "on_click", late)
    _, page = watched
    button = p.addUserDebugParameter("go", 1, 0, 5)
    made = page.listen(of_type("GuiButtonMessage", label="go"))
    page.send(type="GuiUpdateMessage", uuid=made["uuid"], updates={"value": True})
    wait(lambda: p.readUserDebugParameter(button) == 6.0)


def test_lines_are_drawn_replaced_and_removed(watched: Any, wait: Any) -> None:
    window, page = watched
    first = p.addUserDebugLine([0, 0, 0], [1, 0, 0], [1, 0, 0], lineWidth=2)
    p.addUserDebugLine([0, 0, 0], [0, 1, 0], [0, 1, 0], lineWidth=2)
    p.addUserDebugPoints([[0, 0, 1], [0, 0, 2]], [[0, 0, 1], [0, 0, 1]], pointSize=5)
    page.listen(lambda m: m.get("name") == "/drawings/lines 5")
    assert lines(window)[2.0].tolist() == [[[0, 0, 0], [1, 0, 0]], [[0, 0, 0], [0, 1, 0]]]
    assert window._viewer.drawings._nodes[2.0].colors[:, 0].tolist() == [[255, 0, 0], [0, 255, 0]]
    assert lines(window)[5.0][:, 0].tolist() == [[0, 0, 1], [0, 0, 2]]
    p.addUserDebugLine([0, 0, 0], [7, 0, 0], [1, 0, 0], lineWidth=2, replaceItemUniqueId=first)
    wait(lambda: lines(window)[2.0][0, 1].tolist() == [7, 0, 0])
    p.removeUserDebugItem(first)
    wait(lambda: len(lines(window)[2.0]) == 1)
    p.removeAllUserDebugItems()
    wait(lambda: lines(window) == {})
    page.listen(lambda m: m["type"] == "RemoveSceneNodeMessage" and m["name"] == "/drawings/lines 2")


def test_lines_and_texts_move_with_their_parents(watched: Any, wait: Any) -> None:
    window, page = watched
    p.setGravity(0, 0, -10)
    body = box(3.0)
    p.addUserDebugLine([0, 0, 0], [0, 0, 1], [1, 0, 0], parentObjectUniqueId=body)
    p.addUserDebugText("top", [0, 0, 1], [0, 0, 1], parentObjectUniqueId=body)
    wait(lambda: len(texts(window)) == 1 and 1.0 in lines(window))
    page.listen(lambda m: m["type"] == "RunJavascriptMessage" and '"top"' in m["source"])
    for _ in range(60):
        p.stepSimulation()
    height = p.getBasePositionAndOrientation(body)[0][2]
    assert height < 2.8
    wait(lambda: np.allclose(lines(window)[1.0][0, :, 2], [height, height + 1], atol=1e-4))
    wait(lambda: texts(window)[0][:5] == pytest.approx(["top", 0, 0, height + 1, "#0000ff"], abs=1e-4))
    p.removeBody(body)
    wait(lambda: lines(window) == {} and texts(window) == [])


def test_drawings_are_removed_when_their_lifetime_ends(watched: Any, wait: Any) -> None:
    window, _ = watched
    p.addUserDebugText("soon gone", [0, 0, 1], lifeTime=0.3)
    wait(lambda: len(texts(window)) == 1)
    wait(lambda: texts(window) == [])


def test_the_camera_is_synchronised_in_both_directions(watched: Any, wait: Any) -> None:
    _, page = watched
    p.resetDebugVisualizerCamera(3, 30, -20, [1, 2, 3])
    moved = page.listen(
        lambda m: m["type"] == "SetCameraPositionMessage" and abs(m["position"][2] - 4.03) < 0.01
    )
    assert p.getDebugVisualizerCamera()[8:] == (30.0, -20.0, 3.0, (1.0, 2.0, 3.0))

    def look_from(position: Any, look_at: Any, width: int = 800) -> None:
        page.send(
            type="ViewerCameraMessage",
            wxyz=(1.0, 0.0, 0.0, 0.0),
            position=tuple(float(v) for v in position),
            fov=1.5,
            near=0.01,
            far=100.0,
            image_height=400,
            image_width=width,
            look_at=tuple(look_at),
            up_direction=(0.0, 0.0, 1.0),
        )

    look_from(np.array(moved["position"]) + 1e-6, (1, 2, 3))  # the page's echo
    wait(lambda: p.getDebugVisualizerCamera()[:2] == (800, 400))
    assert p.getDebugVisualizerCamera()[8:] == (30.0, -20.0, 3.0, (1.0, 2.0, 3.0))
    look_from((0, -2, 2), (0, 0, 0))
    wait(lambda: p.getDebugVisualizerCamera()[8] != 30.0)
    camera = p.getDebugVisualizerCamera()
    np.testing.assert_allclose(camera[8:11], [0, -45, 8**0.5], atol=1e-4)
    np.testing.assert_allclose(camera[2], p.computeViewMatrix([0, -2, 2], [0, 0, 0], [0, 0, 1]), atol=1e-5)
    look_from((float("nan"), 0, 0), (0, 0, 0))
    look_from((5, 0, 0), (0, 0, 0), width=-3)
    wait(lambda: p.getDebugVisualizerCamera()[10] == pytest.approx(5.0))
    assert p.getDebugVisualizerCamera()[:2] == (800, 400)
    page.close()
    wait(lambda: p.getDebugVisualizerCamera()[:2] == (1024, 768))


def test_a_page_opening_while_the_camera_moves_gets_the_view(window: Any, browser: Any, wait: Any) -> None:
    p.resetDebugVisualizerCamera(2, 0, 0, [0, 0, 0])
    slow = browser(window._viewer, is_slow=True)  # got its view before the script moved the camera
    browser(window._viewer)
    wait(lambda: window._viewer.watchers == 1)
    p.resetDebugVisualizerCamera(3, 30, -20, [1, 2, 3])
    reported = p.getDebugVisualizerCamera()[8:]
    wait(lambda: window.camera._pages._aimed.target[0] == 1.0)
    slow.look_from((0.0, -2.0, 0.0))
    for _ in range(2):  # the first message is lost
        moved = slow.listen(lambda m: m["type"] == "SetCameraPositionMessage" and not m["initial"])
        np.testing.assert_allclose(moved["position"], window.camera._pages._aimed.eye)
    assert p.getDebugVisualizerCamera()[8:] == reported == (30.0, -20.0, 3.0, (1.0, 2.0, 3.0))
    slow.look_from(moved["position"], (1.0, 2.0, 3.0))
    wait(lambda: 1 not in window.camera._pages._requested)
    slow.look_from((0.0, -5.0, 0.0))  # now a user turns it
    wait(lambda: p.getDebugVisualizerCamera()[10] == pytest.approx(5.0))


def test_a_page_opens_with_the_view_of_the_script(window: Any) -> None:
    p.resetDebugVisualizerCamera(3, 0, 0, [1, 2, 3])
    np.testing.assert_allclose(window._viewer.server.initial_camera.position, [1, -1, 3], atol=1e-9)


def test_keys_and_mouse_reach_the_script_once(watched: Any, wait: Any) -> None:
    window, page = watched
    count = [0]

    def say(script: Any, value: Any) -> None:
        count[0] += 1
        page.send(
            type="GuiUpdateMessage",
            uuid=script._script._uuid,
            updates={"value": json.dumps([count[0], value])},
        )

    say(window._keys, [["ArrowUp", True], ["a", True], ["a", False], ["NoSuchKey", True]])
    wait(lambda: len(window._client.keyboard._states) == 2)
    both = p.KEY_WAS_TRIGGERED | p.KEY_WAS_RELEASED
    assert p.getKeyboardEvents() == {p.B3G_UP_ARROW: p.KEY_IS_DOWN | p.KEY_WAS_TRIGGERED, ord("a"): both}
    assert p.getKeyboardEvents() == {p.B3G_UP_ARROW: p.KEY_IS_DOWN}
    say(window._keys, [["ArrowUp", False]])
    wait(lambda: p.getKeyboardEvents() == {p.B3G_UP_ARROW: p.KEY_WAS_RELEASED})
    assert p.getKeyboardEvents() == {}

    say(window._pointer, [["move", 3, 4, -1], ["down", 3, 4, 0], ["up", 3, 4, 0], ["fly", 1, 1, 1], 7])
    wait(lambda: len(window._client.mouse._events) == 3)
    down = p.KEY_IS_DOWN | p.KEY_WAS_TRIGGERED
    assert p.getMouseEvents() == ((1, 3, 4, -1, 0), (2, 3, 4, 0, down), (2, 3, 4, 0, p.KEY_WAS_RELEASED))
    assert p.getMouseEvents() == ()


def test_a_body_is_dragged_and_released(watched: Any, wait: Any) -> None:
    window, page = watched
    body, floor = box(0.5), box(-2.0, mass=0.0)
    wait(lambda: drawn_shapes(window) == 2)
    nodes = {shape.owner[0]: handle.name for handle, shape in window._viewer.nodes._shapes.values()}

    def drag(phase: str, node: str, target: Any) -> None:
        page.send(
            type="SceneNodeDragMessage",
            phase=phase,
            name=node,
            instance_index=None,
            start_position=(0.0, 0.0, 0.6),
            start_screen_pos=(0.5, 0.5),
            end_position=tuple(target),
            end_screen_pos=(0.5, 0.5),
            button="left",
            modifier=None,
            owner="",
        )

    name = nodes[CLIENTS[0].scene.bodies[body].body.id]
    page.listen(lambda m: m["type"] == "SetSceneNodeDragBindingsMessage" and m["name"] == name)
    fixed = nodes[CLIENTS[0].scene.bodies[floor].body.id]
    assert not any(
        m["type"] == "SetSceneNodeDragBindingsMessage" and m["name"] == fixed for m in page.messages
    )
    drag("start", name, (0, 0, 0.6))
    drag("update", name, (1, 1, 0.6))
    wait(lambda: window._dragging._held is not None)
    drag("update", name, (float("nan"), 1, 0.6))
    end = time.monotonic() + 60
    while time.monotonic() < end:
        p.stepSimulation()
        time.sleep(0.001)
        if np.linalg.norm(np.subtract(p.getBasePositionAndOrientation(body)[0][:2], (1, 1))) < 0.2:
            break
    else:
        pytest.fail("the body did not follow")
    assert p.getNumConstraints() == 0
    drag("end", name, (1, 1, 0.6))
    wait(lambda: window._dragging._held is None)
    assert len(CLIENTS[0].scene.world.constraints) == 0

    drag("start", name, (0, 0, 0.6))
    wait(lambda: window._dragging._held is not None)
    page.close()  # during the drag: the next command releases the body
    wait(lambda: window._viewer.watchers == 0 and window.update_requested)
    p.stepSimulation()
    assert len(CLIENTS[0].scene.world.constraints) == 0


def test_real_time_simulation_runs_in_the_background(window: Any, wait: Any) -> None:
    p.setGravity(0, 0, -10)
    body = box(5.0)
    start = time.monotonic()
    p.setRealTimeSimulation(1)
    wait(lambda: p.getBasePositionAndOrientation(body)[0][2] < 4.6)
    assert time.monotonic() - start > 0.2  # 0.4 m take 0.28 s
    with CLIENTS[0].lock:
        time.sleep(0.05)  # the clock waits for its turn to step
        p.setRealTimeSimulation(0)
        height = p.getBasePositionAndOrientation(body)[0][2]
    time.sleep(0.1)
    assert p.getBasePositionAndOrientation(body)[0][2] == height


def test_flags_act_on_the_page(watched: Any, wait: Any) -> None:
    window, page = watched
    box()
    wait(lambda: drawn_shapes(window) == 1)
    p.configureDebugVisualizer(p.COV_ENABLE_WIREFRAME, 1)
    page.listen(lambda m: m["type"] == "MeshMessage" and m["props"]["wireframe"])
    p.configureDebugVisualizer(p.COV_ENABLE_SHADOWS, 0)
    page.listen(lambda m: m.get("name") == "/lights/sun" and m.get("updates", {}).get("cast_shadow") is False)
    p.configureDebugVisualizer(p.COV_ENABLE_GUI, 0)
    page.listen(lambda m: m["type"] == "GuiSetPanelCollapsedMessage" and m["collapsed"])
    p.configureDebugVisualizer(rgbBackground=[1, 0, 0])
    page.listen(lambda m: m["type"] == "FogMessage" and tuple(m["color"]) == (255, 0, 0))
    p.configureDebugVisualizer(p.COV_ENABLE_MOUSE_PICKING, 0)
    page.listen(lambda m: m["type"] == "SetSceneNodeDragBindingsMessage" and not m["bindings"])
    p.configureDebugVisualizer(p.COV_ENABLE_RENDERING, 0)
    time.sleep(0.1)
    box(2.0)
    time.sleep(0.3)
    assert drawn_shapes(window) == 1
    p.configureDebugVisualizer(p.COV_ENABLE_RENDERING, 1)
    wait(lambda: drawn_shapes(window) == 2)


def test_pictures_of_a_script_are_shown_in_the_panel(watched: Any) -> None:
    _, page = watched
    p.configureDebugVisualizer(p.COV_ENABLE_DEPTH_BUFFER_PREVIEW, 0)
    p.getCameraImage(64, 48)
    page.listen(of_type("GuiImageMessage", label="camera"))
    segmentation = of_type("GuiImageMessage", label="segmentation")
    if not any(segmentation(m) for m in page.messages):
        page.listen(segmentation)
    assert not any(of_type("GuiImageMessage", label="depth")(m) for m in page.messages)


def test_invalid_messages_are_ignored(watched: Any, browser: Any, wait: Any) -> None:
    window, page = watched
    p.setGravity(0, 0, -10)
    body = box(5.0)
    slider = p.addUserDebugParameter("s", 0, 1, 0.5)
    made = page.listen(of_type("GuiSliderMessage", label="s"))
    for rubbish in (b"\xff\x00rubbish", b"", b"\x81\xa4type\xa4Nope"):
        browser(window._viewer).socket.send(rubbish)
    for uuid in (made["uuid"], "nobody", window._keys._script._uuid, window._pointer._script._uuid):
        for value in ({"value": {}}, {"value": "[[[["}, {"no": 1}, {"value": "[1, [[1, 2, 3, 4]]]"}):
            page.send(type="GuiUpdateMessage", uuid=uuid, updates=value)
    page.send(type="SceneNodeDragMessage", phase="start")
    for _ in range(24):
        p.stepSimulation()
    assert p.readUserDebugParameter(slider) == 0.5
    assert (p.getKeyboardEvents(), p.getMouseEvents()) == ({}, ())
    expected = 5.0 - 10.0 / 240**2 * 24 * 25 / 2
    assert p.getBasePositionAndOrientation(body)[0][2] == pytest.approx(expected, abs=1e-3)
    good = browser(window._viewer)
    good.listen(lambda m: m["type"] == "SetPositionMessage" and m["position"][2] < 5.0)


def test_without_an_open_page_nothing_is_sent(window: Any) -> None:
    box()
    p.addUserDebugLine([0, 0, 0], [1, 0, 0])
    p.addUserDebugParameter("s", 0, 1, 0.5)
    for _ in range(10):
        p.stepSimulation()
    assert window._viewer.frames_sent == 1
    assert drawn_shapes(window) == 0
    assert not window.update_requested


def test_a_script_with_a_page_computes_the_same(window: Any, browser: Any, wait: Any) -> None:
    def run() -> list[Any]:
        p.resetSimulation()
        p.setGravity(0, 0, -10)
        box(-0.1, mass=0.0)
        bodies = [box(0.3 + 0.25 * k) for k in range(3)]
        for _ in range(200):
            p.stepSimulation()
        return [p.getBasePositionAndOrientation(body) for body in bodies]

    alone = run()
    browser(window._viewer)
    wait(lambda: window._viewer.watchers == 1)
    assert run() == alone


@pytest.mark.parametrize(
    ("text", "field", "value"),
    [
        ("", "background", (0.7, 0.7, 0.8)),
        ("--width=300 --height=200", "width", 300),
        ("--background_color_red=1 --background_color_blue=0", "background", (1.0, 0.7, 0.0)),
        ("--port=9000 --opengl2", "port", 9000),
        ('--mp4="my film.mp4" --mp4fps=30', "mp4", "my film.mp4"),
    ],
)
def test_options(text: str, field: str, value: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert getattr(parse_options(text), field) == value
    assert capsys.readouterr().err == ""


def test_wrong_options_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    parse_options("--colour=1")
    assert "--colour=1" in capsys.readouterr().err
    with pytest.raises(p.error, match="--width must be a number, got 'wide'"):
        parse_options("--width=wide")
    with pytest.raises(p.error, match="width must be positive"):
        parse_options("--width=0")


@pytest.mark.parametrize("width", [0.001, 0.5, 1.0, 2.0, 6.28, 1e6])
def test_sliders_have_a_thousand_steps(width: float) -> None:
    assert 1000 <= width / step_of(width) * (1 + 1e-9) <= 10001

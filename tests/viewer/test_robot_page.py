"""A robot as one HTML file: its data, its safety, and its joints and layers in a real browser."""

from __future__ import annotations

import base64
import json
import math
import re
import sys
import time
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboyard import cli
from roboyard.assets import asset_path
from roboyard.description import load_description
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.reports.robot_page import robot_page

sys.path.insert(0, str(Path(__file__).parent))
import chromium
from chromium import until

MIMIC = """
<robot name="&lt;/script&gt;&lt;b&gt;">
  <link name="base"><visual><geometry><box size="0.2 0.4 0.6"/></geometry></visual></link>
  <link name="slide">
    <collision><origin xyz="0 0 1"/><geometry><sphere radius="0.5"/></geometry></collision></link>
  <link name="turn"><visual><geometry><cylinder radius="0.1" length="0.4"/></geometry></visual></link>
  <joint name="a" type="prismatic"><parent link="base"/><child link="slide"/>
    <origin xyz="0 1 0" rpy="0.3 0 0"/>
    <axis xyz="0 0 1"/><limit lower="0.1" upper="0.9" effort="1" velocity="1"/></joint>
  <joint name="b" type="revolute"><parent link="slide"/><child link="turn"/><origin xyz="0 0 1"/>
    <axis xyz="1 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/>
    <mimic joint="a" multiplier="2" offset="0.25"/></joint>
</robot>
"""


def contents(page: str) -> tuple[dict[str, Any], bytes]:
    found = re.search(r'<script id="robot"[^>]*>(.*?)</script>', page, re.DOTALL)
    packed = re.search(r'<script id="data"[^>]*>(.*?)</script>', page, re.DOTALL)
    assert found is not None
    assert packed is not None
    return json.loads(found[1]), zlib.decompress(base64.b64decode(packed[1]))


def test_shapes_are_in_the_file_where_they_belong(tmp_path: Path) -> None:
    file = tmp_path / "robot.urdf"
    file.write_text(MIMIC)
    robot, data = contents(robot_page(load_description(file)))
    parts = {(part["link"], part["layer"]): part for part in robot["parts"]}
    assert set(parts) == {("base", "visual"), ("slide", "collision"), ("turn", "visual")}
    assert parts["base", "visual"]["low"] == pytest.approx([-0.1, -0.2, -0.3])
    assert parts["base", "visual"]["size"] == pytest.approx([0.2, 0.4, 0.6])
    ball = parts["slide", "collision"]
    rows = np.frombuffer(data, np.uint8, 16 * ball["vertices"], ball["at"]).reshape(-1, 16)
    places = rows[:, :6].copy().view("<u2") / 65535.0 * ball["size"] + ball["low"]
    assert ball["position"] == [0.0, 0.0, 1.0]
    assert ball["quaternion"] == [0.0, 0.0, 0.0, 1.0]
    np.testing.assert_allclose(np.linalg.norm(places, axis=1), 0.5, atol=1e-3)
    normals = rows[:, 8:11].copy().view(np.int8) / 127.0
    np.testing.assert_allclose(normals, places / 0.5, atol=0.25)
    faces = np.frombuffer(data, "<u4", ball["faces"], ball["at"] + 16 * ball["vertices"])
    assert faces.max() == ball["vertices"] - 1
    assert robot["joints"][0]["start"] == 0.1  # the limit nearest to zero


ALIKE = """
<robot name="alike"><link name="base">
  <visual><origin xyz="0 0 1" rpy="0 0 1.5"/>
    <geometry><mesh filename="tetra.obj" scale="2 1 1"/></geometry></visual>
  <visual><origin xyz="0 3 0"/><geometry><mesh filename="tetra.obj" scale="2 1 1"/></geometry></visual>
  <visual><geometry><mesh filename="tetra.obj" scale="-2 1 1"/></geometry></visual>
  <visual><geometry><mesh filename="tetra.obj" scale="2 1 1"/></geometry>
    <material name="red"><color rgba="1 0 0 1"/></material></visual>
  <visual><geometry><box size="1 2 3"/></geometry></visual>
  <visual><origin xyz="0 5 0"/><geometry><box size="1 2 3"/></geometry></visual>
</link></robot>
"""


def test_equal_shapes_are_in_the_file_once_and_mirrored_ones_face_outwards(tmp_path: Path) -> None:
    (tmp_path / "tetra.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
    file = tmp_path / "robot.urdf"
    file.write_text(ALIKE)
    robot, data = contents(robot_page(load_description(file)))
    turned, moved, mirrored, red, box, other_box = robot["parts"]
    assert turned["at"] == moved["at"]
    assert box["at"] == other_box["at"]
    assert len({turned["at"], mirrored["at"], red["at"], box["at"]}) == 4
    assert turned["quaternion"] == pytest.approx([0.0, 0.0, math.sin(0.75), math.cos(0.75)])
    assert moved["position"] == [0.0, 3.0, 0.0]
    for part, color in ((moved, None), (mirrored, None), (red, (255, 0, 0, 255))):
        rows = np.frombuffer(data, np.uint8, 16 * part["vertices"], part["at"]).reshape(-1, 16)
        places = rows[:, :6].copy().view("<u2") / 65535.0 * part["size"] + part["low"]
        end = part["at"] + 16 * part["vertices"]
        corners = places[np.frombuffer(data, "<u4", part["faces"], end).reshape(-1, 3)]
        volume = np.einsum("ni,ni->n", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2]).sum() / 6
        assert volume == pytest.approx(2 / 6, rel=1e-3)
        if color is not None:
            assert (rows[:, 12:] == color).all()
    assert mirrored["low"] == pytest.approx([-2.0, 0.0, 0.0])


def test_names_cannot_leave_their_place_and_nothing_is_loaded(tmp_path: Path) -> None:
    file = tmp_path / "robot.urdf"
    file.write_text(MIMIC)
    page = robot_page(load_description(file))
    assert page.count("</script>") == 3
    assert "<b>" not in page.split("<style>")[0]
    assert contents(page)[0]["name"] == "</script><b>"
    assert not re.search(r"https?:|src=|import ", page.split('<script id="data"')[0])


def test_the_command_writes_one_file_and_names_a_missing_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["view", "rover", "--export", str(tmp_path / "rover.html")]) == 0
    assert contents((tmp_path / "rover.html").read_text(encoding="utf-8"))[0]["parts"]
    assert cli.main(["view", "rover", "--export", str(tmp_path / "none" / "rover.html")]) != 0
    assert f"there is no folder {tmp_path / 'none'}" in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "none").exists()


@pytest.mark.slow
@pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium")
@pytest.mark.parametrize("robot", ["arm7", "mimic"])
def test_joints_and_layers_work_in_a_browser(tmp_path: Path, robot: str) -> None:
    pytest.importorskip("websockets")
    file = asset_path("arm7") if robot == "arm7" else tmp_path / "robot.urdf"
    if robot == "mimic":
        file.write_text(MIMIC)
    description = load_description(file)
    out = tmp_path / "page.html"
    out.write_text(robot_page(description), encoding="utf-8")
    page = chromium.Page(out.as_uri(), tmp_path / "profile", (1000, 700))
    try:
        until(lambda: page.evaluate("document.body?.dataset.ready"))
        positions = {}
        for joint in contents(out.read_text(encoding="utf-8"))[0]["joints"]:
            if "range" in joint and "mimic" not in joint:
                lower, upper = joint["range"]
                positions[joint["name"]] = value = lower + 0.7 * (upper - lower)
                page.evaluate(
                    f"(s => {{ s.value = {value}; s.dispatchEvent(new Event('input')); }})"
                    f"(document.querySelector('[data-joint={json.dumps(joint['name'])}]'))"
                )
        if robot == "mimic":
            positions["b"] = 2 * positions["a"] + 0.25
        shown = page.evaluate("window.linkFrames()")
        for name, frame in forward_kinematics(description, positions).items():
            np.testing.assert_allclose(np.reshape(shown[name], (4, 4)).T, frame, atol=1e-9)

        def scene() -> np.ndarray:
            return page.picture()[:, :600]

        seen: list[np.ndarray] = []

        def is_still() -> bool:
            seen.append(scene())
            time.sleep(0.8)
            return np.array_equal(seen[-1], scene())

        def click(layer: str) -> None:
            page.evaluate(f"document.querySelector('[data-layer={layer}]').click()")

        until(is_still)
        before = seen[-1]
        green = lambda p: ((p[..., 1] > p[..., 0] + 25) & (p[..., 1] > p[..., 2] + 15)).mean()  # noqa: E731
        assert green(before) < 0.01
        click("collision")
        until(lambda: green(scene()) > 0.01)
        click("visual")
        until(lambda: np.abs(scene() - before).max() > 50)
        x = "document.querySelector('canvas')"
        page.evaluate(f"{x}.dispatchEvent(new KeyboardEvent('keydown', {{key: 'ArrowLeft'}}))")
        sliders = "[...document.querySelectorAll('input[type=range]')]"
        assert page.evaluate(f"{sliders}.every(e => e.getAttribute('aria-label'))")
    finally:
        page.close()

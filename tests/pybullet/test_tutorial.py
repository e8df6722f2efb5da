"""The tutorial, run as it is, against what its document prints."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import roboyard

ROOT = Path(__file__).parents[2]
SOURCE = str(Path(roboyard.__file__).parents[1])
R2D2_ROWS = {
    "base_to_right_leg": ("4", "-1", "-1", "0", "right_leg", "-1"),
    "right_front_wheel_joint": ("0", "7", "6", "1", "right_front_wheel", "1"),
    "gripper_extension": ("1", "11", "10", "1", "gripper_pole", "-1"),
    "right_gripper_joint": ("0", "13", "12", "1", "right_gripper", "8"),
    "head_swivel": ("0", "14", "13", "1", "head", "-1"),
    "tobox": ("4", "-1", "-1", "0", "box", "13"),
}
FRAMES = {
    "base_to_right_leg": ((0.22, 0.0, 0.25), (0.0, -0.7070904020014416, 0.0, 0.7071231599922604)),
    "right_base_joint": (
        (0.2999999996780742, 0.0, -1.3898038463944216e-05),
        (0.0, 0.7070904020014416, 0.0, 0.7071231599922604),
    ),
    "right_front_wheel_joint": (
        (0.0, 0.133333333333, -0.085),
        (0.0, -0.7070904020014416, 0.0, 0.7071231599922604),
    ),
    "gripper_extension": ((0.0, 0.19, 0.2), (0.0, 0.0, -0.7070904020014416, 0.7071231599922604)),
    "tobox": ((0.0, 0.1214, 0.1214), (0.0, 0.0, 0.0, 1.0)),
    "chassis_joint": ((0.0, 0.0, 0.14493), (0.0, 0.0, 0.0, 1.0)),
    "imu_joint": ((0.08748, 0.00085, 0.09053), (0.0, 0.0, 0.0, 1.0)),
    "front_right_wheel": ((0.34348, -0.28455, -0.06665), (0.0, 0.0, 0.0, 1.0)),
    "rear_bumper": ((-0.39252, 0.00085, -0.00847), (0.0, 0.0, 0.9999999999991198, -1.3267948966775328e-06)),
}
FALLING = [
    *(1.0, 0.9754825000, 0.9265205793, 0.8532349732, 0.7557932696, 0.6344087447),
    *(0.4893388571, 0.3208834200, 0.1293824832),
]


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    folder = tmp_path_factory.mktemp("tutorial")
    done = subprocess.run(
        [sys.executable, str(ROOT / "tools/tutorial_cells.py")],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": SOURCE},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout, folder


def joints(text: str) -> dict[str, dict[str, str]]:
    rows = {}
    for line in re.findall(r"Joint\((.*)\)\n", text):
        fields = dict(re.findall(r"(\w+)=(\([^)]*\)|'[^']*'|[^,]+)", line))
        rows[fields["name"].strip("'")] = fields
    return rows


def numbers(text: str) -> list[float]:
    return [float(x) for x in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", text)]


def test_ids_and_images(printed: tuple[str, Path]) -> None:
    text, _ = printed
    lines = text.splitlines()
    assert lines[:2] == ["0", "2"]
    assert "r2d2 unique ID: 1" in lines
    assert "husky unique ID: 1" in lines
    assert text.count("width : 320, height: 200") == 3
    assert text.count("rgba shape=(200, 320, 4), dtype=uint8") == 3
    assert text.count("depth shape=(200, 320), dtype=float32") == 3
    assert text.count("mask shape=(200, 320), dtype=int32") == 3


def test_joint_tables(printed: tuple[str, Path]) -> None:
    found = joints(printed[0])
    assert len(found) == 15 + 10
    for name, (kind, q, u, flags, link, parent) in R2D2_ROWS.items():
        row = found[name]
        assert (row["type"], row["gIndex"], row["uIndex"], row["flags"]) == (kind, q, u, flags)
        assert (row["linkName"], row["parentIndex"]) == (f"'{link}'", parent)
    for name, (position, orientation) in FRAMES.items():
        np.testing.assert_allclose(numbers(found[name]["parentFramePosition"]), position, atol=1e-6)
        np.testing.assert_allclose(numbers(found[name]["parentFrameOrientation"]), orientation, atol=1e-6)
    gripper = found["left_gripper_joint"]
    limits = [gripper[k] for k in ("lowerLimit", "upperLimit", "maxForce", "maxVelocity")]
    assert limits == ["0.0", "0.548", "1000.0", "0.5"]
    wheel = found["front_left_wheel"]
    assert [wheel[k] for k in ("lowerLimit", "upperLimit", "maxForce", "maxVelocity")] == [
        "0.0",
        "-1.0",
        "0.0",
        "0.0",
    ]
    assert numbers(wheel["axis"]) == [0.0, 1.0, 0.0]


def test_the_rover_falls_as_printed_and_stays_upright(printed: tuple[str, Path]) -> None:
    rows = [numbers(line.split(":", 1)[1]) for line in re.findall(r"^ *\d+: x=.*$", printed[0], re.MULTILINE)]
    assert len(rows) == 20
    for row, z in zip(rows, FALLING, strict=False):
        np.testing.assert_allclose(row, [1.0, -1.0, z, 0.0, 0.0, 0.0], atol=1e-6)
    x, y, z, roll, pitch, _ = rows[-1]
    np.testing.assert_allclose([x, y, z], [1.0734620350, -0.9452093575, 0.1388371824], atol=0.06)
    assert max(abs(roll), abs(pitch)) < 0.3


def test_the_animation_has_twenty_frames(printed: tuple[str, Path]) -> None:
    from PIL import Image

    with Image.open(printed[1] / "husky_falling.gif") as gif:
        assert gif.n_frames == 20
        assert gif.size == (320, 200)

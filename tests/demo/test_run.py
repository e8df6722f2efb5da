"""The whole demo, on robots with known behaviour."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from roboyard.demo import DemoResult, run_demo
from roboyard.demo.demo_world import DemoWorld
from roboyard.demo.motion_sequence import MotionRecorder
from roboyard.demo.plan import make_plan
from roboyard.description import RobotDescription
from roboyard.errors import DescriptionError
from roboyard.morphology.point_model import PointModel

FILES = {"robot.gif", "front.png", "side.png", "top.png", "three_quarter.png", "joints.png", "summary.json"}


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> DemoResult:
    folder = tmp_path_factory.mktemp("demo")
    file = folder / "sloppy arm.urdf"
    file.write_text(_sloppy_arm(), encoding="utf-8")
    phases: list[str] = []
    found = run_demo(file, out=folder / "out", short=True, progress=lambda phase, share: phases.append(phase))
    assert list(dict.fromkeys(phases)) == ["reading", "settling", "views", "moving", "writing"]
    return found


def _sloppy_arm() -> str:
    """An arm with an axis that is not of unit length and a link without inertial."""
    foot = '<origin xyz="0 0 0.05"/><geometry><box size="0.1 0.1 0.1"/></geometry>'
    rod = '<origin xyz="0 0 0.2"/><geometry><cylinder radius="0.03" length="0.4"/></geometry>'
    return f"""<robot name="sloppy">
      <link name="foot"><collision>{foot}</collision><visual>{foot}</visual></link>
      <link name="rod"><inertial><origin xyz="0 0 0.2"/><mass value="1.5"/>
        <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.001"/></inertial>
        <visual>{rod}</visual><collision>{rod}</collision></link>
      <joint name="swing" type="revolute"><parent link="foot"/><child link="rod"/><origin xyz="0 0 0.1"/>
        <axis xyz="0 2 0"/><limit lower="-1.2" upper="0.8" effort="30" velocity="3"/></joint>
    </robot>"""


def test_every_file_is_there_and_nothing_else(result: DemoResult) -> None:
    assert {path.name for path in result.folder.iterdir()} == FILES
    assert [path.name for path in result.folder.parent.iterdir() if path.name.startswith(".")] == []


def test_summary_file_is_what_was_returned(result: DemoResult) -> None:
    text = (result.folder / "summary.json").read_text(encoding="utf-8")
    assert json.loads(text) == result.summary
    assert set(result.summary["files"]) == FILES


def test_the_summary_lists_findings_and_fixes(result: DemoResult) -> None:
    found = {finding["code"] for finding in result.summary["findings"]}
    fixed = {fix["code"] for fix in result.summary["repairs"]}
    assert "axis-not-unit" in found
    assert "axis-not-unit" in fixed
    assert fixed <= found


def test_summary_figures(result: DemoResult) -> None:
    summary = result.summary
    assert summary["links"] == 2
    joint = summary["joints"]["swing"]
    assert joint["limits"] == joint["moved"] == [-1.2, 0.8]
    assert joint["share_of_range"] == 1.0
    assert joint["tracking_error_rms"] < 0.05
    assert summary["stance"]["kind"] == "mounted"
    assert summary["settle_time"] < 0.5
    assert summary["real_time_factor"] == pytest.approx(
        summary["simulated_time"] / summary["stepping_time"], rel=1e-6
    )
    assert summary["simulated_time"] == pytest.approx(summary["steps"] * summary["time_step"], rel=1e-6)
    assert summary["places"]["rod"][2] == pytest.approx(0.1 + summary["stance"]["stand_height"], abs=1e-3)


def test_pictures_show_the_robot_and_the_obstacle(result: DemoResult) -> None:
    for name in ("front", "side", "top", "three_quarter"):
        with Image.open(result.folder / f"{name}.png") as picture:
            pixels = np.asarray(picture.convert("RGB")).astype(int)
        assert pixels.shape == (360, 480, 3)
        orange = (pixels[..., 0] > pixels[..., 2] + 60) & (pixels[..., 0] > pixels[..., 1] + 30)
        assert 0.001 < orange.mean() < 0.5, name


def test_the_film_moves(result: DemoResult) -> None:
    with Image.open(result.folder / "robot.gif") as film:
        assert getattr(film, "n_frames", 1) == result.summary["film"]["frames"] > 10
        first = np.asarray(film.convert("RGB")).astype(int)
        film.seek(film.n_frames // 2)
        later = np.asarray(film.convert("RGB")).astype(int)
    assert (np.abs(first - later).max(axis=-1) > 40).mean() > 0.002


def test_an_unusable_robot_leaves_no_folder(tmp_path: Path) -> None:
    file = tmp_path / "bad.urdf"
    file.write_text('<robot name="bad"><link name="a"/><link name="b"/></robot>', encoding="utf-8")
    with pytest.raises(DescriptionError, match=r"bad\.urdf"):
        run_demo(file, out=tmp_path / "out" / "deep")
    assert [path.name for path in tmp_path.iterdir()] == ["bad.urdf"]


def record_motion(description: RobotDescription) -> MotionRecorder:
    model = PointModel(description)
    recorder = MotionRecorder(DemoWorld(model, make_plan(model)), lambda phase, share: None, short=True)
    recorder.settle_on_support()
    recorder.move()
    return recorder


def test_a_cart_stays_on_its_wheels_and_comes_home(cart: RobotDescription) -> None:
    recorder = record_motion(cart)
    sequence, robot = recorder.sequence, recorder.scene.robot
    assert not robot.is_fixed
    assert not sequence.fell_when_dropped
    assert not sequence.fell_when_moved
    assert sequence.settle_time is not None
    assert robot.position[2] == pytest.approx(0.15, abs=0.005)
    # the wheels turned forth and back, so it is where it was, give or take some slip
    assert np.abs(robot.position[:2]).max() < 0.1
    # while they turned it went as far as they rolled
    rolled = 0.1 * recorder.scene.plan.sweeps["roll_fl"].upper
    assert rolled > 0.1
    assert sequence.errors["lean"][0] < 0.05
    assert robot.joint("wave").position == pytest.approx(0.1 - 2 * robot.joint("lean").position, abs=0.01)


def test_the_base_of_a_walker_is_fixed_after_the_drop(walker: RobotDescription) -> None:
    recorder = record_motion(walker)
    robot, plan = recorder.scene.robot, recorder.scene.plan
    assert robot.is_fixed
    assert robot.position[2] == pytest.approx(0.3 + plan.stand, abs=1e-6)
    assert [body.name for body in recorder.scene.world.bodies].count("walker") == 1
    assert all(rms < 0.05 for rms, _ in recorder.sequence.errors.values())
    positions = np.array(recorder.sequence.record.positions)
    assert positions.max() == pytest.approx(1.0, abs=0.1)
    assert positions.min() == pytest.approx(-1.0, abs=0.1)


def test_recorded_velocities_are_the_slopes_of_the_positions(arm: RobotDescription) -> None:
    record = record_motion(arm).sequence.record
    times = np.array(record.times)
    positions, velocities = np.array(record.positions), np.array(record.velocities)
    assert (np.diff(times) > 0).all()
    slope = np.gradient(positions, times, axis=0)
    assert np.abs(slope - velocities).mean() < 0.03

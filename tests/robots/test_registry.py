"""Which robots are found, live."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from roboyard.assets import asset_path
from roboyard.cli import main
from roboyard.errors import ConfigError
from roboyard.robots import REGISTERED_ROBOTS, Registry, add_robot
from roboyard.sim import World

ARM = """
raw_controller_order: [arm_0]
default_controllers: {arm_0: InverseKinematicsController}
default_joint_pos: [0, 0.5, 0, -1, 0, 0.5, 0]
manipulation:
  arm_joint_names: {"0": [joint1, joint2, joint3, joint4, joint5, joint6, joint7]}
  eef_link_names: {"0": tool}
"""


def place(data: Path, name: str, text: str, dataset: str = "mine") -> Path:
    folder = data / dataset / "models" / name
    (folder / "urdf").mkdir(parents=True)
    (folder / f"{name}.yaml").write_text(text)
    shutil.copytree(asset_path("arm7").parent / "meshes", folder / "urdf" / "meshes")
    shutil.copy(asset_path("arm7"), folder / "urdf" / f"{name}.urdf")
    return folder


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ROBOYARD_DATA", str(tmp_path))
    return tmp_path


def test_bundled_robots_need_no_data_folder(own: Path) -> None:
    assert {"r1", "rover"} <= set(REGISTERED_ROBOTS)
    assert REGISTERED_ROBOTS["rover"].bundled
    assert REGISTERED_ROBOTS.problems() == {}


def test_added_and_removed_files_appear_at_the_next_access(own: Path) -> None:
    assert "gripper_bot" not in REGISTERED_ROBOTS
    folder = place(own, "gripper_bot", ARM)
    assert "gripper_bot" in REGISTERED_ROBOTS
    assert REGISTERED_ROBOTS["gripper_bot"].definition.arm_names == ("0",)
    robot = add_robot(World(), "Gripper_Bot")
    assert robot.n_dof == 7
    shutil.rmtree(folder)
    assert "gripper_bot" not in REGISTERED_ROBOTS


def test_only_a_file_named_like_its_folder_is_registered(own: Path) -> None:
    folder = place(own, "one", ARM)
    (folder / "two.yaml").write_text(ARM)
    assert "two" not in REGISTERED_ROBOTS
    assert "one" in REGISTERED_ROBOTS


def test_a_robot_of_the_data_folder_overrides_a_bundled_one(own: Path) -> None:
    place(own, "rover", ARM)
    assert not REGISTERED_ROBOTS["rover"].bundled
    assert REGISTERED_ROBOTS["rover"].definition.capabilities == ("manipulation",)


def test_an_invalid_file_is_reported_and_others_still_load(own: Path, capsys: pytest.CaptureFixture) -> None:
    place(own, "good", ARM)
    place(own, "bad", "raw_controller_order: 3\ndefault_controllers: {}\n")
    (own / "mine" / "models" / "lost").mkdir()
    (own / "mine" / "models" / "lost" / "lost.yaml").write_text(ARM)
    message = REGISTERED_ROBOTS.problems()
    assert set(message) == {"bad", "lost"}
    assert message["bad"] == "bad.yaml:1: raw_controller_order: must be a list; got 3"
    assert "urdf/lost.urdf" in message["lost"]
    with pytest.raises(ConfigError, match=r"bad\.yaml:1: raw_controller_order"):
        add_robot(World(), "bad")
    assert main(["robots", "--json"]) == 0
    rows = {row["name"]: row for row in json.loads(capsys.readouterr().out)["robots"]}
    assert rows["bad"]["problem"] == message["bad"]
    assert rows["good"]["joints"] == 7
    assert rows["good"]["capabilities"] == ["manipulation"]


def test_unknown_names_list_the_registered_robots(own: Path) -> None:
    with pytest.raises(ConfigError, match="no robot named 'rovr'; did you mean 'rover'"):
        add_robot(World(), "rovr")


def test_a_file_given_as_a_name_is_answered_with_the_import_command() -> None:
    with pytest.raises(ConfigError, match=r"import it: roboyard import models/arm\.urdf --name NAME"):
        REGISTERED_ROBOTS.find("models/arm.urdf")


def test_paths_stay_inside_the_dataset(own: Path) -> None:
    place(own, "sly", ARM + "urdf_path: ../../secret.urdf\n")
    with pytest.raises(ConfigError, match="urdf_path: must be a path inside the dataset"):
        add_robot(World(), "sly")


def test_a_registry_of_another_folder(tmp_path: Path) -> None:
    place(tmp_path, "one", ARM)
    assert list(Registry(tmp_path, with_bundled=False)) == ["one"]


def test_robots_are_listed_with_pictures_that_are_rendered_once(
    own: Path, capsys: pytest.CaptureFixture
) -> None:
    folder = place(own, "good", ARM)
    place(own, "shown", ARM)
    (own / "mine" / "models" / "shown" / "preview.png").write_bytes(b"a picture of its own")
    place(own, "bad", "raw_controller_order: 3\n")

    def pictures(*options: str) -> dict[str, str | None]:
        assert main(["robots", "--json", *options]) == 0
        return {row["name"]: row["picture"] for row in json.loads(capsys.readouterr().out)["robots"]}

    assert pictures("--no-pictures")["good"] is None
    first = pictures()
    assert first["bad"] is None
    assert Path(first["r1"]).is_file()
    assert Path(first["shown"]).name == "preview.png"
    seen = np.asarray(Image.open(first["good"]).convert("RGB"), dtype=float)
    assert seen.shape == (360, 480, 3)
    assert np.ptp(seen[100:260, 180:300], axis=(0, 1)).min() > 100  # an arm, not only the floor
    stamp = Path(first["good"]).stat().st_mtime_ns
    assert pictures() == first
    assert Path(first["good"]).stat().st_mtime_ns == stamp
    (folder / "good.yaml").write_text(ARM + "self_collisions: false\n")
    assert pictures()["good"] != first["good"]


def test_a_robot_has_html_for_notebooks(own: Path) -> None:
    place(own, "<one>", ARM)
    world = World()
    html = add_robot(world, "<one>")._repr_html_()
    assert "data:image/png;base64," in html
    assert "&lt;one&gt;" in html
    assert "<one>" not in html
    assert "<td>arm_0</td><td>InverseKinematicsController</td><td>0 to 5</td>" in html
    assert html.count("<tr>") == 1 + 1 + 1 + 7

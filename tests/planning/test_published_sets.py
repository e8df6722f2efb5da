"""MotionBenchMaker's problem sets in small files of that format: scenes and requests, and VAMP's one file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from roboyard import cli
from roboyard.description.model import Box, Cylinder, Mesh, Sphere
from roboyard.errors import ConfigError
from roboyard.planning.published_sets import load_published_set

ARM = """<robot name="two">
 <link name="base"/>
 <joint name="mount" type="fixed"><parent link="base"/><child link="plate"/><origin xyz="0 0 0.1"/></joint>
 <link name="plate"/>
 <joint name="j1" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
  <limit lower="-3" upper="3" velocity="2" effort="1"/></joint>
 <link name="upper"><collision><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.05 0.05"/></geometry>
  </collision></link>
 <joint name="j2" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.5 0 0.08"/>
  <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="2" effort="1"/></joint>
 <link name="lower"><collision><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.05 0.05"/></geometry>
  </collision></link>
 <joint name="finger" type="prismatic"><parent link="lower"/><child link="tip"/><origin xyz="0.4 0 0"/>
  <axis xyz="1 0 0"/><limit lower="0" upper="0.1" velocity="1" effort="1"/></joint>
 <link name="tip"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>
</robot>"""

SCENE = """
robot_state: {joint_state: {name: [j1], position: [0]}}
fixed_frame_transforms:
  - child_frame_id: camera
    transform: {translation: [0, 0, 1], rotation: [0, 0, 0, 1]}
world:
  collision_objects:
    - id: post
      primitives: [{type: box, dimensions: [0.1, 0.1, 0.5]}]
      primitive_poses: [{position: [0.7, 0, 0], orientation: [0, 0, 0, 1]}]
    - id: turned
      header: {frame_id: world}
      pose: {position: [0, 2, 0], orientation: [0, 0, 0.7071067811865476, 0.7071067811865476]}
      primitives:
        - {type: cylinder, dimensions: [0.4, 0.05]}
        - {dimensions: [0.2], type: sphere}
      primitive_poses:
        - {position: [1, 0, 0], orientation: [0, 0, 0, 1]}
        - {position: [0, 0, 3], orientation: [0, 0, 0, 1]}
    - id: seen
      header: {frame_id: camera}
      meshes:
        - vertices: [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]
          triangles: [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
        - resource: package://sets/objs/part.obj
          dimensions: [2, 2, 2]
      mesh_poses:
        - {position: [0, 3, 0], orientation: [0, 0, 0, 1]}
        - {position: [0, 4, 0], orientation: [0, 0, 0, 1]}
    - id: fixed
      header: {frame_id: plate}
      primitives: [{type: sphere, dimensions: [0.1]}]
      primitive_poses: [{position: [0, -3, 0], orientation: [0, 0, 0, 1]}]
"""
REQUEST = """
group_name: arm
allowed_planning_time: 60
start_state:
  joint_state:
    name: [wheel, j1, j2, finger]
    position: [0.3, -0.6, 0, 0.05]
  multi_dof_joint_state:
    joint_names: [virtual]
    transforms: [{translation: [0.1, 0, 0], rotation: [0, 0, 0, 1]}]
goal_constraints:
  - joint_constraints:
      - {joint_name: j2, position: 0.1}
      - {position: 0.6, joint_name: j1}
"""
PART = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "post_two"
    (made / "objs").mkdir(parents=True)
    (tmp_path / "arm.urdf").write_text(ARM)
    (made / "objs" / "part.obj").write_text(PART)
    for number in (1, 2):
        (made / f"scene{number:04d}.yaml").write_text(SCENE)
        (made / f"request{number:04d}.yaml").write_text(REQUEST)
    return made


def test_scenes_and_requests_are_read(folder: Path) -> None:
    read = load_published_set(folder, folder.parent / "arm.urdf")
    assert read.joints == ("j1", "j2")
    assert read.hold == {"finger": 0.05}  # the robot has no wheel
    assert [problem.name for problem in read.problems] == ["post_two 0001", "post_two 0002"]
    problem = read.problems[0]
    assert problem.start == (-0.6, 0.0)
    assert problem.goal == (0.6, 0.1)
    places = {o.name: np.round(o.pose.position, 9).tolist() for o in problem.obstacles}
    assert places == {  # the robot stands 0.1 m ahead in the scene
        "post": [0.6, 0, 0],
        "turned": [-0.1, 3, 0],
        "turned 1": [-0.1, 2, 3],
        "seen": [-0.1, 3, 1],
        "seen 1": [-0.1, 4, 1],
        "fixed": [0, -3, 0.1],
    }
    shapes = [o.shape for o in problem.obstacles]
    assert shapes[0] == Box(size=(0.1, 0.1, 0.5))
    assert shapes[1] == Cylinder(length=0.4, radius=0.05)
    assert shapes[2] == Sphere(radius=0.2)
    assert isinstance(shapes[3], Mesh)
    assert shapes[3].data is not None
    assert len(shapes[3].data.faces) == 4
    assert isinstance(shapes[4], Mesh)
    assert shapes[4].path == folder / "objs" / "part.obj"
    assert shapes[4].scale == (2, 2, 2)
    assert problem.obstacles[1].pose.quaternion == pytest.approx((0, 0, 0.5**0.5, 0.5**0.5))


def test_the_command_plans_a_folder(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder.parent / "rows.jsonl"
    urdf = str(folder.parent / "arm.urdf")
    assert cli.main(["plan", "--problems", str(folder), "--urdf", urdf, "--out", str(out)]) == 0
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    assert [row["outcome"] for row in rows] == ["solved", "solved"]
    np.testing.assert_allclose(rows[0]["path"][0], [-0.6, 0], atol=1e-9)
    np.testing.assert_allclose(rows[0]["path"][-1], [0.6, 0.1], atol=1e-9)
    assert len(rows[0]["path"]) > 2  # around the post
    assert cli.main(["plan", "--problems", str(folder), "--out", str(out)]) == 1
    assert "--urdf" in capsys.readouterr().err


def test_vamps_file_is_read_and_planned(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    file = tmp_path / "problems.json"
    problem = {
        "index": 7,
        "start": [-0.6, 0],
        "goals": [[0.6, 0.1], [0.7, 0]],
        "box": [
            {
                "name": "post",
                "half_extents": [0.05, 0.05, 0.25],
                "position": [0.6, 0, 0],
                "orientation_quat_xyzw": [0, 0, 0, 1],
            }
        ],
        "sphere": [{"name": "s", "radius": 0.1, "position": [0, 2, 0]}],
        "cylinder": [{"name": "c", "radius": 0.1, "length": 0.3, "position": [0, 3, 0]}],
    }
    file.write_text(json.dumps({"robot": "two", "joints": ["j1", "j2"], "problems": {"post": [problem]}}))
    read = load_published_set(file, tmp_path / "arm.urdf")
    assert read.problems[0].name == "post 7"
    assert read.problems[0].goal == ((0.6, 0.1), (0.7, 0.0))
    assert [o.shape for o in read.problems[0].obstacles] == [
        Box(size=(0.1, 0.1, 0.5)),
        Sphere(radius=0.1),
        Cylinder(length=0.3, radius=0.1),
    ]
    out = tmp_path / "rows.jsonl"
    urdf = str(tmp_path / "arm.urdf")
    assert cli.main(["plan", "--problems", str(file), "--urdf", urdf, "--out", str(out)]) == 0
    row = json.loads(out.read_text())
    assert row["outcome"] == "solved"
    assert any(np.allclose(row["path"][-1], goal) for goal in problem["goals"])


WRONG = {
    "no request": ("request0002.yaml", None, "request0002.yaml"),
    "no goal": ("request0001.yaml", ("goal_constraints", "goals"), "goal_constraints"),
    "pose goal": ("request0001.yaml", ("joint_constraints", "position_constraints"), "joint_constraints"),
    "another group": ("request0002.yaml", ("joint_name: j2", "joint_name: finger"), "finger, j2"),
    "another held position": ("request0002.yaml", ("0, 0.05]", "0, 0.02]"), '"finger" is at 0.02'),
    "primitive": ("scene0001.yaml", ("type: box", "type: cone"), "cone"),
    "size": ("scene0001.yaml", ("[0.1, 0.1, 0.5]", "[0.1, 0.1, -0.5]"), "positive"),
    "mesh file": ("scene0001.yaml", ("objs/part.obj", "objs/other.obj"), "other.obj"),
    "outside": ("scene0001.yaml", ("package://sets/objs/part.obj", "../arm.urdf"), "arm.urdf"),
    "indices": ("scene0001.yaml", ("[1, 2, 3]", "[1, 2, 4]"), "triangles"),
    "frame": ("scene0001.yaml", ("frame_id: plate", "frame_id: lower"), '"lower" is a link that moves'),
    "poses": ("scene0001.yaml", ("dimensions: [0.2]", "dimensions: [0.2, 1]"), "dimensions"),
    "not YAML": ("scene0001.yaml", ("world:", "world: ]"), "not YAML"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_entries_are_named(name: str, folder: Path) -> None:
    file, change, word = WRONG[name]
    path = folder / file
    if change is None:
        path.unlink()
    else:
        text = path.read_text()
        assert change[0] in text
        path.write_text(text.replace(*change))
    with pytest.raises(ConfigError) as error:
        load_published_set(folder, folder.parent / "arm.urdf")
    assert word in str(error.value)
    assert file in str(error.value)

"""`roboyard import` tells what it found, writes the package, and answers bad input in one line."""

import json

from roboyard.assets import asset_path
from roboyard.cli import main

URDF = """<robot name="b"><link name="base"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
<link name="tip"><inertial><mass value="0"/>
<inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>
<visual><geometry><box size=".1 .1 .1"/></geometry></visual></link>
<joint name="j1" type="continuous"><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>
</joint></robot>"""


LINK = """<link name="{name}"><inertial><origin xyz="0 0 0.1"/><mass value="{mass}"/>
<inertia ixx=".02" ixy="0" ixz="0" iyy=".02" iyz="0" izz=".02"/></inertial>
<visual><origin xyz="0 0 0.1"/><geometry><box size=".05 .05 .16"/></geometry></visual>
<collision><origin xyz="0 0 0.1"/><geometry><box size=".05 .05 .16"/></geometry></collision></link>"""
JOINT = """<joint name="joint{k}" type="revolute"><parent link="link{k}"/><child link="link{n}"/>
<origin xyz="0 0 0.2"/><axis xyz="{axis}"/>
<limit lower="-1" upper="1" effort="{effort}" velocity="2"/></joint>"""


def arm_of(effort: float) -> str:
    """Four joints in a row, standing up."""
    links = "".join(LINK.format(name=f"link{k}", mass=20 if k == 0 else 1) for k in range(5))
    joints = "".join(
        JOINT.format(k=k, n=k + 1, effort=effort, axis="0 1 0" if k % 2 else "1 0 0") for k in range(4)
    )
    return f'<robot name="arm">{links}{joints}</robot>'


def test_what_was_found_is_told(tmp_path, capsys):
    file = tmp_path / "b.urdf"
    file.write_text(URDF)
    assert main(["import", str(file), "--name", "b", "--data", str(tmp_path / "data"), "--headless"]) == 0
    out = capsys.readouterr().out
    assert "tip" in out and "mass" in out and "import_report.html" in out
    assert main(["import", str(file), "--name", "b", "--data", str(tmp_path / "data")]) == 1
    assert "overwrite" in capsys.readouterr().err


def test_json_names_the_files(tmp_path, capsys):
    assert main(["import", str(asset_path("cube")), "--data", str(tmp_path), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["name"] == "cube" and result["definition"].endswith("models/cube/cube.yaml")


def test_the_robot_is_tried_out_and_what_fails_is_told(tmp_path, capsys):
    """An arm whose motors cannot move it: the import ends well all the same."""
    file = tmp_path / "weak.urdf"
    file.write_text(arm_of(0.001))
    assert main(["import", str(file), "--data", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "gates passed" in out and "FAIL" in out and "look at" in out
    folder = tmp_path / "omnigibson-robot-assets" / "objects" / "robot" / "weak"
    log = json.loads((folder / "import_log.json").read_text())
    failed = [gate for gate in log["validation"]["gates"] if not gate["passed"]]
    assert failed and all(gate["advice"] for gate in failed)
    assert "failed" in (folder / "import_report.html").read_text()


def test_trial_in_json_and_left_out(tmp_path, capsys):
    file = tmp_path / "strong.urdf"
    file.write_text(arm_of(100))
    assert main(["import", str(file), "--data", str(tmp_path), "--json"]) == 0
    trial = json.loads(capsys.readouterr().out)["validation"]
    passed = {gate["name"]: gate["passed"] for gate in trial["gates"]}
    assert passed["settle"] and passed["self_collision"] and passed["ik_reach"]
    # standing straight up it cannot go up, nor turn about itself: what the gate is there to tell
    assert not passed["response"] and len(trial["gates"]) > 5
    assert main(["import", str(file), "--data", str(tmp_path), "--json", "--overwrite", "--no-validate"]) == 0
    assert json.loads(capsys.readouterr().out)["validation"] is None


def test_a_trial_that_breaks_is_a_warning(tmp_path, capsys, monkeypatch):
    def breaks(*_, **__):
        raise ZeroDivisionError("float division")

    monkeypatch.setattr("roboyard.validation.validate", breaks)
    assert main(["import", str(asset_path("cube")), "--data", str(tmp_path)]) == 0
    assert "could not be tried out: ZeroDivisionError: float division" in capsys.readouterr().out


def test_one_source_is_needed(capsys):
    assert main(["import"]) == 1
    assert "--config" in capsys.readouterr().err


def test_help_shows_the_example(capsys):
    assert main(["import", "--help"]) == 0
    out = capsys.readouterr().out
    assert "convex_links: [base_link]" in out and "use_holonomic_joints" in out


def test_names_that_an_import_keeps_are_not_told():
    from roboyard.cli.importing import _found

    kinds = ("joint-name-odd", "link-name-odd", "mesh-open", "mesh-open")
    lines = _found([{"code": code, "element": "", "message": "it is so", "line": 3} for code in kinds])
    assert lines == ["found: line 3: it is so (and 1 more like this) [mesh-open]"]

"""`roboyard import` prints findings, writes the package, and answers bad input with one line."""

import json
from pathlib import Path

from roboyard.assets import asset_path
from roboyard.cli import main
from roboyard.description import load_description
from roboyard.importer.pipeline import import_robot

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


def test_findings_are_printed(tmp_path, capsys):
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


def test_the_robot_is_validated_and_failed_gates_are_printed(tmp_path, capsys):
    """An arm whose motors cannot move it: the import ends well all the same."""
    file = tmp_path / "weak.urdf"
    file.write_text(arm_of(0.001))
    assert main(["import", str(file), "--data", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "gates passed" in out and "FAIL" in out and "warning: " in out
    folder = tmp_path / "omnigibson-robot-assets" / "objects" / "robot" / "weak"
    log = json.loads((folder / "import_log.json").read_text())
    failed = [gate for gate in log["validation"]["gates"] if not gate["passed"]]
    assert failed and all(gate["advice"] for gate in failed)
    assert "failed" in (folder / "import_report.html").read_text()


def test_validation_is_in_the_json_and_can_be_disabled(tmp_path, capsys):
    file = tmp_path / "strong.urdf"
    file.write_text(arm_of(100))
    assert main(["import", str(file), "--data", str(tmp_path), "--json"]) == 0
    validation = json.loads(capsys.readouterr().out)["validation"]
    passed = {gate["name"]: gate["passed"] for gate in validation["gates"]}
    assert passed["settle"] and passed["self_collision"] and passed["ik_reach"]
    # its rest posture is bent: straight up it could neither move up nor turn about its own axis
    assert passed["response"] and len(validation["gates"]) > 5
    assert main(["import", str(file), "--data", str(tmp_path), "--json", "--overwrite", "--no-validate"]) == 0
    assert json.loads(capsys.readouterr().out)["validation"] is None


def test_a_validation_that_raises_is_a_warning(tmp_path, capsys, monkeypatch):
    def breaks(*_, **__):
        raise ZeroDivisionError("float division")

    monkeypatch.setattr("roboyard.validation.validate", breaks)
    assert main(["import", str(asset_path("cube")), "--data", str(tmp_path)]) == 0
    assert "validation could not run: ZeroDivisionError: float division" in capsys.readouterr().out


def test_a_source_is_required(capsys):
    assert main(["import"]) == 1
    assert "--config" in capsys.readouterr().err


def test_the_source_may_be_a_configuration_or_come_with_one(tmp_path, capsys):
    urdf, config = tmp_path / "b.urdf", tmp_path / "source.yaml"
    urdf.write_text(URDF)
    config.write_text("urdf_path: missing.urdf\nname: configured\n")
    options = ["--no-validate", "--no-report", "--json"]
    assert main(["import", str(config), "--out", str(tmp_path / "a"), *options]) == 1
    assert "missing.urdf" in capsys.readouterr().err
    assert main(["import", str(urdf), "--config", str(config), "--out", str(tmp_path / "b"), *options]) == 0
    assert json.loads(capsys.readouterr().out)["name"] == "configured"
    config.write_text("urdf_path: b.urdf\nname: configured\n")
    for number, sources in enumerate(([str(config)], ["--config", str(config)])):
        assert main(["import", *sources, "--data", str(tmp_path / f"c{number}"), *options]) == 0
        result = json.loads(capsys.readouterr().out)
        assert result["name"] == "configured"
        assert not Path(result["report"]).exists()
    assert main(["import", str(config), "--config", str(config), *options]) == 1
    assert "is a configuration already" in capsys.readouterr().err


def test_a_description_is_a_source(tmp_path):
    file = tmp_path / "b.urdf"
    file.write_text(URDF)
    options = {"validate": False, "report": False}
    made = import_robot(load_description(file), out=tmp_path / "a", **options)
    from_file = import_robot(file, out=tmp_path / "b", **options)
    assert made.name == from_file.name == "b"
    assert made.robot.description.link_by_name.keys() == from_file.robot.description.link_by_name.keys()
    written = [(r.folder / "urdf" / "b.urdf").read_text() for r in (made, from_file)]
    assert written[0] == written[1]


def test_help_shows_the_example(capsys):
    assert main(["import", "--help"]) == 0
    out = capsys.readouterr().out
    assert "convex_links: [base_link]" in out and "use_holonomic_joints" in out


def test_names_that_an_import_keeps_are_not_printed():
    from roboyard.cli.importing import _finding_lines

    kinds = ("joint-name-odd", "link-name-odd", "mesh-open", "mesh-open")
    lines = _finding_lines(
        [{"code": code, "element": "", "message": "it is so", "line": 3} for code in kinds]
    )
    assert lines == ["info: line 3: it is so (and 1 more like this) [mesh-open]"]

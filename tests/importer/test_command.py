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


def test_one_source_is_needed(capsys):
    assert main(["import"]) == 1
    assert "--config" in capsys.readouterr().err


def test_help_shows_the_example(capsys):
    assert main(["import", "--help"]) == 0
    out = capsys.readouterr().out
    assert "convex_links: [base_link]" in out and "use_holonomic_joints" in out

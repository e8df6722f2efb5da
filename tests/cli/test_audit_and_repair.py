"""`roboyard audit` and `roboyard repair`: exit codes, text, JSON, refusals."""

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "audit"))
from audit_cases import CASES, CUBE, INERTIAL, arm, arm_with_joint, both, link, mesh, robot, stl, write_case

from roboyard.cli import main


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))


def test_a_robot_without_faults_is_reported_in_two_lines(tmp_path: Path, capsys) -> None:
    assert main(["audit", str(write_case(arm(), tmp_path))]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "arm.urdf: ok",
        "2 links, 1 joints (1 moving, 0 mimic), 0 mesh files of 0 triangles, 2 kg",
    ]


def test_findings_have_line_element_remedy_and_code(tmp_path: Path, capsys) -> None:
    file = write_case(arm_with_joint(axis='<axis xyz="0 0 0"/>', limit=""), tmp_path)
    assert main(["audit", str(file)]) == 1
    out = capsys.readouterr().out.splitlines()
    assert out[0] == "arm.urdf: not usable (1 error, 1 warning)"
    assert out[2] == ('arm.urdf:4: error: joint "j": <axis> is (0, 0, 0); give a non-zero axis [axis-zero]')
    assert out[3].startswith('arm.urdf:4: warning: joint "j": a revolute joint needs a <limit>')


def test_an_error_that_repair_fixes_exits_0(tmp_path: Path, capsys) -> None:
    assert main(["audit", str(write_case(CASES["mass-missing"][0], tmp_path))]) == 0
    out = capsys.readouterr().out
    assert out.startswith("arm.urdf: usable after repair")
    assert "[mass-missing, repair fixes it]" in out


def test_many_alike_are_counted(tmp_path: Path, capsys) -> None:
    names = [f"l {k}" for k in range(30)]
    joints = [
        f'<joint name="j{k}" type="fixed"><parent link="base"/><child link="{name}"/></joint>'
        for k, name in enumerate(names)
    ]
    file = write_case(robot(link("base"), *[link(name, "") for name in names], *joints), tmp_path)
    assert main(["audit", str(file)]) == 0
    out = capsys.readouterr().out
    assert out.count("[link-name-odd, repair fixes it]") == 1
    assert "and 29 more of [link-name-odd]" in out
    assert main(["audit", "--all", str(file)]) == 0
    assert capsys.readouterr().out.count("[link-name-odd, repair fixes it]") == 30
    assert main(["repair", str(file), "--out", str(tmp_path / "repaired")]) == 0
    out = capsys.readouterr().out
    assert out.count("[link-name-odd]") == 2 and "and 29 more of [link-name-odd], see renames.json" in out


def test_other_findings_that_are_alike_are_shown_a_dozen_times(tmp_path: Path, capsys) -> None:
    joints = [
        f'<joint name="j{k}" type="fixed"><parent link="base"/><child link="l{k}"/></joint>'
        for k in range(30)
    ]
    shape = '<visual><geometry><box size="0 1 1"/></geometry></visual>'
    links = [link(f"l{k}", shape) for k in range(30)]
    main(["audit", str(write_case(robot(link("base"), *links, *joints), tmp_path))])
    lines = capsys.readouterr().out.splitlines()
    (more,) = (line for line in lines if "and 18 more of [" in line)
    code = more.rpartition("[")[2]
    assert sum(f"[{code.rstrip(']')}" in line for line in lines) == 13


def test_json_has_the_documented_keys(tmp_path: Path, capsys) -> None:
    assert (
        main(["audit", "--json", str(write_case(arm_with_joint(axis='<axis xyz="0 0 2"/>'), tmp_path))]) == 0
    )
    data = json.loads(capsys.readouterr().out)
    assert list(data) == ["file", "robot", "status", "usable", "counts", "facts", "findings"]
    (finding,) = data["findings"]
    assert finding == {
        "code": "axis-not-unit",
        "severity": "info",
        "element": 'joint "j"',
        "line": 4,
        "message": "<axis> has length 2",
        "remedy": "scale it to length 1",
        "fixable": True,
        "links": ["tip"],
    }


def test_packages_are_found_where_they_are_named(tmp_path: Path, capsys) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "part.stl").write_bytes(stl(0.1 * CUBE))
    file = write_case(arm(tip=INERTIAL + both(mesh("package://parts/part.stl"))), tmp_path)
    assert main(["audit", str(file)]) == 1
    assert main(["audit", str(file), "--package", f"parts={tmp_path / 'elsewhere'}"]) == 0
    capsys.readouterr()
    out = tmp_path / "out"
    assert main(["repair", str(file), "--out", str(out), "--package", f"parts={tmp_path / 'elsewhere'}"]) == 0
    assert (out / "meshes" / "part.stl").is_file()
    assert main(["audit", str(out / "arm.urdf")]) == 0


def test_html_is_written(tmp_path: Path, capsys) -> None:
    page = tmp_path / "page.html"
    assert main(["audit", str(write_case(arm(), tmp_path)), "--html", str(page)]) == 0
    assert page.read_text(encoding="utf-8").startswith("<!doctype html>")
    assert ": ok" in capsys.readouterr().out


def test_a_missing_file_is_named(tmp_path: Path, capsys) -> None:
    assert main(["audit", str(tmp_path / "absent.urdf")]) == 1
    assert "absent.urdf: error: no such file" in capsys.readouterr().out


def test_a_terminal_gets_a_table(tmp_path: Path, capsys, monkeypatch) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "160")
    assert main(["audit", str(write_case(CASES["axis-zero"][0], tmp_path))]) == 1
    out = capsys.readouterr().out
    assert "fault" in out
    assert "axis-zero" in out
    assert out.index("error") < out.index("axis-zero")


# --------------------------------------------------------------------------------------------------- repair


def test_repair_reports_each_fix_and_the_remaining_findings(tmp_path: Path, capsys) -> None:
    text = arm_with_joint(
        axis='<axis xyz="0 0 2"/>', limit='<limit lower="1" upper="-1" effort="1" velocity="1"/>'
    )
    assert main(["repair", str(write_case(text, tmp_path)), "--out", str(tmp_path / "out")]) == 0
    out = capsys.readouterr().out.splitlines()
    assert out[0] == 'arm.urdf:4: joint "j": <axis xyz="0 0 2"> -> <axis xyz="0 0 1"> [axis-not-unit]'
    assert out[1].startswith("1 fixes, 0 files copied; wrote ")
    assert "[limit-reversed]" in out[-1]


def test_repair_of_what_stays_unusable_exits_1(tmp_path: Path, capsys) -> None:
    file = write_case(CASES["mesh-missing"][0], tmp_path)
    assert main(["repair", str(file), "--out", str(tmp_path / "out")]) == 1
    assert "gone.stl" in capsys.readouterr().out


def test_repair_json_lists_fixes(tmp_path: Path, capsys) -> None:
    file = write_case(CASES["joint-name-odd"][0], tmp_path)
    assert main(["repair", str(file), "--out", str(tmp_path / "out"), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["renames"] == {"links": {}, "joints": {"joint-1": "joint_1"}}
    assert [fix["code"] for fix in data["fixes"]] == ["joint-name-odd"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--only", "nonsense-code"], "no code named 'nonsense-code'"),
        (["--keep", "axis-zero"], "axis-zero is not fixed"),
        (["--package", "x"], "NAME=PATH"),
    ],
)
def test_wrong_options_are_reported_in_one_line(tmp_path: Path, capsys, options, words) -> None:
    command = ["repair", str(write_case(arm(), tmp_path)), "--out", str(tmp_path / "out"), *options]
    assert main(command) == 1
    error = capsys.readouterr().err
    assert words in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "out").exists()


# ------------------------------------------------------------------------------------------- configurations


def test_a_configuration_is_audited_too(tmp_path: Path, capsys) -> None:
    write_case(arm(), tmp_path)
    config = tmp_path / "arm" / "config.yaml"
    config.write_text("urdf_path: arm.urdf\nname: arm\nheadless: true\n")
    assert main(["audit", str(config)]) == 0
    assert "config.yaml: usable" in capsys.readouterr().out
    config.write_text("urdf_path: arm.urdf\nname: arm\nno_such_key: 3\n")
    assert main(["audit", str(config)]) == 1
    assert "no_such_key" in capsys.readouterr().err
    assert main(["audit", "--json", str(config)]) == 1
    data = json.loads(capsys.readouterr().out)
    assert data["usable"] is False
    assert "no_such_key" in data["problems"][0]
    assert main(["audit", str(config), "--html", "page.html"]) == 2

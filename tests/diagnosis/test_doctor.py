"""`roboyard doctor` says what is there, what is missing, and what to do about it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from roboyard import cli
from roboyard.diagnosis import folder_checks, package_checks, robot_checks, speed_checks
from roboyard.diagnosis.packages import EXTRAS, _extra, _required


def test_each_required_package_is_named_with_its_installed_version() -> None:
    checks = {check.name: check for check in package_checks()}
    for name in ("mujoco", "numpy", "numba", "trimesh"):
        assert (checks[name].status, checks[name].detail) == ("ok", metadata.version(name))
    assert {f"extra {extra}" for extra in EXTRAS} <= checks.keys()


def test_every_extra_for_users_is_reported() -> None:
    provided = set(metadata.metadata("roboyard").get_all("Provides-Extra") or ())
    assert set(EXTRAS) == provided - {"test", "test-all", "docs", "dev"}


def test_a_missing_and_an_old_package_name_the_command_that_installs_it() -> None:
    missing = _required(Requirement("no-such-package>=2,<3"))
    assert (missing.status, missing.detail) == ("failed", "no-such-package is not installed")
    assert missing.remedy in ('pip install "no-such-package>=2,<3"', 'pip install "no-such-package<3,>=2"')
    old = _required(Requirement("numpy>=1000"))
    assert old.status == "failed"
    assert old.detail == f"numpy {metadata.version('numpy')} is installed, >=1000 is needed"
    extra = _extra("gui", "pages", [Requirement("no-such-package")])
    assert extra.status == "missing"
    assert extra.remedy.startswith('pip install "viser')  # of the metadata, which works from a checkout, too


def test_a_data_folder_that_cannot_be_written_fails(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ROBOYARD_DATA", str(tmp_path / "data"))
    assert {check.status for check in folder_checks()} <= {"ok", "slow"}
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    checks = {check.name: check for check in folder_checks()}
    assert checks["data folder"].status == "failed"
    assert "ROBOYARD_DATA" in checks["data folder"].remedy
    assert checks["compiled loops"].status == "slow"


def test_a_broken_robot_is_named(tmp_path: Path) -> None:
    folder = tmp_path / "omnigibson-robot-assets" / "models" / "broken"
    (folder / "urdf").mkdir(parents=True)
    (folder / "broken.yaml").write_text("raw_controller_order: 3\n")
    (folder / "urdf" / "broken.urdf").write_text("<robot name='broken'><link name='a'/></robot>")
    run = subprocess.run(
        [sys.executable, "-m", "roboyard", "doctor", "--json", "--no-speed"],
        env={**os.environ, "ROBOYARD_DATA": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    checks = {check["name"]: check for check in json.loads(run.stdout)["checks"]}
    assert run.returncode == 1
    assert checks["robot broken"]["status"] == "failed"
    assert "raw_controller_order" in checks["robot broken"]["detail"]
    assert "remove" in checks["robot broken"]["remedy"]


def test_bundled_robots_load() -> None:
    assert [check.name for check in robot_checks() if check.status != "ok"] == []


def test_speeds_are_measured() -> None:
    assert [check.name for check in speed_checks()] == ["first step", "first picture", "steps", "pictures"]


def test_the_command_prints_every_group(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["doctor", "--no-speed"]) == 0
    printed = capsys.readouterr().out
    for title in ("Packages", "Folders", "Robots"):
        assert f"{title}\n" in printed
    assert "Speed" not in printed
    assert "0 failed" in printed

"""Figures of hulls and spheres against closed forms, and findings that later steps settle."""

import json
import math
from pathlib import Path

import pytest

from roboyard.cli import main
from roboyard.importer.build import build_package
from roboyard.shapes import primitives
from roboyard.shapes.coverage import measure_coverage

BOX = primitives.box(0.05, 0.05, 0.05)


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOYARD_CACHE", str(tmp_path / "cache"))


def test_a_ball_in_and_around_a_cube():
    inner = measure_coverage([BOX], [BOX], [[0, 0, 0]], [0.05])
    assert inner.coverage == pytest.approx(math.pi / 6, abs=0.01)
    assert inner.sphere_excess == 0
    assert inner.excess == 0 and inner.missing < 0.01
    outer = measure_coverage([BOX], [], [[0, 0, 0]], [0.05 * math.sqrt(3)])
    assert outer.coverage == 1 and outer.missing == 1
    volume = 4 / 3 * math.pi * 3**1.5 / 8
    assert outer.sphere_excess == pytest.approx(volume - 1, abs=0.2)  # a voxel's skin counts as link


def test_a_hull_twice_as_wide_and_one_that_is_shifted():
    wide = measure_coverage([BOX], [primitives.box(0.1, 0.05, 0.05)])
    assert wide.excess == pytest.approx(1.0, abs=0.06) and wide.missing < 0.01
    half = primitives.box(0.05, 0.05, 0.025)
    assert measure_coverage([BOX], [half]).missing == pytest.approx(0.5, abs=0.03)


SHELF = """<robot name="shelf"><link name="base"><inertial><mass value="5"/>
<inertia ixx=".1" ixy="0" ixz="0" iyy=".1" iyz="0" izz=".1"/></inertial>
<visual><geometry><mesh filename="shelf.obj"/></geometry></visual>
<collision><geometry><mesh filename="shelf.obj"/></geometry></collision></link>
<link name="tip"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>
<inertia ixx=".01" ixy="0" ixz="0" iyy=".01" iyz="0" izz=".01"/></inertial>
<visual><origin xyz="0.1 0 0"/><geometry><box size=".2 .1 .1"/></geometry></visual>
<collision><origin xyz="0.1 0 0"/><geometry><box size=".2 .1 .1"/></geometry></collision></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="tip"/><origin xyz="0.48 0 0.05"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="20" velocity="2"/></joint></robot>"""
"""Two boards of 2 cm, 40 cm apart: one hull is nine parts air to one part shelf. The tip reaches 2 cm in."""


def obj_of(*boxes):
    vertices, faces = [], []
    for box, z in boxes:
        faces += [[i + 1 + len(vertices) for i in face] for face in box.faces]
        vertices += [(x, y, h + z) for x, y, h in box.vertices]
    return "".join(f"v {x} {y} {z}\n" for x, y, z in vertices) + "".join(
        f"f {a} {b} {c}\n" for a, b, c in faces
    )


@pytest.fixture
def shelf(tmp_path):
    board = primitives.box(0.5, 0.2, 0.01)
    (tmp_path / "shelf.obj").write_text(obj_of((board, 0.01), (board, 0.41)))
    file = tmp_path / "shelf.urdf"
    file.write_text(SHELF)
    return file


def test_mostly_empty_hulls_are_reported_and_decomposition_fixes_them(shelf, tmp_path):
    config = {"urdf_path": str(shelf), "name": "shelf", "canonical_frame": False}
    one = build_package({**config, "collision": {"convex_links": ["base"]}}, out=tmp_path / "data")
    assert one.facts["links"]["base"]["excess"] == pytest.approx(0.42 / 0.04 - 1, rel=0.15)
    assert [w.element for w in one.warnings if "times its volume" in w.message] == ['link "base"']
    assert one.facts["links"]["tip"]["size"] == pytest.approx([0.2, 0.1, 0.1])
    assert one.facts["links"]["base"]["overlaps_mm"]["tip"] == pytest.approx(20, abs=0.5)
    parts = build_package(
        {**config, "collision": {"coacd_links": ["base"]}, "overwrite": True}, out=tmp_path / "data"
    )
    assert parts.facts["links"]["base"]["excess"] < 0.1
    assert not [w for w in parts.warnings if "times its volume" in w.message]


def test_findings_that_hulls_settle_are_no_longer_to_look_at(shelf, tmp_path):
    result = build_package(shelf, out=tmp_path / "data")
    codes = {finding["code"] for finding in result.facts["remaining"]}
    assert "collision-hull-balloons" in codes
    assert "collision-hull-balloons" not in {f["code"] for f in result.facts["unresolved"]}
    assert not [w for w in result.warnings if "collision-hull-balloons" in w.message]
    log = json.loads((result.folder / "import_log.json").read_text())
    assert any("collision-hull-balloons" in d["message"] for d in log["decisions"])


def test_the_figures_of_links_are_in_the_log(shelf, tmp_path, capsys):
    assert main(["import", str(shelf), "--data", str(tmp_path / "data"), "--json", "--no-validate"]) == 0
    folder = Path(json.loads(capsys.readouterr().out)["folder"])
    links = json.loads((folder / "import_log.json").read_text())["links"]
    assert {"size", "mass", "shapes", "excess"} <= set(links["base"])


def test_coacd_leaves_the_rest_of_an_import_its_time() -> None:
    from roboyard.importer.steps.collision import TIME_BUDGET, time_for_coacd

    assert 30.0 < time_for_coacd(30) < TIME_BUDGET < 60.0
    assert time_for_coacd(60) < time_for_coacd(30)
    assert time_for_coacd(500) == 0.2 * TIME_BUDGET

"""Each file is parsed once: what was parsed is passed on from audit to repair to the loaded robot."""

from collections import Counter
from pathlib import Path

import pytest
from audit_cases import arm, write_case

from roboyard.audit import audit_urdf
from roboyard.description import load_description
from roboyard.description.urdf import xml
from roboyard.description.urdf.parse import parse_urdf
from roboyard.repair import repair_urdf


@pytest.fixture
def parsed(monkeypatch) -> Counter[str]:
    """Name of a URDF to how often the XML parser was called for it."""
    counts: Counter[str] = Counter()
    parse = xml._parse

    def counted(data: bytes, file: Path | None, encoding: str | None = None):
        if file is None or file.suffix == ".urdf":
            counts[str(file)] += 1
        return parse(data, file, encoding)

    monkeypatch.setattr(xml, "_parse", counted)
    return counts


def test_elements_are_passed_on_from_audit_to_repair_to_robot(tmp_path, parsed) -> None:
    file = write_case(arm(axis='<axis xyz="0 0 2"/>'), tmp_path)
    elements = parse_urdf(file)
    audit = audit_urdf(elements)
    made = repair_urdf(elements, tmp_path / "out")
    assert made.before == audit
    vendor = load_description(elements)
    repaired = load_description(made.elements)
    assert sorted(parsed.values()) == [1, 1]  # the vendor's file, and the repaired one for its audit
    assert vendor == load_description(file)
    assert repaired == load_description(made.urdf)
    assert repaired.source.file == made.urdf


def test_a_repair_does_not_change_the_elements_that_it_was_given(tmp_path) -> None:
    elements = parse_urdf(write_case(arm(axis='<axis xyz="0 0 2"/>'), tmp_path))
    before = audit_urdf(elements)
    repair_urdf(elements, tmp_path / "out")
    assert elements.root.find("joint/axis").get("xyz") == "0 0 2"
    assert audit_urdf(elements) == before


def test_an_import_parses_each_urdf_once(tmp_path, parsed) -> None:
    from roboyard.assets import asset_path
    from roboyard.importer.build import build_package
    from roboyard.importer.report.page import write_import_page

    source = asset_path("rover")
    build_package(source, out=tmp_path, finish=write_import_page)
    by_place = Counter({("vendor" if file == str(source) else "ours"): 0 for file in parsed})
    for file, count in parsed.items():
        by_place["vendor" if file == str(source) else "ours"] += count
    assert by_place == {"vendor": 1, "ours": 2}  # ours: the repaired copy, and the package's own file


def test_a_demo_parses_each_urdf_once(tmp_path, parsed) -> None:
    from roboyard.assets import asset_path
    from roboyard.demo.load import load_robot

    source = asset_path("rover")
    load_robot(source, packages=None, folder=tmp_path / "out")
    assert parsed[str(source)] == 1
    assert sum(parsed.values()) == 2

"""The XML parser: lines, bounds, and nothing from outside."""

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from roboyard.errors import DescriptionError
from roboyard.urdf import xml
from roboyard.urdf.xml import line_of, read_xml

ARM = Path(__file__).parents[1] / "data" / "urdf" / "arm.urdf"


def test_same_tree_as_the_standard_library():
    root, notes = read_xml(ARM)
    assert notes == ()
    assert ET.tostring(root) == ET.tostring(ET.parse(ARM).getroot())


def test_every_element_has_the_line_of_its_start_tag():
    root, _ = read_xml(ARM)
    lines = ARM.read_text(encoding="utf-8").splitlines()
    for element in root.iter():
        assert f"<{element.tag}" in lines[line_of(element) - 1]


def test_elements_made_elsewhere_have_no_line():
    assert line_of(ET.Element("robot")) is None


def test_undeclared_prefixes_are_kept_as_written():
    root, notes = read_xml("<robot><gazebo:plugin a:b='1'/></robot>")
    assert notes == ()
    assert root[0].tag == "gazebo:plugin"
    assert root[0].attrib == {"a:b": "1"}


@pytest.mark.parametrize(
    "text",
    [
        '<!DOCTYPE robot SYSTEM "robot.dtd"><robot/>',
        '<!DOCTYPE robot [<!ENTITY x SYSTEM "/etc/hostname">]><robot>&x;</robot>',
        '<!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><robot>&b;</robot>',
        '\n\n<!DOCTYPE r [<!ENTITY % p SYSTEM "x"> %p;]><robot/>',
    ],
)
def test_dtd_and_entities_are_refused(text):
    with pytest.raises(DescriptionError, match=r"a DOCTYPE .* is not accepted; remove it"):
        read_xml(text)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_declared_encodings(tmp_path, encoding):
    declared = encoding.removesuffix("-sig")
    file = tmp_path / "robot.urdf"
    file.write_bytes(f'<?xml version="1.0" encoding="{declared}"?><robot name="für"/>'.encode(encoding))
    root, notes = read_xml(file)
    assert root.get("name") == "für"
    assert notes == ()


def test_binary_rubbish_is_refused_quickly(tmp_path):
    file = tmp_path / "robot.urdf"
    file.write_bytes(bytes(range(256)) * 4000)
    with pytest.raises(DescriptionError, match=r"robot\.urdf:1: not well-formed XML"):
        read_xml(file)


def test_bounds(monkeypatch, tmp_path):
    with pytest.raises(DescriptionError, match="nested more than 100 deep"):
        read_xml("<a>" * 101 + "</a>" * 101)
    monkeypatch.setattr(xml, "MAX_ELEMENTS", 1000)
    with pytest.raises(DescriptionError, match="more than 1000 elements"):
        read_xml("<a>" + "<b/>" * 1000 + "</a>")
    monkeypatch.setattr(xml, "MAX_BYTES", 1000)
    file = tmp_path / "robot.urdf"
    file.write_text("<a>" + " " * 1000 + "</a>")
    with pytest.raises(DescriptionError, match="too large for a robot description"):
        read_xml(file)


def test_text_that_cannot_be_mended_names_the_first_fault():
    with pytest.raises(DescriptionError) as caught:
        read_xml("\n<robot>\n<link name=base/>\n</robot>")
    assert caught.value.line == 3


def test_elements_after_the_root_are_not_thrown_away():
    with pytest.raises(DescriptionError, match="junk after document element"):
        read_xml("<robot></robot><robot><link name='a'/></robot>")

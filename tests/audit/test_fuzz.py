"""Broken input of every kind: an audit, never an exception; what passes can be read, repaired, read again.

ROBOYARD_FUZZ_EXAMPLES=10000 looks longer.
"""

import os
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from audit_cases import CASES, CUBE, arm, stl, two_joints
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from roboyard.audit import ERROR, audit_urdf
from roboyard.audit.checks.xml import ATTRIBUTES, CHILDREN
from roboyard.description import load_description
from roboyard.errors import RoboyardError
from roboyard.repair import repair_urdf

EXAMPLES = int(os.environ.get("ROBOYARD_FUZZ_EXAMPLES", "300"))
FUZZ = settings(
    max_examples=EXAMPLES,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.large_base_example],
)

TAGS = sorted({tag for tags in CHILDREN.values() for tag in tags} | {"robot", "gazebo", "xacro:if", "cone"})
KEYS = sorted({key for keys in ATTRIBUTES.values() for key in keys} | {"xmlns:xacro", "reference"})
NUMBERS = [
    "0",
    "1",
    "-1",
    "0.1",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "-inf",
    "1,",
    "0x1",
    "1e999",
    "١",
    "",
]
values = st.one_of(
    st.sampled_from(["base", "tip", "j", "k", "revolute", "fixed", "floating", "continuous", "prismatic"]),
    st.sampled_from(NUMBERS),
    st.lists(st.sampled_from(NUMBERS), max_size=5).map(" ".join),
    st.floats().map(repr),
    st.sampled_from(
        ["part.stl", "package://x/part.stl", "../../etc/passwd", "/", ".", "file://", "part.stl/..", "a\\b"]
    ),
    st.sampled_from(
        ["${x}", "$(optenv A 1)", "{", "]]>", "\u2028", "\ud7ff", "x" * 3000, "é", "基座", " ", "a b"]
    ),
    st.text(max_size=8).filter(lambda text: text.isprintable()),
)
attributes = st.dictionaries(st.sampled_from(KEYS), values, max_size=4)


@st.composite
def elements(draw, depth=4, tag=None) -> ET.Element:
    """A tree in the vocabulary of URDF, mostly in places where it makes sense."""
    tag = tag or draw(st.sampled_from(TAGS))
    element = ET.Element(tag)
    known = ATTRIBUTES.get(tag, ())
    for key in known:
        if draw(st.booleans()):
            element.set(key, draw(values))
    for key, value in draw(attributes).items() if draw(st.integers(0, 3)) == 0 else ():
        element.set(key, value)
    if depth:
        inside = st.sampled_from(CHILDREN.get(tag, TAGS))
        for child in draw(st.lists(inside, max_size=5 if tag == "robot" else 3)):
            element.append(draw(elements(depth=depth - 1, tag=child)))
    return element


SEEDS = [arm(), two_joints(), *(case for pair in CASES.values() for case in pair if isinstance(case, str))]
SEEDS = [text for text in SEEDS if len(text) < 5000]


@st.composite
def mutated(draw) -> bytes:
    """A real robot with a few elements, attributes or bytes changed."""
    text = draw(st.sampled_from(SEEDS))
    try:
        root = ET.fromstring(text)
    except ET.ParseError:
        root = ET.fromstring(arm())
    for _ in range(draw(st.integers(1, 4))):
        nodes = list(root.iter())
        node = nodes[draw(st.integers(0, len(nodes) - 1))]
        match draw(st.integers(0, 5)):
            case 0 if node.attrib:
                node.set(draw(st.sampled_from(sorted(node.attrib))), draw(values))
            case 1 if node.attrib:
                node.attrib.pop(draw(st.sampled_from(sorted(node.attrib))))
            case 2 if len(node):
                node.remove(node[draw(st.integers(0, len(node) - 1))])
            case 3 if len(node):
                node.append(node[draw(st.integers(0, len(node) - 1))])
            case 4:
                node.append(draw(elements(depth=2)))
            case _:
                node.tag = draw(st.sampled_from(TAGS))
    data = ET.tostring(root)
    if draw(st.integers(0, 4)) == 0:
        at = draw(st.integers(0, len(data)))
        data = data[:at] + draw(st.binary(max_size=4)) + data[at + draw(st.integers(0, 6)) :]
    return data


def read_quietly(file: Path) -> None:
    with np.errstate(all="ignore"):
        load_description(file)


def survives(data: bytes) -> None:
    """The invariants of an audit and a repair, for any bytes."""
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder) / "robot"
        home.mkdir()
        (home / "part.stl").write_bytes(stl(0.1 * CUBE))
        file = home / "arm.urdf"
        file.write_bytes(data)
        result = audit_urdf(file)
        assert isinstance(result.to_json(), dict)
        assert list(result.findings) == sorted(result.findings, key=lambda f: f.severity)
        if not any(finding.severity == ERROR for finding in result.findings):
            read_quietly(file)
        try:
            first = repair_urdf(file, Path(folder) / "one")
        except RoboyardError:
            assert not result.is_usable
            return
        assert first.after.is_usable or not result.is_usable
        if first.after.is_usable:
            read_quietly(first.urdf)
        second = repair_urdf(first.urdf, Path(folder) / "two")
        assert second.fixes == ()
        assert first.urdf.read_bytes() == second.urdf.read_bytes()
        assert sorted(path.name for path in home.iterdir()) == ["arm.urdf", "part.stl"]


@pytest.mark.slow
@FUZZ
@given(elements(tag="robot").map(ET.tostring))
def test_any_tree_gets_an_audit(data: bytes) -> None:
    survives(data)


@pytest.mark.slow
@FUZZ
@given(mutated())
def test_any_change_to_a_robot_gets_an_audit(data: bytes) -> None:
    survives(data)


@FUZZ
@given(st.binary(max_size=200) | st.text(max_size=200).map(lambda text: text.encode("utf-8", "replace")))
def test_any_bytes_get_an_audit(data: bytes) -> None:
    survives(data)

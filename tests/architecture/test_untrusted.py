"""Files are read through `roboyard.untrusted`, which bounds them: no reader opens one by itself."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from house import SOURCE, Call, modules, outline

OWN_FILES = {
    "roboyard._mujoco": "entry points of installed packages",
    "roboyard.viewer.bar.bar": "bar.js, which is part of this package",
    "roboyard.config.yaml_edit": "the backup of a file that was read before",
    "roboyard.demo.output": "the summary that the demo wrote",
    "roboyard.importer.verify.read_back": "what the import has just written",
    "roboyard.native.called": "sources of this package",
    "roboyard.native.objects": "machine code that was stored here",
    "roboyard.reports.robot_page.page": "page.html, which is part of this package",
    "roboyard.robots.pictures": "files of a registered robot, which were read before",
    "roboyard.shapes.convex.coacd_process": "what our own child process wrote",
    "roboyard.shapes.convex.coacd_worker": "what our own parent process wrote",
    "roboyard.viewer.driving.insets": "insets.js, which is part of this package",
    "roboyard.viewer.driving.panel": "a video that was written here",
    "roboyard.viewer.inspector.edits.save_edits": "a file that was read within bounds before",
    "roboyard.viewer.inspector.panels.link_tree": "link_tree.js, which is part of this package",
    "roboyard.viewer.inspector.panels.save_panel": "a file that was read within bounds before",
    "roboyard.viewer.page.document": "early.js, which is part of this package",
    "roboyard.viewer.timeline.time_folder": "a state log that was written here",
    "roboyard.untrusted.files": "the one place",
}
"""Modules that read files of their own, and why."""
READING = {"read_text", "read_bytes"}


def reads_a_file(call: Call) -> bool:
    numpy = call.owner == "np" and call.attribute in ("load", "loadtxt", "genfromtxt")
    return numpy or call.attribute in READING


def reads_of(path: Path) -> list[int]:
    """Lines on which a module reads a file by itself."""
    return [call.line for call in outline(path).calls if reads_a_file(call)]


def test_readers_open_files_in_one_place() -> None:
    reads = {name: reads_of(path) for name, path in modules().items()}
    others = {name: lines for name, lines in reads.items() if lines and name not in OWN_FILES}
    assert not others, f"read with roboyard.untrusted.files.read_file: {others}"


OWN_JSON = {
    "roboyard.description.xacro.expand": "what our own child process wrote",
    "roboyard.description.xacro.worker": "what our own parent process wrote",
    "roboyard.demo.output": "the summary that the demo wrote",
    "roboyard.importer.collection.pool": "what our own child process wrote",
    "roboyard.importer.collection.worker": "what our own parent process wrote",
    "roboyard.pybullet.face.wire": "messages that are bounded before",
    "roboyard.recording.state_log": "an array that is bounded before",
    "roboyard.shapes.convex.coacd_worker": "what our own parent process wrote",
    "roboyard.shapes.convex.decomposition": "an array that is bounded before",
    "roboyard.untrusted.json_reading": "the one place",
    "roboyard.viewer.page.page_script": "messages of a page, which are bounded before",
}
"""Modules that parse JSON by themselves, and why."""


OWN_YAML = {
    "roboyard.config.yaml_edit": "places in the text, after its values were counted",
    "roboyard.config.yaml_lines": "lines of the text, after its values were counted",
    "roboyard.untrusted.yaml_reading": "the one place",
}
"""Modules that parse YAML by themselves, and why."""


def parses_of(path: Path, library: str) -> list[int]:
    """Lines on which a module parses JSON or YAML by itself."""
    parsing = ("load", "loads", "safe_load", "load_all", "safe_load_all", "compose", "parse")
    calls = outline(path).calls
    return [call.line for call in calls if call.owner == library and call.attribute in parsing]


def test_readers_parse_json_in_one_place() -> None:
    parses = {name: parses_of(path, "json") for name, path in modules().items()}
    found = {name for name, lines in parses.items() if lines}
    others = found - set(OWN_JSON)
    assert not others, f"parse with roboyard.untrusted.json_reading: {sorted(others)}"
    assert set(OWN_JSON) - found <= {"roboyard.pybullet.face.wire"}


def test_readers_parse_yaml_in_one_place() -> None:
    found = {name for name, path in modules().items() if parses_of(path, "yaml")}
    assert found == set(OWN_YAML)


def test_every_exception_is_one() -> None:
    assert set(OWN_FILES) <= set(modules())
    assert SOURCE.is_dir()

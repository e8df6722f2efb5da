"""Xacro arguments as the launch files of a robot's packages pass them.

Many vendors' files work only with arguments that a launch file gives. The text of launch files (XML of ROS 1
and 2, Python of ROS 2) is read, nothing of it is run: `name:=value` beside the robot's file, with the launch
arguments' defaults for values, and `mappings={...}` of Python.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from roboyard._records import dataclass
from roboyard.description.files.workspaces import package_name
from roboyard.untrusted.files import read_file

MAX_LAUNCH_FILES = 300
"""Launch files that are read."""
_MAX_BYTES = 1 << 20
_LEVELS = 8
_ENDINGS = (".launch", ".launch.xml", ".launch.py", ".py", ".xml")
_PASSED = re.compile(r"(\w+):=(?:'([^']*)'|\"([^\"]*)\"|([^\s'\"]*))")
_XML_COMMENT = re.compile(r"<!--.*?-->", re.S)
_XACRO = re.compile(r"[^\s'\"]*\.xacro\b")
_FIND = re.compile(r"\$\(find\s+(\S+?)\)")
_ANY = "\1"
"""Represents a launch argument in a file's name."""
_WILD = re.compile(r"\$\((?:arg|var)\s+\w+\)")
_XML_ARG = re.compile(r"<arg\b([^>]*)>", re.S)
_ATTRIBUTE = re.compile(r"(\w+)\s*=\s*(?:\"([^\"]*)\"|'([^']*)')")
_PY_COMMENT = re.compile(r"^\s*#.*$", re.M)
_PY_PASSED = re.compile(
    r"[\"']\s*(\w+)\s*:=([^\"']*)[\"']\s*(?:,\s*(?:(?:LaunchConfiguration\(\s*[\"'](\w+)[\"']\s*\))|(\w+)))?"
)
_PY_DECLARED = re.compile(
    r"DeclareLaunchArgument\(\s*(?:name\s*=\s*)?[\"'](\w+)[\"'](.*?)(?=DeclareLaunchArgument\(|\Z)", re.S
)
_PY_VALUE = re.compile(r"default_value\s*=\s*(?:'([^'\n]*)'|\"([^\"\n]*)\")")
_PY_CHOICES = re.compile(r"choices\s*=\s*\[([^\]]*)\]")
_PY_VARIABLE = re.compile(r"^\s*(\w+)\s*=\s*LaunchConfiguration\(\s*[\"'](\w+)[\"']", re.M)
_PY_MAPPINGS = re.compile(r"mappings\s*=\s*\{([^}]*)\}")
_PY_PAIR = re.compile(r"[\"'](\w+)[\"']\s*:\s*[\"']([^\"']*)[\"']")
_TEXT = re.compile(r"[\"']([^\"']*)[\"']")


@dataclass(frozen=True, kw_only=True, slots=True)
class LaunchArguments:
    """Arguments that one launch file passes to a robot's xacro file."""

    file: Path
    values: Mapping[str, str]
    """Argument to its value: stated, or the default of the launch argument that it takes."""
    choices: Mapping[str, tuple[str, ...]]
    """Argument without a value to those that the launch file allows; empty where it names none."""


def launch_arguments(file: Path) -> tuple[LaunchArguments, ...]:
    """Return what launch files pass to a xacro file; the nearest launch files first, each set once.

    Args:
        file: the robot. Launch files of its package and of the packages beside it are read where they contain
            the file's name, or, in XML, one that a launch argument completes (`talos_$(arg robot).xacro`).
    """
    found: list[LaunchArguments] = []
    for launch in _launch_files(file):
        try:
            text = read_file(launch, _MAX_BYTES).decode("utf-8", "replace")
        except (OSError, ValueError):
            continue
        if launch.suffix != ".py":
            values, choices = _of_xml(text, file)
        elif file.name in text:
            values, choices = _of_python(text)
        else:
            continue
        known = any(values == each.values and choices == each.choices for each in found)
        if (values or choices) and not known:
            found.append(LaunchArguments(file=launch, values=values, choices=choices))
    return tuple(found)


def _launch_files(file: Path) -> Iterator[Path]:
    """Yield launch files of the robot's package, then those of the packages beside it."""
    above = list(file.absolute().parents)[:_LEVELS]
    package = next((folder for folder in above if (folder / "package.xml").is_file()), None)
    if package is None:
        return
    beside = [folder for folder in _folders(package.parent) if (folder / "package.xml").is_file()]
    count = 0
    for home in (package, *(folder for folder in beside if folder != package)):
        beside_robot = (file.absolute().parent,) if home == package else ()
        for folder in (home / "launch", *_folders(home / "launch"), *beside_robot):
            for each in _entries(folder):
                if each.name.endswith(_ENDINGS) and each.is_file():
                    count += 1
                    if count > MAX_LAUNCH_FILES:
                        return
                    yield each


def _entries(folder: Path) -> list[Path]:
    try:
        return sorted(folder.iterdir())
    except OSError:
        return []


def _folders(folder: Path) -> list[Path]:
    return [each for each in _entries(folder) if each.is_dir() and not each.is_symlink()]


def _names(command: str, file: Path) -> bool:
    """Return whether a command names a xacro file, perhaps with launch arguments in the name."""
    if file.name in command:
        return True
    for match in _XACRO.finditer(_WILD.sub(_ANY, _FIND.sub(r"@\1@", command))):
        folder, _, name = match[0].rpartition("/")
        pattern = ".+".join(re.escape(part) for part in name.split(_ANY))
        package = re.match(r"@(.+?)@", folder)
        known = package is not None and any(
            package[1] in (above.name, package_name(above)) for above in file.absolute().parents[:_LEVELS]
        )
        if known and _ANY in name and re.fullmatch(pattern, file.name):
            return True
    return False


def _of_xml(text: str, file: Path) -> tuple[dict[str, str], dict[str, tuple[str, ...]]]:
    text = _XML_COMMENT.sub("", text)
    defaults: dict[str, str] = {}
    for match in _XML_ARG.finditer(text):
        given = {key: one or other for key, one, other in _ATTRIBUTE.findall(match[1])}
        value = given.get("value", given.get("default"))
        if value is not None and "name" in given:
            defaults.setdefault(given["name"], value)
    values: dict[str, str] = {}
    choices: dict[str, tuple[str, ...]] = {}
    for match in re.finditer(r"command\s*=\s*(?:\"([^\"]*)\"|'([^']*)')|\$\(command\s+'([^']*)'", text):
        command = next(group for group in match.groups() if group is not None).replace("&quot;", '"')
        if not _names(command, file):
            continue
        for key, *texts in _PASSED.findall(re.sub(r"\$\((?:arg|var) (\w+)\)", r"@\1@", command)):
            value = re.sub(r"@(\w+)@", lambda m: defaults.get(m[1], "@"), "".join(texts))
            if "@" in value or "$(" in value:
                choices.setdefault(key, ())
            else:
                values.setdefault(key, value)
    return values, {key: each for key, each in choices.items() if key not in values}


def _of_python(text: str) -> tuple[dict[str, str], dict[str, tuple[str, ...]]]:
    text = _PY_COMMENT.sub("", text)
    defaults: dict[str, str] = {}
    allowed: dict[str, tuple[str, ...]] = {}
    for name, body in _PY_DECLARED.findall(text):
        if value := _PY_VALUE.search(body):
            defaults[name] = (value[1] if value[1] is not None else value[2]).strip("\"'")
        if listed := _PY_CHOICES.search(body):
            allowed[name] = tuple(_TEXT.findall(listed[1]))
    variables = dict(_PY_VARIABLE.findall(text))
    values: dict[str, str] = {}
    choices: dict[str, tuple[str, ...]] = {}
    for key, stated, direct, variable in _PY_PASSED.findall(text):
        source = direct or variables.get(variable, "")
        if stated.strip():
            values.setdefault(key, stated.strip())
        elif source in defaults:
            values.setdefault(key, defaults[source])
        else:
            choices.setdefault(key, allowed.get(source, ()))
    for block in _PY_MAPPINGS.findall(text):
        for key, value in _PY_PAIR.findall(block):
            values.setdefault(key, value)
    return values, {key: each for key, each in choices.items() if key not in values}

"""Expand a xacro file into URDF with the `xacro` package; ROS is not needed.

The file is untrusted: it is expanded in a child process (`roboyard.description.xacro.worker`) with bounds on
time, memory and files, which reads only the robot's folders.
"""

from __future__ import annotations

import re
import sys
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from roboyard.description.files.resolver import Resolver
from roboyard.description.urdf.write import to_element
from roboyard.description.urdf.xml import LocatedElement, read_xml
from roboyard.errors import DescriptionError

SUFFIX = ".xacro"
USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
_MAX_TRIES = 4
"""Launch files whose arguments are tried."""
_TIMEOUT = 60.0
"""Wall time of the child process (s); its CPU time has a bound of its own."""
_OWN = {"arg", "attribute", "call", "element", "if", "include", "insert_block", "macro", "property", "unless"}
_WORKER = "roboyard.description.xacro.worker"


def robot_stem(file: Path) -> str:
    """Return the name of a robot file without its suffixes: `arm` for `arm.urdf.xacro`."""
    return Path(file.stem).stem if file.suffix.lower() == SUFFIX else file.stem


def is_xacro(file: Path | None, root: ET.Element | None = None) -> bool:
    """Return whether a file has to be expanded: by its suffix, or by elements of xacro in it."""
    if file is not None and file.suffix.lower() == SUFFIX:
        return True
    prefix = "xacro:"
    return root is not None and any(
        isinstance(element.tag, str)
        and element.tag.startswith(prefix)
        and element.tag.removeprefix(prefix) in _OWN
        for element in root.iter()
    )


def read_robot_xml(
    file: Path, resolver: Resolver, arguments: Mapping[str, str] | None = None, *, expand: bool = True
) -> tuple[ET.Element, tuple[str, ...]]:
    """Return the root element of a robot file as URDF, xacro expanded, and notes on each correction.

    Args:
        file: a URDF, xacro, MJCF, SDF or USD file, or another XML file.
        resolver: finds the files that the robot may read.
        arguments: values of `<xacro:arg>` by name.
        expand: whether MJCF, SDF, USD, and xacro elements in files with another suffix than `.xacro`, are
            expanded too.

    Raises:
        DescriptionError: the file cannot be read or expanded, or there are arguments and it is no xacro.
    """
    if file.suffix.lower() in USD_SUFFIXES and expand:
        return _from_usd(file, resolver)
    if not is_xacro(file):
        root, notes = read_xml(file)
        if root.tag == "mujoco" and expand:
            return _from_mjcf(file)
        if root.tag == "sdf" and expand:
            return _from_sdf(root, file, resolver)
        if not (expand and is_xacro(None, root)):
            if arguments:
                raise DescriptionError(
                    f"xacro arguments ({', '.join(arguments)}) are given for a plain file; omit them",
                    file=file,
                )
            return root, notes
    return expand_xacro(file, resolver, arguments)


def _from_mjcf(file: Path) -> tuple[ET.Element, tuple[str, ...]]:
    """Return an MJCF file as URDF elements, and notes on what they do not hold."""
    from roboyard.description.mjcf.build import read_mjcf  # loads MuJoCo

    description = read_mjcf(file)
    return to_element(description), description.notes


def _from_usd(file: Path, resolver: Resolver) -> tuple[ET.Element, tuple[str, ...]]:
    """Return the robot of a USD stage as URDF elements, and notes on what they do not hold."""
    from roboyard.description.usd.build import read_stage  # loads OpenUSD

    description = read_stage(file, resolver)
    return to_element(description), description.notes


def _from_sdf(root: ET.Element, file: Path, resolver: Resolver) -> tuple[ET.Element, tuple[str, ...]]:
    """Return an SDF file as URDF elements, and notes on what they do not hold."""
    from roboyard.description.sdf.build import read_sdf

    return read_sdf(root, file, resolver)


def expand_xacro(
    file: Path, resolver: Resolver, arguments: Mapping[str, str] | None = None
) -> tuple[ET.Element, tuple[str, ...]]:
    """Return the root element of an expanded xacro file, and notes on each correction.

    Where the file cannot be expanded with the arguments given, those that a launch file of its packages
    passes to it are taken, with a note. `$(find NAME)` becomes `package://NAME`. Elements of the file itself
    keep their line, those of included files have none.

    Raises:
        DescriptionError: the file cannot be read or expanded; `file` and `line` are those of the element.
    """
    if not file.is_file():
        read_xml(file)  # raises with the reason
    answer, used = _run_worker(file, resolver, arguments or {}), ""
    if "error" in answer:
        answer, used = _with_launch_arguments(file, resolver, arguments or {}, answer)
    if "error" in answer:
        raise _error(file, answer)
    root, notes = read_xml(_plain_uris(answer["xml"]))
    notes = (*notes, used) if used else notes
    notes = (*notes, *(f"xacro: {name} is omitted: {reason}" for name, reason in answer.get("absent", ())))
    notes = (*notes, *_notes_on_prefixes(answer))
    elements = [element for element in root.iter() if isinstance(element.tag, str)]
    if len(elements) == len(answer["lines"]):
        for element, (source, line) in zip(elements, answer["lines"], strict=True):
            if isinstance(element, LocatedElement):
                element.line = line if source == str(file) else None
    return root, notes


def _notes_on_prefixes(answer: Mapping[str, Any]) -> list[str]:
    """Return a note on elements of xacro without prefix, which ROS's xacro does not take for its own."""
    bare = answer.get("bare", ())
    if not bare:
        return []
    tag, source, line = bare[0]
    where = f"<{tag}> in {Path(source).name}:{line}" + (f" and {len(bare) - 1} more" if len(bare) > 1 else "")
    if answer["prefixed"]:
        done = "read as xacro's, since no link comes out otherwise; ROS's xacro leaves them unread"
    else:
        done = f"left unread, as by ROS's xacro; write <xacro:{tag}> to use it"
    return [f"xacro: elements without the prefix xacro: ({where}) are {done}"]


def _with_launch_arguments(
    file: Path, resolver: Resolver, arguments: Mapping[str, str], failed: dict[str, Any]
) -> tuple[dict[str, Any], str]:
    """Return the answer with the arguments of a launch file and a note on them; else the failure, with the
    arguments that launch files pass added to its message.
    """
    from roboyard.description.xacro.launch_arguments import launch_arguments

    found = launch_arguments(file)
    for launch in found[:_MAX_TRIES]:
        added = {name: value for name, value in launch.values.items() if name not in arguments}
        if not added:
            continue
        answer = _run_worker(file, resolver, {**added, **arguments})
        if "error" not in answer:
            listed = " ".join(f"{name}:={value}" for name, value in added.items())
            return answer, f"xacro: arguments of {launch.file.name} are used: {listed}; see --xacro-arg"
    open_choices = {
        name: (launch.file.name, values)
        for launch in reversed(found)
        for name, values in launch.choices.items()
        if name not in arguments
    }
    if open_choices:
        listed = ", ".join(
            f"{name} ({', '.join(values)})" if values else name for name, (_, values) in open_choices.items()
        )
        launched = next(iter(open_choices.values()))[0]
        text = f"; {launched} passes arguments that have no default: {listed}; give them with --xacro-arg"
        failed = {**failed, "error": f"{failed['error']}{text}"}
    return failed, ""


def _run_worker(file: Path, resolver: Resolver, arguments: Mapping[str, str]) -> dict[str, Any]:
    import json
    import subprocess

    request = {
        "file": str(file),
        "packages": {name: str(folder) for name, folder in (resolver.packages or {}).items()},
        "search_paths": [str(folder) for folder in resolver.search_paths],
        "arguments": dict(arguments),
    }
    try:
        done = subprocess.run(  # noqa: S603 - our own module, the file's name is passed on stdin
            [sys.executable, "-m", _WORKER],
            input=json.dumps(request),
            capture_output=True,
            text=True,
            encoding="utf-8",
            timeout=_TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise DescriptionError(
            f"xacro: the expansion takes more than {_TIMEOUT:g} s; look for macros that call themselves",
            file=file,
        ) from None
    if done.returncode != 0:
        last = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
        remedy = "look for macros or loops without end"
        if "No module named" in last[0]:
            remedy = f"install Roboyard again in the environment of {sys.executable}"
        raise DescriptionError(f"xacro: the expansion stopped ({last[0][:200]}); {remedy}", file=file)
    return json.loads(done.stdout)


def _plain_uris(text: str) -> str:
    """`file://$(find NAME)/...` as `package://NAME/...`."""
    return text.replace("file://package://", "package://")


def _error(file: Path, answer: dict[str, Any]) -> DescriptionError:
    message = str(answer["error"])
    undefined = re.match(r"Undefined substitution argument ([^\s;]+)", message)
    if undefined is not None:
        name, more = undefined[1].strip("'"), message[undefined.end() :]
        message = f"the argument {name!r} has no value; give it with --xacro-arg {name}:=VALUE{more}"
    elif not message.endswith(tuple(".;")) and ";" not in message:
        message = f"{message}; correct the file at this place"
    source = Path(str(answer.get("file") or file))
    line = answer.get("line")
    if source.name == file.name and not isinstance(line, int):
        return DescriptionError(f"xacro: {message}", file=file)
    return DescriptionError(f"xacro: {message}", file=source, line=line if isinstance(line, int) else None)

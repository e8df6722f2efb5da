"""Do the xacro robots of vendors' repositories import with no ROS? One table for repositories in folders.

    python benchmarks/xacro_repositories.py REPO_DIR... [--import {none,one,all}] [--xacro PYTHON]
                                            [--out FILE] [--jobs N]

A robot file is a xacro file that makes links and that no other xacro file of the repository includes. Each is
expanded, read and its meshes are looked for, in a process of its own, with the arguments' own defaults or
those of a launch file (the first choice where it leaves one open); packages are searched in the repository,
then in all folders given, as in a workspace. With `--import one` (the default) the smallest robot of each
repository is also imported as a package, without validation; meshes that a repository lacks are omitted.

A row is `robot`, or why it is none: `part` (expands to no link), `argument` (an argument without default),
`package` (a package that no folder given holds), `file` (a file that the repository lacks), `error`. The
last lines count repositories in which a robot imports, parts aside, and robots among the files whose
packages and arguments are there. With `--xacro PYTHON`, an interpreter that has the package `xacro`, each
robot is also expanded by ROS's own xacro, with a stand-in for ROS's index of packages, and compared:
elements, attributes and texts, in order. `alone` are files of which ROS's xacro makes no robot.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import zip_longest
from pathlib import Path
from typing import Any

ROW = "row: "
INCLUDE = re.compile(r"<(?:xacro:)?include[^>]*filename\s*=\s*[\"']([^\"']+)")
NEEDS = {
    "argument": r"has no value; give it with|is required",
    "package": r"--package \w+=FOLDER",
    "file": r"No such file or directory|does not exist|is missing|not found",
}


def main() -> None:
    """Read every robot of the repositories and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "folders", nargs="*", type=Path, metavar="REPO_DIR", help="a repository's folder each"
    )
    parser.add_argument("--import", dest="imports", choices=("none", "one", "all"), default="one")
    parser.add_argument("--out", type=Path, help="write the rows as JSON")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds for each robot")
    parser.add_argument("--jobs", type=int, default=1, help="robots that are read at once")
    parser.add_argument("--xacro", help="a Python interpreter that has the package xacro")
    parser.add_argument("--one", nargs=3, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one is not None:
        file, folders, action = arguments.one
        row = read_robot(Path(file), [Path(f) for f in json.loads(folders)], action, arguments.xacro)
        print(ROW + json.dumps(row))
        return
    if not arguments.folders:
        parser.error("give the folders of repositories")
    folders = [folder.resolve() for folder in arguments.folders]
    todo = [(folder, file) for folder in folders for file in top_files(folder)]

    def run(item: tuple[Path, Path]) -> dict[str, Any]:
        return _in_process(item[0], item[1], folders, "read", arguments.limit, arguments.xacro)

    with ThreadPoolExecutor(max_workers=arguments.jobs) as pool:
        rows = list(pool.map(run, todo))
        chosen = [] if arguments.imports == "none" else _to_import(rows, arguments.imports)
        done = pool.map(
            lambda row: _in_process(
                Path(row["repository"]), Path(row["file"]), folders, "import", arguments.limit
            ),
            chosen,
        )
        for row, made in zip(chosen, done, strict=True):
            row["imported"] = made["outcome"] == "robot"
            row["message"] = "" if row["imported"] else made["message"]
            row["import_seconds"] = made["seconds"]
    if arguments.out:
        arguments.out.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    print(table(rows, folders))


def top_files(folder: Path) -> list[Path]:
    """Return the xacro robots of a repository that no other file of it includes, sorted."""
    from roboyard.description.files.robot_files import robot_files

    included: set[str] = set()
    for file in folder.rglob("*.xacro"):
        text = file.read_text(encoding="utf-8", errors="replace")
        included |= {Path(name).name for name in INCLUDE.findall(text)}
    return [file for file in robot_files(folder) if file.suffix == ".xacro" and file.name not in included]


def read_robot(file: Path, folders: Sequence[Path], action: str, xacro: str | None = None) -> dict[str, Any]:
    """Return outcome, message, links and seconds of one robot file.

    Args:
        file: of the robot.
        folders: whose packages it may use, its repository first.
        action: `read` expands and reads it, `import` makes a package.
        xacro: an interpreter with ROS's xacro to compare with.
    """
    from roboyard.description.files.workspaces import packages_below

    packages: dict[str, Path] = {}
    for folder in folders:
        packages = {**packages_below(folder), **packages}
    began = time.perf_counter()
    row = _tried(file, packages, action, {})
    for arguments in first_choices(file) if row["outcome"] != "robot" else ():
        chosen = _tried(file, packages, action, arguments)
        if chosen["outcome"] == "robot":
            row = {**chosen, "arguments": arguments}
            break
    row["seconds"] = round(time.perf_counter() - began, 2)
    if xacro is not None and row["outcome"] == "robot":
        row["same"] = _compared(file, packages, row.get("arguments", {}), xacro)
    return row


def _compared(file: Path, packages: dict[str, Path], arguments: dict[str, str], xacro: str) -> str:
    """Return `same`, where the expansion differs from that of ROS's xacro, or why there is none of it."""
    from roboyard.description.files.resolver import Resolver
    from roboyard.description.xacro.expand import expand_xacro

    root, notes = expand_xacro(file, Resolver.of_file(file, packages=packages), arguments)
    folders = {name: str(folder) for name, folder in packages.items()}
    used = _launch_arguments(notes)
    question = {"file": str(file), "arguments": {**used, **arguments}, "packages": folders}
    call = [xacro, str(Path(__file__).with_name("ros_xacro.py"))]
    done = subprocess.run(call, input=json.dumps(question), capture_output=True, text=True, check=False)
    if done.returncode:
        return "alone: " + (done.stderr.strip().splitlines() or ["?"])[-1][:200]
    document = ET.fromstring(done.stdout)
    if document.find("link") is None:
        return "alone: no link comes out of ROS's xacro"
    theirs = _flat(document, folders)
    for own, other in zip_longest(_flat(root, folders), theirs):
        if own != other:
            return f"differs: {own} | {other}"[:400]
    return "same"


def _launch_arguments(notes: Sequence[str]) -> dict[str, str]:
    """Return the arguments that were taken from a launch file, as the note says."""
    return dict(pair for note in notes for pair in re.findall(r"(\w+):=([^\s;]*)", note) if "launch" in note)


def _flat(root: ET.Element, folders: dict[str, str]) -> list[tuple[Any, ...]]:
    """Return tag, attributes and text of all elements, paths of packages as `package://NAME`."""
    names = {folder: name for name, folder in folders.items() if Path(folder).name != name}
    names |= {folder: name for name, folder in folders.items() if folder not in names}

    def plain(text: str) -> str:
        for folder, name in sorted(names.items(), reverse=True):
            text = text.replace(f"file://{folder}/", f"package://{name}/")
            text = text.replace(f"{folder}/", f"package://{name}/")
        return re.sub(r"(?<=\w)/+", "/", text.replace("file://package://", "package://")).strip()

    def local(name: str) -> str:
        return name.rpartition("}")[2].rpartition(":")[2]

    return [
        (
            local(each.tag),
            sorted((local(key), plain(value)) for key, value in each.items() if not key.startswith("xmlns")),
            plain(each.text or ""),
        )
        for each in root.iter()
        if isinstance(each.tag, str)
    ]


def first_choices(file: Path) -> list[dict[str, str]]:
    """Return the arguments of each launch file that leaves some open, with the first of their choices."""
    from roboyard.description.xacro.launch_arguments import launch_arguments

    found = launch_arguments(file)
    return [
        {**launch.values, **{name: values[0] for name, values in launch.choices.items() if values}}
        for launch in found
        if any(launch.choices.values())
    ]


def _tried(file: Path, packages: dict[str, Path], action: str, arguments: dict[str, str]) -> dict[str, Any]:
    from roboyard.errors import ConfigError, DescriptionError

    row: dict[str, Any] = {"outcome": "robot", "message": "", "links": 0}
    try:
        if action == "import":
            from roboyard import import_robot

            with tempfile.TemporaryDirectory() as out:
                options: dict[str, Any] = {"missing_meshes": "warn", "validate": False, "report": False}
                options["xacro_args"] = arguments or None
                made = import_robot(file, name="robot", out=out, packages=packages, **options)
                row["links"] = len(made.robot.description.links)
        else:
            from roboyard.description import load_description

            found = load_description(file, packages=packages, missing_meshes="note", xacro_args=arguments)
            row["links"] = len(found.links)
            row["missing_meshes"] = sum(
                not _has_file(item.geometry)
                for link in found.links
                for item in (*link.visuals, *link.collisions)
            )
    except (ConfigError, DescriptionError) as error:
        row |= {"outcome": outcome_of(str(error)), "message": str(error).splitlines()[0][:300]}
    except Exception as error:
        row |= {"outcome": "error", "message": f"{type(error).__name__}: {error}"[:300]}
    return row


def _has_file(geometry: object) -> bool:
    path = getattr(geometry, "path", None)
    return path is None or Path(path).is_file()


def outcome_of(message: str) -> str:
    """Return why a file is no robot, by the message of its error."""
    if re.search("no <?link", message.lower()):
        return "part"
    return next((name for name, words in NEEDS.items() if re.search(words, message)), "error")


def _in_process(
    folder: Path, file: Path, folders: list[Path], action: str, limit: float, xacro: str | None = None
) -> dict[str, Any]:
    order = [folder, *(other for other in folders if other != folder)]
    call = [sys.executable, __file__, "--one", str(file), json.dumps([str(f) for f in order]), action]
    call += ["--xacro", xacro] if xacro is not None else []
    row: dict[str, Any] = {"repository": str(folder), "file": str(file)}
    try:
        done = subprocess.run(call, capture_output=True, text=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        return {**row, "outcome": "error", "message": f"more than {limit:g} s", "links": 0, "seconds": limit}
    lines = [line for line in done.stdout.splitlines() if line.startswith(ROW)]
    if not lines:
        last = (done.stderr.strip().splitlines() or ["it printed nothing"])[-1]
        return {**row, "outcome": "error", "message": last[:300], "links": 0, "seconds": 0.0}
    return {**row, **json.loads(lines[-1].removeprefix(ROW))}


def _to_import(rows: list[dict[str, Any]], which: str) -> list[dict[str, Any]]:
    """Return the rows of robots to import: all, or the one with the fewest links of each repository."""
    robots = [row for row in rows if row["outcome"] == "robot" and row["links"] > 1]
    if which == "all":
        return robots
    first: dict[str, dict[str, Any]] = {}
    for row in sorted(robots, key=lambda row: (row.get("missing_meshes", 0) > 0, row["links"])):
        first.setdefault(row["repository"], row)
    return list(first.values())


def table(rows: list[dict[str, Any]], folders: Sequence[Path]) -> str:
    """Return a Markdown table with one line a repository, what failed below it, and the shares."""
    lines = ["| repository | files | robots | parts | argument | package | file | error | imported |"]
    lines.append("|---|---|---|---|---|---|---|---|---|")
    whole, failed = [], []
    for folder in folders:
        own = [row for row in rows if row["repository"] == str(folder)]
        if not own:
            continue
        count = Counter(row["outcome"] for row in own)
        tried = [row for row in own if "imported" in row]
        passed = any(row["imported"] for row in tried) if tried else count["robot"] > 0
        if set(count) != {"part"}:
            whole.append(passed)
        text = f"{sum(row['imported'] for row in tried)} of {len(tried)}" if tried else ""
        numbers = [count[name] for name in ("robot", "part", "argument", "package", "file", "error")]
        lines.append("| " + " | ".join(map(str, (folder.name, len(own), *numbers, text))) + " |")
        failed += [row for row in own if row["outcome"] not in ("robot", "part") or row.get("message")]
    lines.append("")
    for row in failed:
        place = Path(row["file"]).relative_to(Path(row["repository"]).parent)
        lines.append(f"- {place}: {row['outcome']}: {row['message'].replace(row['repository'], '')}")
    compared = Counter(row["same"].partition(":")[0] for row in rows if "same" in row)
    if compared:
        lines += ["", "against ROS's xacro: " + ", ".join(f"{n} {name}" for name, n in compared.items())]
        found = [row for row in rows if row.get("same", "same") != "same"]
        lines += [f"- {Path(row['file']).name}: {row['same']}" for row in found]
    count = Counter(row["outcome"] for row in rows)
    able = count["robot"] + count["error"]
    lines += [
        "",
        f"repositories with a robot that imports: {sum(whole)} of {len(whole)}"
        f" ({100 * sum(whole) / max(len(whole), 1):.0f} %)",
        f"robots among files whose packages, files and arguments are there: {count['robot']} of {able}"
        f" ({100 * count['robot'] / max(able, 1):.0f} %)",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    main()

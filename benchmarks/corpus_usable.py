"""Is an imported robot usable? Import each robot without configuration, validate it, drive it at random.

    python benchmarks/corpus_usable.py --robots DIR_OR_URDF... [--out DIR] [--only REGEX] [--limit S]
        [--jobs N] [--again]

Every URDF in the folders is imported and validated in a process of its own, then driven for 30 s by random
actions in the scene `home`. It must not fall through anything, hold a NaN or leave its joint limits. Rows are
added to DIR/rows.jsonl as they come, so that an interrupted run goes on where it was (--again repeats);
DIR/usable.md and DIR/usable.json have the table of the rows so far. ROS packages are searched in the folders
given and above each file.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

SECONDS = 30.0
"""Simulated duration of random actions (s)."""
HELD = 15
"""Control steps for which a random action is held: half a second."""
BEYOND = 0.01
"""Largest excess over a joint limit (rad or m); limits are soft contacts."""
BELOW = 0.05
"""Depth of a link's origin or of the whole robot below the floor that counts as falling through (m)."""
ROW = "row: "


def main() -> None:
    """Run the robots that have no row yet, and write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", nargs="+", type=Path, default=[], help="URDF files, or folders of them")
    parser.add_argument("--out", type=Path, default=Path("usable"), help="folder of the rows and the table")
    parser.add_argument("--only", default="", help="regular expression that a file's path must match")
    parser.add_argument("--limit", type=float, default=400.0, help="seconds for each robot")
    parser.add_argument("--jobs", type=int, default=1, help="robots that are run at once")
    parser.add_argument("--again", action="store_true", help="run robots that have a row, too")
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one is not None:
        print(ROW + json.dumps(run_robot(arguments.one)))
        return
    if not arguments.robots:
        parser.error("--robots: give URDF files or folders of them")
    arguments.out.mkdir(parents=True, exist_ok=True)
    log = arguments.out / "rows.jsonl"
    rows = {} if arguments.again else read_rows(log)
    files = [file for file in find_files(arguments.robots) if re.search(arguments.only, str(file))]
    names = short_names(files)
    folders = [str(path.absolute()) for path in arguments.robots if path.is_dir()]
    left = [file for file in files if names[file] not in rows]
    with ThreadPoolExecutor(max(arguments.jobs, 1)) as pool:
        for file, found in zip(
            left, pool.map(lambda file: run_apart(file, folders, arguments.limit), left), strict=True
        ):
            row = {"robot": names[file], **found}
            rows[names[file]] = row
            with log.open("a") as out:
                out.write(json.dumps(row) + "\n")
            print(f"{row['status']:8} {row['robot']}: {'; '.join(row.get('why', ()))}", flush=True)
            write_tables([rows[names[file]] for file in files if names[file] in rows], arguments.out)
    chosen = [rows[names[file]] for file in files if names[file] in rows]
    write_tables(chosen, arguments.out)
    print(
        f"{sum(row['status'] == 'ok' for row in chosen)} of {len(chosen)} usable; {arguments.out}/usable.md"
    )


def write_tables(rows: list[dict[str, Any]], folder: Path) -> None:
    """Write the rows as JSON and as Markdown."""
    (folder / "usable.json").write_text(json.dumps(rows, indent=1) + "\n")
    (folder / "usable.md").write_text(table(rows))


def find_files(robots: list[Path]) -> list[Path]:
    """Return the URDF files among files and in folders, sorted."""
    found: set[Path] = set()
    for path in robots:
        found |= {file.absolute() for file in path.rglob("*.urdf")} if path.is_dir() else {path.absolute()}
    return sorted(found)


def short_names(files: list[Path]) -> dict[Path, str]:
    """Return each file's path without the folders that all share."""
    common = Path(os.path.commonpath([file.parent for file in files])) if files else Path()
    return {file: file.relative_to(common).with_suffix("").as_posix() for file in files}


def read_rows(log: Path) -> dict[str, dict[str, Any]]:
    """Return the rows of earlier runs by robot."""
    if not log.is_file():
        return {}
    return {row["robot"]: row for row in map(json.loads, log.read_text().splitlines())}


def run_apart(file: Path, folders: list[str], limit: float) -> dict[str, Any]:
    """Return the row of a robot, from a process of its own."""
    paths = [*folders, *filter(None, os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep))]
    environment = {**os.environ, "ROS_PACKAGE_PATH": os.pathsep.join(paths)}
    command = [sys.executable, __file__, "--one", str(file)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit, env=environment)
    except subprocess.TimeoutExpired:
        return {"status": "timeout", "why": [f"no result after {limit:g} s"]}
    rows = [line.removeprefix(ROW) for line in done.stdout.splitlines() if line.startswith(ROW)]
    if rows:
        return json.loads(rows[-1])
    return {"status": "crash", "why": [f"exit {done.returncode}: {done.stderr.strip()[-300:]}"]}


def run_robot(file: Path) -> dict[str, Any]:
    """Import, validate and drive one robot, and return its row."""
    from roboyard.errors import RoboyardError
    from roboyard.importer.build import build_package
    from roboyard.robots.registry import Registry
    from roboyard.validation import validate

    with tempfile.TemporaryDirectory(prefix="roboyard-usable-") as data:
        began = time.process_time()
        try:
            package = build_package(file, name="robot", out=data)
        except RoboyardError as error:
            return {"status": "refused", "why": [" ".join(str(error).split())[:300]]}
        robot = package.robot
        row: dict[str, Any] = {
            "links": len(robot.description.links),
            "import_cpu_s": round(time.process_time() - began, 2),
            "kind": robot.semantic.kind,
            "base": robot.semantic.base,
        }
        registered = Registry(data)["robot"]
        report = validate(registered)
        row["validate_s"] = round(report.seconds, 1)
        row["gates"] = {gate.name: gate.passed for gate in report.gates if not gate.skipped}
        row["failed"] = {gate.name: list(gate.findings[:3]) or [gate.detail] for gate in report.failed}
        row["warnings"] = [text for gate in report.gates for text in gate.warnings]
        row["random"] = list(drive_at_random(registered))
    row["why"] = [f"{name}: {found[0]}" for name, found in row["failed"].items()] + row["random"]
    if row["random"]:
        row["why"] += [f"limits: {text}" for text in report.gate("limits").warnings]
    row["status"] = "ok" if not row["why"] else "gates" if not row["random"] else "random"
    return row


def drive_at_random(registered: Any) -> Iterator[str]:
    """Yield what goes wrong in 30 s of random actions in the scene `home`."""
    import numpy as np

    from roboyard.errors import ModelError
    from roboyard.robots import add_robot
    from roboyard.scenes import load_scene

    scene = load_scene("home")
    robot = add_robot(scene.world, registered, scene.spawn, scene.spawn_orientation)
    low, high = np.maximum(robot.action_space.low, -1.0), np.minimum(robot.action_space.high, 1.0)
    rng = np.random.default_rng(0)
    action = np.zeros(robot.action_dim)
    beyond = np.zeros(robot.n_dof)
    joints = robot.description.joint_by_name
    own = [k for k, name in enumerate(robot.joint_names) if joints[name].mimic is None]
    for step in range(round(SECONDS * robot.control_freq)):
        if step % HELD == 0:
            action = rng.uniform(low, high)
        robot.apply_action(action)
        try:
            scene.world.step(robot.steps_per_control)
        except ModelError as error:
            yield str(error)
            return
        q = robot.joint_positions
        if not (np.isfinite(q).all() and np.isfinite(robot.position).all()):
            yield f"a joint position or the base is NaN after {step / robot.control_freq:.1f} s"
            return
        beyond = np.maximum(beyond, np.maximum(robot.limits.lower - q, q - robot.limits.upper))
        if step % HELD == 0 and robot.body.bounds[1, 2] < scene.spawn[2] - BELOW:
            yield f"it fell through the floor after {step / robot.control_freq:.1f} s"
            return
    lowest = (
        min(float(robot.link(link.name).pose[0][2]) for link in robot.description.links if link.collisions)
        if any(link.collisions for link in robot.description.links)
        else 0.0
    )
    if lowest < scene.spawn[2] - 10 * BELOW:
        yield f"a link is {-lowest:.2f} m below the floor"
    for k in own:
        if beyond[k] > BEYOND:
            yield f"joint {robot.joint_names[k]!r} is {beyond[k]:.3g} beyond its limits"


def table(rows: list[dict[str, Any]]) -> str:
    """Return the rows as Markdown."""
    lines = [
        "| robot | kind | base | links | import, CPU s | gates | 30 s at random | failing |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        gates = row.get("gates", {})
        passed = f"{sum(gates.values())} of {len(gates)}" if gates else "-"
        moved = "-" if "random" not in row else "ok" if not row["random"] else "failed"
        why = "; ".join(row.get("why", ())).replace("|", "/") or ""
        cells = [row["robot"], row.get("kind", "-"), row.get("base", "-"), row.get("links", "-")]
        cells += [row.get("import_cpu_s", "-"), passed, moved, why if gates else f"{row['status']}: {why}"]
        lines.append("| " + " | ".join(str(cell) for cell in cells) + " |")
    usable = sum(row["status"] == "ok" for row in rows)
    refused = sum(row["status"] == "refused" for row in rows)
    lines += ["", f"{usable} of {len(rows)} robots are usable; {refused} files are refused.", ""]
    return "\n".join(lines)


if __name__ == "__main__":
    main()

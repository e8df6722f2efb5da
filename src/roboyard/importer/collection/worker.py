"""The process that imports robots, one after another: a task is a line of JSON, and so is its result.

It ends at once where its parent closes the connection or dies. Nothing but results goes to standard output.
"""

from __future__ import annotations

import json
import os
import queue
import sys
import threading
import time
from pathlib import Path
from typing import Any, TextIO

MARK = "roboyard-result "
"""Beginning of a line that holds a result."""


def main() -> None:
    """Import robots until the parent ends the connection."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    tasks: queue.Queue[str] = queue.Queue()
    threading.Thread(target=_listen, args=(sys.stdin, tasks), daemon=True).start()
    while True:
        result = run_task(json.loads(tasks.get()))
        answers.write(f"{MARK}{json.dumps(result)}\n")
        answers.flush()


def _listen(lines: TextIO, tasks: queue.Queue[str]) -> None:
    for line in lines:
        tasks.put(line)
    os._exit(1)  # the parent is gone: what is under way would be lost in any case


def run_task(data: dict[str, Any]) -> dict[str, Any]:
    """Import the robot of a `Task`, given as plain data; return a `TaskResult` as such."""
    from roboyard.errors import RoboyardError
    from roboyard.importer.pipeline import import_robot

    begin = time.monotonic()
    result: dict[str, Any] = {"name": data["name"], "shown": data["shown"], "message": "", "facts": {}}
    try:
        made = import_robot(
            Path(data["file"]),
            name=data["name"],
            out=data["out"],
            dataset=data["dataset"],
            overwrite=data["overwrite"] or None,
            missing_meshes=data["missing_meshes"],
            validate=data["validate"],
            report=data["report"],
        )
    except RoboyardError as error:
        result |= {"outcome": "refused", "message": _line(error)}
    except MemoryError:
        result |= {"outcome": "failed", "message": "out of memory"}
    except Exception as error:  # one robot costs only itself
        result |= {"outcome": "failed", "message": f"{type(error).__name__}: {_line(error)}"}
    else:
        result |= {"outcome": "imported", "facts": _facts(made, data)}
        if made.validation is not None and made.validation.failed:
            result["message"] = made.validation.failed[0].line()
    result["seconds"] = round(time.monotonic() - begin, 2)
    return result


def _line(error: BaseException) -> str:
    lines = str(error).splitlines() or [""]
    more = f" (and {len(lines) - 1} more)" if len(lines) > 1 else ""
    return f"{lines[0][:400]}{more}"


def _facts(made: Any, data: dict[str, Any]) -> dict[str, Any]:
    """Return what the table shows of an import."""
    description, semantic = made.robot.description, made.robot.semantic
    gates = [] if made.validation is None else [gate for gate in made.validation.gates if not gate.skipped]
    return {
        "links": len(description.links),
        "joints": sum(joint.is_moving for joint in description.joints),
        "mass": round(sum(link.inertial.mass for link in description.links if link.inertial), 3),
        "kind": semantic.kind,
        "warnings": len(made.warnings),
        "gates": [sum(gate.passed for gate in gates), len(gates)],
        "folder": str(made.folder),
        "report": str(made.report) if data["report"] else None,
        "picture": _picture(made, Path(data["picture"])),
    }


def _picture(made: Any, file: Path) -> str | None:
    """Write a picture of the robot; None where it cannot be drawn."""
    from roboyard.rendering import png_bytes
    from roboyard.robots.portrait import render_portrait
    from roboyard.robots.registry import packaged_robot
    from roboyard.robots.spawn import add_robot
    from roboyard.sim.world import World

    try:
        world = World()
        world.add_plane()
        robot = add_robot(world, packaged_robot(made.definition))
        robot.set_pose(robot.position - [0.0, 0.0, robot.body.bounds[0, 2]])
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(png_bytes(render_portrait(robot)))
    except Exception:  # the import is done; a picture is not worth losing it
        return None
    return str(file)


if __name__ == "__main__":
    main()

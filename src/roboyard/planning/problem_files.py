"""Files of planning problems (JSON) and their results (JSON lines).

    {"urdf": "arm.urdf", "joints": ["j1", "j2"], "hold": {"finger": 0.04}, "time_limit": 5.0,
     "limits": {"velocity": [1.5, 1.5], "acceleration": [8, 8], "jerk": [200, 200]},
     "obstacles": [{"name": "o0", "type": "box", "size": [0.1, 0.2, 0.3],
                    "position": [0.5, 0, 0.4], "quaternion": [0, 0, 0, 1]}],
     "problems": [{"name": "p0", "start": [0, 0], "goal": {"joints": [1, 1]}}]}

Obstacles are of type "box" (size: full lengths), "sphere" (radius), "cylinder" and "capsule" (radius, length
along z, for a capsule without its caps), and "mesh" (file, scale). Goals are {"joints": [...]} or {"link",
"position", "quaternion"}; without a quaternion the orientation is free. "hold", "time_limit", "limits",
"planner" (a cuRobo or XRDF file) and own obstacles of a problem are optional. Paths are relative to the file.
"""

from __future__ import annotations

import json
import reprlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from roboyard.description import load_description
from roboyard.description.model import Box, Capsule, Cylinder, Mesh, Pose, Sphere
from roboyard.errors import ConfigError, unknown_name
from roboyard.planning.goals import Goal, PoseGoal, PosesGoal
from roboyard.planning.obstacles import Obstacle, Shape
from roboyard.planning.planner import Planner
from roboyard.planning.planner_files import load_planner_file
from roboyard.planning.spheres.link_fit import covering_model, fitted_model
from roboyard.planning.spheres.sphere_model import SphereModel
from roboyard.planning.trajectory import Plan
from roboyard.transforms import normalized
from roboyard.untrusted.json_reading import read_json

_SHORT = reprlib.Repr()
"""Values in messages, cut where they are long."""
_SHORT.maxlist = _SHORT.maxdict = 12
_SHORT.maxstring = _SHORT.maxother = 120
LARGEST_NUMBER = 1e12
"""Beyond it, a number in a file is a mistake."""

TIME_LIMIT = 5.0
"""Longest search of a problem (s)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Problem:
    """One start and goal."""

    name: str
    start: tuple[float, ...]
    """(n,) joint positions (rad or m)."""
    goal: Goal
    obstacles: tuple[Obstacle, ...]
    """All obstacles of this problem."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ProblemFile:
    """A robot, its surroundings and the motions to plan."""

    path: Path
    urdf: Path
    planner: Path | None
    joints: tuple[str, ...]
    hold: Mapping[str, float]
    """Joint name to position (rad or m)."""
    time_limit: float
    """s"""
    limits: Mapping[str, Sequence[float]]
    """"velocity", "acceleration", "jerk" to a limit for each joint."""
    problems: tuple[Problem, ...]


def load_problems(path: Path | str) -> ProblemFile:
    """Return the problems of a file.

    Raises:
        ConfigError: the file cannot be read, or an entry is missing or wrong.
    """
    file = Path(path)
    try:
        data = read_json(file, 64 << 20)
    except json.JSONDecodeError as error:
        raise ConfigError(f"{file.name}:{error.lineno}: not JSON: {error.msg}; correct the file") from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror or error}; check the path") from None
    except ValueError as error:
        raise ConfigError(f"{file.name}: cannot be read: {error}") from None
    if not isinstance(data, dict):
        raise ConfigError(f'{file.name}: must be an object with "urdf", "joints" and "problems"')
    joints = tuple(_entry(file, data, "joints", list))
    for k, joint in enumerate(joints):
        if not isinstance(joint, str):
            raise ConfigError(f"{file.name}: joints[{k}] is {_SHORT.repr(joint)}; give a joint's name")
    shared = _obstacles(file, data.get("obstacles", []), "obstacles")
    problems = []
    for k, one in enumerate(_entry(file, data, "problems", list)):
        where = f"problems[{k}]"
        if not isinstance(one, dict):
            raise ConfigError(f"{file.name}: {where} is {_SHORT.repr(one)}; it must be an object")
        start = tuple(numbers(file, one, "start", where, len(joints)))
        own = _obstacles(file, one.get("obstacles", []), f"{where}.obstacles")
        problems.append(
            Problem(
                name=str(one.get("name", f"p{k}")),
                start=start,
                goal=_goal(file, one.get("goal"), where, len(joints)),
                obstacles=(*shared, *own),
            )
        )
    limits = _entry(file, {"limits": {}, **data}, "limits", dict)
    for key in limits:
        if key not in ("velocity", "acceleration", "jerk"):
            known = ("velocity", "acceleration", "jerk")
            raise ConfigError(f"{file.name}: limits: {unknown_name('limit', key, known)}")
        if isinstance(limits[key], list):
            numbers(file, limits, key, "limits", len(joints))
        else:
            _number(file, limits, key, "limits")
    held = _entry(file, {"hold": {}, **data}, "hold", dict)
    named = data.get("planner")
    return ProblemFile(
        path=file,
        urdf=file.parent / str(_entry(file, data, "urdf", str)),
        planner=None if named is None else file.parent / str(named),
        joints=joints,
        hold={name: _number(file, held, name, "hold") for name in held},
        time_limit=_number(file, {"time_limit": TIME_LIMIT, **data}, "time_limit", "the file"),
        limits=limits,
        problems=tuple(problems),
    )


def solve_problems(
    problems: ProblemFile, *, seed: int = 0, progress: Callable[[str], None] | None = None
) -> Iterator[tuple[Problem, Plan]]:
    """Yield each problem with its plan; the first call compiles or loads the kernels outside any timing.

    Args:
        problems: the loaded file.
        seed: seed of the random samples.
        progress: called with a line of text while spheres are fitted.

    Raises:
        ConfigError: a joint or file does not exist.
        DescriptionError: the URDF cannot be loaded.
    """
    model = load_model(problems, progress)
    planner, of = None, None
    for problem in problems.problems:
        if planner is None or problem.obstacles != of:
            planner = Planner(
                model,
                problems.joints,
                problem.obstacles,
                held=problems.hold,
                velocity=problems.limits.get("velocity"),
                acceleration=problems.limits.get("acceleration"),
                jerk=problems.limits.get("jerk"),
            )
            of = problem.obstacles
            planner.warm_up()
        yield problem, planner.plan(problem.start, problem.goal, time_limit=problems.time_limit, seed=seed)


def load_model(problems: ProblemFile, progress: Callable[[str], None] | None = None) -> SphereModel:
    """Return the robot of a problem file: from its planner file, or fitted to its URDF.

    Raises:
        ConfigError: a file does not exist or is wrong.
        DescriptionError: the URDF cannot be loaded.
    """
    if not problems.urdf.is_file():
        raise ConfigError(f"{problems.path.name}: urdf: there is no file {problems.urdf}; check the path")
    description = load_description(problems.urdf)
    if problems.planner is not None:
        return covering_model(load_planner_file(problems.planner, description), progress)
    return fitted_model(description, rest=problems.hold, progress=progress)


def row_of(name: str, plan: Plan) -> dict[str, Any]:
    """Return a plan as an object of the results file."""
    made = plan.trajectory
    trajectory = None
    if made is not None:
        trajectory = {"t": made.t.tolist(), "q": made.q.tolist(), "v": made.v.tolist(), "a": made.a.tolist()}
    return {
        "name": name,
        "outcome": plan.outcome,
        "reason": plan.reason,
        "planning_seconds": plan.planning_seconds,
        "timing_seconds": plan.timing_seconds,
        "path": plan.path.tolist(),
        "trajectory": trajectory,
    }


# ----------------------------------------------------------------------------------- entries


def _entry(file: Path, data: Mapping[str, Any], key: str, kind: type) -> Any:
    if not isinstance(data.get(key), kind):
        wanted = {list: "a list", str: "a text", dict: "an object"}[kind]
        raise ConfigError(f'{file.name}: "{key}" is {_SHORT.repr(data.get(key))}; it must be {wanted}')
    return data[key]


def _number(file: Path, data: Mapping[str, Any], key: str, where: str) -> float:
    value = data[key]
    if not isinstance(value, int | float) or not abs(value) < LARGEST_NUMBER:
        raise ConfigError(f"{file.name}: {where}: {key} is {_SHORT.repr(value)}; give a finite number")
    return float(value)


def numbers(file: Path, data: Any, key: str, where: str, count: int) -> list[float]:
    """Return `count` finite numbers of an object in a file.

    Raises:
        ConfigError: there are none, or others; `where` is the object's place in the file.
    """
    values = data.get(key) if isinstance(data, dict) else None
    try:
        found = np.asarray(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        found = np.zeros(0)
    if found.shape != (count,) or not (abs(found) < LARGEST_NUMBER).all():
        said = _SHORT.repr(values)
        raise ConfigError(f"{file.name}: {where}: {key} is {said}; give {count} finite numbers")
    return [float(x) for x in found]


def _goal(file: Path, goal: Any, where: str, count: int) -> Goal:
    if isinstance(goal, dict) and "joints" in goal:
        return tuple(numbers(file, goal, "joints", f"{where}.goal", count))
    if isinstance(goal, dict) and "link" in goal:
        return _pose_goal(file, goal, f"{where}.goal")
    poses = goal.get("poses") if isinstance(goal, dict) else None
    if isinstance(poses, list) and poses and all(isinstance(one, dict) and "link" in one for one in poses):
        named = enumerate(cast(list[dict[str, Any]], poses))
        return PosesGoal(poses=[_pose_goal(file, one, f"{where}.goal.poses[{k}]") for k, one in named])
    said = _SHORT.repr(goal)
    raise ConfigError(
        f'{file.name}: {where}: goal is {said}; give {{"joints": [...]}}, {{"link", "position"}} or '
        '{"poses": [...]}'
    )


def _pose_goal(file: Path, goal: dict[str, Any], where: str) -> PoseGoal:
    return PoseGoal(
        link=str(goal["link"]),
        position=numbers(file, goal, "position", where, 3),
        quaternion=None if goal.get("quaternion") is None else quaternion(file, goal, where),
    )


def quaternion(file: Path, data: Any, where: str) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) under that key, of length 1.

    Args:
        file: file that holds it, for messages.
        data: object with the key.
        where: place of the object in the file.

    Raises:
        ConfigError: it is no list of four numbers, or its length is zero.
    """
    values = numbers(file, data, "quaternion", where, 4)
    if not np.linalg.norm(values) > 1e-9:
        raise ConfigError(f"{file.name}: {where}: quaternion is {values}; its length must not be zero")
    x, y, z, w = (float(v) for v in normalized(values))
    return x, y, z, w


def _obstacles(file: Path, entries: Any, where: str) -> tuple[Obstacle, ...]:
    if not isinstance(entries, list):
        raise ConfigError(f"{file.name}: {where} is {_SHORT.repr(entries)}; it must be a list")
    return tuple(_obstacle(file, one, f"{where}[{k}]", k) for k, one in enumerate(entries))


def _obstacle(file: Path, data: Any, where: str, k: int) -> Obstacle:
    if not isinstance(data, dict):
        raise ConfigError(f"{file.name}: {where} is {_SHORT.repr(data)}; it must be an object")
    position = numbers(file, data, "position", where, 3) if "position" in data else [0.0, 0.0, 0.0]
    turn = quaternion(file, data, where) if "quaternion" in data else (0.0, 0.0, 0.0, 1.0)
    pose = Pose(position=(position[0], position[1], position[2]), quaternion=turn)
    return Obstacle(name=str(data.get("name", f"o{k}")), shape=_shape(file, data, where), pose=pose)


def _shape(file: Path, data: Mapping[str, Any], where: str) -> Shape:
    def length(key: str) -> float:
        value = data.get(key)
        if not isinstance(value, int | float) or not 0 < value < LARGEST_NUMBER:
            raise ConfigError(f"{file.name}: {where}: {key} is {_SHORT.repr(value)}; give a positive number")
        return float(value)

    kind = data.get("type")
    if kind == "box":
        x, y, z = numbers(file, data, "size", where, 3)
        if min(x, y, z) <= 0:
            raise ConfigError(f"{file.name}: {where}: size is {[x, y, z]}; give positive lengths")
        return Box(size=(x, y, z))
    if kind == "sphere":
        return Sphere(radius=length("radius"))
    if kind == "cylinder":
        return Cylinder(radius=length("radius"), length=length("length"))
    if kind == "capsule":
        return Capsule(radius=length("radius"), length=length("length"))
    if kind == "mesh":
        named = next((data[key] for key in ("file", "path", "uri", "mesh") if key in data), None)
        found = file.parent / str(named)
        if named is None or not found.is_file():
            said = _SHORT.repr(named)
            raise ConfigError(f"{file.name}: {where}: file is {said}; give a mesh file that exists")
        given = data.get("scale", 1.0)
        given = given if isinstance(given, list) else [given] * 3
        scale = numbers(file, {"scale": given}, "scale", where, 3)
        return Mesh(uri=str(named), path=found, scale=(scale[0], scale[1], scale[2]))
    kinds = ("box", "sphere", "cylinder", "capsule", "mesh")
    raise ConfigError(f"{file.name}: {where}: {unknown_name('type of obstacle', str(kind), kinds)}")

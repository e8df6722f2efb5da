"""MotionBenchMaker's problem sets: folders of scenes and requests as MoveIt writes them, or VAMP's one file.

A folder holds `scene0001.yaml` and `request0001.yaml` for each problem:

    scene     world.collision_objects: id, pose, primitives (box: lengths; sphere: radius; cylinder: height,
              radius; cone is refused) with primitive_poses, meshes (vertices and triangles, or resource and
              dimensions) with mesh_poses; fixed_frame_transforms
    request   start_state.joint_state: name, position; start_state.multi_dof_joint_state: where the robot
              stands; goal_constraints: joint_constraints of each goal

VAMP's `problems.json` has all sets of a robot: joints, and problems, from the name of a set to objects with
start, goals, and lists box (half_extents), sphere and cylinder. Its pickles are not read: to load one runs
what it holds.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from roboyard.description import load_description
from roboyard.description.model import Box, Cylinder, Mesh, Pose, RobotDescription, Sphere
from roboyard.errors import ConfigError, unknown_name
from roboyard.planning.obstacles import Obstacle, Shape
from roboyard.planning.problem_files import TIME_LIMIT, Problem, ProblemFile, numbers
from roboyard.shapes.mesh import TriangleMesh
from roboyard.transforms import Array, inverse_pose, normalized, pose_matrix, quaternion_from_matrix
from roboyard.untrusted.files import is_inside
from roboyard.untrusted.json_reading import read_json
from roboyard.untrusted.yaml_reading import read_yaml

MAX_BYTES = 64 << 20
"""Largest file of a set (bytes)."""
SCENE = re.compile(r"scene(\d+)\.ya?ml")
"""Names of scenes; a request has the same number."""


def load_published_set(
    path: Path | str, urdf: Path | str, *, planner: Path | str | None = None
) -> ProblemFile:
    """Return the problems of a folder of MotionBenchMaker, or of VAMP's `problems.json`.

    Joints of the requests' goals are planned, the others are held where the requests start them; those that
    the robot does not have are ignored.

    Args:
        path: the folder, or the file.
        urdf: the robot, which the sets do not contain.
        planner: a cuRobo or XRDF file of the robot, in place of fitted spheres.

    Raises:
        ConfigError: a file cannot be read, or an entry is missing or wrong.
        DescriptionError: the URDF cannot be loaded.
    """
    source, robot = Path(path), load_description(urdf)
    if source.is_dir():
        joints, hold, problems = _folder(source, robot)
    else:
        joints, problems = _one_file(source)
        hold = {}
    return ProblemFile(
        path=source,
        urdf=Path(urdf),
        planner=None if planner is None else Path(planner),
        joints=joints,
        hold={name: value for name, value in hold.items() if name in robot.joint_by_name},
        time_limit=TIME_LIMIT,
        limits={},
        problems=problems,
    )


def is_published_set(path: Path | str) -> bool:
    """Whether a path is a folder, or a file of VAMP: its problems are grouped in sets.

    Raises:
        ConfigError: the file cannot be read.
    """
    source = Path(path)
    if source.is_dir():
        return True
    if not source.is_file():
        return False
    data = _read(source, read_json, "JSON")
    return isinstance(data, dict) and isinstance(data.get("problems"), dict)


# ----------------------------------------------------------------------------------- folders


def _folder(
    folder: Path, robot: RobotDescription
) -> tuple[tuple[str, ...], dict[str, float], tuple[Problem, ...]]:
    found = sorted(
        (int(match[1]), file) for file in folder.iterdir() if (match := SCENE.fullmatch(file.name))
    )
    if not found:
        raise ConfigError(f"{folder}: has no scene0001.yaml; give a folder of scenes and requests")
    joints: tuple[str, ...] = ()
    hold: dict[str, float] = {}
    problems = []
    for number, file in found:
        request = file.with_name(file.name.replace("scene", "request"))
        data = _read(request, read_yaml, "YAML")
        state = _entry(request, data, "start_state", dict)
        start = _start(request, state)
        goals = _joint_goals(request, data)
        if not joints:
            joints = tuple(name for name in start if name in goals[0])
        for k, goal in enumerate(goals):
            if set(goal) != set(joints):
                said = ", ".join(sorted(set(goal) ^ set(joints)))
                raise ConfigError(
                    f"{request.name}: goal_constraints[{k}]: joints differ from the other goals' or are not "
                    f"in start_state: {said}; keep requests of another group in a folder of their own"
                )
        held = {name: value for name, value in start.items() if name not in joints}
        if hold and held != hold:
            moved = next(name for name in {**held, **hold} if held.get(name) != hold.get(name))
            raise ConfigError(
                f'{request.name}: start_state: joint "{moved}" is at {held.get(moved)}, in other requests at '
                f"{hold.get(moved)}; keep requests that hold it elsewhere in a folder of their own"
            )
        hold = held
        rows = [tuple(goal[name] for name in joints) for goal in goals]
        problems.append(
            Problem(
                name=f"{folder.name} {number:04d}",
                start=tuple(start[name] for name in joints),
                goal=rows[0] if len(rows) == 1 else tuple(rows),
                obstacles=tuple(_scene(file, _read(file, read_yaml, "YAML"), robot, _root(request, state))),
            )
        )
    return joints, hold, tuple(problems)


def _start(file: Path, state: Mapping[str, Any]) -> dict[str, float]:
    joints = _entry(file, state, "joint_state", dict)
    names = [str(name) for name in _entry(file, joints, "name", list)]
    return dict(zip(names, numbers(file, joints, "position", "joint_state", len(names)), strict=True))


def _joint_goals(file: Path, data: Any) -> list[dict[str, float]]:
    goals = []
    for k, one in enumerate(_entry(file, data, "goal_constraints", list)):
        where = f"goal_constraints[{k}]"
        listed = one.get("joint_constraints") if isinstance(one, dict) else None
        if not isinstance(listed, list) or not listed or not all(isinstance(c, dict) for c in listed):
            raise ConfigError(
                f"{file.name}: {where} has no joint_constraints; give the goal's joint positions"
            )
        positions = [one.get("position") for one in listed]
        values = numbers(file, {"position": positions}, "position", where, len(positions))
        goals.append(dict(zip((str(one.get("joint_name")) for one in listed), values, strict=True)))
    if not goals:
        raise ConfigError(f"{file.name}: goal_constraints is empty; give at least one goal")
    return goals


def _root(file: Path, state: Mapping[str, Any]) -> Array:
    """Return the (4, 4) pose of the robot's root in the scene's frame (m)."""
    joints = state.get("multi_dof_joint_state")
    transforms = joints.get("transforms") if isinstance(joints, dict) else None
    if not isinstance(transforms, list) or not transforms:
        return np.eye(4)
    return _transform(file, transforms[0], "multi_dof_joint_state")


def _scene(file: Path, data: Any, robot: RobotDescription, root: Array) -> Iterator[Obstacle]:
    world = _entry(file, data, "world", dict)
    frames = {
        str(one.get("child_frame_id")): _transform(file, one.get("transform"), f"fixed_frame_transforms[{k}]")
        for k, one in enumerate(data.get("fixed_frame_transforms") or [])
        if isinstance(one, dict)
    }
    to_root = inverse_pose(root)
    for k, one in enumerate(world.get("collision_objects") or []):
        where = f"collision_objects[{k}]"
        if not isinstance(one, dict):
            raise ConfigError(f"{file.name}: {where} is not an object; give id, primitives, primitive_poses")
        header = one.get("header")
        frame = str(header.get("frame_id", "")) if isinstance(header, dict) else ""
        at = to_root @ frames[frame] if frame in frames else _frame(file, robot, frame, to_root, where)
        if isinstance(one.get("pose"), dict):
            at = at @ _transform(file, one["pose"], f"{where}.pose")
        name, count = str(one.get("id", f"o{k}")), 0
        for kind, shape_of in (("primitive", _primitive), ("mesh", _mesh)):
            plural = {"primitive": "primitives", "mesh": "meshes"}[kind]
            shapes, poses = one.get(plural) or [], one.get(f"{kind}_poses") or []
            if not isinstance(shapes, list) or not isinstance(poses, list) or len(shapes) != len(poses):
                raise ConfigError(f"{file.name}: {where}: give as many {kind}_poses as {plural}")
            for shape, pose in zip(shapes, poses, strict=True):
                place = at @ _transform(file, pose, f"{where}.{kind}_poses")
                called = name if count == 0 else f"{name} {count}"
                yield Obstacle(name=called, shape=shape_of(file, shape, where), pose=_pose(place))
                count += 1


def _frame(file: Path, robot: RobotDescription, frame: str, to_root: Array, where: str) -> Array:
    """Return the (4, 4) pose of a frame in the root link's (m); names the robot has not are the scene's."""
    above = robot.parent_joint
    if frame not in above:
        return np.eye(4) if frame == robot.root.name else to_root
    pose = np.eye(4)
    while frame in above:
        joint = above[frame]
        if joint.type != "fixed":
            raise ConfigError(
                f'{file.name}: {where}: frame_id "{frame}" is a link that moves; give poses in its root link'
            )
        pose = pose_matrix(joint.origin.position, joint.origin.quaternion) @ pose
        frame = joint.parent
    return pose


def _primitive(file: Path, data: Any, where: str) -> Shape:
    kind = str(data.get("type")) if isinstance(data, dict) else ""
    counts = {"box": 3, "sphere": 1, "cylinder": 2}
    if kind not in counts:
        raise ConfigError(f"{file.name}: {where}: {unknown_name('primitive', kind, counts)}")
    sizes = numbers(file, data, "dimensions", where, counts[kind])
    if min(sizes) <= 0:
        raise ConfigError(f"{file.name}: {where}: dimensions are {sizes}; give positive lengths")
    if kind == "box":
        return Box(size=(sizes[0], sizes[1], sizes[2]))
    return Sphere(radius=sizes[0]) if kind == "sphere" else Cylinder(length=sizes[0], radius=sizes[1])


def _mesh(file: Path, data: Any, where: str) -> Shape:
    if not isinstance(data, dict):
        raise ConfigError(f"{file.name}: {where}: a mesh is not an object; give vertices and triangles")
    if "resource" in data:
        uri = str(data["resource"])
        scale = numbers(file, {"dimensions": [1, 1, 1], **data}, "dimensions", where, 3)
        return Mesh(uri=uri, path=_mesh_file(file, uri, where), scale=(scale[0], scale[1], scale[2]))
    try:
        vertices = np.asarray(data.get("vertices"), dtype=float).reshape(-1, 3)
        faces = np.asarray(data.get("triangles"), dtype=np.int32).reshape(-1, 3)
    except (TypeError, ValueError, OverflowError):
        vertices, faces = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)
    inside = len(faces) and faces.min() >= 0 and faces.max() < len(vertices)
    if not inside or not np.isfinite(vertices).all():
        raise ConfigError(
            f"{file.name}: {where}: a mesh needs finite vertices, and triangles of their indices"
        )
    return Mesh(uri=f"{file.name} {where}", path=None, data=TriangleMesh(vertices=vertices, faces=faces))


def _mesh_file(file: Path, uri: str, where: str) -> Path:
    """Return the file that a resource names, by its last folders, in the folder of the scene."""
    parts = [part for part in uri.split("://")[-1].split("/") if part not in ("", ".")]
    for k in range(len(parts)):
        found = file.parent.joinpath(*parts[k:])
        if ".." not in parts and found.is_file() and is_inside(found, [file.parent]):
            return found
    raise ConfigError(f"{file.name}: {where}: there is no {uri}; put {'/'.join(parts[-2:])} beside the scene")


# ----------------------------------------------------------------------------------- VAMP's file


def _one_file(file: Path) -> tuple[tuple[str, ...], tuple[Problem, ...]]:
    data = _read(file, read_json, "JSON")
    joints = tuple(str(name) for name in _entry(file, data, "joints", list))
    problems = []
    for name, listed in _entry(file, data, "problems", dict).items():
        for k, one in enumerate(listed if isinstance(listed, list) else [None]):
            where = f"problems.{name}[{k}]"
            if not isinstance(one, dict):
                raise ConfigError(f"{file.name}: {where} is not an object; give start and goals")
            goals = _entry(file, one, "goals", list)
            rows = [tuple(numbers(file, {"goals": row}, "goals", where, len(joints))) for row in goals]
            if not rows:
                raise ConfigError(f"{file.name}: {where}: goals is empty; give at least one")
            problems.append(
                Problem(
                    name=f"{name} {one.get('index', k)}",
                    start=tuple(numbers(file, one, "start", where, len(joints))),
                    goal=rows[0] if len(rows) == 1 else tuple(rows),
                    obstacles=tuple(_listed(file, one, where)),
                )
            )
    return joints, tuple(problems)


def _listed(file: Path, problem: Mapping[str, Any], where: str) -> Iterator[Obstacle]:
    for kind in ("box", "sphere", "cylinder"):
        for k, one in enumerate(problem.get(kind) or []):
            place = f"{where}.{kind}[{k}]"
            if not isinstance(one, dict):
                raise ConfigError(f"{file.name}: {place} is not an object; give name and position")
            if kind == "box":
                sizes: list[Any] = [2 * x for x in numbers(file, one, "half_extents", place, 3)]
            else:
                sizes = [
                    one.get(key) for key in (("length", "radius") if kind == "cylinder" else ("radius",))
                ]
            shape = _primitive(file, {"type": kind, "dimensions": sizes}, place)
            turn = one.get("orientation_quat_xyzw", (0.0, 0.0, 0.0, 1.0))
            at = _transform(file, {"position": one.get("position"), "orientation": turn}, place)
            yield Obstacle(name=str(one.get("name", f"{kind}{k}")), shape=shape, pose=_pose(at))


# ----------------------------------------------------------------------------------- entries


def _read(file: Path, reader: Callable[[Path, int], Any], kind: str) -> Any:
    try:
        return reader(file, MAX_BYTES)
    except OSError as error:
        raise ConfigError(f"{file}: cannot be read: {error.strerror or error}; check the path") from None
    except ValueError as error:
        raise ConfigError(f"{file.name}: not {kind}: {error}; correct the file") from None


def _entry(file: Path, data: Any, key: str, kind: type) -> Any:
    found = data.get(key) if isinstance(data, dict) else None
    if not isinstance(found, kind):
        wanted = {list: "a list", dict: "an object"}[kind]
        raise ConfigError(f"{file.name}: {key} is missing or not {wanted}; is this a file of another format?")
    return found


def _transform(file: Path, data: Any, where: str) -> Array:
    """Return the (4, 4) pose of `position` or `translation` and `orientation` or `rotation` (m)."""
    given = data if isinstance(data, dict) else {}
    keys = ("translation", "rotation") if "translation" in given else ("position", "orientation")
    turn = numbers(file, given, keys[1], where, 4)
    if not np.linalg.norm(turn) > 1e-9:
        raise ConfigError(f"{file.name}: {where}: {keys[1]} is {turn}; its length must not be zero")
    return pose_matrix(numbers(file, given, keys[0], where, 3), normalized(turn))


def _pose(matrix: Array) -> Pose:
    x, y, z = (float(v) for v in matrix[:3, 3])
    a, b, c, d = (float(v) for v in quaternion_from_matrix(matrix[:3, :3]))
    return Pose(position=(x, y, z), quaternion=(a, b, c, d))

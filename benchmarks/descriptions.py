"""Do MJCF, SDF and USD robots read as other programs read them? One table for the robots in folders.

    python benchmarks/descriptions.py FOLDER... [--kind mjcf,sdf,usd] [--drake PYTHON] [--round-trip]
                                      [--out FILE] [--jobs N] [--limit S]

Every robot file below the folders is read, in a process of its own, and put into two random postures.
MuJoCo's own reading of the same MJCF file, Drake's of an SDF file (`--drake` names the interpreter of an
environment with the package `drake`) and Newton's of a USD stage give each body's mass, the place of its
centre of mass in the root's frame and its inertia about it; the greatest differences are in the table:
places in m, masses and inertias relative (inertia to the greatest entry of the body). Newton computes in
single precision, so that 1e-5 is its own. Joints that a stage stacks between two bodies are moved one at a
time: MuJoCo, whose joints they are, turns them in the stage's order, Newton in that of their paths. A stage
with loops and no articulation, and so no stated tree, is compared with all joints at zero.

Not compared, and named in the table: bodies that no joint holds to the robot, as the description's notes
say; inertias that no body can have (Drake and Newton replace them, a description keeps what is written); in
USD, bodies whose mass follows from a mesh that is not closed (it bounds no volume: Newton integrates over
its triangles all the same, Roboyard takes its convex hull).

A row is `agrees`, `differs`, `alone` where the other program refuses the file, `refused` where Roboyard
does, or `error`. With `--round-trip` each description is also written as USD, read, written as URDF and
read again, and compared with what was written: places, masses, inertias, limits, mimic and loop joints, the
number of shapes.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

ROW = "row: "
TOLERANCES = {"mjcf": 1e-6, "sdf": 1e-6, "usd": 2e-5}
"""Difference up to which readings agree: m, and relative for masses and inertias."""
TINY = 1e-12
"""kg m²: the least that a body in USD has."""
SUFFIXES = {"sdf": (".sdf", ".world"), "usd": (".usd", ".usda", ".usdc", ".usdz"), "mjcf": (".xml", ".mjcf")}


class Body(NamedTuple):
    """A body in one frame of a robot, its root's or the world's."""

    pose: np.ndarray
    """(4, 4) of the body's frame (m)."""
    mass: float
    """kg."""
    centre: np.ndarray
    """(3,) of its mass (m)."""
    inertia: np.ndarray
    """(3, 3) about the centre (kg m²)."""


Bodies = dict[str, Body]


def main() -> None:
    """Read the robots and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", nargs="*", type=Path, metavar="FOLDER", help="folders with robots")
    parser.add_argument("--kind", default="mjcf,sdf,usd", help="formats to read, separated by commas")
    parser.add_argument("--drake", help="a Python interpreter that has the package drake")
    parser.add_argument("--round-trip", action="store_true", help="also to USD and URDF and back")
    parser.add_argument("--out", type=Path, help="write the rows as JSON")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds for each robot")
    parser.add_argument("--jobs", type=int, default=1, help="robots that are read at once")
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one is not None:
        kind, file = arguments.one
        row = read_robot(Path(file), kind, arguments)
        print(ROW + json.dumps(row))
        return
    if not arguments.folders:
        parser.error("give the folders of robots")
    folders = [folder.resolve() for folder in arguments.folders]
    todo = [
        (folder, kind, file)
        for folder in folders
        for kind in arguments.kind.split(",")
        for file in files_of(folder, kind)
    ]

    def run(item: tuple[Path, str, Path]) -> dict[str, Any]:
        folder, kind, file = item
        name = file.relative_to(folder.parent).as_posix()
        return {"file": name, "kind": kind, **_in_process(file, kind, arguments)}

    with ThreadPoolExecutor(max_workers=arguments.jobs) as pool:
        rows = list(pool.map(run, todo))
    if arguments.out:
        arguments.out.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    print(table(rows, round_trip=arguments.round_trip))


def files_of(folder: Path, kind: str) -> list[Path]:
    """Return the robot files of a kind below a folder."""
    from roboyard.description.files.robot_files import robot_files

    found = [file for file in robot_files(folder) if file.suffix.lower() in SUFFIXES[kind]]
    if kind == "mjcf":
        return [file for file in found if b"<mujoco" in file.read_bytes()]
    return found if kind == "usd" else [file for file in found if b"<world" not in file.read_bytes()]


def read_robot(file: Path, kind: str, options: argparse.Namespace) -> dict[str, Any]:
    """Return outcome, message and differences of one robot file."""
    from roboyard.description import load_description
    from roboyard.description.files.workspaces import packages_below
    from roboyard.errors import RoboyardError

    models = models_below([folder.resolve() for folder in options.folders])
    packages = {**models, **dict(itertools.chain(*(packages_below(f).items() for f in options.folders)))}
    began = time.perf_counter()
    row: dict[str, Any] = {"outcome": "refused", "message": "", "links": 0}
    try:
        description = load_description(file, packages=packages, missing_meshes="note")
    except RoboyardError as error:
        refused = str(error).splitlines()[0][:300]
        try:
            reference(kind, file, {}, packages, options.drake, None)
        except Exception as other:
            return {**row, "message": f"{refused} | the other program: {_first_line(other)}"}
        return {**row, "message": refused}
    row |= {
        "links": len(description.links),
        "joints": len(description.joints),
        "loops": len(description.loops),
    }
    generator = np.random.default_rng(7)
    worst: dict[str, tuple[float, str]] = {}
    unjoined = ("not joined to the robot", "models other than")
    omitted = [note for note in description.notes if any(words in note for words in unjoined)]
    open_bodies = bodies_of_open_meshes(file) if kind == "usd" else set()
    ours: Bodies = {}
    try:
        for _ in range(2):
            q = posture(description, generator)
            if kind == "usd":
                q = comparable(file, q, generator, has_loops=bool(description.loops))
            ours = bodies_of(description, q)
            theirs = reference(kind, file, q, packages, options.drake, description)
            if omitted:
                theirs = {name: body for name, body in theirs.items() if name in ours}
            compared = {name: body for name, body in ours.items() if name not in open_bodies}
            theirs = {name: body for name, body in theirs.items() if name not in open_bodies & set(ours)}
            for name, found in differences(compared, theirs, description.root.name).items():
                worst[name] = max(worst.get(name, (0.0, "")), found)
        row["outcome"] = "agrees" if all(d <= TOLERANCES[kind] for d, _ in worst.values()) else "differs"
        where = [f"{name} of {body}" for name, (d, body) in worst.items() if d > TOLERANCES[kind]]
        if odd := [name for name, body in ours.items() if not is_possible(body.inertia)]:
            where.append(f"not compared: impossible inertia of {_some(odd)}")
        if open_ := [name for name in ours if name in open_bodies]:
            where.append(f"not compared: open meshes of {_some(open_)}")
        where += [note.partition(": ")[2] for note in omitted]
        row["message"] = ", ".join(where)
    except Exception as error:  # the other program raises several types
        row |= {"outcome": "alone", "message": _first_line(error)}
    row |= {name: float(d) for name, (d, _) in worst.items()}
    if options.round_trip:
        row["round_trip"] = round_trip(description)
    return {**row, "seconds": round(time.perf_counter() - began, 2)}


def _some(names: Sequence[str]) -> str:
    """Return the first names of a list and the number of others."""
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")


def _first_line(error: BaseException) -> str:
    lines = str(error).strip().splitlines() or [""]
    return f"{type(error).__name__}: {lines[0]}"[:300]


def models_below(folders: Sequence[Path]) -> dict[str, Path]:
    """Return the folders of Gazebo's models (those with a `model.config`) by name."""
    found: dict[str, Path] = {}
    for folder in folders:
        for place, _, files in os.walk(folder):
            if "model.config" in files:
                found.setdefault(Path(place).name, Path(place))
    return found


def posture(description: Any, generator: np.random.Generator) -> dict[str, float]:
    """Return a position for each joint of one axis, within its limits; those that follow included."""
    q: dict[str, float] = {}
    for joint in description.joints:
        if joint.type in ("revolute", "continuous", "prismatic") and joint.mimic is None:
            lower, upper = joint.position_limits() or (-1.0, 1.0)
            q[joint.name] = float(generator.uniform(max(lower, -1.0), max(min(upper, 1.0), max(lower, -1.0))))
    by_name, todo = description.joint_by_name, [joint for joint in description.joints if joint.mimic]
    for _ in range(len(todo)):  # each round settles those that follow a settled one
        for joint in todo:
            mimic = joint.mimic
            if mimic.joint in q and mimic.joint in by_name:
                q[joint.name] = mimic.multiplier * q[mimic.joint] + mimic.offset
    return q


def bodies_of(description: Any, q: Mapping[str, float]) -> Bodies:
    """Return the bodies as the description has them, in its root's frame."""
    from roboyard.kinematics.description_poses import forward_kinematics

    poses = forward_kinematics(description, dict(q))
    found: Bodies = {}
    for link in description.links:
        each = link.inertial
        if each is None or not each.mass > 0:
            continue
        T = poses[link.name] @ each.origin.matrix()
        inertia = T[:3, :3] @ each.matrix() @ T[:3, :3].T
        found[link.name] = Body(poses[link.name], each.mass, T[:3, 3], inertia)
    return found


def reference(
    kind: str,
    file: Path,
    q: Mapping[str, float],
    packages: Mapping[str, Path],
    drake: str | None,
    description: Any,
) -> Bodies:
    """Return the bodies as another program reads them, in its frame of the world."""
    if kind == "mjcf":
        return mujoco_bodies(file, q, description)
    if kind == "usd":
        return newton_bodies(file, q)
    if drake is None:
        raise RuntimeError("give --drake PYTHON to compare SDF files")
    question = {"file": str(file), "q": dict(q), "packages": {n: str(p) for n, p in packages.items()}}
    question["model"] = "" if description is None else description.name
    call = [drake, str(Path(__file__).with_name("drake_reading.py"))]
    done = subprocess.run(
        call, input=json.dumps(question), capture_output=True, text=True, timeout=100, check=False
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith(ROW)]
    if not lines:
        raise RuntimeError((done.stderr.strip().splitlines() or ["it printed nothing"])[-1])
    answer = json.loads(lines[-1].removeprefix(ROW))
    return {name: Body(np.array(T), m, np.array(c), np.array(i)) for name, (T, m, c, i) in answer.items()}


def mujoco_bodies(file: Path, q: Mapping[str, float], description: Any) -> Bodies:
    """Return the bodies as MuJoCo has them, `q` set and other joints at zero.

    Bodies and joints without a name have those that the description gives to its own in the same order.
    """
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    bodies = [model.body(b).name for b in range(model.nbody)]
    joints = [model.joint(j).name for j in range(model.njnt)]
    if description is not None:
        own = {b for b in range(1, model.nbody) if model.body_rootid[b] == _robot_of(model)}
        given = (x.name for x in description.links if x.name not in bodies and x.inertial)
        bodies = [
            n or (next(given, "") if b in own and model.body_mass[b] > 0 else "")
            for b, n in enumerate(bodies)
        ]
        given = (x.name for x in description.joints if x.name not in joints and x.type != "fixed")
        is_given = [model.jnt_bodyid[j] in own and model.jnt_type[j] != 0 for j in range(model.njnt)]
        joints = [n or (next(given, "") if is_given[j] else "") for j, n in enumerate(joints)]
    for j, name in enumerate(joints):
        start, kind = model.jnt_qposadr[j], model.jnt_type[j]
        if kind == mujoco.mjtJoint.mjJNT_BALL:
            data.qpos[start : start + 4] = 1, 0, 0, 0
        elif kind != mujoco.mjtJoint.mjJNT_FREE:
            data.qpos[start] = q.get(name, 0.0)
    mujoco.mj_kinematics(model, data)
    found: Bodies = {}
    for body in range(1, model.nbody):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = data.xmat[body].reshape(3, 3), data.xpos[body]
        R = data.ximat[body].reshape(3, 3)
        inertia = R @ np.diag(model.body_inertia[body]) @ R.T
        if model.body_rootid[body] == _robot_of(model):
            found[bodies[body]] = Body(T, float(model.body_mass[body]), data.xipos[body].copy(), inertia)
    return found


def _robot_of(model: Any) -> int:
    """Return the body at the top of the world with the most bodies."""
    return Counter(model.body_rootid[1:].tolist()).most_common(1)[0][0]


def newton_bodies(file: Path, q: Mapping[str, float]) -> Bodies:
    """Return the bodies of a stage as Newton has them."""
    import newton
    import warp
    from pxr import Usd

    from roboyard.transforms import matrix_from_quaternion

    warp.config.quiet = True
    builder = newton.ModelBuilder()
    read = builder.add_usd(str(file), load_visual_shapes=False)
    stage = Usd.Stage.Open(str(file))
    paths: dict[int, list[str]] = {}
    for path, j in read["path_joint_map"].items():
        paths.setdefault(j, []).append(path)
    for j, label in enumerate(builder.joint_label):
        count, start = sum(builder.joint_dof_dim[j]), builder.joint_q_start[j]
        names = [shown_name(stage, path) for path in sorted(paths.get(j, []), key=lambda p: _turns(stage, p))]
        if len(names) != count:
            names = [f"{shown_name(stage, label)}_{k + 1}" for k in range(count)]
        if builder.joint_q_start[j + 1 :][:1] != [start + count + 1]:  # neither ball nor free joint
            builder.joint_q[start : start + count] = [q.get(each, 0.0) for each in names]
    _articulate(builder)
    model = builder.finalize(device="cpu")
    state = model.state()
    newton.eval_fk(model, model.joint_q, model.joint_qd, state)
    poses = state.body_q.numpy().astype(float)
    found: Bodies = {}
    for k, label in enumerate(builder.body_label):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = matrix_from_quaternion(poses[k, 3:]), poses[k, :3]
        tensor = np.array(builder.body_inertia[k], dtype=float).reshape(3, 3)
        centre = T[:3, 3] + T[:3, :3] @ np.array(builder.body_com[k], dtype=float)
        inertia = T[:3, :3] @ tensor @ T[:3, :3].T
        found[shown_name(stage, label)] = Body(T, float(builder.body_mass[k]), centre, inertia)
    return found


def shown_name(stage: Any, path: str) -> str:
    """Return the name that a prim shows, else its own."""
    prim = stage.GetPrimAtPath(path)
    return (prim.GetDisplayName() or prim.GetName()) if prim else path.rpartition("/")[2]


def bodies_of_open_meshes(file: Path) -> set[str]:
    """Return the bodies of a stage whose mass, centre or inertia follow from a mesh that is not closed."""
    from pxr import Usd, UsdGeom, UsdPhysics

    stage = Usd.Stage.Open(str(file))
    found: set[str] = set()
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if not (prim.IsA(UsdGeom.Mesh) and prim.HasAPI(UsdPhysics.CollisionAPI)):
            continue
        body = prim
        while body and not body.HasAPI(UsdPhysics.RigidBodyAPI):
            body = body.GetParent()
        if not body:
            continue
        stated = (body.GetAttribute(f"physics:{n}") for n in ("mass", "centerOfMass", "diagonalInertia"))
        if all(each and each.HasAuthoredValue() for each in stated):
            continue
        mesh, edges = UsdGeom.Mesh(prim), Counter[tuple[int, int]]()
        points = np.round(np.array(mesh.GetPointsAttr().Get(), dtype=float), 6)
        same = np.unique(points, axis=0, return_inverse=True)[1].reshape(-1)
        corners = same[np.array(mesh.GetFaceVertexIndicesAttr().Get())]
        start = 0
        for count in mesh.GetFaceVertexCountsAttr().Get():
            polygon = corners[start : start + count].tolist()
            edges.update(zip(polygon, polygon[1:] + polygon[:1], strict=True))
            start += count
        if any(edges[b, a] != number for (a, b), number in edges.items()):
            found.add(shown_name(stage, str(body.GetPath())))
    return found


def _turns(stage: Any, path: str) -> bool:
    return "Revolute" in str(stage.GetPrimAtPath(path).GetTypeName())


def _articulate(builder: Any) -> None:
    """Make articulations of joints that the stage gives to none: Newton moves no others."""
    held = {
        builder.joint_child[j] for j in range(len(builder.joint_label)) if builder.joint_articulation[j] >= 0
    }
    run: list[int] = []
    for j in range(len(builder.joint_label)):
        if builder.joint_articulation[j] < 0 and builder.joint_child[j] not in held:
            held.add(builder.joint_child[j])
            run.append(j)
            if builder.joint_articulation[j + 1 :][:1] == [-1] and builder.joint_child[j + 1] not in held:
                continue
            builder.add_articulation(run)
            run = []


def comparable(
    file: Path, q: Mapping[str, float], generator: np.random.Generator, *, has_loops: bool
) -> dict[str, float]:
    """Return positions that mean the same to every reader of a stage.

    Of the joints between the same two bodies one keeps its position. All are zero where joints close loops
    and the stage names no articulation, so that each reader opens the loops at a joint of its choice.
    """
    from pxr import Usd, UsdPhysics

    stage = Usd.Stage.Open(str(file))
    prims = list(stage.Traverse(Usd.TraverseInstanceProxies()))
    if has_loops and not any(prim.HasAPI(UsdPhysics.ArticulationRootAPI) for prim in prims):
        return dict.fromkeys(q, 0.0)
    groups: dict[tuple[str, ...], list[str]] = {}
    for prim in prims:
        if prim.IsA(UsdPhysics.Joint):
            joint = UsdPhysics.Joint(prim)
            ends = [str(r.GetTargets()) for r in (joint.GetBody0Rel(), joint.GetBody1Rel())]
            groups.setdefault(tuple(ends), []).append(shown_name(stage, str(prim.GetPath())))
    moved = dict(q)
    for names in groups.values():
        kept = names[int(generator.integers(len(names)))]
        moved |= {name: 0.0 for name in names if name in q and name != kept}
    return moved


def differences(ours: Bodies, theirs: Bodies, root: str) -> dict[str, tuple[float, str]]:
    """Return the greatest differences of places, masses and inertias, each with its body.

    Args:
        ours: in the frame of the root link.
        theirs: in the frame of the world.
        root: the root link; the world is in its place where the other program has no body of that name.
    """
    missing = [name for name in ours if name not in theirs]
    if missing:
        raise RuntimeError(f"the other program has no body {missing[0]!r} ({len(missing)} of {len(ours)})")
    T_root_world = np.linalg.inv(theirs[root].pose) if root in theirs else np.eye(4)
    R = T_root_world[:3, :3]
    worst = {"place": (0.0, ""), "mass": (0.0, ""), "inertia": (0.0, "")}
    total = sum(body.mass for body in theirs.values())
    for name, body in theirs.items():
        if name not in ours:
            if body.mass > 1e-9 * total:
                worst["mass"] = max(worst["mass"], (1.0, f"{name!r}, which only the other program has"))
            continue
        own = ours[name]
        centre = R @ body.centre + T_root_world[:3, 3]
        inertia = R @ body.inertia @ R.T
        found = {
            "place": float(np.abs(own.centre - centre).max()),
            "mass": abs(own.mass - body.mass) / own.mass,
            "inertia": relative(own.inertia, inertia) if is_possible(own.inertia) else 0.0,
        }
        for what, size in found.items():
            worst[what] = max(worst[what], (size, name))
    return worst


def is_possible(inertia: np.ndarray) -> bool:
    """Return whether a body can have an inertia: positive, no moment above the sum of the others."""
    least, middle, greatest = np.linalg.eigvalsh(inertia)
    return bool(least > -TINY and least + middle > greatest * (1 - 1e-6) - TINY)


def relative(ours: np.ndarray, theirs: np.ndarray) -> float:
    """Return the greatest difference of two inertias, to the greatest entry; none below `TINY`."""
    difference = float(np.abs(ours - theirs).max())
    return 0.0 if difference <= TINY else difference / max(float(np.abs(theirs).max()), TINY)


def round_trip(description: Any) -> str:
    """Return what differs after URDF → USD → description → URDF, `same` where nothing does."""
    from roboyard.description import load_description
    from roboyard.description.robot_model import RobotModel
    from roboyard.description.semantic import SemanticDescription
    from roboyard.export import urdf, usd

    semantic = SemanticDescription(base_link=description.root.name)
    try:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            read = [description]
            for number in range(2):
                robot = RobotModel(name="robot", description=read[-1], semantic=semantic)
                urdf.write(robot, folder / f"urdf{number}")
                read.append(load_description(folder / f"urdf{number}" / "robot.urdf"))
                if number == 0:
                    usd.write(replace(robot, description=read[-1]), folder / "robot.usda")
                    read.append(load_description(folder / "robot.usda"))
            changes = [
                change for before, after in itertools.pairwise(read) for change in _changes(before, after)
            ]
            return "; ".join(changes)[:500] or "same"
    except Exception as error:
        return _first_line(error)


def _changes(before: Any, after: Any) -> list[str]:
    """Return what a description lost."""
    found: list[str] = []
    names = [{link.name for link in each.links} for each in (before, after)]
    if names[0] != names[1]:
        return [f"links {sorted(names[0] ^ names[1])[:3]}"]
    q = posture(before, np.random.default_rng(3))
    ours, theirs = (bodies_of(each, q) for each in (after, before))
    if set(ours) != set(theirs):
        return [f"masses of {sorted(set(ours) ^ set(theirs))[:3]}"]
    for name in [name for name, body in theirs.items() if not is_possible(body.inertia)]:
        theirs[name] = theirs[name]._replace(inertia=ours[name].inertia)  # writers change it, with a note
    for what, (size, name) in differences(ours, theirs, "").items():
        if size > TOLERANCES["mjcf"]:
            found.append(f"{what} of {name} by {size:.2g}")
    for joint in before.joints:
        same = after.joint_by_name.get(joint.name)
        if same is None or _kind(same) != _kind(joint):
            found.append(f"joint {joint.name}")
        elif not _same(_numbers(joint), _numbers(same)):
            found.append(f"numbers of joint {joint.name}")
    if len(before.loops) != len(after.loops):
        found.append("loops")
    for link in before.links:
        same = after.link_by_name[link.name]
        counts = [(len(each.visuals), len(each.collisions)) for each in (link, same)]
        if counts[0] != counts[1]:
            found.append(f"shapes of {link.name}: {counts[0]} {counts[1]}")
    return found


def _kind(joint: Any) -> str:
    """Return a joint's type; one that turns without limits is continuous."""
    return "continuous" if joint.type == "revolute" and joint.position_limits() is None else joint.type


def _numbers(joint: Any) -> list[Any]:
    """Return limits, damping, friction and what a joint follows."""
    limit, mimic = joint.limit, joint.mimic
    values = [*(joint.position_limits() or ()), joint.damping, joint.friction]
    values += [limit.effort, limit.velocity] if limit is not None and joint.is_moving else []
    return values if mimic is None else [*values, mimic.multiplier, mimic.offset, mimic.joint]


def _same(first: list[Any], second: list[Any]) -> bool:
    """Return whether all are equal, numbers to 1e-6."""
    if len(first) != len(second):
        return False
    return all(
        a == b
        or (isinstance(a, float) and isinstance(b, float) and math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-6))
        for a, b in zip(first, second, strict=True)
    )


def _in_process(file: Path, kind: str, options: argparse.Namespace) -> dict[str, Any]:
    call = [sys.executable, __file__, *map(str, options.folders), "--one", kind, str(file)]
    call += ["--drake", options.drake] if options.drake else []
    call += ["--round-trip"] if options.round_trip else []
    row: dict[str, Any] = {"outcome": "error", "links": 0}
    try:
        done = subprocess.run(call, capture_output=True, text=True, timeout=options.limit, check=False)
    except subprocess.TimeoutExpired:
        return {**row, "message": f"more than {options.limit:g} s"}
    lines = [line for line in done.stdout.splitlines() if line.startswith(ROW)]
    if not lines:
        last = (done.stderr.strip().splitlines() or ["it printed nothing"])[-1]
        return {**row, "message": f"ended with {done.returncode}: {last}"[:300]}
    return json.loads(lines[-1].removeprefix(ROW))


def table(rows: Sequence[Mapping[str, Any]], *, round_trip: bool) -> str:
    """Return a Markdown table of all robots, and counts of each kind below it."""
    columns = ["file", "links", "outcome", "place (m)", "mass", "inertia", "differences"]
    columns += ["round trip"] if round_trip else []
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    for row in rows:
        values = [row["file"], row["links"], row["outcome"]]
        values += [f"{row[name]:.1g}" if name in row else "" for name in ("place", "mass", "inertia")]
        values += [row["message"], *([row.get("round_trip", "")] if round_trip else [])]
        lines.append("| " + " | ".join(str(value).replace("|", "/") for value in values) + " |")
    lines.append("")
    for kind in dict.fromkeys(row["kind"] for row in rows):
        own = [row for row in rows if row["kind"] == kind]
        count = Counter(row["outcome"] for row in own)
        lines.append(f"{kind}: {len(own)} files, " + ", ".join(f"{n} {name}" for name, n in count.items()))
        same = sum(row.get("round_trip") == "same" for row in own)
        if round_trip:
            lines.append(f"{kind}: {same} unchanged by the round trip")
    return "\n".join(lines)


if __name__ == "__main__":
    main()

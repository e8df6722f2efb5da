"""Motion planning of the same problems by Roboyard, mplib, OMPL and pybullet_planning, where installed.

    python benchmarks/planning.py make PROBLEMS.json [URDF] [--scene table|shelf|cage] [--count 100]
    python benchmarks/planning.py scenes [URDF] [--count 30]
    python benchmarks/planning.py run PROBLEMS.json [PROBLEMS.json ...] [--with ours,mplib,ompl,pybullet]

`scenes` makes problems in all three scenes and runs them. Each path is replayed in MuJoCo with the hulls of
the collision shapes every 0.01 rad. Times are CPU seconds of path and shortening; for ours the timing is
included. A planner that is not installed is skipped.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from roboyard.assets import assets_root
from roboyard.description import load_description
from roboyard.planning.hull_judge import HullJudge, judge_of
from roboyard.planning.planner import Planner
from roboyard.planning.problem_files import ProblemFile, load_model, load_problems
from roboyard.planning.spheres.sphere_model import sphere_robot

CLEARANCE = 0.008
"""Distance of starts and goals from obstacles (m)."""
STEP = 0.01
"""Distance of replayed configurations (rad)."""
ARM = assets_root() / "arm7" / "arm7.urdf"


# ------------------------------------------------------------------------------------------------ problems


def box(size: Sequence[float], position: Sequence[float], turn: float = 0.0) -> dict[str, object]:
    quaternion = [0.0, 0.0, float(np.sin(turn / 2)), float(np.cos(turn / 2))]
    at, whole = [float(x) for x in position], [float(x) for x in size]
    return {"type": "box", "size": whole, "position": at, "quaternion": quaternion}


def table(rng: np.random.Generator, reach: float) -> list[dict[str, object]]:
    made = [box((0.9 * reach, 1.6 * reach, 0.04), (0.65 * reach, 0, 0.1 * reach))]
    for k in range(5):
        angle = -1.0 + 0.5 * k + rng.uniform(-0.1, 0.1)
        far, tall = rng.uniform(0.5, 0.8) * reach, rng.uniform(0.25, 0.5) * reach
        at = (far * np.cos(angle), far * np.sin(angle), 0.1 * reach + 0.02 + tall / 2)
        made.append(box((0.12 * reach, 0.12 * reach, tall), at, rng.uniform(0, 1)))
    return made


def shelf(rng: np.random.Generator, reach: float) -> list[dict[str, object]]:
    x, low = rng.uniform(0.6, 0.68) * reach, rng.uniform(0.25, 0.32) * reach
    made = [box((0.35 * reach, 1.1 * reach, 0.02), (x, 0, low + 0.36 * k * reach)) for k in range(3)]
    return [*made, box((0.35 * reach, 0.02, 0.72 * reach), (x, 0.0, low + 0.36 * reach))]


def cage(rng: np.random.Generator, reach: float) -> list[dict[str, object]]:
    first = rng.uniform(0, 1)
    angles = first + 2 * np.pi * np.arange(8) / 8
    return [
        box(
            (0.08 * reach, 0.08 * reach, reach),
            (0.6 * reach * np.cos(a), 0.6 * reach * np.sin(a), reach / 2),
            a,
        )
        for a in angles
    ]


SCENES: dict[str, Callable[[np.random.Generator, float], list[dict[str, object]]]] = {
    "table": table,
    "shelf": shelf,
    "cage": cage,
}


def make(out: Path, urdf: Path, scene: str, count: int, seed: int, joints: Sequence[str] | None) -> None:
    """Write seeded problems whose straight lines are blocked, and whose ends keep a clearance."""
    from roboyard.planning.problem_files import _obstacles
    from roboyard.planning.spheres.link_fit import fitted_model

    rng = np.random.default_rng(seed)
    model = fitted_model(load_description(urdf), progress=print)
    names = list(joints or model.coordinate_names)
    robot = sphere_robot(model, names)
    lower, upper = robot.arrays.lower, robot.arrays.upper
    reach = float(np.linalg.norm(robot.chain.origin_position, axis=1)[1:].sum()) + 0.1
    problems: list[dict[str, object]] = []
    while len(problems) < count:
        obstacles = SCENES[scene](rng, reach)
        wide = [{**o, "size": [s + 2 * CLEARANCE for s in o["size"]]} for o in obstacles]  # type: ignore[attr-defined]
        free = judge_of(robot, _obstacles(out, wide, "obstacles"))
        exact = judge_of(robot, _obstacles(out, obstacles, "obstacles"))
        found: list[np.ndarray] = []
        want = min(20, count - len(problems))
        for _ in range(20_000):
            q = rng.uniform(lower, upper)
            if not free.clashes(q):
                found.append(q)
            if len(found) == 2:
                line = found[0] + np.linspace(0, 1, 300)[:, None] * (found[1] - found[0])
                if exact.first_clash(line) is not None:
                    start, goal = (_named(robot.order, q) for q in found)
                    problems.append(
                        {
                            "name": f"{scene}{len(problems)}",
                            "start": start,
                            "goal": {"joints": goal},
                            "obstacles": obstacles,
                        }
                    )
                    want -= 1
                found = []
            if want == 0:
                break
    data = {
        "urdf": os.path.relpath(urdf, out.parent),
        "joints": names,
        "time_limit": 5.0,
        "problems": problems,
    }
    data["limits"] = {key: [value] * len(names) for key, value in (("acceleration", 15.0), ("jerk", 500.0))}
    out.write_text(json.dumps(data), encoding="utf-8")


def _named(order: Sequence[int], q: np.ndarray) -> list[float]:
    out = [0.0] * len(q)
    for value, k in zip(q, order, strict=True):
        out[k] = float(value)
    return out


# ------------------------------------------------------------------------------------------------ planners

Row = dict[str, object]
"""name, seconds, path (w, n) or None, dense (k, n) what is replayed, duration (s) or None."""


def ours(problems: ProblemFile) -> list[Row]:
    model = load_model(problems)
    rows: list[Row] = []
    planner, of = None, None
    for problem in problems.problems:
        if planner is None or problem.obstacles != of:
            limits = {key: problems.limits.get(key) for key in ("velocity", "acceleration", "jerk")}
            planner = Planner(model, problems.joints, problem.obstacles, held=problems.hold, **limits)
            planner.warm_up()
            of = problem.obstacles
        begin = time.process_time()
        plan = planner.plan(problem.start, problem.goal, time_limit=problems.time_limit)
        seconds = time.process_time() - begin
        row: Row = {"name": problem.name, "seconds": seconds, "path": None, "dense": None, "duration": None}
        if plan.trajectory is not None:
            dense, duration = plan.trajectory.dense(STEP), plan.trajectory.duration
            row |= {"path": plan.path, "dense": dense, "duration": duration}
        rows.append(row)
    return rows


def along(path: np.ndarray | None) -> np.ndarray | None:
    if path is None:
        return None
    rows = [path[:1]]
    for a, b in pairwise(path):
        count = max(1, int(np.ceil(np.linalg.norm(b - a) / STEP)))
        rows.append(a + np.linspace(0, 1, count + 1)[1:, None] * (b - a))
    return np.concatenate(rows)


def mplib(problems: ProblemFile) -> list[Row]:
    import mplib as package

    with tempfile.TemporaryDirectory() as folder:
        urdf, srdf = _plain_files(problems, Path(folder))
        rows = []
        for problem in problems.problems:
            planner = package.Planner(urdf=str(urdf), srdf=str(srdf), move_group=_last_link(problems))
            names = list(planner.user_joint_names)
            order = [problems.joints.index(n) if n in problems.joints else -1 for n in names]
            add_boxes(planner, package, problem.obstacles)
            hold = np.array(
                [0.0 if k >= 0 else problems.hold.get(n, 0.0) for n, k in zip(names, order, strict=True)]
            )
            start, goal = hold.copy(), hold.copy()
            for i, k in enumerate(order):
                if k >= 0:
                    start[i], goal[i] = problem.start[k], problem.goal[k]  # type: ignore[index]
            begin = time.process_time()
            status, path = planner.planner.plan(
                start, [goal], time=problems.time_limit, range=0.1, simplify=True, verbose=False
            )
            seconds = time.process_time() - begin
            solved = "Exact" in status and len(path) > 1
            out = None
            if solved:
                out = np.zeros((len(path), len(problems.joints)))
                for i, k in enumerate(order):
                    if k >= 0:
                        out[:, k] = np.asarray(path)[:, i]
            rows.append(
                {"name": problem.name, "seconds": seconds, "path": out, "dense": along(out), "duration": None}
            )
    return rows


def add_boxes(planner: object, package: object, obstacles: Sequence[object]) -> None:
    from mplib.collision_detection import fcl

    world = planner.planning_world  # type: ignore[attr-defined]
    for k, o in enumerate(obstacles):
        x, y, z, w = o.pose.quaternion  # type: ignore[attr-defined]
        shape = fcl.CollisionObject(
            fcl.Box(np.array(o.shape.size)), package.Pose(np.array(o.pose.position), np.array([w, x, y, z]))
        )  # type: ignore[attr-defined]
        world.add_object(
            fcl.FCLObject(
                f"o{k}",
                package.Pose(),
                [shape],
                [package.Pose(np.array(o.pose.position), np.array([w, x, y, z]))],
            )
        )  # type: ignore[attr-defined]


def _last_link(problems: ProblemFile) -> str:
    description = load_description(problems.urdf)
    return description.joint_by_name[problems.joints[-1]].child


def _plain_files(problems: ProblemFile, folder: Path) -> tuple[Path, Path]:
    """Copies of the URDF with absolute paths and hulls as STL, and an SRDF with the pairs that we ignore."""
    model = load_model(problems)
    urdf = folder / "robot.urdf"
    urdf.write_text(_with_hulls(problems.urdf, folder), encoding="utf-8")
    pairs = [
        f'<disable_collisions link1="{a}" link2="{b}" reason="ignored"/>' for a, b in sorted(model.ignore)
    ]
    srdf = folder / "robot.srdf"
    name = model.description.name
    srdf.write_text(f'<robot name="{name}">{"".join(pairs)}</robot>', encoding="utf-8")
    return urdf, srdf


def _with_hulls(urdf: Path, folder: Path) -> str:
    """The URDF without visuals, its collision meshes replaced by their hulls in `folder`."""
    import xml.etree.ElementTree as ET

    import trimesh

    tree = ET.parse(urdf)
    for link in tree.iter("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
        for k, mesh in enumerate(link.iter("mesh")):
            name = mesh.get("filename", "")
            found = next(p for p in (urdf.parent / name.split("//")[-1], urdf.parent / name) if p.is_file())
            target = folder / f"{link.get('name')}_{k}.stl"
            trimesh.load(found, force="mesh").convex_hull.export(target)
            mesh.set("filename", str(target))
    return ET.tostring(tree.getroot(), encoding="unicode")


def ompl(problems: ProblemFile) -> list[Row]:
    """OMPL's RRT-Connect and path simplification, with Roboyard's checker for states every 0.05 rad.

    Where spheres overlap, MuJoCo's hulls decide: starts and goals are nearer to obstacles than spheres allow.
    """
    from ompl import base, geometric, util

    from roboyard.planning.checking import CollisionChecker
    from roboyard.planning.obstacles import Obstacles

    util.setLogLevel(util.LOG_NONE)
    model = load_model(problems)
    robot = sphere_robot(model, problems.joints, problems.hold)
    n = len(problems.joints)
    order = np.array(robot.order)
    rows = []
    for problem in problems.problems:
        checker, judge = (
            CollisionChecker(robot, Obstacles(problem.obstacles)),
            judge_of(robot, problem.obstacles),
        )
        space = base.RealVectorStateSpace(n)
        bounds = base.RealVectorBounds(n)
        for j in range(n):
            bounds.setLow(j, float(robot.arrays.lower[j]))
            bounds.setHigh(j, float(robot.arrays.upper[j]))
        space.setBounds(bounds)
        setup = geometric.SimpleSetup(space)

        def valid(state: object, checker: CollisionChecker = checker, judge: HullJudge = judge) -> bool:
            q = np.array([state[j] for j in range(n)])  # type: ignore[index]
            return bool(checker.free(q[None])[0]) or not judge.clashes(q)

        setup.setStateValidityChecker(valid)
        setup.getSpaceInformation().setStateValidityCheckingResolution(0.05 / space.getMaximumExtent())
        start, goal = space.allocState(), space.allocState()
        for j in range(n):
            start[j], goal[j] = problem.start[order[j]], problem.goal[order[j]]  # type: ignore[index]
        setup.setStartAndGoalStates(start, goal)
        setup.setPlanner(geometric.RRTConnect(setup.getSpaceInformation()))
        begin = time.process_time()
        solved = setup.solve(problems.time_limit)
        out = None
        if solved and setup.haveExactSolutionPath():
            setup.simplifySolution()
            found = setup.getSolutionPath()
            out = np.zeros((found.getStateCount(), n))
            for i in range(found.getStateCount()):
                out[i, order] = [found.getState(i)[j] for j in range(n)]
        seconds = time.process_time() - begin
        rows.append(
            {"name": problem.name, "seconds": seconds, "path": out, "dense": along(out), "duration": None}
        )
    return rows


def pybullet(problems: ProblemFile) -> list[Row]:
    """pybullet_planning's bidirectional RRT with smoothing, in PyBullet itself."""
    import pybullet_planning as pp

    import pybullet as p

    model = load_model(problems)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        urdf, _ = _plain_files(problems, Path(folder))
        for problem in problems.problems:
            pp.connect(use_gui=False)
            with pp.HideOutput():
                robot = pp.load_pybullet(str(urdf), fixed_base=True)
            links = {pp.get_link_name(robot, k): k for k in range(-1, p.getNumJoints(robot))}
            bodies = []
            for o in problem.obstacles:
                body = pp.create_box(*o.shape.size)  # type: ignore[union-attr]
                pp.set_pose(body, (o.pose.position, o.pose.quaternion))
                bodies.append(body)
            joints = pp.joints_from_names(robot, problems.joints)
            pp.set_joint_positions(robot, joints, problem.start)
            disabled = {(links[a], links[b]) for a, b in model.ignore if a in links and b in links}
            begin = time.process_time()
            path = pp.plan_joint_motion(
                robot,
                joints,
                problem.goal,
                obstacles=bodies,
                self_collisions=True,
                disabled_collisions=disabled,
                max_time=problems.time_limit,
                diagnosis=False,
            )
            seconds = time.process_time() - begin
            out = None if path is None else np.array(path)
            rows.append(
                {"name": problem.name, "seconds": seconds, "path": out, "dense": along(out), "duration": None}
            )
            pp.disconnect()
    return rows


PLANNERS: dict[str, tuple[str, Callable[[ProblemFile], list[Row]]]] = {
    "ours": ("roboyard", ours),
    "mplib": ("mplib", mplib),
    "ompl": ("ompl", ompl),
    "pybullet": ("pybullet_planning", pybullet),
}


# ------------------------------------------------------------------------------------------------ comparison


def toppra_duration(path: np.ndarray, limits: np.ndarray) -> float | None:
    """Duration of toppra's motion along a spline through the way points, without a jerk limit."""
    if importlib.util.find_spec("toppra") is None or len(path) < 2:
        return None
    import toppra
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

    toppra.setup_logging("ERROR")
    s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    bounds = [np.stack([-row, row], axis=1) for row in limits[:2]]
    constraints = [JointVelocityConstraint(bounds[0]), JointAccelerationConstraint(bounds[1])]
    made = TOPPRA(constraints, toppra.SplineInterpolator(s, path), parametrizer="ParametrizeConstAccel")
    found = made.compute_trajectory()
    return None if found is None else float(found.duration)


def is_valid(judge: HullJudge, order: Sequence[int], dense: np.ndarray) -> bool:
    return judge.first_clash(dense[:, list(order)]) is None


def run(files: Sequence[Path], chosen: Sequence[str]) -> None:
    print("| problems | planner | solved | valid | median ms | p95 ms | length / ours | duration / toppra |")
    print("|---|---|---|---|---|---|---|---|")
    for file in files:
        problems = load_problems(file)
        model = load_model(problems)
        robot = sphere_robot(model, problems.joints, problems.hold)
        velocity = np.where(np.isfinite(robot.chain.velocity), robot.chain.velocity, 2.0)
        limits = np.zeros((2, len(problems.joints)))
        limits[0, list(robot.order)] = velocity
        limits[1] = problems.limits.get("acceleration", 15.0)
        base: dict[str, float] = {}
        for name in chosen:
            package, planner = PLANNERS[name]
            if importlib.util.find_spec(package) is None:
                print(f"| {file.stem} | {name} | not installed | | | | | |")
                continue
            rows = planner(problems)
            seconds = np.array([row["seconds"] for row in rows], dtype=float)
            valid, ratios, durations, solved = 0, [], [], 0
            for problem, row in zip(problems.problems, rows, strict=True):
                if row["path"] is None:
                    continue
                solved += 1
                judge = judge_of(robot, problem.obstacles)
                valid += is_valid(judge, robot.order, row["dense"])  # type: ignore[arg-type]
                length = float(np.linalg.norm(np.diff(row["path"], axis=0), axis=1).sum())  # type: ignore[arg-type]
                if name == chosen[0]:
                    base[problem.name] = length
                elif problem.name in base:
                    ratios.append(length / base[problem.name])
                if row["duration"] is not None:
                    best = toppra_duration(np.asarray(row["path"]), limits)
                    if best:
                        durations.append(float(row["duration"]) / best)  # type: ignore[arg-type]
            ratio = f"{np.mean(ratios):.3f}" if ratios else "1"
            duration = f"{np.median(durations):.3f}" if durations else "-"
            print(
                f"| {file.stem} | {name} | {solved}/{len(rows)} | {valid}/{solved} "
                f"| {1e3 * np.median(seconds):.2f} "
                f"| {1e3 * np.percentile(seconds, 95):.2f} | {ratio} | {duration} |",
                flush=True,
            )


def main(arguments: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    making = commands.add_parser("make")
    making.add_argument("out", type=Path)
    making.add_argument("urdf", type=Path, nargs="?", default=ARM)
    making.add_argument("--scene", choices=SCENES, default="table")
    making.add_argument("--count", type=int, default=100)
    making.add_argument("--seed", type=int, default=0)
    making.add_argument("--joints")
    running = commands.add_parser("run")
    running.add_argument("files", type=Path, nargs="+")
    running.add_argument("--with", dest="chosen", default=",".join(PLANNERS))
    both = commands.add_parser("scenes")
    both.add_argument("urdf", type=Path, nargs="?", default=ARM)
    both.add_argument("--count", type=int, default=30)
    both.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
    if given.command == "scenes":
        with tempfile.TemporaryDirectory() as folder:
            files = [Path(folder) / f"{given.urdf.stem} {scene}.json" for scene in SCENES]
            for scene, file in zip(SCENES, files, strict=True):
                make(file, given.urdf, scene, given.count, given.seed, None)
            run(files, list(PLANNERS))
    elif given.command == "make":
        joints = given.joints.split(",") if given.joints else None
        make(given.out, given.urdf, given.scene, given.count, given.seed, joints)
    else:
        run(given.files, given.chosen.split(","))


if __name__ == "__main__":
    main(sys.argv[1:])

"""Seeded sets of planning problems for several robots, each trajectory judged by MuJoCo, as one table.

    python benchmarks/planning_sets.py [--count 100] [ARM.urdf ...] [--only arm7,r1]

The bundled 7-joint arm at a table, a shelf and in a cage; R1 at a table with one arm, both arms and its whole
body; and each further arm at all three scenes in turn, by default a UR5 and an xArm 6 where their packages
(example-robot-data, pybullet) are installed. Starts and goals keep 8 mm from obstacles, and every straight
line between them is blocked.

solved      by the planner in 5 s; of those unsolved, how many have a solution that 60 s find
touching    trajectories that touch anything, replayed every 0.01 rad with the hulls of the collision shapes
beyond      most that a velocity, acceleration or jerk exceeds its limit, sampled densely (1)
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from planning import ARM, CLEARANCE, SCENES, STEP
from roboyard.assets import assets_root
from roboyard.description import load_description
from roboyard.description.model import Box, Pose
from roboyard.kinematics import forward_kinematics
from roboyard.planning import (
    Obstacle,
    Plan,
    Planner,
    SphereModel,
    covering_model,
    fitted_model,
    load_planner_file,
)
from roboyard.planning.hull_judge import judge_of
from roboyard.planning.spheres.sphere_model import SphereRobot, sphere_robot

VELOCITY, ACCELERATION, JERK = 2.0, 15.0, 500.0
"""Limits where the files have none (rad/s, rad/s², rad/s³)."""
LONG = 60.0
"""Search for problems that were not solved at first (s)."""


@dataclass(frozen=True, kw_only=True)
class Group:
    """One group of joints in some scenes."""

    name: str
    model: SphereModel
    joints: tuple[str, ...]
    scenes: tuple[str, ...]
    lift: float = 0.0
    """Height of the scenes above the root link (m)."""
    ahead: float = 0.0
    """Distance of the scenes before the root link (m)."""
    reach: float = 0.0
    """Size of the scenes (m)."""


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A start and a goal among obstacles, in the group's order of joints."""

    start: np.ndarray
    goal: np.ndarray
    obstacles: tuple[Obstacle, ...]


def groups(urdfs: Sequence[Path], only: Sequence[str]) -> Iterator[Group]:
    """Yield the robots and groups of the table."""
    if not only or "arm7" in only:
        model = fitted_model(load_description(ARM))
        for scene in SCENES:
            yield group_of(f"arm7 {scene}", model, model.coordinate_names, (scene,))
    for urdf in urdfs:
        if not only or urdf.stem in only:
            model = fitted_model(load_description(urdf), progress=lambda text: print(text, file=sys.stderr))
            yield group_of(urdf.stem, model, model.coordinate_names[:6], tuple(SCENES))
    if not only or "r1" in only:
        folder = assets_root() / "r1"
        description = load_description(next((folder / "urdf").glob("*.urdf")))
        model = covering_model(load_planner_file(folder / "curobo" / "r1.yml", description))
        arms = {s: tuple(f"{s}_arm_joint{k}" for k in range(1, 7)) for s in ("left", "right")}
        torso = tuple(f"torso_joint{k}" for k in range(1, 5))
        base = tuple(f"base_footprint_{axis}_joint" for axis in ("x", "y", "rz"))
        at_table = {"lift": 0.66, "ahead": 0.25, "reach": 0.85}
        both = (*arms["left"], *arms["right"])
        yield Group(name="r1 one arm", model=model, joints=arms["left"], scenes=("table",), **at_table)
        yield Group(name="r1 both arms", model=model, joints=both, scenes=("table",), **at_table)
        whole = (*base, *torso, *both)
        yield Group(name="r1 whole body", model=model, joints=whole, scenes=("table",), **at_table)


def group_of(name: str, model: SphereModel, joints: Sequence[str], scenes: tuple[str, ...]) -> Group:
    """A group of an arm on the floor, whose reach is the sum of its links."""
    robot = sphere_robot(model, joints)
    reach = float(np.linalg.norm(robot.chain.origin_position, axis=1)[1:].sum()) + 0.1
    return Group(name=name, model=model, joints=tuple(joints), scenes=scenes, reach=reach)


def installed_arms() -> list[Path]:
    """A UR5 and an xArm 6, where their packages are installed."""
    found = []
    for base in map(Path, sys.path):
        found += sorted(
            base.glob("cmeel.prefix/share/example-robot-data/robots/ur_description/urdf/ur5_robot.urdf")
        )
    data = importlib.util.find_spec("pybullet_data")
    if data is not None and data.origin is not None:
        found += [Path(data.origin).parent / "xarm" / "xarm6_robot.urdf"]
    return [path for path in found if path.is_file()]


def problems_of(group: Group, count: int, seed: int) -> tuple[SphereRobot, list[Problem]]:
    """Seeded problems whose straight lines are blocked."""
    random = np.random.default_rng(seed)
    robot = sphere_robot(group.model, group.joints)
    lower, upper = np.maximum(robot.arrays.lower, -2.0 * np.pi), np.minimum(robot.arrays.upper, 2.0 * np.pi)
    rest = np.clip([group.model.retract.get(name, 0.0) for name in robot.joint_names], lower, upper)
    # random postures of many joints are tangled: those of robots with several limbs stay nearer to rest
    spread = 1.0 if len(group.joints) < 10 else 0.35
    made: list[Problem] = []
    while len(made) < count:
        scene = group.scenes[len(made) % len(group.scenes)]
        boxes = SCENES[scene](random, group.reach)
        shift = np.array([group.ahead, 0.0, group.lift])
        exact, wide = (
            [
                Obstacle(
                    name=f"{scene}{k}",
                    shape=Box(size=tuple(float(s) + grow for s in box["size"])),  # type: ignore[attr-defined]
                    pose=Pose(
                        position=tuple((np.array(box["position"]) + shift).tolist()),  # type: ignore[arg-type]
                        quaternion=tuple(box["quaternion"]),  # type: ignore[arg-type]
                    ),
                )
                for k, box in enumerate(boxes)
            ]
            for grow in (0.0, 2 * CLEARANCE)
        )
        free, judge = judge_of(robot, wide), judge_of(robot, exact)
        want = 1 if len(group.scenes) > 1 else min(20, count - len(made))
        found: list[np.ndarray] = []
        for _ in range(30_000):
            q = rest + spread * (random.uniform(lower, upper) - rest)
            if free.clashes(q):
                continue
            found.append(q)
            if len(found) == 2:
                line = found[0] + np.linspace(0, 1, 200)[:, None] * (found[1] - found[0])
                if judge.first_clash(line) is not None:
                    made.append(
                        Problem(
                            start=named(robot, found[0]), goal=named(robot, found[1]), obstacles=tuple(exact)
                        )
                    )
                    want -= 1
                found = []
            if want == 0:
                break
    return robot, made


def named(robot: SphereRobot, q: np.ndarray) -> np.ndarray:
    """A configuration in the caller's order of joints."""
    out = np.empty_like(q)
    out[list(robot.order)] = q
    return out


def beyond(plan: Plan, limits: np.ndarray) -> float:
    """Most that a trajectory exceeds a limit."""
    trajectory = plan.trajectory
    assert trajectory is not None
    times = np.concatenate([trajectory.t, np.linspace(0, trajectory.duration, 2000)])
    _, v, a, jerk = trajectory.at(times)
    return max(float((np.abs(rows) - limit).max()) for rows, limit in zip((v, a, jerk), limits, strict=True))


def run(group: Group, count: int, seed: int) -> str:
    """One row of the table."""
    robot, problems = problems_of(group, count, seed)
    seconds, lengths, solved, known, touching, most = [], [], 0, 0, 0, -np.inf
    judged: tuple[Obstacle, ...] | None = None
    for problem in problems:
        if judged is not problem.obstacles:
            planner = Planner(
                group.model, group.joints, problem.obstacles, acceleration=ACCELERATION, jerk=JERK
            )
            planner.warm_up()
            judge, judged = judge_of(robot, problem.obstacles), problem.obstacles
        begin = time.process_time()
        plan = planner.plan(problem.start, problem.goal)
        seconds.append(time.process_time() - begin)
        if not plan.solved:
            print(f"{group.name}: {plan.outcome}: {plan.reason}", file=sys.stderr)
            known += planner.plan(problem.start, problem.goal, time_limit=LONG, seed=1).solved
            continue
        assert plan.trajectory is not None
        solved += 1
        lengths.append(plan.length)
        dense = plan.trajectory.dense(STEP)[:, list(robot.order)]
        touching += judge.first_clash(dense) is not None
        most = max(most, beyond(plan, planner.named_limits))
        end = forward_kinematics(robot.chain, dense[-1])
        wanted = forward_kinematics(robot.chain, problem.goal[list(robot.order)])
        assert np.abs(end - wanted).max() < 1e-6, "the trajectory ends elsewhere"
    unsolved = count - solved
    open_ones = f", {known} of {unsolved} others have a solution" if unsolved else ""
    median, slow = 1e3 * np.percentile(seconds, (50, 95))
    return (
        f"| {group.name} | {len(group.joints)} | {solved}/{count}{open_ones} | {touching} "
        f"| {max(most, 0.0):.0e} | {median:.1f} | {slow:.0f} | {np.mean(lengths):.2f} |"
    )


def main(arguments: Sequence[str]) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("urdfs", type=Path, nargs="*", help="arms; the first six joints are planned")
    parser.add_argument("--count", type=int, default=100, help="problems of each group")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="robots, by name")
    given = parser.parse_args(arguments)
    print("| group | joints | solved | touching | beyond | median ms | p95 ms | length |")
    print("|---|---|---|---|---|---|---|---|")
    only = [name for name in given.only.split(",") if name]
    for group in groups(given.urdfs or installed_arms(), only):
        print(run(group, given.count, given.seed), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])

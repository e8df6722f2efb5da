"""`roboyard plan`: collision-free, jerk-limited motions of a robot."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from roboyard.cli.completion import scene_names, viewed_names
from roboyard.cli.numbers import read_numbers
from roboyard.cli.packages import PackageOption
from roboyard.cli.robot_argument import robot_source
from roboyard.cli.xacro_args import XacroArgOption
from roboyard.untrusted.text import json_text, one_line, say

if TYPE_CHECKING:
    from roboyard.description.model import RobotDescription
    from roboyard.planning import Plan, PoseGoal, RobotPlanner
    from roboyard.robots.robot import Robot

EXAMPLES = """
Examples:

\b
  roboyard plan arm7 --to 0.4,0.3,0.5                      a motion as GIF and plot
  roboyard plan r1 --arm left --to 0.5,0.3,1.0 --scene home
  roboyard plan r1 --scene tabletop --browser              drag the goal in the browser
  roboyard plan --problems arm.json --out rows.jsonl       every problem of a file
  roboyard plan --problems box_panda --urdf panda.urdf --out rows.jsonl
"""
FPS = 20.0
"""Pictures a second of the video."""
VIEW = (0.72, -0.58, 0.38)
"""Direction from the robot to the camera."""


def plan(
    robot: Annotated[
        str | None,
        typer.Argument(
            help="A robot file, or the name of a robot.",
            metavar="ROBOT",
            show_default=False,
            autocompletion=viewed_names,
        ),
    ] = None,
    to: Annotated[
        str | None,
        typer.Option(
            help="Goal of the end effector in the world: X,Y,Z in m, or X,Y,Z,R,P,Y with angles in rad.",
            metavar="X,Y,Z[,R,P,Y]",
            show_default=False,
        ),
    ] = None,
    arm: Annotated[str | None, typer.Option(help='Arm of the robot, or "both".', show_default=False)] = None,
    torso: Annotated[bool, typer.Option("--torso", help="Also move the trunk.")] = False,
    base: Annotated[bool, typer.Option("--base", help="Also move a holonomic base.")] = False,
    link: Annotated[
        str | None, typer.Option(help="Link that reaches the goal; the end effector.", show_default=False)
    ] = None,
    scene: Annotated[
        str | None,
        typer.Option(
            help="empty, tabletop, home, terrain, or a scene file.",
            show_default=False,
            autocompletion=scene_names,
        ),
    ] = None,
    video: Annotated[Path, typer.Option(help="Video to write (.gif or .mp4).")] = Path("plan.gif"),
    plot: Annotated[Path, typer.Option(help="Plot to write (.png).")] = Path("plan.png"),
    problems: Annotated[
        Path | None,
        typer.Option(
            help="Problems to plan (.json), or a set of MotionBenchMaker; docs/planning.md has the formats.",
            show_default=False,
        ),
    ] = None,
    urdf: Annotated[
        Path | None,
        typer.Option(help="Robot of a set of MotionBenchMaker, which has none.", show_default=False),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Results of --problems, one JSON object a line (.jsonl).", show_default=False),
    ] = None,
    browser: Annotated[
        bool, typer.Option("--browser", help="Drag the goal in the browser; each motion is shown at once.")
    ] = False,
    host: Annotated[str, typer.Option(help="Address of the page.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="First port to try for the page.")] = 8080,
    open_browser: Annotated[
        bool, typer.Option("--open/--no-open", help="Open a browser if there is a display.")
    ] = True,
    time_limit: Annotated[float, typer.Option(help="Longest search for ROBOT (s).")] = 5.0,
    seed: Annotated[int, typer.Option(help="Seed of the random samples.")] = 0,
    package: PackageOption = None,
    xacro_arg: XacroArgOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Plan collision-free motions within velocity, acceleration and jerk limits.

    With ROBOT and --to, shows one motion as a video and as a plot against its limits. With --problems, plans
    every problem of a file; each result has the outcome, the reason of a failure, the path and the timing.
    """
    from roboyard.errors import ConfigError

    if problems is not None:
        if robot is not None or to is not None:
            raise ConfigError(
                f"--problems {problems}: cannot be combined with ROBOT or --to; omit one of them"
            )
        if out is None:
            raise ConfigError(f"--out is missing; give a file for the results, such as {problems.stem}.jsonl")
        _plan_file(problems, urdf, out, seed, as_json=as_json)
        return
    if robot is None or (to is None and not browser):
        raise ConfigError("give ROBOT and --to X,Y,Z or --browser, or --problems FILE and --out FILE")
    if plot.suffix != ".png":
        raise ConfigError(f"--plot {plot}: the file of a plot must end in .png")
    numbers = None
    if to is not None:
        numbers = read_numbers("--to", to, (3, 6), "X,Y,Z or X,Y,Z,R,P,Y, separated by commas")
    subject = _in_scene(robot_source(robot, package, xacro_arg), scene)
    group = {"arm": arm, "torso": torso, "base": base}
    if browser or numbers is None:
        _plan_in_browser(subject, numbers, link, group, host, port, open_browser=open_browser)
        return
    made = _plan_one(subject, numbers, link, group, video, plot, time_limit, seed)
    assert made.trajectory is not None
    milliseconds = 1e3 * (made.planning_seconds + made.timing_seconds)
    if as_json:
        import numpy as np

        done = {
            "outcome": made.outcome,
            "path": np.asarray(made.path).tolist(),
            "duration": made.trajectory.duration,
        }
        print(json_text({**done, "planning_ms": milliseconds, "files": [str(video), str(plot)]}))
        return
    say(
        f"{len(made.path)} way points, {made.trajectory.duration:.2f} s; planned in {milliseconds:.1f} ms",
        f"wrote {video}",
        f"wrote {plot}",
    )


def _in_scene(source: str | RobotDescription, scene: str | None) -> Robot:
    """Add the robot to a scene; to an empty floor by default."""
    from roboyard.robots import add_robot
    from roboyard.scenes import load_scene

    loaded = load_scene(scene or "empty")
    made = add_robot(loaded.world, source, loaded.spawn, loaded.spawn_orientation)
    made.reset()
    return made


def _plan_one(
    robot: Robot,
    numbers: list[float],
    link: str | None,
    group: dict[str, Any],
    video: Path,
    plot: Path,
    time_limit: float,
    seed: int,
) -> Plan:
    """Plan one motion, and write its video and plot."""
    from roboyard.errors import RoboyardError
    from roboyard.planning import planner_for
    from roboyard.planning.plots import plot_trajectory

    planner = planner_for(robot, **group)
    goal = _pose_goal(link or planner.tool, numbers)
    planner.planner().warm_up()
    made = planner.plan(goal, time_limit=time_limit, seed=seed)
    if made.trajectory is None:
        raise RoboyardError(f"{made.outcome}: {made.reason}")
    at_goal = planner.planner()
    plot_trajectory(plot, made.trajectory, at_goal.named_limits, at_goal.bounds)
    _film(robot, planner, made, video)
    return made


def _pose_goal(link: str, numbers: list[float]) -> PoseGoal:
    from roboyard.planning import PoseGoal
    from roboyard.transforms import quaternion_from_rpy

    turn = quaternion_from_rpy(numbers[3:]) if len(numbers) == 6 else None
    return PoseGoal(link=link, position=numbers[:3], quaternion=turn)


def _plan_in_browser(
    robot: Robot,
    numbers: list[float] | None,
    link: str | None,
    group: dict[str, Any],
    host: str,
    port: int,
    *,
    open_browser: bool,
) -> None:
    """Serve a page on which the goal is dragged, until the process is interrupted."""
    from roboyard.planning import planner_for
    from roboyard.viewer.page.browser import open_page
    from roboyard.viewer.page.server import load_viser
    from roboyard.viewer.planning import PlanningPage

    load_viser()
    planner = planner_for(robot, **group)
    goal = None if numbers is None else _pose_goal(link or planner.tool, numbers)
    page = PlanningPage(planner, link=link, goal=goal, host=host, port=port)
    try:
        if open_browser:
            open_page(page.viewer.url)
        page.run()
    except KeyboardInterrupt:
        print()
    finally:
        page.close()


def _film(robot: Robot, planner: RobotPlanner, made: Plan, path: Path) -> None:
    """Show the motion from one point of view, with half a second of rest at its end."""
    import numpy as np

    from roboyard.recording import VideoWriter
    from roboyard.rendering import Camera

    trajectory = made.trajectory
    assert trajectory is not None
    rows = [robot.joint_names.index(name) for name in planner.joint_names]

    def show(time: float) -> None:
        posture = robot.joint_positions
        posture[rows] = trajectory.at(time)[0]
        robot.joint_positions = posture

    corners = []
    for time in np.linspace(0.0, trajectory.duration, 8):
        show(float(time))
        corners.append(robot.body.bounds)
    low, high = np.min(corners, axis=0)[0], np.max(corners, axis=0)[1]
    middle, size = (low + high) / 2, float(np.linalg.norm(high - low))
    camera = Camera.look_at(middle + 1.25 * size * np.array(VIEW), middle, width=640, height=480)
    with VideoWriter(path, fps=FPS) as film:
        for time in np.arange(0.0, trajectory.duration + 0.5, 1.0 / FPS):
            show(float(time))
            film.add(robot.world.render(camera))


def _plan_file(problems: Path, urdf: Path | None, out: Path, seed: int, *, as_json: bool) -> None:
    import json
    from collections import Counter

    import numpy as np

    from roboyard.errors import ConfigError
    from roboyard.planning.problem_files import load_problems, row_of, solve_problems
    from roboyard.planning.published_sets import is_published_set, load_published_set

    published = is_published_set(problems)
    if published and urdf is None:
        raise ConfigError(f"--problems {problems}: this set has no robot; give its file with --urdf")
    if urdf is not None and not published:
        raise ConfigError(f"--urdf {urdf}: {problems} names a robot itself; omit --urdf")
    loaded = load_problems(problems) if urdf is None else load_published_set(problems, urdf)
    outcomes: Counter[str] = Counter()
    times: list[float] = []
    with out.open("w", encoding="utf-8") as file:
        for problem, made in solve_problems(loaded, seed=seed, progress=None if as_json else _say_fitting):
            file.write(json.dumps(row_of(problem.name, made)) + "\n")
            outcomes[made.outcome] += 1
            times.append(1e3 * (made.planning_seconds + made.timing_seconds))
            if not made.solved and not as_json:
                say(f"{problem.name}: {made.outcome}: {made.reason}")
    if as_json:
        middle = float(np.median(times)) if times else None
        print(json_text({"outcomes": dict(outcomes), "median_ms": middle, "files": [str(out)]}))
        return
    counts = ", ".join(f"{count} {outcome}" for outcome, count in outcomes.most_common()) or "no problems"
    median = f"; median {np.median(times):.1f} ms" if times else ""
    say(f"{counts}{median}", f"wrote {out}")


def _say_fitting(link: str) -> None:
    print(f"fitting spheres to {one_line(link)}", flush=True)

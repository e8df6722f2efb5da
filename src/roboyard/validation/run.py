"""Run the gates of a robot; a gate that raises an error counts as failed."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from roboyard._second_process import Part, SecondProcess
from roboyard.description.robot_model import RobotModel
from roboyard.description.understanding import understanding
from roboyard.errors import ConfigError, MeshError, RoboyardError, unknown_name
from roboyard.morphology.analyze import infer_semantics
from roboyard.robots import RegisteredRobot
from roboyard.robots.definition.load import check_fits
from roboyard.robots.sensor_frames import camera_frames
from roboyard.robots.spawn import DefinitionSource, RobotSource, Source, found_robot, load_source
from roboyard.untrusted.json_reading import read_json
from roboyard.untrusted.yaml_reading import read_yaml
from roboyard.validation.gates import GATES, PARTS
from roboyard.validation.report import Gate, ValidationReport
from roboyard.validation.test_world import TestWorld


def validate(
    robot: RobotSource,
    *,
    definition: DefinitionSource | None = None,
    gates: Sequence[str] | None = None,
    seed: int = 0,
    progress: Callable[[str, float], None] | None = None,
    scene: Callable[[Any], None] | None = None,
    second: SecondProcess | None = None,
    **options: Any,
) -> ValidationReport:
    """Run a robot's tests in worlds of their own and return the result of every gate.

    Args:
        robot: a registered name, a robot file, a registered robot, a description or a model.
        definition: a definition file, its data, or a loaded definition; the default is as in `add_robot`.
        gates: names of the gates to run; all by default (see `roboyard.validation.gates.GATES`).
        seed: of randomly sampled poses.
        progress: called with the name of each gate and the finished fraction.
        scene: adds a floor (and more) to each world; a plane by default.
        second: another process that runs gates, too, from the last on.
        options: of `roboyard.robots.add_robot`.

    Raises:
        ConfigError: the definition is wrong, or the robot or a gate unknown.
        DescriptionError: the robot file cannot be loaded.
    """
    for name in gates or ():
        if name not in GATES:
            raise ConfigError(unknown_name("gate", name, GATES))
    began = time.perf_counter()
    test_world = _test_world(robot, definition, seed, scene, options)
    chosen = [name for name in GATES if gates is None or name in gates]
    results: dict[str, Sequence[Gate]] = {}
    started = {} if second is None else _started(chosen, test_world, second)
    order = chosen if second is None else sorted(chosen, key=lambda gate: gate not in PARTS)
    for index, name in enumerate(order):
        if progress is not None:
            progress(name, index / len(chosen))
        try:
            results[name] = started[name]() if started else GATES[name](test_world)
        except RoboyardError as error:
            results[name] = [_broken(name, str(error))]
    joints = (
        test_world.joint_count if test_world.joint_count is not None else len(test_world.robot().joint_names)
    )
    return ValidationReport(
        robot=test_world.name,
        gates=tuple(gate for name in chosen for gate in results[name]),
        capabilities=test_world.definition.capabilities,
        joints=joints,
        seconds=time.perf_counter() - began,
    )


def _started(
    chosen: Sequence[str], test_world: TestWorld, second: SecondProcess
) -> dict[str, Callable[[], tuple[Gate, ...]]]:
    """Have another process run gates, the last first; return the functions that complete them here.

    Those in parts take longest, so both processes begin with them, one with the last part.
    """
    made: dict[str, Callable[[], tuple[Gate, ...]]] = {}
    for name in (gate for gate in chosen if gate in PARTS):
        names_of, test, gates_of = PARTS[name]
        try:
            parts = [second.call(test, test_world, part) for part in reversed(names_of(test_world))]
            made[name] = partial(_completed, parts[::-1], gates_of)
        except RoboyardError:  # the gate as a whole says so
            made[name] = partial(GATES[name], test_world)
    for name in reversed(chosen):
        if name not in PARTS:
            made[name] = second.call(GATES[name], test_world).result
    return made


def _completed(
    parts: Sequence[Part[Any]], gates_of: Callable[[list[Any]], tuple[Gate, ...]]
) -> tuple[Gate, ...]:
    return gates_of([part.result() for part in parts])


def _broken(name: str, message: str) -> Gate:
    """Return the failed result of a gate that raised an error."""
    return Gate(
        name=name,
        title=f"Gate {name} raised an error",
        figure=float("nan"),
        threshold=0.0,
        unit="",
        findings=[" ".join(message.split())],
        advice="fix the error in the message first",
    )


def _beside(robot: RobotSource, source: Source, *, own: bool) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return what an import wrote beside a definition: the understanding of the robot, and its spheres.

    Args:
        robot: as `validate` takes it.
        source: its description and definition.
        own: whether the definition is the robot's own, not one given beside it.
    """
    if not own:
        return {}, {}
    if isinstance(robot, RegisteredRobot):
        file = robot.folder / "understanding.json"
        planner = robot.folder / "curobo" / f"{robot.name}_description_curobo_default.yaml"
        return _understood(file), _spheres_of(planner)
    if isinstance(robot, RobotModel):
        planned = {} if robot.planning is None else robot.planning.spheres
        spheres = {
            link: [{"center": s.center, "radius": s.radius} for s in of] for link, of in planned.items()
        }
        return understanding(robot.semantic), spheres
    try:
        return understanding(infer_semantics(source.description)), {}
    except MeshError:
        return {}, {}


def _understood(file: Path) -> Mapping[str, Any]:
    """Return what an import understood; empty without the file.

    Raises:
        ConfigError: the file cannot be read.
    """
    if not file.is_file():
        return {}
    try:
        understood = read_json(file, 64 << 20)
    except (OSError, ValueError) as error:
        raise ConfigError(f"{file.name}: {error}; import the robot again") from None
    if not isinstance(understood, dict):
        kind = type(understood).__name__
        raise ConfigError(f"{file.name}: it is no object but {kind}; import the robot again")
    found = understood.get("understanding", understood)
    return found if isinstance(found, dict) else {}


def _spheres_of(planner: Path) -> Mapping[str, Any]:
    """Return the spheres of each link in a cuRobo file; empty without the file."""
    if not planner.is_file():
        return {}
    try:
        data = read_yaml(planner, 64 << 20) or {}
    except (OSError, ValueError) as error:
        raise ConfigError(f"{planner.name}: {error}; import the robot again") from None
    for key in ("robot_cfg", "kinematics"):
        data = data.get(key, data) if isinstance(data, dict) else {}
    found = data.get("collision_spheres", {}) if isinstance(data, dict) else {}
    return found if isinstance(found, dict) else {}


def _test_world(
    robot: RobotSource,
    definition: DefinitionSource | None,
    seed: int,
    scene: Callable[[Any], None] | None,
    options: Mapping[str, Any],
) -> TestWorld:
    """Return the worlds that gates run in; the definition is checked first."""
    robot = found_robot(robot)
    source = load_source(robot, definition)
    file, model = source.definition_file, source.model
    check_fits(
        source.definition, source.description, name=file.name if file else f"definition of {model}", file=file
    )
    understood, spheres = _beside(robot, source, own=definition is None)
    return TestWorld(
        name=model,
        understood=understood,
        spheres=spheres,
        source=robot if isinstance(robot, RegisteredRobot) else source.description,
        definition=source.definition,
        seed=seed,
        cameras=() if source.sensor_file is None else camera_frames(source.sensor_file),
        scene=scene,
        options=options,
    )

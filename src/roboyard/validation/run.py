"""Run the gates of a robot; a gate that raises an error counts as failed."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from roboyard.errors import ConfigError, RoboyardError, unknown_name
from roboyard.robots import REGISTERED_ROBOTS, RegisteredRobot
from roboyard.robots.definition.load import check_fits
from roboyard.robots.sensor_frames import camera_frames
from roboyard.robots.spawn import DefinitionSource, RobotSource, is_robot_file, load_source
from roboyard.validation.gates import GATES
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
    results: list[Gate] = []
    for index, name in enumerate(chosen):
        if progress is not None:
            progress(name, index / len(chosen))
        try:
            results += GATES[name](test_world)
        except RoboyardError as error:
            results.append(_broken(name, str(error)))
    joints = (
        test_world.joint_count if test_world.joint_count is not None else len(test_world.robot().joint_names)
    )
    return ValidationReport(
        robot=test_world.name,
        gates=tuple(results),
        capabilities=test_world.definition.capabilities,
        joints=joints,
        seconds=time.perf_counter() - began,
    )


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


def _test_world(
    robot: RobotSource,
    definition: DefinitionSource | None,
    seed: int,
    scene: Callable[[Any], None] | None,
    options: Mapping[str, Any],
) -> TestWorld:
    """Return the worlds that gates run in; the definition is checked first."""
    if isinstance(robot, str) and not is_robot_file(robot):
        robot = REGISTERED_ROBOTS.find(robot)
    source = load_source(robot, definition)
    file, model = source.definition_file, source.model
    check_fits(
        source.definition, source.description, name=file.name if file else f"definition of {model}", file=file
    )
    return TestWorld(
        name=model,
        source=robot if isinstance(robot, RegisteredRobot) else source.description,
        definition=source.definition,
        seed=seed,
        cameras=() if source.sensor_file is None else camera_frames(source.sensor_file),
        scene=scene,
        options=options,
    )

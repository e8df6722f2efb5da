"""Validate a robot: every gate in turn, one that breaks counts as failed."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from roboyard.description.model import RobotDescription
from roboyard.errors import ConfigError, RoboyardError, unknown_name
from roboyard.robots import REGISTERED_ROBOTS, RegisteredRobot, RobotDefinition
from roboyard.robots.definition.load import check_fits
from roboyard.robots.sensor_frames import camera_frames
from roboyard.robots.spawn import _is_file, _read
from roboyard.validation.gates import GATES
from roboyard.validation.report import Gate, ValidationReport
from roboyard.validation.test_world import TestWorld


def validate(
    robot: str | Path | RegisteredRobot | RobotDescription,
    *,
    definition: str | Path | Mapping[str, Any] | RobotDefinition | None = None,
    gates: Sequence[str] | None = None,
    seed: int = 0,
    progress: Callable[[str, float], None] | None = None,
    scene: Callable[[Any], None] | None = None,
    **options: Any,
) -> ValidationReport:
    """Try a robot out in a scene of its own and report on every gate.

    Args:
        robot: a registered name or robot, or with `definition` a URDF file or a description.
        definition: a definition file, its data or a checked one; a registered robot has its own.
        gates: names of the gates to run; all by default (see `roboyard.validation.gates.GATES`).
        seed: of the poses that are sampled.
        progress: told the gate and the share done.
        scene: puts a floor (and more) into each world; a plane by default.
        options: of `roboyard.robots.add_robot`.

    Raises:
        ConfigError: the definition is wrong, or the robot or a gate unknown.
        DescriptionError: the URDF cannot be used.
    """
    for name in gates or ():
        if name not in GATES:
            raise ConfigError(unknown_name("gate", name, GATES))
    began = time.perf_counter()
    bench = _bench(robot, definition, seed, scene, options)
    chosen = [name for name in GATES if gates is None or name in gates]
    results: list[Gate] = []
    for index, name in enumerate(chosen):
        if progress is not None:
            progress(name, index / len(chosen))
        try:
            results += GATES[name](bench)
        except RoboyardError as error:
            results.append(_broken(name, str(error)))
    joints = bench.joint_count if bench.joint_count is not None else len(bench.robot().joint_names)
    return ValidationReport(
        robot=bench.name,
        gates=tuple(results),
        capabilities=bench.definition.capabilities,
        joints=joints,
        seconds=time.perf_counter() - began,
    )


def _broken(name: str, told: str) -> Gate:
    return Gate(
        name=name,
        title=f"Gate {name} could not be finished",
        figure=float("nan"),
        threshold=0.0,
        unit="",
        findings=[" ".join(told.split())],
        advice="mend what the message names first",
    )


def _bench(robot: Any, definition: Any, seed: int, scene: Any, options: Mapping[str, Any]) -> TestWorld:
    cameras = ()
    if isinstance(robot, str) and not _is_file(robot):
        robot = REGISTERED_ROBOTS.find(robot)
    if isinstance(robot, RegisteredRobot):
        name = robot.name
        file: Path | None = robot.file
        own = robot.definition
        if definition is not None:
            own, file = _read(definition)
        check_fits(
            own, robot.description(own), name=file.name if file else f"definition of {name}", file=file
        )
        if robot.sensors is not None:
            cameras = camera_frames(robot.sensors)
        return TestWorld(
            name=name, source=robot, definition=own, seed=seed, cameras=cameras, scene=scene, options=options
        )
    if definition is None:
        raise ConfigError("definition: is required with a URDF; name its definition file")
    own, file = _read(definition)
    if isinstance(robot, RobotDescription):
        description = robot
    else:
        from roboyard.description import load_description

        description = load_description(robot)
    check_fits(own, description, name=file.name if file else f"definition of {description.name}", file=file)
    return TestWorld(
        name=description.name, source=description, definition=own, seed=seed, scene=scene, options=options
    )

"""Whether the registered robots can be loaded."""

from __future__ import annotations

from collections.abc import Iterator

from roboyard.diagnosis.check import Check
from roboyard.errors import RoboyardError
from roboyard.robots.registry import REGISTERED_ROBOTS


def robot_checks() -> Iterator[Check]:
    """Yield the number of usable robots, and each one that is not."""
    good = 0
    for robot in REGISTERED_ROBOTS.values():
        try:
            robot.description(robot.definition)
        except RoboyardError as error:
            yield Check(
                name=f"robot {robot.name}",
                status="failed",
                detail=str(error).splitlines()[0],
                remedy=f"import it again, or remove {robot.file.parent}",
            )
        else:
            good += 1
    yield Check(name="robots", status="ok" if good else "failed", detail=f"{good} can be loaded")

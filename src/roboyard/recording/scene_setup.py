"""A scene with a robot in it, built from plain data; the same data builds the same scene again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.errors import ConfigError
from roboyard.transforms import quaternion_from_rpy

if TYPE_CHECKING:
    from roboyard.robots import Robot
    from roboyard.scenes import Scene

ABOVE = 1.0
"""Height above the scene's spawn pose from which the surface at a given pose is sought (m)."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SceneSetup:
    """A scene and its robot, as `set_up` builds them."""

    scene: Scene
    robot: Robot | None
    """The robot, if `setup` names one."""
    setup: dict[str, Any]
    """The data that the scene was built from; see `set_up`."""


def set_up(setup: Mapping[str, Any]) -> SceneSetup:
    """Build a scene and add a robot at its spawn pose.

    Args:
        setup: "scene" (a name or file for `load_scene`), "robot" (a registered robot's name, or None),
            "controllers" (group to controller name or keys; the robot's defaults where not given) and "pose"
            (3 numbers: x, y in m and yaw in rad in the world frame; the scene's spawn pose by default). At a
            given pose the robot stands on the surface below.

    Raises:
        ConfigError: `setup` has other keys, names an unknown scene, robot or controller, or the robot would
            start inside something.
    """
    from roboyard.scenes import load_scene

    unknown = [name for name in setup if name not in ("scene", "robot", "controllers", "pose")]
    if unknown or not isinstance(setup.get("scene"), str):
        raise ConfigError(
            f"a scene setup needs 'scene' and may have 'robot', 'controllers' and 'pose', got "
            f"{sorted(str(name) for name in setup)}"
        )
    scene = load_scene(setup["scene"])
    robot = None
    if setup.get("robot") is not None:
        from roboyard.robots import add_robot
        from roboyard.robots.placement import raise_out_of_ground

        pose = _pose(setup.get("pose"))
        position, quaternion = scene.spawn, scene.spawn_orientation
        if pose is not None:
            position = (pose[0], pose[1], scene.spawn[2] + ABOVE)
            quaternion = quaternion_from_rpy((0.0, 0.0, pose[2]))
        robot = add_robot(
            scene.world,
            str(setup["robot"]),
            position,
            quaternion,
            controllers=setup.get("controllers") or None,
            on_floor=None if pose is None else True,
        )
        if pose is not None and (inside := raise_out_of_ground(robot)) is not None:
            where = ", ".join(f"{number:g}" for number in pose)
            raise ConfigError(
                f"pose ({where}): {inside.link_a.name} of the robot would start inside "
                f"{inside.body_b.name!r}; choose another pose"
            )
    return SceneSetup(scene=scene, robot=robot, setup=dict(setup))


def _pose(given: Any) -> tuple[float, float, float] | None:
    """Return x, y (m) and yaw (rad) of a setup; None where it has no pose."""
    if given is None:
        return None
    try:
        numbers = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise ConfigError(f"pose: must be 3 finite numbers, x and y in m and yaw in rad, got {given!r}")
    x, y, yaw = numbers.tolist()
    return x, y, yaw

"""A scene with a robot in it, built from plain data; the same data builds the same scene again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from roboyard.errors import ConfigError

if TYPE_CHECKING:
    from roboyard.robots import Robot
    from roboyard.scenes import Scene


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
        setup: "scene" (a name or file for `load_scene`), "robot" (a registered robot's name, or None) and
            "controllers" (group to controller name or keys; the robot's defaults where not given).

    Raises:
        ConfigError: `setup` has other keys, or names an unknown scene, robot or controller.
    """
    from roboyard.scenes import load_scene

    unknown = [name for name in setup if name not in ("scene", "robot", "controllers")]
    if unknown or not isinstance(setup.get("scene"), str):
        raise ConfigError(
            f"a scene setup needs 'scene' and may have 'robot' and 'controllers', got "
            f"{sorted(str(name) for name in setup)}"
        )
    scene = load_scene(setup["scene"])
    robot = None
    if setup.get("robot") is not None:
        from roboyard.robots import add_robot

        robot = add_robot(
            scene.world,
            str(setup["robot"]),
            scene.spawn,
            scene.spawn_orientation,
            controllers=setup.get("controllers") or None,
        )
    return SceneSetup(scene=scene, robot=robot, setup=dict(setup))

"""A scene with a robot in it, from a few words; the same words make the same stage again."""

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
    """What `set_up` made."""

    scene: Scene
    robot: Robot | None
    setup: dict[str, Any]
    """The words."""


def set_up(setup: Mapping[str, Any]) -> SceneSetup:
    """Make a scene and put a robot at its spawn place.

    Args:
        setup: "scene" (a name or file for `load_scene`), "robot" (a registered robot's name, or None) and
            "controllers" (group to controller name or keys; the robot's defaults where not given).

    Raises:
        ConfigError: the words are others, or name nothing that there is.
    """
    from roboyard.scenes import load_scene

    strange = [name for name in setup if name not in ("scene", "robot", "controllers")]
    if strange or not isinstance(setup.get("scene"), str):
        raise ConfigError(
            f"a stage is set up from scene, robot and controllers; got {sorted(str(name) for name in setup)}"
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

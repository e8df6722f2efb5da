"""How each of n environments looks: colours of its shapes, its light, and where its cameras are."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from roboyard.envs.batch_physics import BatchPhysics
from roboyard.rendering.light import Light
from roboyard.rendering.renderer import DEFAULT_LIGHT
from roboyard.robots.robot import Robot
from roboyard.sensors import CameraSensor
from roboyard.transforms import Array

VIEW = "view"
"""Name of the task's own camera, with which a robot without cameras observes."""


class Appearance:
    """Looks of n environments; None is the world's own."""

    def __init__(self, physics: BatchPhysics, robot: Robot) -> None:
        """Leave everything as the world has it.

        Args:
            physics: of the environments.
            robot: whose cameras observe.
        """
        self._physics, self._robot = physics, robot
        self.count = physics.count
        """n."""
        self.lights: list[Light] | None = None
        """n lights."""
        self.camera_shifts: dict[str, Array] = {}
        """Camera to the (n, 3) shifts in its own frame (m)."""
        self.camera_turns: dict[str, Array] = {}
        """Camera to the (n, 4) rotations x, y, z, w in its own frame."""
        self._is_colored = False

    @cached_property
    def own_colors(self) -> Array:
        """(shapes, 3) RGB of the shapes in the world's scene, 0 to 1."""
        shapes = self._physics.world.render_scene().shapes
        return np.array([shape.rgba[:3] for shape in shapes], dtype=float).reshape(-1, 3)

    @cached_property
    def owners(self) -> np.ndarray:
        """(shapes, 2) body id and link index of the shapes."""
        shapes = self._physics.world.render_scene().shapes
        return np.array([shape.owner for shape in shapes], dtype=np.intp).reshape(-1, 2)

    @cached_property
    def camera_names(self) -> tuple[str, ...]:
        """Links with a camera; the task's view for a robot without one."""
        sensors = [self._robot.sensors[name] for name in self._robot.sensors.names]
        return tuple(s.link.name for s in sensors if isinstance(s, CameraSensor)) or (VIEW,)

    @cached_property
    def colors(self) -> Array:
        """(n, shapes, 3) RGB of the shapes, to be written."""
        self._is_colored = True
        return np.tile(self.own_colors, (self.count, 1, 1))

    def colors_of(self, row: int) -> Array | None:
        """Return (shapes, 3) RGB of one environment; None where no colour was changed."""
        return self.colors[row] if self._is_colored else None

    def light_of(self, row: int) -> Light:
        """Return the light of one environment."""
        return DEFAULT_LIGHT if self.lights is None else self.lights[row]

    def placed(self, camera: str, row: int, position: Array, rotation: Array) -> tuple[Array, Array]:
        """Return where a camera of one environment is.

        Args:
            camera: its name.
            row: the environment.
            position: (3,) where the robot has it, in the world frame (m).
            rotation: (3, 3) likewise.
        """
        if camera not in self.camera_shifts:
            return position, rotation
        from roboyard.transforms import matrix_from_quaternion

        turn = matrix_from_quaternion(self.camera_turns[camera][row])
        return position + rotation @ self.camera_shifts[camera][row], rotation @ turn

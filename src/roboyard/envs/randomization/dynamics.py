"""Differences of the physics: masses, friction, gains, gravity, delays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.random_rows import RandomRows, Rows
from roboyard.envs.randomization.declared import (
    Draw,
    Randomization,
    Range,
    check_range,
    robot_of,
    rows_of_links,
)
from roboyard.errors import ConfigError


@dataclass(frozen=True)
class Mass(Randomization):
    """Mass and inertia of links, by a common factor."""

    body: str
    factor: Range = (0.8, 1.2)
    links: tuple[str, ...] = ()
    """Links; all of the body by default."""

    def bind(self, env: EnvArrays) -> Draw:
        """Return the function that draws masses."""
        check_range("Mass.factor", self.factor, 1e-6)
        rows_of_body = rows_of_links(env.body(self.body), self.links)
        physics = env.physics
        mass, inertia = physics.model_field("body_mass"), physics.model_field("body_inertia")
        own_mass, own_inertia = mass[0, rows_of_body].copy(), inertia[0, rows_of_body].copy()

        def draw(rows: Rows, random: RandomRows) -> None:
            factor = random.uniform(*self.factor)
            mass[np.ix_(rows, rows_of_body)] = factor[:, None] * own_mass
            inertia[np.ix_(rows, rows_of_body)] = factor[:, None, None] * own_inertia
            physics.update_constants(rows)

        return draw


@dataclass(frozen=True)
class Friction(Randomization):
    """Sliding friction of a body's shapes; between two bodies the larger coefficient acts."""

    body: str
    coefficient: Range = (0.5, 1.2)
    links: tuple[str, ...] = ()
    """Links; all of the body by default."""

    def bind(self, env: EnvArrays) -> Draw:
        """Return the function that draws coefficients."""
        check_range("Friction.coefficient", self.coefficient, 0.0)
        physics = env.physics
        geoms = np.flatnonzero(
            np.isin(physics.world.model.geom_bodyid, rows_of_links(env.body(self.body), self.links))
        )
        friction = physics.model_field("geom_friction")

        def draw(rows: Rows, random: RandomRows) -> None:
            friction[rows[:, None], geoms, 0] = random.uniform(*self.coefficient)[:, None]

        return draw


@dataclass(frozen=True)
class Gains(Randomization):
    """Stiffness and damping of a robot's drives, by factors."""

    robot: str = "robot"
    stiffness: Range = (0.9, 1.1)
    damping: Range = (0.9, 1.1)

    def bind(self, env: EnvArrays) -> Draw:
        """Return the function that draws gains."""
        check_range("Gains.stiffness", self.stiffness, 0.0)
        check_range("Gains.damping", self.damping, 0.0)
        joints = robot_of(env, self.robot).joint_arrays
        rows_of_drives = np.array([joints.joints[i]._built.actuator.id for i in joints.driven], dtype=np.intp)
        bias = env.physics.model_field("actuator_biasprm")
        own = bias[0, rows_of_drives].copy()

        def draw(rows: Rows, random: RandomRows) -> None:
            for column, bounds in ((1, self.stiffness), (2, self.damping)):
                bias[rows[:, None], rows_of_drives, column] = (
                    random.uniform(*bounds)[:, None] * own[:, column]
                )

        return draw


@dataclass(frozen=True)
class Gravity(Randomization):
    """Direction and size of gravity: changes along each axis (m/s²)."""

    change: Range = (-0.1, 0.1)

    def bind(self, env: EnvArrays) -> Draw:
        """Return the function that draws gravity."""
        check_range("Gravity.change", self.change)
        gravity = env.physics.model_field("opt.gravity")
        own = gravity[0].copy()

        def draw(rows: Rows, random: RandomRows) -> None:
            gravity[rows] = own + random.uniform(*self.change, size=3)

        return draw


@dataclass(frozen=True)
class Delay(Randomization):
    """Actions act so many control steps late."""

    steps: tuple[int, int] = (0, 1)

    def bind(self, env: EnvArrays) -> None:
        """Check the range; `Randomizer` draws delays and keeps past actions."""
        if not 0 <= self.steps[0] <= self.steps[1] <= 100:
            raise ConfigError(f"Delay.steps: a range must be (low, high) from 0 to 100, got {self.steps}")

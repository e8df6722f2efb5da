"""Input and result of a check."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from roboyard.transforms import Array
from roboyard.viewer.inspector.edits.edit_state import EditState

if TYPE_CHECKING:
    from roboyard.audit import Audit
    from roboyard.description.model import RobotDescription
    from roboyard.robots.definition.schema import RobotDefinition
    from roboyard.sim.body import Body


@dataclass(frozen=True, kw_only=True, slots=True)
class CheckContext:
    """The robot on the page in its current state."""

    body: Body
    """The robot; checks read it and never change it."""
    audit: Audit
    edits: EditState
    definition: RobotDefinition | None = None
    wheels: Sequence[str] = ()
    """Names of wheel links, from the definition."""
    fingers: Sequence[str] = ()
    """Names of finger joints, from the definition."""

    @property
    def description(self) -> RobotDescription:
        """Description that the body was built from."""
        assert self.body.description is not None
        return self.body.description


@dataclass(frozen=True, kw_only=True, slots=True)
class Violation:
    """One violation of a check."""

    text: str
    """Element, value and, where known, the remedy."""
    link: str | None = None
    """Name of the link to show."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CheckResult:
    """The result of one check."""

    text: str
    """The measurement, in a sentence."""
    violations: Sequence[Violation] = field(default=())
    is_open: bool = False
    """Whether there was nothing to check."""

    @property
    def passed(self) -> bool:
        """Whether the check found no violation."""
        return not self.violations and not self.is_open


def points_of(body: Body, name: str, *, collision: bool) -> Array:
    """Return the (n, 3) vertices of a link's shapes in the link frame (m)."""
    from roboyard.sim.appearance.shape_appearance import render_shape

    assert body.description is not None
    link = body.description.link_by_name[name]
    found = [np.zeros((0, 3))]
    for shape in link.collisions if collision else link.visuals:
        drawn = render_shape(shape.geometry, shape.origin, None, body.scale, (0, 0))
        if drawn is not None and not drawn.infinite:
            local = np.asarray(drawn.mesh.vertices, dtype=float) * drawn.scale
            found.append(local @ np.asarray(drawn.rotation).T + drawn.position)
    return np.concatenate(found)


def world_points(body: Body, name: str, *, collision: bool) -> Array:
    """Return the (n, 3) vertices of a link's shapes in the world frame (m)."""
    from roboyard.transforms import matrix_from_quaternion

    position, quaternion = body.link(name).pose
    return points_of(body, name, collision=collision) @ matrix_from_quaternion(quaternion).T + position

"""What a check is given, and what it answers."""

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
    """The robot on the page, standing as it stands now."""

    body: Body
    audit: Audit
    notes: EditState
    definition: RobotDefinition | None = None
    wheels: Sequence[str] = ()
    """Links that somebody says are wheels."""
    fingers: Sequence[str] = ()
    """Joints that somebody says are a gripper's."""

    @property
    def description(self) -> RobotDescription:
        """What the body was made of."""
        assert self.body.description is not None
        return self.body.description


@dataclass(frozen=True, kw_only=True, slots=True)
class Violation:
    """One thing to look at."""

    told: str
    link: str | None = None
    """Where to look."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CheckResult:
    """The answer of one check."""

    told: str
    """What was measured, in a sentence."""
    offences: Sequence[Violation] = field(default=())
    is_open: bool = False
    """There was nothing to judge."""

    @property
    def passed(self) -> bool:
        """Whether nothing was found."""
        return not self.offences and not self.is_open


def points_of(body: Body, name: str, *, collision: bool) -> Array:
    """(n, 3) vertices of a link's shapes in the link's frame; m. Empty where it has none."""
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
    """The same in the world."""
    from roboyard.transforms import matrix_from_quaternion

    position, quaternion = body.link(name).pose
    return points_of(body, name, collision=collision) @ matrix_from_quaternion(quaternion).T + position

"""Whether a change of posture leaves the centre of mass of a robot on legs well inside what it stands on."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from roboyard.description.model import RobotDescription
from roboyard.description.semantic import Leg
from roboyard.morphology.point_model import PointModel
from roboyard.morphology.support_mode import decide

SHARE = 0.6
"""Share of the margin before that has to be left."""

Posture = Mapping[str, float]


def keeps_standing(
    description: RobotDescription, legs: Sequence[Leg], rest: Posture
) -> Callable[[Posture], bool]:
    """Return a test of postures that differ from the rest posture above the legs.

    It passes every posture of a robot without legs, or whose rest posture does not stand.

    Args:
        description: the robot; the root link's z axis is up.
        legs: its legs.
        rest: joint name to position (rad or m).
    """
    if not legs:
        return lambda posture: True
    figure = PointModel(description)
    figure.home |= {name: rest[name] for name in figure.home if name in rest}
    stance = decide(figure)
    if stance.margin <= 0.0:
        return lambda posture: True

    def stands(posture: Posture) -> bool:
        changed = {name: value for name, value in posture.items() if name in figure.home}
        centre = figure.centre_of_mass(figure.poses(changed))
        return bool(stance.margin_at(centre) >= SHARE * stance.margin)

    return stands

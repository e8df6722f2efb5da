"""Joints of UsdPhysics: the motions that each leaves free, its bounds, and what engines add to them.

| USD | here |
| --- | --- |
| PhysicsRevoluteJoint, PrismaticJoint, SphericalJoint, FixedJoint | one motion, or none |
| PhysicsJoint with locked and free axes | the free ones, slides first; three turns without limits: a ball |
| PhysicsDistanceJoint, and one whose axes are all free | no joint |
| `drive:*:physics:maxForce`, MuJoCo's `actuatorfrcrange` | effort limit |
| PhysX's, newton's, MuJoCo's attributes | velocity limit, damping, friction |

Angles are degrees in a stage.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from roboyard.description.model import Limit, Vector3
from roboyard.description.usd.stage import OpenStage

UNBOUNDED = 1e6
"""rad, m, and their like: a limit beyond this is none."""
OPEN_RANGE = 4 * math.pi
"""rad or m: range of a joint that has a limit at one end only, which a description cannot state."""
_TOKENS = ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")
_AXES: dict[str, Vector3] = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}
Kind = Literal["turn", "slide", "ball", "free"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Motion:
    """One motion that a joint leaves free."""

    kind: Kind
    axis: Vector3 = (0.0, 0.0, 1.0)
    """Unit, in the frame of the joint."""
    limit: Limit | None = None
    damping: float = 0.0
    """N m s/rad or N s/m"""
    friction: float = 0.0
    """N m or N"""


def motions_of(prim: Any, opened: OpenStage) -> tuple[Motion, ...]:
    """Return the motions of a joint; none for a fixed one, one that is "free" for a body without joint."""
    kind = str(prim.GetTypeName())
    if kind in ("PhysicsRevoluteJoint", "PhysicsPrismaticJoint"):
        turns = kind == "PhysicsRevoluteJoint"
        token = str(prim.GetAttribute("physics:axis").Get() or "X")
        lower, upper = (_number(prim, f"physics:{name}Limit") for name in ("lower", "upper"))
        return (_motion(prim, opened, token if token in _AXES else "X", lower, upper, turns=turns),)
    if kind == "PhysicsSphericalJoint":
        return (Motion(kind="ball", damping=_damping(prim, opened, ("",), turns=True)),)
    if kind == "PhysicsFixedJoint":
        return ()
    if kind == "PhysicsDistanceJoint":
        return (Motion(kind="free"),)
    return _of_free_axes(prim, opened)


def _of_free_axes(prim: Any, opened: OpenStage) -> tuple[Motion, ...]:
    free = []
    for token in _TOKENS:
        low, high = (_number(prim, f"limit:{token}:physics:{end}") for end in ("low", "high"))
        if low is not None or high is not None:
            low = -math.inf if low is None else low
            high = math.inf if high is None else high
            if low >= high:
                continue
        free.append((token, low, high))
    if len(free) == 6:
        return (Motion(kind="free"),)
    turns = [token for token, _, _ in free if token.startswith("rot")]
    ends = [end for token, low, high in free if token in turns for end in (low, high)]
    is_ball = len(turns) == 3 and not any(end is not None and abs(end) < UNBOUNDED for end in ends)
    motions = []
    for token, low, high in free:
        if token in turns and is_ball:
            continue
        motions.append(_motion(prim, opened, token[-1], low, high, turns=token in turns, instance=token))
    if is_ball:
        motions.append(Motion(kind="ball", damping=_damping(prim, opened, tuple(turns), turns=True)))
    return tuple(motions)


def _motion(
    prim: Any,
    opened: OpenStage,
    letter: str,
    low: float | None,
    high: float | None,
    *,
    turns: bool,
    instance: str = "",
) -> Motion:
    """Return a motion about or along one axis.

    Args:
        prim: the joint.
        opened: its stage.
        letter: of the axis.
        low: lower bound in the stage's unit.
        high: upper bound, likewise.
        turns: whether it is an angle.
        instance: of the axis, where the joint has several.
    """
    unit = math.radians(1.0) if turns else opened.metres
    ends = [
        None if value is None or abs(value * unit) >= UNBOUNDED else value * unit for value in (low, high)
    ]
    if ends[0] is not None and ends[1] is not None and ends[0] > ends[1]:
        ends = [0.0, 0.0]  # locked, as UsdPhysics words it
    names = tuple(dict.fromkeys((instance, "angular" if turns else "linear")))
    force = opened.kilograms * opened.metres ** (2 if turns else 1)
    effort = _first(prim, [f"drive:{name}:physics:maxForce" for name in names if name], force)
    stated = _first(prim, ["mjc:actuatorfrcrange:max"], 1.0) if effort is None else None
    effort = effort if effort is not None else stated if stated else _custom(prim, "urdf_effort")
    velocity = _first(
        prim,
        [
            *(f"physxJointAxis:{name}:maxJointVelocity" for name in names if name),
            "physxJoint:maxJointVelocity",
            "newton:velocityLimit",
        ],
        unit,
    )
    velocity = velocity if velocity is not None else _custom(prim, "urdf_velocity")
    lower, upper = ends
    if lower is None and upper is not None:
        lower = upper - OPEN_RANGE
    if upper is None and lower is not None:
        upper = lower + OPEN_RANGE
    has_limit = any(value is not None for value in (lower, upper, effort, velocity))
    return Motion(
        kind="turn" if turns else "slide",
        axis=_AXES[letter],
        limit=Limit(lower=lower, upper=upper, effort=effort, velocity=velocity) if has_limit else None,
        damping=_damping(prim, opened, names, turns=turns),
        friction=_friction(prim, opened, names, turns=turns),
    )


def _damping(prim: Any, opened: OpenStage, names: tuple[str, ...], *, turns: bool) -> float:
    """Return passive damping; what a drive does is no property of the robot."""
    kept = _custom(prim, "urdf_damping")
    if kept is not None:
        return kept
    scale = opened.kilograms * (opened.metres**2 if turns else 1.0)
    per_degree = scale * (math.degrees(1.0) if turns else 1.0)
    found = _first(prim, ["newton:damping"], per_degree)
    if found is None:
        found = _first(prim, ["mjc:damping"], scale)
    if found is None:
        axes = [f"physxJointAxis:{name}:viscousFrictionCoefficient" for name in names if name]
        found = _first(prim, axes, per_degree)
    return max(found or 0.0, 0.0)


def _friction(prim: Any, opened: OpenStage, names: tuple[str, ...], *, turns: bool) -> float:
    effort = opened.kilograms * opened.metres ** (2 if turns else 1)
    axes = [f"physxJointAxis:{name}:dynamicFrictionEffort" for name in names if name]
    found = _first(prim, ["newton:friction", "mjc:frictionloss", *axes, "physxJoint:jointFriction"], effort)
    return max(found or 0.0, 0.0)


def _first(prim: Any, names: list[str], unit: float) -> float | None:
    """Return the first of these attributes that is authored and bounded, in `unit`."""
    for name in names:
        value = _number(prim, name)
        if value is not None and abs(value * unit) < 1e10:
            return value * unit
    return None


def _number(prim: Any, name: str) -> float | None:
    """Return an authored, finite number."""
    attribute = prim.GetAttribute(name)
    value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None


def _custom(prim: Any, name: str) -> float | None:
    """Return a number that our own writer kept beside a joint."""
    value = prim.GetCustomDataByKey(name)
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None

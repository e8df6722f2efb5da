"""Joints of a stage that follow another one, in the words of newton, MuJoCo and PhysX."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from roboyard.description.model import Mimic
from roboyard.description.usd.stage import OpenStage


def mimic_of(prim: Any, names: Mapping[str, str], opened: OpenStage) -> Mimic | None:
    """Return what a joint follows; None where it moves on its own, or its leader is no joint of the robot.

    Args:
        prim: the joint.
        names: path of each joint to its name.
        opened: the stage.
    """
    unit = _unit(prim, opened)
    for relation, offset, slope in (
        ("newton:mimicJoint", "newton:mimicCoef0", "newton:mimicCoef1"),
        ("mjc:target", "mjc:coef0", "mjc:coef1"),
    ):
        leader = _target(prim, relation, names)
        if leader is not None and (relation != "mjc:target" or "MjcEqualityJointAPI" in _schemas(prim)):
            kept = prim.GetCustomDataByKey("urdf_mimic")
            if isinstance(kept, dict) and {"multiplier", "offset"} <= set(
                kept
            ):  # exact, as our writer keeps it
                multiplier, shift = float(kept["multiplier"]), float(kept["offset"])
                if math.isfinite(multiplier) and math.isfinite(shift):
                    return Mimic(joint=names[leader], multiplier=multiplier, offset=shift)
            scale = unit if relation.startswith("newton") else 1.0
            return Mimic(
                joint=names[leader],
                multiplier=_number(prim, slope, 1.0),
                offset=_number(prim, offset, 0.0) * scale,
            )
    for schema in _schemas(prim):
        kind, _, axis = schema.partition(":")
        if kind != "PhysxMimicJointAPI":
            continue
        name = f"physxMimicJoint:{axis}"
        leader = _target(prim, f"{name}:referenceJoint", names)
        if leader is None:
            continue
        other = _unit(prim.GetStage().GetPrimAtPath(leader), opened)
        gearing, offset = _number(prim, f"{name}:gearing", 1.0), _number(prim, f"{name}:offset", 0.0)
        # PhysX: position + gearing · leader's + offset = 0, in the stage's units
        return Mimic(joint=names[leader], multiplier=-gearing * unit / other, offset=-offset * unit)
    return None


def _unit(prim: Any, opened: OpenStage) -> float:
    turns = "Revolute" in str(prim.GetTypeName())
    return math.radians(1.0) if turns else opened.metres


def _schemas(prim: Any) -> list[str]:
    """Return the names of applied schemas, unknown ones too."""
    listed = prim.GetMetadata("apiSchemas")
    return [] if listed is None else [str(name) for name in listed.GetAddedOrExplicitItems()]


def _target(prim: Any, name: str, names: Mapping[str, str]) -> str | None:
    relation = prim.GetRelationship(name)
    targets = relation.GetTargets() if relation else []
    path = str(targets[0]) if targets else ""
    return path if path in names and path != str(prim.GetPath()) else None


def _number(prim: Any, name: str, default: float) -> float:
    attribute = prim.GetAttribute(name)
    value = attribute.Get() if attribute else None
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else default

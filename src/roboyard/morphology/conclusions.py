"""Conclusions about a robot: each with its confidence, its evidence and the setting that changes it."""

from __future__ import annotations

from roboyard.description.semantic import Arm, Conclusion, SemanticDescription
from roboyard.morphology.base.drive import WheeledBase
from roboyard.morphology.kind import Kind
from roboyard.morphology.limbs.roles import Roles


def make_conclusions(
    semantic: SemanticDescription, kind: Kind, base: WheeledBase | None, roles: Roles
) -> tuple[Conclusion, ...]:
    """Return the conclusions about kind, base, wheels and limbs, in this order."""
    found = [
        Conclusion(
            field="kind",
            value=semantic.kind,
            confidence=kind.confidence,
            evidence=kind.evidence,
            setting=f"understanding: {{kind: {semantic.kind}}}",
        ),
        Conclusion(
            field="base",
            value=semantic.base,
            confidence=kind.base_confidence,
            evidence=kind.base_evidence,
            setting=f"understanding: {{base: {semantic.base}}}",
        ),
    ]
    if base is not None:
        found += _wheels(semantic, base)
    if roles.trunk:
        found.append(
            Conclusion(
                field="trunk_joints",
                value=list(roles.trunk),
                confidence=0.85,
                evidence=roles.trunk_evidence,
                setting=_names("curobo: {torso_joints", roles.trunk, "}"),
            )
        )
    for part in roles.heads[:1]:
        found.append(
            Conclusion(
                field="head_joints",
                value=list(part.joints),
                confidence=part.confidence,
                evidence=part.evidence,
                setting=_names("understanding: {head_joints", part.joints, "}"),
            )
        )
    for field, parts in (("legs", roles.legs), ("arms", roles.arms)):
        for part in parts:
            found.append(
                Conclusion(
                    field=f"{field}.{part.name}",
                    value=list(part.joints),
                    confidence=part.confidence,
                    evidence=part.evidence,
                    setting=_names(f"understanding: {{{field}: {{{part.name}", part.joints, "}}"),
                )
            )
    return tuple(found)


def with_stated(
    found: tuple[Conclusion, ...],
    stated: SemanticDescription,
    arms: tuple[Arm, ...],
    trunk: tuple[str, ...],
) -> tuple[Conclusion, ...]:
    """Return conclusions in which stated arms and trunk replace the inferred ones, with full confidence."""
    given: list[Conclusion] = []
    if stated.end_effectors or stated.arms:
        found = tuple(one for one in found if not one.field.startswith("arms."))
        given += [_stated(f"arms.{arm.name}", arm.joints) for arm in arms]
    if stated.end_effectors or stated.trunk_joints:
        found = tuple(one for one in found if one.field != "trunk_joints")
        given += [_stated("trunk_joints", trunk)] if trunk else []
    return (*found, *given)


def _stated(field: str, joints: tuple[str, ...]) -> Conclusion:
    return Conclusion(field=field, value=list(joints), confidence=1.0, evidence=("as configured",))


def _wheels(semantic: SemanticDescription, base: WheeledBase) -> list[Conclusion]:
    driven = [wheel.joint for wheel in base.wheels if wheel.is_driven]
    evidence = [
        f'"{wheel.joint}": radius {wheel.radius:.3g} m, '
        + ("rolls forwards" if wheel.forward_sign > 0 else "rolls backwards" if wheel.forward_sign else
           "rolls sideways") + " where its joint turns forwards"
        for wheel in base.wheels if wheel.is_driven
    ]  # fmt: skip
    found = [
        Conclusion(
            field="drive_wheels",
            value=driven,
            confidence=base.confidence,
            evidence=tuple(evidence),
            setting=_names("base_motion: {wheel_links", semantic.wheel_links, "}"),
        )
    ]
    for field, joints, text in (
        (
            "steer_joints",
            semantic.steer_joints,
            "turns a wheel about an upright axis, with limits or no trail",
        ),
        (
            "caster_joints",
            semantic.caster_joints,
            "a wheel trails behind an upright axis without limits",
        ),
    ):
        if joints:
            found.append(
                Conclusion(
                    field=field,
                    value=list(joints),
                    confidence=0.85,
                    evidence=(text,),
                    setting=_names(f"understanding: {{{field}", joints, "}"),
                )
            )
    return found


def _names(key: str, names: tuple[str, ...] | list[str], end: str) -> str:
    return f"{key}: [{', '.join(names)}]{end}"

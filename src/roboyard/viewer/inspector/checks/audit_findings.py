"""Checks of masses, joints and limits from the audit of the file, and of self-collision."""

from __future__ import annotations

from roboyard.audit.findings import INFO
from roboyard.audit.registry import CHECKS as KINDS
from roboyard.viewer.inspector.checks.status import CheckContext, CheckResult, Violation
from roboyard.viewer.inspector.edits.edit_state import pair
from roboyard.viewer.inspector.overlaps import overlaps

DEEP = 1e-3
"""Penetration that counts as an overlap (m)."""


def masses(context: CheckContext) -> CheckResult:
    """Return impossible and implausible masses and inertias."""
    text = f"{context.body.mass:.4g} kg in {sum(k.mass > 0 for k in context.body.links)} links with mass."
    return CheckResult(text=text, violations=_findings(context, ("inertials", "masses")))


def joints(context: CheckContext) -> CheckResult:
    """Return impossible and implausible joint axes, limits and mimic joints."""
    count = sum(joint.is_moving for joint in context.description.joints)
    violations = _findings(context, ("joints", "limits", "mimics"))
    return CheckResult(text=f"{count} moving joints.", violations=violations)


def _findings(context: CheckContext, topics: tuple[str, ...]) -> list[Violation]:
    """Return errors and warnings of the audit, except those about the virtual joints of a holonomic base."""
    from roboyard.robots.definition.schema import VIRTUAL_JOINTS  # loads all of robots/

    names = {link.name for link in context.body.links}
    virtual = [joint for joint in context.description.joints if joint.name in VIRTUAL_JOINTS]
    ours = {f'joint "{joint.name}"' for joint in virtual}
    ours |= {f'link "{joint.child}"' for joint in virtual}
    violations = []
    for finding in context.audit.findings:
        if finding.severity == INFO or finding.element in ours:
            continue
        if finding.code in KINDS and KINDS[finding.code].topic in topics:
            element = f"{finding.element}: " if finding.element else ""
            link = next((name for name in finding.links if name in names), None)
            violations.append(Violation(text=f"{element}{finding.message}", link=link))
    return violations


def self_collision(context: CheckContext) -> CheckResult:
    """Return links that overlap in the current posture and whose collision is not disabled."""
    found = [
        entry for entry in overlaps(context.body, DEEP) if pair(*entry[:2]) not in context.edits.physics_pairs
    ]
    violations = [
        Violation(text=f"{a} and {b} overlap by {depth * 1000:.1f} mm", link=a) for a, b, depth in found
    ]
    return CheckResult(
        text=f"{len(context.edits.physics_pairs)} pairs have collision disabled.", violations=violations
    )

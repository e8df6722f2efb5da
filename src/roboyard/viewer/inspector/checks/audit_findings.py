"""What the audit of the file says about masses, joints and limits; and what overlaps at rest."""

from __future__ import annotations

from roboyard.audit.findings import INFO
from roboyard.audit.registry import CHECKS as KINDS
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.viewer.inspector.checks.status import CheckContext, CheckResult, Violation
from roboyard.viewer.inspector.edits.edit_state import pair
from roboyard.viewer.inspector.overlaps import overlaps

DEEP = 1e-3
"""m: contacts this deep push"""


def masses(subject: CheckContext) -> CheckResult:
    """Masses and inertias that cannot be, or are off the scale."""
    told = f"{subject.body.mass:.4g} kg in {sum(k.mass > 0 for k in subject.body.links)} links with mass."
    return CheckResult(told=told, offences=_findings(subject, ("inertials", "masses")))


def joints(subject: CheckContext) -> CheckResult:
    """Axes, limits and followers that cannot be, or are off the scale."""
    count = sum(joint.is_moving for joint in subject.description.joints)
    offences = _findings(subject, ("joints", "limits", "mimics"))
    return CheckResult(told=f"{count} joints that move.", offences=offences)


def _findings(subject: CheckContext, topics: tuple[str, ...]) -> list[Violation]:
    """Findings that make trouble, without those about the virtual joints of a holonomic base."""
    names = {link.name for link in subject.body.links}
    made = [joint for joint in subject.description.joints if joint.name in VIRTUAL_JOINTS]
    ours = {f'joint "{joint.name}"' for joint in made} | {f'link "{joint.child}"' for joint in made}
    offences = []
    for finding in subject.audit.findings:
        if finding.severity == INFO or finding.element in ours:
            continue
        if finding.code in KINDS and KINDS[finding.code].topic in topics:
            who = f"{finding.element}: " if finding.element else ""
            link = next((name for name in finding.links if name in names), None)
            offences.append(Violation(told=f"{who}{finding.message}", link=link))
    return offences


def self_collision(subject: CheckContext) -> CheckResult:
    """Links that overlap in the posture of the page and are not said to be allowed to."""
    found = [
        entry for entry in overlaps(subject.body, DEEP) if pair(*entry[:2]) not in subject.notes.physics_pairs
    ]
    offences = [
        Violation(told=f"{a} and {b} overlap by {depth * 1000:.1f} mm", link=a) for a, b, depth in found
    ]
    return CheckResult(told=f"{len(subject.notes.physics_pairs)} pairs may touch.", offences=offences)

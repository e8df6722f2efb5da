"""Audit findings that remain at the end of an import; later steps resolve many of them."""

from __future__ import annotations

from roboyard.audit import audit_urdf
from roboyard.description.robot_model import RobotModel
from roboyard.description.urdf.parse import UrdfElements
from roboyard.importer.context import ImportContext
from roboyard.importer.steps.repair_and_copy import KEPT

RESOLVED = ("collision-overlap", *KEPT)
"""Codes found again in the written URDF although they are resolved: the collision of links that overlap at
rest is disabled, and each writer makes names that its format accepts.
"""


def mark_resolved(robot: RobotModel, context: ImportContext, written: UrdfElements) -> None:
    """Audit the written URDF; warnings about the vendor's file that no longer apply become notes."""
    log = context.log
    codes = {decision.code for decision in log.warnings if decision.code}.difference(RESOLVED)
    log.facts["unresolved"] = []
    if not codes:
        log.downgrade_findings()
        return
    ours = {f'link "{name}"' for name in robot.description.link_by_name if _is_virtual(name)}
    ours |= {f'joint "{name}"' for name in robot.description.joint_by_name if _is_virtual(name)}
    found = audit_urdf(written).findings
    unresolved = [finding for finding in found if finding.code in codes and finding.element not in ours]
    log.facts["unresolved"] = [finding.to_json() for finding in unresolved]
    log.downgrade_findings()
    for finding in unresolved:
        log.warn(f"{finding.message}; {finding.remedy} [{finding.code}]", finding.element, code=finding.code)


def _is_virtual(name: str) -> bool:
    """Return whether a link or joint is one of a holonomic base's virtual ones."""
    return name.startswith("base_footprint_")

"""Which of the audit's findings are still there at the end: later steps settle many of them."""

from __future__ import annotations

from roboyard.audit import audit_urdf
from roboyard.description.robot_model import RobotModel
from roboyard.description.urdf.parse import UrdfElements
from roboyard.importer.context import ImportContext
from roboyard.importer.steps.repair_and_copy import KEPT

SETTLED = ("collision-overlap", *KEPT)
"""Found again in the written URDF, and settled all the same: the planning step keeps links that overlap from
pushing, and each writer finds names that its format takes.
"""


def mark_resolved(robot: RobotModel, context: ImportContext, written: UrdfElements) -> None:
    """Audit the written URDF; warnings about the vendor's file that no longer hold become notes."""
    log = context.log
    codes = {decision.code for decision in log.warnings if decision.code}.difference(SETTLED)
    log.facts["unresolved"] = []
    if not codes:
        log.settle()
        return
    ours = {f'link "{name}"' for name in robot.description.link_by_name if _is_virtual(name)}
    ours |= {f'joint "{name}"' for name in robot.description.joint_by_name if _is_virtual(name)}
    found = audit_urdf(written).findings
    still = [finding for finding in found if finding.code in codes and finding.element not in ours]
    log.facts["unresolved"] = [finding.to_json() for finding in still]
    log.settle()
    for finding in still:
        log.warn(f"{finding.message}; {finding.remedy} [{finding.code}]", finding.element, code=finding.code)


def _is_virtual(name: str) -> bool:
    """Whether a link or joint is one of those that carry a holonomic base."""
    return name.startswith("base_footprint_")

"""Findings of the audit as text, all or those of one link."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard.viewer.page.markdown import plain

if TYPE_CHECKING:
    from roboyard.audit import Audit, Finding
    from roboyard.sim.body import Body
    from roboyard.sim.link import Link

MAX_SHOWN = 40
"""Findings listed on the page; further ones are counted."""


def findings_of(body: Body, link: Link, audit: Audit | None) -> list[Finding]:
    """Return the findings about a link or the joint that holds it."""
    joint = body.joint_of(link)
    names = {f'link "{link.name}"'} | ({f'joint "{joint.name}"'} if joint is not None else set())
    return [finding for finding in (() if audit is None else audit.findings) if about(finding, names)]


def findings_text(audit: Audit | None) -> str:
    """Format an audit as Markdown, errors first."""
    if audit is None:
        return "No file to audit."
    if not audit.findings:
        return "**OK.** The audit found nothing."
    lines = [f"**{audit.status.capitalize()}**: {len(audit.findings)} findings."]
    severity = None
    for finding in audit.findings[:MAX_SHOWN]:
        if finding.severity != severity:
            severity = finding.severity
            lines += ["", f"**{severity.label.capitalize()}**", ""]
        lines.append(finding_line(finding))
    if len(audit.findings) > MAX_SHOWN:
        lines += ["", f"... and {len(audit.findings) - MAX_SHOWN} more; `roboyard audit` lists them."]
    return "\n".join(lines)


def finding_line(finding: Finding) -> str:
    """Format a finding as an item of a Markdown list."""
    who = f"{plain(finding.element)}: " if finding.element else ""
    where = f" (line {finding.line})" if finding.line is not None else ""
    return f"- {who}{plain(finding.message)}{where}; *{plain(finding.remedy)}*"


def about(finding: Finding, names: set[str]) -> bool:
    """Return whether a finding is about one of the elements, as in `link "elbow"`."""
    return any(finding.element == name or finding.element.startswith(name) for name in names)

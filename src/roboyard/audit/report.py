"""An audit as text."""

from __future__ import annotations

from collections.abc import Iterator

from roboyard.audit.findings import Audit, Finding

MAX_ALIKE = 12
"""Findings of one code shown in full; the others are counted."""
SHOWN_ONCE = ("link-name-odd", "joint-name-odd")
"""Codes of which one finding is shown: a file that has one name of a kind often has a hundred."""


def shown_findings(audit: Audit, *, everything: bool = False) -> Iterator[tuple[Finding, int]]:
    """Yield the findings to show, in order, and how many more of the same code follow the last of each."""
    counts: dict[str, int] = {}
    for finding in audit.findings:
        counts[finding.code] = counts.get(finding.code, 0) + 1
    shown: dict[str, int] = {}
    for finding in audit.findings:
        shown[finding.code] = shown.get(finding.code, 0) + 1
        most = 1 if finding.code in SHOWN_ONCE else MAX_ALIKE
        most = counts[finding.code] if everything else most
        if shown[finding.code] <= most:
            is_last = shown[finding.code] == most
            yield finding, (counts[finding.code] - most if is_last else 0)


def summary(audit: Audit) -> str:
    """Return one line: the status and how many findings of each severity."""
    counts = ", ".join(f"{count} {severity.label}" for severity, count in audit.counts().items() if count)
    return f"{audit.file.name}: {audit.status}" + (f" ({counts})" if counts else "")


def facts_line(audit: Audit) -> str:
    """Return one line: the size of the robot."""
    facts = audit.facts
    mass = "" if facts.mass is None else f", {facts.mass:.4g} kg"
    return (
        f"{facts.links} links, {facts.joints} joints "
        f"({facts.moving_joints} moving, {facts.mimic_joints} mimic), "
        f"{facts.mesh_files} mesh files of {facts.triangles} triangles{mass}"
    )


def report_lines(audit: Audit, *, everything: bool = False) -> list[str]:
    """Return the audit, one line for each finding: `file:line: severity: element: message; remedy [code]`."""
    lines = [summary(audit)]
    if audit.facts.links:
        lines.append(facts_line(audit))
    for finding, more in shown_findings(audit, everything=everything):
        where = f"{audit.file.name}:{finding.line}" if finding.line else audit.file.name
        element = f"{finding.element}: " if finding.element else ""
        fixable = ", repair fixes it" if finding.fixable else ""
        lines.append(
            f"{where}: {finding.severity.label}: {element}{finding.message}; {finding.remedy} "
            f"[{finding.code}{fixable}]"
        )
        if more > 0:
            lines.append(f"{audit.file.name}: and {more} more of [{finding.code}]")
    return lines

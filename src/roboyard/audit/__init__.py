"""Audit a robot description: find its faults.

`audit_urdf(path)` returns an `Audit`: findings with a code, a severity, the element and its line, the fault
and the remedy. docs/findings.md lists every code. A new check is one small function in `checks/`; see
`registry`.
"""

from roboyard.audit.findings import ERROR, INFO, WARNING, Audit, Facts, Finding, Severity
from roboyard.audit.registry import CHECKS, Check
from roboyard.audit.run import audit_urdf

__all__ = [
    "CHECKS",
    "ERROR",
    "INFO",
    "WARNING",
    "Audit",
    "Check",
    "Facts",
    "Finding",
    "Severity",
    "audit_urdf",
]

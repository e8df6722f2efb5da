"""Know what is wrong with a robot description.

`audit(path)` gives an `Audit`: findings with a code, a severity, the element and its line, what is wrong and
the remedy. docs/findings.md lists every code. A new check is one small function in `checks/`; see `registry`.
"""

from roboyard.audit.findings import BLOCKS, MISBEHAVES, UNTIDY, Audit, Facts, Finding, Severity
from roboyard.audit.registry import CHECKS, Check
from roboyard.audit.run import audit

__all__ = [
    "BLOCKS",
    "CHECKS",
    "MISBEHAVES",
    "UNTIDY",
    "Audit",
    "Check",
    "Facts",
    "Finding",
    "Severity",
    "audit",
]

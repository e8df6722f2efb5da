"""Does a robot work? Gates with figures: it settles, stays, obeys each controller, reaches, sees.

report = validate("r1")
print(report.passed, [gate.name for gate in report.failed])
"""

from roboyard.validation.report import Gate, ValidationReport
from roboyard.validation.run import validate

__all__ = ["Gate", "ValidationReport", "validate"]

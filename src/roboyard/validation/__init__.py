"""Pass/fail tests of a robot: resting stability, controllers, IK reach and cameras, each with its figures.

report = validate("r1")
print(report.passed, [gate.name for gate in report.failed])
"""

from roboyard.validation.report import Gate, ValidationReport
from roboyard.validation.run import validate

__all__ = ["Gate", "ValidationReport", "validate"]

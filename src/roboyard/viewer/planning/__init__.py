"""Plan in the browser: drag a goal; the way there is shown as a swept ghost, with spheres and distances."""

from __future__ import annotations

from roboyard.viewer.planning.page import PlanningPage

__all__ = ["PlanningPage"]

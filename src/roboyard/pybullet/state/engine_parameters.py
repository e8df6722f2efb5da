"""Settings of the physics engine: gravity, time step, iterations and the rest, as the script set them."""

from __future__ import annotations

from dataclasses import field

from roboyard._records import dataclass

TIME_STEP = 1.0 / 240.0
"""Time that one stepSimulation advances at first (s)."""
DEFAULT_ITERATIONS = 50
RESIDUAL = "solverResidualThreshold"
"""Name of the setting below which iterations end."""
ERP, CONTACT_ERP = "erp", "contactERP"
"""Names of the shares of errors that are corrected in a step: of limits and constraints, of contacts."""
PAIRS_BY_ENTRY = "deterministicOverlappingPairs"
"""Name of the setting with which pairs are sorted by the order in which their links were made."""
SOLVER = "constraintSolverType"
"""Name of the setting of the solver."""
DANTZIG = 3
"""Value of it that solves all rows together instead of in rounds."""
MAX_SUB_STEPS = 10_000
"""Largest number of substeps, which one call of stepSimulation executes."""
ATTRIBUTES = {
    "fixedTimeStep": "time_step",
    "numSolverIterations": "iterations",
    "numSubSteps": "sub_steps",
    "contactBreakingThreshold": "contact_breaking_threshold",
    "enableFileCaching": "file_caching",
    "restitutionVelocityThreshold": "restitution_velocity_threshold",
    "enableConeFriction": "cone_friction",
    "jointFeedbackMode": "feedback_mode",
    "reportSolverAnalytics": "report_analytics",
    "numNonContactInnerIterations": "inner_iterations",
}
"""Arguments of setPhysicsEngineParameter that are attributes of the settings; the others are entries."""


@dataclass(kw_only=True, slots=True)
class EngineParameters:
    """Settings of setGravity, setTimeStep and setPhysicsEngineParameter."""

    time_step: float = TIME_STEP
    """Time that one stepSimulation advances (s)."""
    sub_steps: int = 0
    """Number of substeps of a step; 0 and 1 mean one undivided step."""
    iterations: int = DEFAULT_ITERATIONS
    """Rounds in which motors, limits and contacts are solved."""
    inner_iterations: int = 1
    """Inner solver iterations; read back, without effect on this engine."""
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Gravity in the world frame (m/s²)."""
    real_time: int = 0
    """Argument of setRealTimeSimulation; without a window time advances only with stepSimulation."""
    contact_breaking_threshold: float = 0.02
    """Distance beyond which Bullet removes contact points (m); read back only."""
    restitution_velocity_threshold: float = 0.2
    """Impacts slower than this do not bounce (m/s)."""
    cone_friction: int = 1
    """1 for a friction cone, 0 for a pyramid, in which nothing resists contacts' spinning."""
    file_caching: int = 1
    """1 keeps parsed robot files for the next load."""
    feedback_mode: int = 0
    """Bits of JOINT_FEEDBACK_IN_WORLD_SPACE and JOINT_FEEDBACK_IN_JOINT_FRAME."""
    report_analytics: int = 0
    """1 asks for solver statistics; read back only."""
    others: dict[str, float] = field(default_factory=dict)
    """Settings of Bullet's own solver, stored; only those named above have an effect on this engine."""
    revision: int = 0
    """Number of changes so far; the scene applies the settings when it differs."""

    def reset(self) -> None:
        """Restore what resetSimulation resets: gravity, iterations, friction, and the shares of errors."""
        for name in (RESIDUAL, ERP, CONTACT_ERP, SOLVER, PAIRS_BY_ENTRY):
            self.others.pop(name, None)
        self.gravity = (0.0, 0.0, 0.0)
        self.iterations = DEFAULT_ITERATIONS
        self.inner_iterations = self.cone_friction = 1
        self.revision += 1

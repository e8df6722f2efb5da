"""Engine settings: setGravity, setTimeStep, setPhysicsEngineParameter and others."""

from __future__ import annotations

from functools import partial
from math import isfinite
from typing import TYPE_CHECKING

from roboyard.pybullet.face.arguments import number, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.fast_commands import replace_settings
from roboyard.pybullet.state.engine_parameters import ATTRIBUTES, CONTACT_ERP, MAX_SUB_STEPS

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.engine_parameters import EngineParameters

_PLAIN = (int, float)


@command()
def setGravity(client: Client, gravX: float, gravY: float, gravZ: float) -> None:
    """Set gravity in the world frame (m/s²); it is 0 at the start.

    Raises:
        error: it is not finite.
    """
    if type(gravX) in _PLAIN and type(gravY) in _PLAIN and type(gravZ) in _PLAIN:
        gravity = (1.0 * gravX, 1.0 * gravY, 1.0 * gravZ)
    else:
        gravity = (number(gravX), number(gravY), number(gravZ))
    x, y, z = gravity
    total = x + y + z
    if total - total != 0.0 and not all(map(isfinite, gravity)):
        raise failure("setGravity failed.", f"gravity must be finite, got {gravity}")
    parameters = client.parameters
    parameters.gravity = gravity
    parameters.revision += 1


@command()
def setTimeStep(client: Client, timeStep: float) -> None:
    """Set the time that one stepSimulation advances (s).

    Raises:
        error: it is not finite.
    """
    parameters = client.parameters
    if type(timeStep) is float and timeStep - timeStep == 0.0:
        parameters.time_step = timeStep
    else:
        parameters.time_step = _time_step(timeStep, "setTimeStep")
    parameters.revision += 1


@command()
def setRealTimeSimulation(client: Client, enableRealTimeSimulation: int) -> None:
    """Start (1) or stop (0) stepping in real time, in a client with a window.

    Without a window the setting is stored, and the world advances only with stepSimulation, as in PyBullet's
    DIRECT mode.
    """
    real_time = client.parameters.real_time = whole(enableRealTimeSimulation)
    client.follow_clock(bool(real_time))


@command()
def setDefaultContactERP(client: Client, defaultContactERP: float) -> None:
    """Set the share of a penetration that is corrected in a step; 0.08 by default."""
    parameters = client.parameters
    parameters.others[CONTACT_ERP] = (
        defaultContactERP if type(defaultContactERP) is float else number(defaultContactERP)
    )
    parameters.revision += 1


@command()
def setInternalSimFlags(client: Client, flags: int) -> None:
    """Store Bullet's internal flags; no effect here."""
    client.parameters.others["internalSimFlags"] = whole(flags)


@command()
def setPhysicsEngineParameter(
    client: Client,
    fixedTimeStep: float = -1.0,
    numSolverIterations: int = -1,
    useSplitImpulse: int = -1,
    splitImpulsePenetrationThreshold: float = -1.0,
    numSubSteps: int = -1,
    collisionFilterMode: int = -1,
    contactBreakingThreshold: float = -1.0,
    maxNumCmdPer1ms: int = -2,
    enableFileCaching: int = -1,
    restitutionVelocityThreshold: float = -1.0,
    erp: float = -1.0,
    contactERP: float = -1.0,
    frictionERP: float = -1.0,
    enableConeFriction: int = -1,
    deterministicOverlappingPairs: int = -1,
    allowedCcdPenetration: float = -1.0,
    jointFeedbackMode: int = -1,
    solverResidualThreshold: float = -1.0,
    contactSlop: float = -1.0,
    enableSAT: int = -1,
    constraintSolverType: int = -1,
    globalCFM: float = -1.0,
    minimumSolverIslandSize: int = -1,
    reportSolverAnalytics: int = -1,
    warmStartingFactor: float = -1.0,
    sparseSdfVoxelSize: float = -1.0,
    numNonContactInnerIterations: int = -1,
) -> None:
    """Change the given engine settings.

    Time step, substeps, iterations and their residual, friction cone, restitution threshold, error reduction
    (`erp`, `contactERP`), joint feedback and file caching have an effect, and the type of the solver: with
    `CONSTRAINT_SOLVER_LCP_DANTZIG` all rows are solved together, otherwise in rounds. Other settings of
    Bullet's own solver (warm starting, islands, ...) are stored only.

    Raises:
        error: there are more than MAX_SUB_STEPS substeps, or the time step is not finite.
    """
    given = (
        fixedTimeStep, numSolverIterations, useSplitImpulse, splitImpulsePenetrationThreshold, numSubSteps,
        collisionFilterMode, contactBreakingThreshold, maxNumCmdPer1ms, enableFileCaching,
        restitutionVelocityThreshold, erp, contactERP, frictionERP, enableConeFriction,
        deterministicOverlappingPairs, allowedCcdPenetration, jointFeedbackMode, solverResidualThreshold,
        contactSlop, enableSAT, constraintSolverType, globalCFM, minimumSolverIslandSize,
        reportSolverAnalytics, warmStartingFactor, sparseSdfVoxelSize, numNonContactInnerIterations,
    )  # fmt: skip
    parameters: EngineParameters = client.parameters
    try:
        places = [place for place, value in enumerate(given) if not value < 0]
    except TypeError:
        places = range(len(given))
    names = setPhysicsEngineParameter.__code__.co_varnames
    for place in places:
        name, value = names[place + 1], given[place]
        if (value if type(value) in _PLAIN else number(value)) < 0:
            continue
        attribute = ATTRIBUTES.get(name)
        if name == "numSubSteps" and value > MAX_SUB_STEPS:
            raise failure(
                "setPhysicsEngineParameter failed.",
                f"numSubSteps is at most {MAX_SUB_STEPS}, got {value}; reduce it",
            )
        if name == "fixedTimeStep":
            value = _time_step(value, "setPhysicsEngineParameter")
        if attribute is None:
            parameters.others[name] = value
        elif isinstance(getattr(parameters, attribute), int):
            setattr(parameters, attribute, whole(value))
        else:
            setattr(parameters, attribute, number(value))
    parameters.revision += 1


def _time_step(value: float, command_name: str) -> float:
    """Return a time step that is finite; with one that is not positive, steps do nothing, as in PyBullet."""
    seconds = number(value)
    if not isfinite(seconds):
        raise failure(f"{command_name} failed.", f"the time step must be finite, got {seconds}")
    return seconds


@command()
def getPhysicsEngineParameters(client: Client) -> dict[str, float]:
    """Return time step (s), substeps, iterations, the real-time setting and gravity (m/s²)."""
    p = client.parameters
    return {
        "fixedTimeStep": p.time_step,
        "numSubSteps": p.sub_steps,
        "numSolverIterations": p.iterations,
        "useRealTimeSimulation": p.real_time,
        "gravityAccelerationX": p.gravity[0],
        "gravityAccelerationY": p.gravity[1],
        "gravityAccelerationZ": p.gravity[2],
        "numNonContactInnerIterations": p.inner_iterations,
    }


@command()
def setTimeOut(client: Client, timeOutInSeconds: float) -> None:
    """Set how long a remote client waits for an answer (s); a client in this process does not wait."""
    if type(timeOutInSeconds) not in _PLAIN:
        number(timeOutInSeconds)


for _name in (
    *("setGravity", "setTimeStep", "setRealTimeSimulation", "setDefaultContactERP", "setTimeOut"),
    "setPhysicsEngineParameter",
):
    START.later(partial(replace_settings, _name), _name)

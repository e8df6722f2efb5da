"""Commands that store settings, by name, as tables for their machine code; see `settings_entries`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from roboyard.pybullet.face import constants as c
from roboyard.pybullet.fast.settings_entries import (
    CHECKED,
    COLOR,
    ENTRY,
    IGNORED,
    INTEGER,
    LARGEST,
    NUMBER,
    PLACE,
    REFUSED,
    SHORT,
    SWITCH,
    TRIPLE,
    WHOLE,
    Step,
)
from roboyard.pybullet.state.engine_parameters import (
    ATTRIBUTES,
    CONTACT_ERP,
    MAX_SUB_STEPS,
    EngineParameters,
)

Owner = tuple[str | None, str | None, str | None]
"""Attribute of the client that has the settings, its dictionary, and its count of changes.

None for what the command does not use: each costs machine code a look-up.
"""
_ENGINE = "parameters", None, "revision"
_ENTRIES = "parameters", "others", "revision"
_STORED = "parameters", None, None
_CHECKED = None, None, None
_VIEW = "visualizer", "switches", None
_CAMERA = "visualizer", None, None
_TABLES: Mapping[str, tuple[Owner, tuple[Step, ...]]] = {
    "setGravity": (_ENGINE, (Step(TRIPLE, "gravity"), Step(CHECKED), Step(CHECKED))),
    "setTimeStep": (_ENGINE, (Step(NUMBER, "time_step"),)),
    "setDefaultContactERP": (_ENTRIES, (Step(ENTRY, CONTACT_ERP),)),
    "setRealTimeSimulation": (_STORED, (Step(WHOLE, "real_time"),)),
    "setTimeOut": (_CHECKED, (Step(CHECKED),)),
    "setDebugObjectColor": (_CHECKED, (Step(IGNORED), Step(IGNORED), Step(COLOR))),
    "configureDebugVisualizer": (
        _VIEW,
        (
            Step(SWITCH, least=0.0, most=float(c.COV_ENABLE_Y_AXIS_UP)),
            Step(INTEGER),
            *(Step(REFUSED) for _ in range(6)),
        ),
    ),
    "resetDebugVisualizerCamera": (
        _CAMERA,
        (Step(SHORT, "distance"), Step(SHORT, "yaw"), Step(SHORT, "pitch"), Step(PLACE, "target")),
    ),
}


def table_of(command: str, parameters: Sequence[str]) -> tuple[Owner, tuple[Step, ...]]:
    """Return where a command stores settings, and the use of its arguments, whose defaults are missing.

    Args:
        command: its name.
        parameters: names of its parameters after the client.
    """
    if command != "setPhysicsEngineParameter":
        return _TABLES[command]
    settings, steps = EngineParameters(), []
    for name in parameters:  # negative arguments change nothing
        attribute = ATTRIBUTES.get(name)
        kind = ENTRY
        if attribute is not None:
            kind = WHOLE if isinstance(getattr(settings, attribute), int) else NUMBER
        most = float(MAX_SUB_STEPS) if name == "numSubSteps" else LARGEST
        steps.append(Step(kind, attribute or name, least=0.0, most=most))
    return _ENTRIES, tuple(steps)

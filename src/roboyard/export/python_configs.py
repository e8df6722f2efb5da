"""Python files with which Isaac Lab and Newton load a robot.

| file | content |
| --- | --- |
| `isaac_lab/<name>.py` | `<NAME>_CFG`, an `ArticulationCfg` of the USD stage: posture, actuators by group |
| `newton/<name>.py` | `add_<name>(builder)`, which adds the USD stage and sets rest posture and gains |

Joints have their names in USD. Gains are those of the MJCF actuators: critically damped at the inertia that
a joint moves at zero.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboyard.export.export_result import ExportResult
from roboyard.export.mjcf.joints import BANDWIDTH, INFINITE, moved_inertia
from roboyard.export.names import identifier
from roboyard.export.start import height_above_floor, joint_positions, rest_posture, standing
from roboyard.export.usd.naming import paths_of

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel

ISAAC_LAB = '''"""{name} for Isaac Lab: `{constant}`, an articulation of `{usd}`.

Written by Roboyard. Copy the package's folder as a whole, or change USD below.
"""

from pathlib import Path

import isaaclab.sim as sim_utils
from isaaclab.actuators import ImplicitActuatorCfg
from isaaclab.assets import ArticulationCfg

USD = str(Path(__file__).resolve().parent.parent / "usd" / {usd!r})

{constant} = ArticulationCfg(
    spawn=sim_utils.UsdFileCfg(
        usd_path=USD,
        activate_contact_sensors=True,
        rigid_props=sim_utils.RigidBodyPropertiesCfg(disable_gravity=False, max_depenetration_velocity=1.0),
        articulation_props=sim_utils.ArticulationRootPropertiesCfg(
            enabled_self_collisions=True,
            fix_root_link={fixed},
            solver_position_iteration_count=8,
            solver_velocity_iteration_count=1,
        ),
    ),
    init_state=ArticulationCfg.InitialStateCfg(
        pos={position},  # m
        rot={rotation},  # w, x, y, z
        joint_pos={rest},  # rad or m
    ),
    actuators={{
{actuators}
    }},
    soft_joint_pos_limit_factor=0.95,
)
'''
ACTUATOR = """        {group!r}: ImplicitActuatorCfg(
            joint_names_expr={names},
            effort_limit_sim={effort},  # N m or N
            velocity_limit_sim={velocity},  # rad/s or m/s
            stiffness={stiffness},  # N m/rad or N/m
            damping={damping},  # N m s/rad or N s/m
        ),"""
NEWTON = '''"""{name} for Newton: `add_{function}(builder)` adds the robot at rest, with gains of its drives.

Written by Roboyard. Copy the package's folder as a whole.
"""

from pathlib import Path

import newton
import warp as wp

FOLDER = Path(__file__).resolve().parent.parent
USD = FOLDER / "usd" / {usd!r}
POSITION = {position}  # m
ROTATION = {rotation}  # x, y, z, w
REST = {rest}  # rad or m
STIFFNESS = {stiffness}  # N m/rad or N/m
DAMPING = {damping}  # N m s/rad or N s/m


def add_{function}(builder: newton.ModelBuilder) -> None:
    """Add the robot to a builder."""
    first = builder.joint_count
    pose = wp.transform(wp.vec3(*POSITION), wp.quat(*ROTATION))
    builder.add_usd(str(USD), xform=pose, floating={floating}, enable_self_collisions=True)
    for joint in range(first, builder.joint_count):
        name = builder.joint_label[joint].rpartition("/")[2]
        q, qd = builder.joint_q_start[joint], builder.joint_qd_start[joint]
        if name in REST:
            builder.joint_q[q] = REST[name]
            builder.joint_target_q[q] = REST[name]
        if name in STIFFNESS:
            builder.joint_target_ke[qd] = STIFFNESS[name]
            builder.joint_target_kd[qd] = DAMPING[name]
'''


@dataclass(frozen=True, kw_only=True, slots=True)
class _Start:
    """Where a robot starts."""

    position: tuple[float, float, float]
    rotation: tuple[float, float, float, float]
    """x, y, z, w"""
    rest: Mapping[str, float]
    """USD joint name to position (rad or m)."""
    floating: bool


def write(robot: RobotModel, folder: Path | str) -> ExportResult:
    """Write `isaac_lab/<name>.py` and `newton/<name>.py` below a package's folder.

    Raises:
        OSError: a file cannot be written.
    """
    place = Path(folder)
    names, start = paths_of(robot).joints, _start(robot)
    gains = _gains(robot, names)
    function = identifier(robot.name, "robot")
    constant = f"{function.upper()}_CFG"
    x, y, z, w = start.rotation
    common = {"name": robot.name, "usd": f"{robot.name}.usda", "position": start.position}
    rest = _table(start.rest)
    isaac = ISAAC_LAB.format(
        **common,
        constant=constant,
        fixed=not start.floating,
        rotation=(w, x, y, z),
        rest=rest,
        actuators="\n".join(_actuators(robot, names, gains)),
    )
    newton = NEWTON.format(
        **common,
        function=function,
        floating=start.floating,
        rotation=start.rotation,
        rest=rest,
        stiffness=_table({name: kp for name, (kp, _) in gains.items()}),
        damping=_table({name: kd for name, (_, kd) in gains.items()}),
    )
    files = []
    for kind, text in (("isaac_lab", isaac), ("newton", newton)):
        file = place / kind / f"{function}.py"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
        files.append(file)
    return ExportResult(files=tuple(files))


def _start(robot: RobotModel) -> _Start:
    semantic, names = robot.semantic, paths_of(robot).joints
    floating = semantic.base not in ("fixed", "none") and not semantic.virtual_joints
    posture = rest_posture(robot)
    height = height_above_floor(robot, joint_positions(robot, posture)) if floating else 0.0
    rest = {names[name]: float(value) for name, value in posture.items() if name in names}
    return _Start(
        position=(0.0, 0.0, round(height, 4)), rotation=standing(robot), rest=rest, floating=floating
    )


def _gains(robot: RobotModel, names: Mapping[str, str]) -> dict[str, tuple[float, float]]:
    """Return stiffness and damping of each driven joint by its name in USD."""
    inertia = moved_inertia(robot.description)
    found = {}
    for joint in robot.description.depth_first_joints:
        kind = robot.drives.get(joint.name, "none")
        if kind == "none" or joint.mimic is not None or joint.name not in inertia:
            continue
        moved = inertia[joint.name]
        stiffness = moved * BANDWIDTH**2 if kind == "position" else 0.0
        damping = {"position": 2 * moved * BANDWIDTH, "velocity": moved * BANDWIDTH}.get(kind, 0.0)
        found[names[joint.name]] = (float(f"{stiffness:.4g}"), float(f"{damping:.4g}"))
    return found


def _actuators(
    robot: RobotModel, names: Mapping[str, str], gains: Mapping[str, tuple[float, float]]
) -> list[str]:
    """Return one actuator for each group, and one for driven joints of no group."""
    left = dict.fromkeys(gains)
    groups: dict[str, list[str]] = {}
    for group, joints in robot.semantic.groups.items():
        own = [names[name] for name in joints if name in names and names[name] in left]
        for name in own:
            left.pop(name)
        if own:
            groups[group] = own
    if left:
        groups["others"] = list(left)
    limits = {names[joint.name]: joint.limit for joint in robot.description.joints}
    lines = []
    for group, own in groups.items():
        effort = {name: limits[name].effort for name in own if limits[name] is not None}  # type: ignore[union-attr]
        speed = {name: limits[name].velocity for name in own if limits[name] is not None}  # type: ignore[union-attr]
        lines.append(
            ACTUATOR.format(
                group=group,
                names=json.dumps(own),
                effort=_table(_limiting(effort)) if _limiting(effort) else None,
                velocity=_table(_limiting(speed)) if _limiting(speed) else None,
                stiffness=_table({name: gains[name][0] for name in own}),
                damping=_table({name: gains[name][1] for name in own}),
            )
        )
    return lines


def _limiting(values: Mapping[str, float | None]) -> dict[str, float]:
    """Return the limits that limit: zero and enormous ones are none."""
    return {name: v for name, v in values.items() if v is not None and 0 < v < INFINITE and math.isfinite(v)}


def _table(values: Mapping[str, Any]) -> str:
    return json.dumps({name: round(float(value), 6) for name, value in values.items()})

"""Spheres, pairs, limits and locked joints from cuRobo and XRDF files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from roboyard.description.model import RobotDescription
from roboyard.description.robot_model import CollisionSphere
from roboyard.errors import ConfigError, unknown_name
from roboyard.planning.spheres.self_pairs import adjacent_pairs
from roboyard.planning.spheres.sphere_model import SphereModel, sorted_pairs
from roboyard.untrusted.yaml_reading import read_yaml

MAX_BYTES = 64 << 20
"""Largest planner file (bytes)."""


def load_planner_file(path: Path | str, description: RobotDescription) -> SphereModel:
    """Return the robot that a planner file describes.

    Args:
        path: a cuRobo file (flat, nested under `kinematics`, or format 2.0), or an XRDF file.
        description: the robot that it belongs to.

    Raises:
        ConfigError: the file cannot be read, has no spheres, or names links that the robot does not have.
    """
    file = Path(path)
    try:
        data = read_yaml(file, MAX_BYTES)
    except OSError as error:
        raise ConfigError(f"{file}: {error.strerror or error}; check the path") from None
    except ValueError as error:
        raise ConfigError(f"{file.name}: not YAML: {error}; correct the file") from None
    if not isinstance(data, dict):
        raise ConfigError(
            f'{file.name}: has no "robot_cfg" and no "format: xrdf"; give a cuRobo or XRDF file'
        )
    if str(data.get("format", "")).lower() == "xrdf":
        return _xrdf(file, data, description)
    block = data.get("robot_cfg", data)
    return _curobo(file, block.get("kinematics", block), description)


def _spheres_beside(file: Path, name: str) -> Any:
    """Return the spheres in a file that a planner file names, in its folder or one below."""
    other = file.parent / name
    if Path(name).is_absolute() or ".." in Path(name).parts or not other.is_file():
        raise ConfigError(f"{file.name}: collision_spheres: there is no file {name!r} beside it")
    try:
        data = read_yaml(other, MAX_BYTES)
    except (OSError, ValueError) as error:
        raise ConfigError(f"{file.name}: collision_spheres: {name}: {error}; correct the file") from None
    return data.get("collision_spheres") if isinstance(data, dict) else None


def _curobo(file: Path, block: Mapping[str, Any], description: RobotDescription) -> SphereModel:
    spheres = block.get("collision_spheres")
    if isinstance(spheres, str):
        spheres = _spheres_beside(file, spheres)
    space = block.get("cspace") or {}
    nested = isinstance(space, dict)
    names = space.get("joint_names", []) if nested else space
    values = space if nested else block
    rest = values.get("default_joint_position") or values.get("retract_config") or []
    tools = block.get("tool_frames") or [block.get("ee_link"), *(block.get("link_names") or [])]
    buffer = block.get("collision_sphere_buffer") or 0.0
    return _model(
        file,
        description,
        spheres,
        ignore=block.get("self_collision_ignore") or {},
        buffer=float(buffer)
        if not isinstance(buffer, dict)
        else max(map(float, buffer.values()), default=0.0),
        self_buffer=block.get("self_collision_buffer") or {},
        retract=dict(zip(names, rest, strict=False)),
        locked=block.get("lock_joints") or {},
        tools=[tool for tool in tools if tool],
        acceleration=_least(values.get("max_acceleration")),
        jerk=_least(values.get("max_jerk")),
    )


def _xrdf(file: Path, data: Mapping[str, Any], description: RobotDescription) -> SphereModel:
    collision = data.get("collision") or {}
    own = data.get("self_collision") or {}
    geometry = (data.get("geometry") or {}).get(collision.get("geometry")) or {}
    space = data.get("cspace") or {}
    rest = data.get("default_joint_positions") or {}
    active = space.get("joint_names") or []
    buffer = (collision.get("buffer_distance") or {}).values()
    return _model(
        file,
        description,
        geometry.get("spheres"),
        ignore=own.get("ignore") or {},
        buffer=max(map(float, buffer), default=0.0),
        self_buffer=own.get("buffer_distance") or {},
        retract=rest,
        locked={name: value for name, value in rest.items() if name not in active},
        tools=data.get("tool_frames") or [],
        acceleration=_least(space.get("acceleration_limits")),
        jerk=_least(space.get("jerk_limits")),
    )


def _least(values: Any) -> float | None:
    if values is None:
        return None
    return float(min(values)) if isinstance(values, list) else float(values)


def _model(
    file: Path,
    description: RobotDescription,
    spheres: Any,
    *,
    ignore: Mapping[str, Any],
    buffer: float,
    self_buffer: Mapping[str, Any],
    retract: Mapping[str, Any],
    locked: Mapping[str, Any],
    tools: list[str],
    acceleration: float | None,
    jerk: float | None,
) -> SphereModel:
    if not isinstance(spheres, dict) or not spheres:
        raise ConfigError(f"{file.name}: has no collision spheres; import the robot with planner files")
    for name in (*spheres, *tools):
        if name not in description.link_by_name and not str(name).startswith("attached_object"):
            raise ConfigError(f"{file.name}: {unknown_name('link', str(name), description.link_by_name)}")
    found = {
        str(link): tuple(
            CollisionSphere(center=(float(x), float(y), float(z)), radius=float(s["radius"]))
            for s in own
            if float(s["radius"]) > 0
            for x, y, z in [s["center"]]
        )
        for link, own in spheres.items()
        if link in description.link_by_name
    }
    named = [name for name, own in found.items() if own]
    pairs = {pair for pair in sorted_pairs(ignore) if set(pair) <= set(description.link_by_name)}
    pairs |= adjacent_pairs(description, named)
    joints = description.joint_by_name
    return SphereModel(
        description=description,
        spheres=found,
        ignore=frozenset(pairs),
        buffer=buffer,
        self_buffer={str(k): float(v) for k, v in self_buffer.items()},
        retract={str(k): float(v) for k, v in retract.items() if k in joints},
        locked={str(k): float(v) for k, v in locked.items() if k in joints},
        tools=tuple(tool for tool in tools if tool in description.link_by_name),
        acceleration=acceleration,
        jerk=jerk,
    )

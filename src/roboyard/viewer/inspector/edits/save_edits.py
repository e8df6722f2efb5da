"""Save the edits into their files; all other content of these files stays.

| edit | import configuration | package |
| --- | --- | --- |
| sensors, end effectors | `camera_links`, `lidar_links`, `eef_vis_links` | (written by the import) |
| planning spheres | `curobo.collision_spheres` | `collision_spheres` of every planner file |
| pairs of the planner | `curobo.self_collision_ignore` | `self_collision_ignore` of every planner file |
| pairs of the simulation | | `disabled_collision_pairs` of the definition |
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from roboyard.config.yaml_edit import edited_yaml, write_with_backup
from roboyard.config.yaml_lines import read_yaml
from roboyard.errors import ConfigError
from roboyard.untrusted.yaml_reading import parse_yaml
from roboyard.viewer.inspector.edits.edit_state import (
    KINDS,
    EditedSphere,
    EditState,
    Pair,
    SensorPose,
    ignore_tables,
    pair,
    sphere_tables,
)

DIGITS = 6
"""Decimals of lengths in m."""


def write_config(
    target: Path, edits: EditState, before: EditState, *, source: Path | None, urdf: Path, name: str
) -> Path:
    """Update an import configuration, or write a new one; returns its path.

    Args:
        target: the file to write; what was there is kept as `.bak`.
        edits: edits to save.
        before: state of the last save.
        source: the configuration that was read; None: there is none.
        urdf: the vendor's file, for a new configuration.
        name: of the robot, for a new configuration.

    Raises:
        ConfigError: the file cannot be written, or is another's configuration.
    """
    if source is None:
        if target.exists():
            raise ConfigError(f"{target}: exists already and is not this robot's; name another file")
        text, data = f"# Import configuration of {name}.\n", {}
        data: dict[str, Any] = {"urdf_path": _path_from(urdf, target.parent), "name": name}
        data |= {"canonical_frame": False, "overwrite": True}
    else:
        text = _text(source)
        data = _data(source)
        if target.absolute() != source.absolute():
            if target.exists():
                raise ConfigError(f"{target}: exists already; name another file")
            data["urdf_path"] = _path_from(_urdf_of(data, source), target.parent)
    for kind in KINDS:
        sensors, old = ([m for m in some.sensors if m.kind == kind] for some in (edits, before))
        if sensors != old or (source is None and sensors):
            data[kind] = _sensor_entries(sensors, old, data.get(kind) or [])
    _curobo(data, edits, before)
    return _write(target, text, data)


def _curobo(data: dict[str, Any], edits: EditState, before: EditState) -> None:
    block = dict(data.get("curobo") or {})
    if edits.spheres != before.spheres:
        table = block.get("collision_spheres") or {}
        if isinstance(table, list):  # Lula's list of one-key mappings
            table = {link: spheres for item in table for link, spheres in item.items()}
        # a given table replaces all computed spheres
        block["collision_spheres"] = _sphere_table(table, edits, before if table else EditState())
    if edits.planner_pairs != before.planner_pairs:
        table = dict(block.get("self_collision_ignore") or {})
        given = before.planner_pairs if table else set()
        block["self_collision_ignore"] = _ignore_table(table, edits.planner_pairs, given)
    if block:
        data["curobo"] = block


def write_planner_files(folder: Path, edits: EditState, before: EditState) -> list[Path]:
    """Update every planner file below a package's `curobo` folder; returns the changed ones."""
    written = []
    if edits.spheres == before.spheres and edits.planner_pairs == before.planner_pairs:
        return written
    for file in sorted(path for path in folder.rglob("*") if path.suffix in (".yaml", ".yml", ".xrdf")):
        data = _data(file)
        for table in sphere_tables(data):
            new = _sphere_table(table, edits, before)
            table.clear()
            table.update(new)
        for table in ignore_tables(data):
            new = _ignore_table(table, edits.planner_pairs, before.planner_pairs)
            table.clear()
            table.update(new)
        text = _text(file)
        if edited_yaml(text, data) != text:
            written.append(_write(file, text, data))
    return written


def write_definition(file: Path, edits: EditState, before: EditState) -> Path | None:
    """Update `disabled_collision_pairs` of a definition; returns its path, None: nothing changed."""
    if edits.physics_pairs == before.physics_pairs:
        return None
    data = _data(file)
    kept = [
        list(one) for one in data.get("disabled_collision_pairs") or () if pair(*one) in edits.physics_pairs
    ]
    there = {pair(*one) for one in kept}
    data["disabled_collision_pairs"] = kept + [list(one) for one in sorted(edits.physics_pairs - there)]
    return _write(file, _text(file), data)


# ------------------------------------------------------------------------------------------------- entries


def _sensor_entries(sensors: list[SensorPose], old: list[SensorPose], given: list[Any]) -> list[Any]:
    """Return the entries of the configuration; unchanged ones stay as they were written."""
    entries = []
    for k, sensor in enumerate(sensors):
        if sensor in old and len(given) == len(old):
            entries.append(given[old.index(sensor)])
            continue
        entry = dict(given[k]) if k < len(given) and given[k].get("link") == sensor.link else {}
        was = old[k] if entry and k < len(old) else SensorPose(kind=sensor.kind, link=sensor.link)
        offset = dict(entry.get("offset") or {})
        if sensor.position != was.position:
            offset["position"] = _rounded(sensor.position)
        if sensor.quaternion != was.quaternion:
            offset["orientation"] = _rounded(sensor.quaternion)
        entries.append({**entry, "link": sensor.link, "parent_link": sensor.parent, "offset": offset})
    return entries


def _sphere_table(table: Mapping[str, Any], edits: EditState, before: EditState) -> dict[str, Any]:
    """Return link name to spheres, replacing only links whose spheres changed."""
    new = dict(table)
    for link in {**before.spheres, **edits.spheres}:
        spheres, old = edits.spheres.get(link, []), before.spheres.get(link, [])
        if spheres == old:
            continue
        if not spheres:
            new.pop(link, None)
        else:
            # the planner reserves spheres of radius zero for a grasped object
            kept = [one for one in new.get(link) or () if not one.get("radius", 0) > 0]
            new[link] = [_entry(sphere) for sphere in spheres] + kept
    return new


def _entry(sphere: EditedSphere) -> dict[str, Any]:
    return {"center": _rounded(sphere.center), "radius": round(sphere.radius, DIGITS)}


def _ignore_table(table: Mapping[str, Any], pairs: set[Pair], before: set[Pair]) -> dict[str, Any]:
    """Return link name to unchecked links, with removed pairs deleted and new ones added."""
    gone = before - pairs
    new: dict[str, list[str]] = {link: list(others or ()) for link, others in table.items()}
    for link, others in tuple(new.items()):
        kept = [other for other in others if pair(link, other) not in gone]
        if kept or not others:
            new[link] = kept
        else:
            del new[link]
    there = {pair(link, other) for link, others in new.items() for other in others}
    for a, b in sorted(pairs - before - there):
        first, second = (b, a) if b in new and a not in new else (a, b)
        new.setdefault(first, []).append(second)
    return new


# --------------------------------------------------------------------------------------------------- files


def _write(file: Path, text: str, data: dict[str, Any]) -> Path:
    try:
        write_with_backup(file, edited_yaml(text, data))
    except OSError as error:
        raise ConfigError(f"{file}: cannot be written ({error.strerror})") from error
    except ConfigError as error:
        raise ConfigError(f"{file.name}: {error}") from error
    return file


def _data(file: Path) -> dict[str, Any]:
    read_yaml(file)  # its errors name the line and the remedy
    data = parse_yaml(_text(file))
    if not isinstance(data, dict):
        raise ConfigError(f"{file.name}: is no mapping of keys to values")
    return data


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8")


def _urdf_of(data: Mapping[str, Any], config: Path) -> Path:
    path = Path(str(data.get("urdf_path", ""))).expanduser()
    return path if path.is_absolute() else config.parent / path


def _path_from(file: Path, folder: Path) -> str:
    """Return a path for a configuration in `folder`: relative if the file is in or below it."""
    whole = file.absolute()
    try:
        return whole.relative_to(folder.absolute()).as_posix()
    except ValueError:
        return str(whole)


def _rounded(values: Any) -> list[float]:
    return [round(float(v), DIGITS) for v in values]

"""cuRobo robot configurations, in the three layouts that are in use.

| file | layout |
| --- | --- |
| `<name>_description_curobo_default.yaml` | flat, as in OmniGibson's tutorial: everything under `robot_cfg` |
| `..._curobo_{base,arm,arm_no_torso}.yaml` | the same for holonomic robots, with more joints locked |
| `nested/<the same names>` | cuRobo 0.7: under `robot_cfg.kinematics`, `cspace` a block |
| `<name>.yml` | cuRobo's `format_version: 2.0` |

| concept | flat | nested | 2.0 |
| --- | --- | --- | --- |
| root of the tree | `base_link` | same | same |
| end effectors | `ee_link`, `link_names` | same | `tool_frames` |
| joint order | `cspace` | `cspace.joint_names` | same, without mimics |
| rest posture | `retract_config` | `cspace.retract_config` | `cspace.default_joint_position` |
| joints not planned | `lock_joints` with positions | same | same, without mimics |
| spheres, padding | `collision_spheres`, `collision_sphere_buffer`, `self_collision_buffer` | same | same |
| pairs not checked | `self_collision_ignore` | same | same |
| grasped object | `extra_links`, `extra_collision_spheres` | same | and `grasp_contact_link_names` |
| axes | `usd_flip_joints` empty | letter of each axis | - |
| files | - | - | `urdf_path` relative to this file |

Joint vectors are in one order everywhere: link by link depth first, each link's own joints in file order
(`joint_order.prim_order_joints`); each number of the rest posture carries its joint's name as a comment.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.config.yaml_text import Column, annotate, dump
from roboyard.export.export_result import ExportResult
from roboyard.export.planner import ATTACHED_SPHERES, MAX_ACCELERATION, MAX_JERK, SPHERE_BUFFER, Planner

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel

_ORDER_NOTE = "Every joint vector is in the order of the joint names of cspace."


def write(robot: RobotModel, folder: Path | str, *, urdf: Path | str | None = None) -> ExportResult:
    """Write all configurations of a robot; none without planning data.

    Args:
        robot: the robot.
        folder: where the files are written.
        urdf: the URDF that `<name>.yml` names; `../urdf/<name>.urdf` by default.
    """
    if robot.planning is None:
        return ExportResult(files=(), notes=("no planning data; no planner files",))
    place = Path(folder)
    (place / "nested").mkdir(parents=True, exist_ok=True)
    planner = Planner(robot=robot, data=robot.planning)
    files = []
    for variant, flat in _variants(planner).items():
        name = f"{robot.name}_description_curobo_{variant}.yaml"
        files.append(_write(place / name, {"robot_cfg": flat}, planner, "retract_config"))
        nested = {"robot_cfg": {"kinematics": _nested(flat, planner)}}
        files.append(_write(place / "nested" / name, nested, planner, "retract_config"))
    source = Path(urdf) if urdf is not None else place.parent / "urdf" / f"{robot.name}.urdf"
    current = {"robot_cfg": {"kinematics": _current(planner, Path(os.path.relpath(source, place)))}}
    header = ("Paths are relative to this file.", _ORDER_NOTE)
    files.append(_write(place / f"{robot.name}.yml", current, planner, "default_joint_position", header))
    return ExportResult(files=tuple(files), notes=_notes(robot))


def _write(
    path: Path, data: dict[str, Any], planner: Planner, vector: str, header: tuple[str, ...] = (_ORDER_NOTE,)
) -> Path:
    text = dump(data, header=header, sort_keys=True)
    names = [joint.name for joint in planner.joints]
    if vector == "default_joint_position":
        names = [joint.name for joint in planner.joints if joint.mimic is None]
    path.write_text(annotate(text, vector, names), encoding="utf-8")
    return path


def _notes(robot: RobotModel) -> tuple[str, ...]:
    odd = [j for j in robot.description.joints if j.type in ("planar", "floating", "spherical")]
    return tuple(f'joint "{j.name}": {j.type} joints cannot be planned; skipped' for j in odd)


def _variants(planner: Planner) -> dict[str, dict[str, Any]]:
    """Return the configurations by name; each has all keys."""
    default = _flat(planner)
    if not planner.robot.semantic.virtual_joints:
        return {"default": default}
    rest = {joint.name: planner.rest(joint) for joint in planner.joints}
    body = {name: value for name, value in rest.items() if "base_footprint" not in name}
    virtual = {name: rest[name] for name in planner.robot.semantic.base_joints if name in rest}
    torso = {name: rest[name] for name in planner.robot.semantic.trunk_joints if name in rest}
    locked = default["lock_joints"]
    arm = {**default, "lock_joints": {**virtual, **locked}}
    return {
        "default": default,
        "base": {
            **default,
            "ee_link": planner.robot.semantic.base_link,
            "link_names": [],
            "lock_joints": {**body, **locked},
        },
        "arm": arm,
        "arm_no_torso": {**arm, "lock_joints": {**torso, **arm["lock_joints"]}},
    }


def _flat(planner: Planner) -> dict[str, Any]:
    spheres = planner.spheres()
    links = [*spheres, *planner.attached()]
    first, *others = planner.end_links
    return {
        "usd_robot_root": planner.root,
        "usd_flip_joints": {},
        "usd_flip_joint_limits": list(planner.data.flip_joint_limits),
        "base_link": planner.base_link,
        "ee_link": first,
        "link_names": others,
        "lock_joints": planner.locked,
        "extra_links": _extra_links(planner),
        "collision_link_names": links,
        "collision_spheres": spheres,
        "collision_sphere_buffer": SPHERE_BUFFER,
        "extra_collision_spheres": dict.fromkeys(planner.attached(), ATTACHED_SPHERES),
        "self_collision_ignore": planner.ignore(attached=True),
        "self_collision_buffer": _floats(planner.data.self_collision_buffer),
        "use_global_cumul": True,
        "mesh_link_names": list(links),
        "external_asset_path": None,
        "cspace": [joint.name for joint in planner.joints],
        "retract_config": Column(planner.rest(joint) for joint in planner.joints),
        "null_space_weight": [1] * len(planner.joints),
        "cspace_distance_weight": [1] * len(planner.joints),
        "max_jerk": MAX_JERK,
        "max_acceleration": MAX_ACCELERATION,
    }


_CSPACE_KEYS = (
    "retract_config",
    "null_space_weight",
    "cspace_distance_weight",
    "max_jerk",
    "max_acceleration",
)


def _nested(flat: dict[str, Any], planner: Planner) -> dict[str, Any]:
    kinematics = {key: value for key, value in flat.items() if key not in (*_CSPACE_KEYS, "cspace")}
    kinematics["usd_flip_joints"] = _axis_letters(planner)
    kinematics["cspace"] = {"joint_names": flat["cspace"], **{key: flat[key] for key in _CSPACE_KEYS}}
    return kinematics


def _axis_letters(planner: Planner) -> dict[str, str]:
    """Return the letter of each joint's axis; joints along no coordinate axis have none."""
    letters = {}
    for joint in planner.joints:
        along = np.flatnonzero(np.rint(joint.axis))
        if len(along) == 1:
            letters[joint.name] = "XYZ"[along[0]]
    return letters


def _current(planner: Planner, urdf: Path) -> dict[str, Any]:
    spheres = planner.spheres()
    own = [joint for joint in planner.joints if joint.mimic is None]
    grippers = [link for effector in planner.robot.semantic.end_effectors for link in effector.gripper_links]
    held = list(planner.attached())
    return {
        "format_version": 2.0,
        "urdf_path": urdf.as_posix(),
        "asset_root_path": urdf.parent.as_posix(),
        "base_link": planner.base_link,
        "tool_frames": list(planner.end_links),
        "lock_joints": {
            joint.name: planner.locked[joint.name] for joint in own if joint.name in planner.locked
        },
        "extra_links": _extra_links(planner),
        "collision_link_names": [*spheres, *held],
        "collision_spheres": spheres,
        "collision_sphere_buffer": SPHERE_BUFFER,
        "extra_collision_spheres": dict.fromkeys(held, ATTACHED_SPHERES),
        "self_collision_ignore": planner.ignore(attached=True),
        "self_collision_buffer": _floats(planner.data.self_collision_buffer),
        "grasp_contact_link_names": [*dict.fromkeys(grippers), *held],
        "mesh_link_names": list(spheres),
        "use_global_cumul": True,
        "cspace": {
            "joint_names": [joint.name for joint in own],
            "default_joint_position": Column(planner.rest(joint) for joint in own),
            "null_space_weight": [1] * len(own),
            "cspace_distance_weight": [1] * len(own),
            "max_jerk": MAX_JERK,
            "max_acceleration": MAX_ACCELERATION,
        },
    }


def _extra_links(planner: Planner) -> dict[str, dict[str, Any]]:
    """Return the links to which grasped objects attach; poses are position, then quaternion (w, x, y, z)."""
    return {
        name: {
            "parent_link_name": parent,
            "link_name": name,
            "joint_name": f"{name}_joint",
            "joint_type": "FIXED",
            "fixed_transform": [0, 0, 0, 1, 0, 0, 0],
        }
        for name, parent in planner.attached().items()
    }


def _floats(values: Any) -> dict[str, float]:
    return {name: float(value) for name, value in values.items()}

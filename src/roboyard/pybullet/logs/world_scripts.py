"""The Python script that saveWorld writes."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.bodies.body_records import BodyRecord

_HEAD = """import pybullet as p

client = p.connect(p.SHARED_MEMORY)
if client < 0:
    client = p.connect(p.GUI)
"""
_LOADERS = {".sdf": "loadSDF", ".xml": "loadMJCF", ".mjcf": "loadMJCF"}


def world_script(client: Client) -> str:
    """Return Python source that recreates a client's bodies."""
    scene = client.scene
    lines = [_HEAD]
    seen: set[str] = set()
    for number in scene.order:
        record = scene.ready(number, "")
        if not record.file:
            lines.append(f"# body {number} was created by createMultiBody and is not saved\n")
            continue
        suffix = record.file[record.file.rfind(".") :].lower()
        if suffix in _LOADERS:
            if record.file not in seen:
                seen.add(record.file)
                lines.append(f"objects = list(p.{_LOADERS[suffix]}({record.file!r}))")
            lines.append("body = objects.pop(0)")
        else:
            lines.append(_load_urdf(record))
        position, orientation = client.getBasePositionAndOrientation(number)
        lines.append(f"p.resetBasePositionAndOrientation(body, {position!r}, {orientation!r})")
        lines += _joints(record)
        lines.append("")
    x, y, z = client.parameters.gravity
    lines += [f"p.setGravity({x!r}, {y!r}, {z!r})", "p.stepSimulation()", "p.disconnect()", ""]
    return "\n".join(lines)


def _load_urdf(record: BodyRecord) -> str:
    position, orientation = map(tuple, record.base_pose())
    fixed = ", useFixedBase=1" if record.model.fixed_base else ""
    return f"body = p.loadURDF({record.file!r}, {position!r}, {orientation!r}{fixed})"


def _joints(record: BodyRecord) -> list[str]:
    lines = []
    for info in record.infos:
        joint, kind = info[0], info[2]
        if kind in (0, 1):
            value = record.qpos.item(record.position_addresses[joint])
            lines.append(f"p.resetJointState(body, {joint}, {value!r})")
        elif kind == 2:
            w, x, y, z = record.qpos[record.positions_of(joint)].tolist()
            lines.append(f"p.resetJointStateMultiDof(body, {joint}, {[x, y, z, w]!r})")
    return lines

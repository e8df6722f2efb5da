"""Joints that follow others."""

from __future__ import annotations

from collections.abc import Sequence

from roboyard.audit.registry import Fault
from roboyard.description.urdf.elements import JointElement
from roboyard.repair.registry import Changes, RepairContext, change, fix, shown, text


def _without_mimic(faults: Sequence[Fault]) -> Changes:
    for fault in faults:
        joint = fault.at
        assert isinstance(joint, JointElement)
        for mimic in joint.element.findall("mimic"):
            joint.element.remove(mimic)
            yield change(fault, shown(mimic), "removed")


@fix("mimic-unknown")
def unknown_leader(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Remove a `<mimic>` of a joint that does not exist; the joint moves freely, as in every reader."""
    yield from _without_mimic(faults)


@fix("mimic-itself")
def own_leader(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Remove a `<mimic>` of the joint itself."""
    yield from _without_mimic(faults)


@fix("mimic-fixed")
def fixed_leader(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Remove a `<mimic>` of a fixed joint, or on one."""
    yield from _without_mimic(faults)


@fix("mimic-chain")
def first_leader(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Follow the first joint of the chain: q = a (b p + c) + d = (a b) p + (a c + d)."""
    joints = context.urdf.joint_by_name
    resolved: dict[str, tuple[str, float, float]] = {}
    for fault in faults:
        joint = fault.at
        assert isinstance(joint, JointElement)
        assert joint.mimic is not None
        way: list[JointElement] = []
        current = joint
        while current.name not in resolved and current.mimic is not None and current.mimic_of in joints:
            way.append(current)
            current = joints[current.mimic_of]
        leader, multiplier, offset = resolved.get(current.name, (current.name, 1.0, 0.0))
        for follower in reversed(way):
            offset = follower.multiplier * offset + follower.offset
            multiplier *= follower.multiplier
            resolved[follower.name] = leader, multiplier, offset
        before = shown(joint.mimic)
        leader, multiplier, offset = resolved[joint.name]
        joint.mimic.set("joint", leader)
        joint.mimic.set("multiplier", text(multiplier))
        joint.mimic.set("offset", text(offset))
        yield change(fault, before, shown(joint.mimic))

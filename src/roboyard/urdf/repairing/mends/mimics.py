"""Joints that follow others."""

from __future__ import annotations

from collections.abc import Sequence

from roboyard.urdf.auditing.draft import DraftJoint
from roboyard.urdf.auditing.registry import Fault
from roboyard.urdf.repairing.registry import Bench, Changes, change, mend, shown, text


def _without_mimic(faults: Sequence[Fault]) -> Changes:
    for fault in faults:
        joint = fault.at
        assert isinstance(joint, DraftJoint)
        for mimic in joint.element.findall("mimic"):
            joint.element.remove(mimic)
            yield change(fault, shown(mimic), "removed")


@mend("mimic-unknown")
def unknown_leader(bench: Bench, faults: Sequence[Fault]) -> Changes:
    """Remove a `<mimic>` of a joint that does not exist; the joint moves freely, as every reader has it."""
    yield from _without_mimic(faults)


@mend("mimic-itself")
def own_leader(bench: Bench, faults: Sequence[Fault]) -> Changes:
    """Remove a `<mimic>` of the joint itself."""
    yield from _without_mimic(faults)


@mend("mimic-fixed")
def fixed_leader(bench: Bench, faults: Sequence[Fault]) -> Changes:
    """Remove a `<mimic>` of a fixed joint, or on one."""
    yield from _without_mimic(faults)


@mend("mimic-chain")
def first_leader(bench: Bench, faults: Sequence[Fault]) -> Changes:
    """Follow the first joint of the chain: q = a (b p + c) + d = (a b) p + (a c + d)."""
    for fault in faults:
        joint = fault.at
        assert isinstance(joint, DraftJoint)
        assert joint.mimic is not None
        multiplier, offset = joint.multiplier, joint.offset
        leader = bench.draft.joint_by_name[joint.mimic_of]
        while leader.mimic is not None and leader.mimic_of in bench.draft.joint_by_name:
            offset += multiplier * leader.offset
            multiplier *= leader.multiplier
            leader = bench.draft.joint_by_name[leader.mimic_of]
        before = shown(joint.mimic)
        joint.mimic.set("joint", leader.name)
        joint.mimic.set("multiplier", text(multiplier))
        joint.mimic.set("offset", text(offset))
        yield change(fault, before, shown(joint.mimic))

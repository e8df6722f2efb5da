"""Joints that follow others."""

from __future__ import annotations

from collections.abc import Iterator

from roboyard.audit.findings import ERROR, INFO, WARNING
from roboyard.audit.registry import Fault, Faults, check
from roboyard.description.urdf.elements import MOVING_TYPES, JointElement
from roboyard.description.urdf.parse import UrdfElements
from roboyard.errors import unknown_name


def _mimics(urdf: UrdfElements) -> Iterator[JointElement]:
    return (joint for joint in urdf.joints if joint.mimic is not None and joint.mimic_of)


@check(
    "mimic-without-joint",
    ERROR,
    remedy='add joint="..."',
    example='<mimic multiplier="1"/>',
)
def mimic_without_joint(urdf: UrdfElements) -> Faults:
    """A `<mimic>` names no joint."""
    for joint in urdf.joints:
        if joint.mimic is not None and not joint.mimic_of:
            yield Fault(at=joint, message="<mimic> names no joint to follow")


@check(
    "mimic-unknown",
    WARNING,
    remedy="correct the name, or remove the <mimic>",
    fixable=True,
    example='<mimic joint="ghost"/>',
)
def mimic_unknown(urdf: UrdfElements) -> Faults:
    """A joint follows one that does not exist, so it moves freely."""
    for joint in _mimics(urdf):
        if joint.mimic_of not in urdf.joint_by_name:
            yield Fault(
                at=joint, message=f"mimic: {unknown_name('joint', joint.mimic_of, urdf.joint_by_name)}"
            )


@check(
    "mimic-itself",
    WARNING,
    remedy="remove the <mimic>",
    fixable=True,
    example='<joint name="j" ...><mimic joint="j"/>',
)
def mimic_itself(urdf: UrdfElements) -> Faults:
    """A joint follows itself; it moves freely."""
    for joint in _mimics(urdf):
        if joint.mimic_of == joint.name:
            yield Fault(at=joint, message="mimic: it follows itself")


@check(
    "mimic-fixed",
    WARNING,
    remedy="remove the <mimic>",
    fixable=True,
    example='<joint name="j" type="fixed"><mimic joint="k"/>',
)
def mimic_fixed(urdf: UrdfElements) -> Faults:
    """A fixed joint follows another, or a joint follows a fixed one."""
    for joint in _mimics(urdf):
        leader = urdf.joint_by_name.get(joint.mimic_of)
        if joint.type == "fixed":
            yield Fault(at=joint, message="mimic: a fixed joint cannot follow another")
        elif leader is not None and leader.type == "fixed" and leader is not joint:
            yield Fault(at=joint, message=f'mimic: joint "{leader.name}", which it follows, is fixed')


@check(
    "mimic-cycle",
    WARNING,
    remedy="let one of them lead: remove its <mimic>",
    example="(j follows k and k follows j)",
)
def mimic_cycle(urdf: UrdfElements) -> Faults:
    """Joints follow each other in a ring, so that none leads."""
    for ring in urdf.mimic_rings:
        if len(ring) > 1:
            named = " -> ".join(
                f'"{name}"' for name in (*ring[:6], *(("...",) if len(ring) > 6 else ()), ring[0])
            )
            message = f"mimic: joints follow each other in a ring ({named})"
            yield Fault(at=urdf.joint_by_name[ring[0]], message=message)


@check(
    "mimic-chain",
    INFO,
    remedy="follow the first joint of the chain directly",
    fixable=True,
    example="(j follows k and k follows l)",
)
def mimic_chain(urdf: UrdfElements) -> Faults:
    """A joint follows one that follows another; many programs follow only one step."""
    for joint in _mimics(urdf):
        leader = urdf.joint_by_name.get(joint.mimic_of)
        if leader is None or leader is joint or leader.mimic is None or leader.mimic_of == leader.name:
            continue
        if leader.mimic_of in urdf.joint_by_name and joint.name not in urdf.mimic_ring_entries:
            message = f'mimic: joint "{leader.name}", which it follows, follows "{leader.mimic_of}"'
            yield Fault(at=joint, message=message)


@check(
    "mimic-multiplier",
    WARNING,
    remedy="correct the multiplier",
    example='<mimic joint="k" multiplier="0"/>',
)
def mimic_multiplier(urdf: UrdfElements) -> Faults:
    """A multiplier is zero, or so large or small (100 times) that it must be a mistake."""
    for joint in _mimics(urdf):
        size = abs(joint.multiplier)
        leader = urdf.joint_by_name.get(joint.mimic_of)
        same_kind = leader is not None and leader.unit == joint.unit
        if size == 0.0:
            yield Fault(at=joint, message="mimic: multiplier 0 keeps it where it is")
        elif size > 100.0 or (size < 0.01 and same_kind):
            yield Fault(at=joint, message=f"mimic: multiplier {joint.multiplier:g} is implausible")


@check(
    "mimic-range",
    WARNING,
    remedy="correct its limits, multiplier or offset",
    example='(upper="0.04" that follows a joint of upper="1" with multiplier 1)',
)
def mimic_range(urdf: UrdfElements) -> Faults:
    """Following takes the joint beyond its own limits (by more than 1 % of its range)."""
    for joint in _mimics(urdf):
        leader = urdf.joint_by_name.get(joint.mimic_of)
        if leader is None or leader.type not in MOVING_TYPES or not (joint.has_range and leader.has_range):
            continue
        if joint.type not in ("revolute", "prismatic") or leader.type not in ("revolute", "prismatic"):
            continue
        ends = [joint.multiplier * end + joint.offset for end in (leader.lower or 0.0, leader.upper or 0.0)]
        lower, upper = joint.lower or 0.0, joint.upper or 0.0
        slack = 0.01 * (upper - lower)
        if min(ends) < lower - slack or max(ends) > upper + slack:
            yield Fault(
                at=joint,
                message=f"mimic: following takes it to [{min(ends):g}, {max(ends):g}], "
                f"beyond its limits [{lower:g}, {upper:g}] {joint.unit}",
            )

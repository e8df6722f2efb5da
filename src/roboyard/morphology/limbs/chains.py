"""Limbs: chains of joints from a hub (base, torso, pelvis) outwards; what branches off a chain and is small
beside it is an accessory.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from roboyard.morphology.limbs.heads import looks_like_head
from roboyard.morphology.skeleton import BASE, Skeleton
from roboyard.morphology.words import meanings

MAJOR_REACH = 0.35
"""Reach of a limb as a share of its longest sibling's."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Limb:
    """A chain of joints that ends in no further limb."""

    hub: str
    """Body from which it begins."""
    joints: tuple[str, ...]
    """Hub first, without those of a hand; joints that mimic others included."""
    palm: str | None = None
    """Body from which its fingers move."""
    fingers: tuple[str, ...] = ()
    """Joints of its hand."""
    is_head: bool = False
    accessories: tuple[str, ...] = ()
    """Joints that branch off and carry nothing."""

    @property
    def tip(self) -> str:
        """Body at the end of the chain."""
        return self.joints[-1] if self.joints else self.hub


@dataclass(frozen=True, kw_only=True, slots=True)
class Anatomy:
    """All limbs of a robot, and the bodies from which they begin."""

    hubs: tuple[str, ...]
    """The base first."""
    limbs: tuple[Limb, ...]
    """Depth first."""
    accessories: tuple[str, ...]
    """Joints that belong to no limb."""


def find_limbs(
    skeleton: Skeleton, palms: Mapping[str, tuple[str, ...]], used: Collection[str] = ()
) -> Anatomy:
    """Return the limbs of a robot.

    Args:
        skeleton: the robot.
        palms: bodies with fingers, and the joints of these.
        used: joints of wheels and rotors.
    """
    fingers = {name for joints in palms.values() for name in joints}
    hidden = {*used, *fingers}
    hubs: list[str] = []
    limbs: list[Limb] = []
    accessories: list[str] = []

    def visit(hub: str) -> None:
        hubs.append(hub)
        majors, heads, minors = _sorted(skeleton, hub, hidden, palms)
        accessories.extend(joint for kid in minors for joint in _open(skeleton, kid, hidden))
        for kid in skeleton.children[hub]:
            if kid in heads:
                joints = tuple(_open(skeleton, kid, hidden))
                limbs.append(Limb(hub=hub, joints=joints, is_head=True))
            elif kid in majors:
                follow(hub, kid)

    def follow(hub: str, kid: str) -> None:
        chain, extra = [kid], []
        while True:
            body = chain[-1]
            if body in palms:
                break
            majors, heads, minors = _sorted(skeleton, body, hidden, palms)
            if len(majors) > 1 or (majors and heads):
                accessories.extend(extra)
                visit(body)
                return
            ahead = majors or heads
            if not ahead:
                break
            extra += [joint for kid in minors for joint in _open(skeleton, kid, hidden)]
            chain.append(ahead[0])
        palm = body if body in palms else None
        limbs.append(
            Limb(hub=hub, joints=tuple(chain), palm=palm, fingers=tuple(palms.get(body, ())),
                 accessories=tuple(extra))
        )  # fmt: skip

    visit(BASE)
    return Anatomy(hubs=tuple(hubs), limbs=tuple(limbs), accessories=tuple(accessories))


def _open(skeleton: Skeleton, joint: str, hidden: Collection[str]) -> list[str]:
    return [name for name in skeleton.below(joint) if name not in hidden]


def _sorted(
    skeleton: Skeleton, body: str, hidden: Collection[str], palms: Mapping[str, tuple[str, ...]]
) -> tuple[list[str], list[str], list[str]]:
    """Return the joints that hang from a body: those of limbs, heads, and accessories."""
    kids = [name for name in skeleton.children[body] if name not in hidden]
    if len(kids) == 1:
        alone = body == BASE and looks_like_head(skeleton, kids[0], palms, alone=True)
        return ([], kids, []) if alone else (kids, [], [])
    if not kids:
        return [], [], []
    heads = [name for name in kids if looks_like_head(skeleton, name, palms)]
    others = [name for name in kids if name not in heads]
    reach = {name: skeleton.reach(name) for name in others}
    longest = max(reach.values(), default=0.0)
    handed = [n for n in others if any(joint in palms for joint in skeleton.below(n))]
    majors = [
        name
        for name in others
        if name in handed or (skeleton.depth(name) >= 2 and reach[name] >= MAJOR_REACH * longest)
    ]
    if not majors and not heads and others:
        majors = [max(others, key=lambda name: _likely(skeleton, name, reach[name]))]
        if body == BASE:
            majors = [n for n in others if reach[n] >= MAJOR_REACH * longest and skeleton.depth(n) >= 1]
    return majors, heads, [name for name in others if name not in majors]


def _likely(skeleton: Skeleton, name: str, reach: float) -> tuple[bool, bool, float]:
    """Return how likely a chain goes on here: by name, by having a motor, by reach."""
    words = meanings(name) | meanings(skeleton.joint[name].child)
    return bool(words & {"leg", "arm"}) and "suspension" not in words, skeleton.is_driven(name), reach

"""Which links of a robot overlap one another in a posture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard.sim import World

if TYPE_CHECKING:
    from roboyard.sim.body import Body


def overlaps(body: Body, least: float = 0.0) -> list[tuple[str, str, float]]:
    """Pairs of links that overlap in the present posture by more than `least` m, the deepest first.

    Neighbours (links joined by a joint, and those held together by fixed ones) are left out, as everywhere.

    Returns:
        Names of both links, and the depth in m.
    """
    assert body.description is not None
    world = World(visual_geoms=False)
    copy = world.add_description(body.description, fixed_base=True, self_collision=True, drives=False)
    for joint in body.joints:
        if joint.is_scalar:
            copy.joint(joint.name).position = joint.position
    world.detect_contacts()
    deepest: dict[tuple[str, str], float] = {}
    for contact in world.contacts(copy, copy):
        a, b = sorted((contact.link_a.name, contact.link_b.name))
        deepest[a, b] = max(deepest.get((a, b), 0.0), -contact.distance)
    found = [(a, b, depth) for (a, b), depth in deepest.items() if depth > least]
    return sorted(found, key=lambda entry: -entry[2])

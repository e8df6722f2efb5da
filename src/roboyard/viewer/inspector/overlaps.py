"""Pairs of links of a robot that overlap in its current posture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard.sim import World

if TYPE_CHECKING:
    from roboyard.sim.body import Body


def overlaps(body: Body, least: float = 0.0) -> list[tuple[str, str, float]]:
    """Return the pairs of links that overlap by more than `least` (m), the deepest first.

    Neighbours (links joined by a joint, or by fixed joints) are skipped, as in the simulation.

    Returns:
        Names of both links in alphabetical order, and the depth (m).
    """
    from roboyard.validation.test_world import own_contacts  # loads all of robots/, which a page needs later

    assert body.description is not None
    world = World(visual_geoms=False)
    copy = world.add_description(body.description, fixed_base=True, self_collision=True, drives=False)
    for joint in body.joints:
        if joint.is_scalar:
            copy.joint(joint.name).position = joint.position
    return [entry for entry in own_contacts(world, copy) if entry[2] > least]

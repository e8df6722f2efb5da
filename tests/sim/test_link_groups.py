"""Groups and masks of links: the bits and exclusions in MuJoCo's arrays against the rule, pair by pair."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from colliding_links import colliding_links

from roboyard.description.model import Box, Collision, Joint, Link, RobotDescription
from roboyard.sim.build.group_masks import BITS, CODE_SIZE, code_masks, group_masks, meet
from roboyard.sim.physics_profile import BULLET
from roboyard.sim.world import World

USUAL = (1, -1)


def chain(count: int) -> RobotDescription:
    links = tuple(
        Link(name=f"link{k}", collisions=(Collision(geometry=Box(size=(0.1, 0.1, 0.1))),))
        for k in range(count)
    )
    joints = tuple(
        Joint(name=f"joint{k}", type="revolute", parent=f"link{k}", child=f"link{k + 1}")
        for k in range(count - 1)
    )
    return RobotDescription(name="chain", links=links, joints=joints)


def expected(world: World, groups: dict, disabled: dict, selves: set[int]) -> set:
    found = set()
    links = [(body.id, link.index) for body in world.bodies for link in body.links]
    for a, b in combinations(links, 2):
        does = meet(groups.get(a, USUAL), groups.get(b, USUAL))
        does = disabled.get((a, b), does)
        if does and (a[0] != b[0] or a[0] in selves):
            found.add((a, b))
    return found


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kinds", [3, 40])
def test_links_of_groups_meet_by_the_rule(seed: int, kinds: int) -> None:
    """Bodies come and go, steps and reads of the spec pass; `kinds` groups are more than there are bits."""
    rng = np.random.default_rng([seed, kinds])
    world, robot = World(profile=BULLET), chain(3)
    choices = [(0, 0), (1, 1), (2, 2), (2, -3), (4, 1), (4, 4), USUAL]
    choices += [(1 << k, ~(1 << k)) for k in range(3, kinds)]
    groups: dict = {}
    disabled: dict = {}
    selves: set[int] = set()
    for _ in range(60):
        match rng.integers(9):
            case 0 | 1:
                is_self = bool(rng.integers(2))
                place = rng.uniform(-5, 5, 3)
                made = (
                    world.add_description(robot, place, self_collision=is_self)
                    if rng.integers(2)
                    else world.add_box((0.2, 0.2, 0.2), place, mass=1.0)
                )
                if is_self:
                    selves.add(made.id)
            case 2 if len(world.bodies) > 2:
                gone = world.bodies[rng.integers(len(world.bodies))]
                groups = {key: given for key, given in groups.items() if key[0] != gone.id}
                disabled = {k: on for k, on in disabled.items() if gone.id not in (k[0][0], k[1][0])}
                world.remove(gone)
            case 3:
                world.step()
            case 4 if world.bodies:
                _ = world.spec
            case 5 if len(world.bodies) > 1:
                a, b = (
                    world.bodies[k].links[0] for k in sorted(rng.choice(len(world.bodies), 2, replace=False))
                )
                on = bool(rng.integers(2))
                world.filters.set(a, b, collide=on)
                disabled[((a.body.id, 0), (b.body.id, 0))] = on
            case _ if world.bodies:
                body = world.bodies[rng.integers(len(world.bodies))]
                link = body.links[rng.integers(len(body.links))]
                given = choices[rng.integers(len(choices))]
                world.filters.set_group(link, *given)
                groups[(body.id, link.index)] = given
        if rng.integers(3) == 0 and world.bodies:
            assert colliding_links(world, world.live_model) == expected(world, groups, disabled, selves)
    if world.bodies:
        compiled = world.spec.copy().compile()
        _ = world.live_model
        assert colliding_links(world, compiled) == expected(world, groups, disabled, selves)


def test_no_code_is_within_another() -> None:
    contypes = [code_masks(number)[0] for number in range(1000)]
    assert len(set(contypes)) == 1000
    assert {bin(contype).count("1") for contype in contypes} == {CODE_SIZE}
    assert all(contype & masks == 0 for contype, masks in map(code_masks, range(1000)))


def test_groups_that_meet_the_same_share_a_bit() -> None:
    found = group_masks([(1 << k, 1) for k in range(1, 3 * BITS)])
    assert len(set(found.values())) == 1


def test_a_group_without_bits_is_missing() -> None:
    groups = [(1 << k, ~(1 << k)) for k in range(1, BITS + 5)]
    found = group_masks(groups)
    assert list(found) == groups[:BITS]


def test_many_bodies_of_a_group_need_no_exclusions() -> None:
    world = World(profile=BULLET)
    world.add_plane()
    for k in range(20):
        box = world.add_box((0.2, 0.2, 0.2), (0.1 * k, 0, 0.1), mass=1.0)
        world.filters.set_group(box.links[0], 0, 0)
    world.step()
    assert world.live_model.nexclude == 0
    assert world.live_data.ncon == 0

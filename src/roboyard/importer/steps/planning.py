"""Planning data: spheres, pairs of links not checked for collision, rest posture, locked joints.

Values of the configuration are used as given; the others are computed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from roboyard.description.geometry import shape_meshes
from roboyard.description.model import Collision, Link
from roboyard.description.robot_model import CollisionSphere, PlanningData, RobotModel
from roboyard.description.semantic import REST, TUCK
from roboyard.errors import MeshError
from roboyard.importer.context import ImportContext
from roboyard.importer.planning.centred_legs import centred_legs
from roboyard.importer.planning.contact_checker import ContactChecker
from roboyard.importer.planning.contact_free_posture import contact_free_posture
from roboyard.importer.planning.ik_rest_posture import NewContacts, ik_rest_posture
from roboyard.importer.planning.landed_arms import landed_arms
from roboyard.importer.planning.link_spheres import fit_links
from roboyard.importer.planning.rest_posture import lock_joints, rest_posture
from roboyard.importer.planning.standing_posture import standing_posture
from roboyard.importer.planning.support_margin import keeps_standing
from roboyard.importer.planning.tuck_posture import tuck_posture
from roboyard.shapes.surface_points import share_near_spheres, surface_points

MIN_COVERED = 0.8
"""Share of a link's visual surface from which its spheres cover what is seen."""
NEAR = 0.01
"""Distance to a sphere that counts as covered (m)."""
SMALL = 0.03
"""Visual shapes smaller than this need no spheres of their own (m)."""


def add_planning_data(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Return the robot with its planning data, rest posture and disabled collision pairs."""
    curobo = context.config.curobo
    checker = ContactChecker(robot.description)
    rest = _rest(robot, context, checker)
    locked = lock_joints(robot, context.config, rest)
    spheres = _spheres(robot, context)
    touching = _touching(checker, rest, context)
    if curobo.self_collision_ignore:
        ignore: Mapping[str, tuple[str, ...]] = {
            link: tuple(others) for link, others in curobo.self_collision_ignore.items()
        }
        _compare(robot, ignore, touching, context)
    else:
        ignore = _ignore(robot, spheres, {**rest, **locked}, touching, context)
    data = PlanningData(
        spheres=spheres,
        ignore=ignore,
        self_collision_buffer=dict(curobo.self_collision_buffer),
        lock_joints=locked,
        flip_joint_limits=tuple(curobo.flip_joint_limits),
    )
    start = {**rest, **locked}
    tuck = tuck_posture(robot, start, spheres, ignore, NewContacts(checker, start))
    if tuck:
        context.log.note("tucked: the arms are near the body, without contact")
    semantic = replace(
        robot.semantic,
        disabled_collision_pairs=tuple((a, b) for a, b, _ in touching),
        postures={REST: rest, **({TUCK: tuck} if tuck else {})},
    )
    return replace(robot, semantic=semantic, planning=data)


def _rest(robot: RobotModel, context: ImportContext, checker: ContactChecker) -> dict[str, float]:
    """Return the rest posture: stated, else standing, with arms bent and no contact."""
    straight = rest_posture(robot, context.config)
    if context.config.curobo.default_qpos is not None:
        return straight
    stood = standing_posture(robot.description, robot.semantic.legs, straight)
    straight |= stood
    _note_rest(context, stood, "because the robot would not stand on its legs as they are drawn")
    stands = keeps_standing(robot.description, robot.semantic.legs, straight)
    rest = ik_rest_posture(robot, context.config, straight, checker, stands)
    bent = {name: rest[name] for name in rest if rest[name] != straight[name]}
    _note_rest(context, bent, "because the stretched arm is near a singularity")
    semantic = robot.semantic
    if semantic.kind == "drone" and semantic.arms:
        raised = landed_arms(robot.description, semantic.arms, rest, NewContacts(checker, rest))
        _note_rest(context, raised, "because the robot would land on its arm")
        rest |= raised
    still = {*semantic.base_joints, *semantic.virtual_joints, *semantic.caster_joints, *semantic.steer_joints}
    still |= {wheel.joint for wheel in semantic.wheels}
    still |= {name for leg in semantic.legs for name in leg.joints}
    freed = contact_free_posture(checker, rest, still, stands)
    _note_rest(context, freed, "because links overlapped that the robot can hold apart")
    rest |= freed
    leant = centred_legs(robot.description, semantic.legs, rest, semantic.forward)
    _note_rest(context, leant, "because the centre of mass is then over the middle of the feet")
    return rest | leant


def _note_rest(context: ImportContext, changed: Mapping[str, float], why: str) -> None:
    if changed:
        text = ", ".join(f"{name} {value:.2f}" for name, value in changed.items())
        context.log.note(f"rest: {text}, {why}")


def _spheres(robot: RobotModel, context: ImportContext) -> dict[str, tuple[CollisionSphere, ...]]:
    given = context.config.curobo.collision_spheres
    if given:
        context.log.note(f"{sum(map(len, given.values()))} collision spheres on {len(given)} links, as given")
        return {
            link: tuple(CollisionSphere(center=s.center, radius=s.radius) for s in spheres)
            for link, spheres in given.items()
        }
    order = {link.name: robot.solids.get(link.name, ()) for link in robot.description.links}
    preset = context.config.curobo.sphere_preset
    found = fit_links(order, context, preset=preset)
    bare = bare_links(robot.description.links, found)
    if bare:
        facts = context.log.facts["spheres"]
        exact = {name: found[name] for name in bare if facts.get(name, {}).get("exact")}
        wider = {name: shapes if name in exact else (*order[name], *shapes) for name, shapes in bare.items()}
        fitted = fit_links(wider, context, preset=preset)
        found |= {name: (*exact.get(name, ()), *spheres) for name, spheres in fitted.items()}
        context.log.facts["spheres"] = {**facts, **context.log.facts["spheres"]}
        context.log.note(
            f"spheres of {len(bare)} links also cover their visual shapes, which reach far beyond the "
            f"collision shapes: {', '.join(sorted(bare))}"
        )
    context.log.note(f"{sum(map(len, found.values()))} collision spheres fitted to {len(found)} links")
    return found


def bare_links(
    links: Iterable[Link], spheres: Mapping[str, Sequence[CollisionSphere]]
) -> dict[str, tuple[Collision, ...]]:
    """Return the visual shapes of links of which spheres leave a good part bare, by link."""
    found: dict[str, tuple[Collision, ...]] = {}
    for link in links:
        try:
            points = surface_points(shape_meshes(link.visuals))
        except MeshError:
            continue
        if not len(points) or float(np.ptp(points, axis=0).max()) < SMALL:
            continue
        own = spheres.get(link.name, ())
        centers, radii = [sphere.center for sphere in own], [sphere.radius for sphere in own]
        if share_near_spheres(points, centers, radii, NEAR) < MIN_COVERED:
            found[link.name] = tuple(
                Collision(geometry=visual.geometry, origin=visual.origin) for visual in link.visuals
            )
    return found


def _touching(
    checker: ContactChecker, rest: Mapping[str, float], context: ImportContext
) -> list[tuple[str, str, float]]:
    """Return links whose collision shapes overlap at zero or at rest, with depth (m), in link order."""
    deepest: dict[tuple[str, str], float] = {}
    for posture in (dict.fromkeys(rest, 0.0), rest):
        for pair, depth in checker.overlaps(posture).items():
            deepest[pair] = max(depth, deepest.get(pair, 0.0))
    context.log.facts["overlaps_at_rest"] = [
        {"links": [a, b], "depth_mm": round(depth * 1000, 3)} for (a, b), depth in deepest.items()
    ]
    if deepest:
        worst = max(deepest, key=deepest.__getitem__)
        context.log.note(
            f"{len(deepest)} pairs of links overlap at rest; their collision is disabled "
            f"(deepest: {worst[0]} and {worst[1]}, {deepest[worst] * 1000:.1f} mm)"
        )
    return [(a, b, depth) for (a, b), depth in deepest.items()]


def _ignore(
    robot: RobotModel,
    spheres: Mapping[str, tuple[CollisionSphere, ...]],
    rest: Mapping[str, float],
    touching: list[tuple[str, str, float]],
    context: ImportContext,
) -> dict[str, tuple[str, ...]]:
    from roboyard.importer.planning.self_collision import self_collision_matrix

    context.log.report_progress(0.9, "self-collision")
    grippers = [end.gripper_links for end in robot.semantic.end_effectors]
    found = self_collision_matrix(robot.description, spheres, rest, touching, grippers=grippers)
    context.log.facts["self_collision"] = {
        "samples": found.samples,
        "adjacent": len(found.adjacent),
        "at_rest": [list(pair) for pair in found.at_rest],
        "always": [list(pair) for pair in found.always],
        "never": len(found.never),
    }
    context.log.note(
        f"self-collision: {len(found.adjacent)} pairs are adjacent, {len(found.at_rest)} collide at rest, "
        f"{len(found.always)} always collide and {len(found.never)} never do in {found.samples} postures"
    )
    return found.ignore()


def _compare(
    robot: RobotModel,
    ignore: Mapping[str, tuple[str, ...]],
    touching: list[tuple[str, str, float]],
    context: ImportContext,
) -> None:
    """Warn of overlapping pairs that the configuration does not list."""
    given = {frozenset((a, b)) for a, others in ignore.items() for b in others}
    for a, b, depth in touching:
        if frozenset((a, b)) not in given:
            context.log.warn(
                f'overlaps "{b}" by {depth * 1000:.1f} mm at rest, which self_collision_ignore does not list',
                f'link "{a}"',
            )

"""A rest posture in which no arm is near a singularity.

In many files arms are stretched out at zero, with parallel joint axes: the tip cannot move along the arm, and
controllers that follow poses get stuck. With J the Jacobian of the tip, its lengths in units of the arm's
reach, such postures have a vanishing smallest singular value σ of J (Yoshikawa, "Manipulability of robotic
mechanisms", IJRR 4(2), 1985). An arm with a small σ is bent: of the postures whose joints are turned by
0°, 45° or 90°, the one with the largest

    σ / σ_best - 0.1 (turns / 90°) + 0.2 x / reach + 0.2 z / reach

is chosen, with x the forward position of its tip and z the height of its lowest joint, so that mirrored arms
are bent in mirror images. It must not cause new contacts, and must stay above the floor.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from roboyard.description.model import RobotDescription
from roboyard.description.robot_model import RobotModel
from roboyard.importer.config.schema import ImportConfig
from roboyard.importer.planning.contact_checker import ContactChecker
from roboyard.kinematics import ChainArrays, forward_kinematics, from_description, jacobian
from roboyard.transforms import Array

ENOUGH = 0.06
"""σ from which a posture is kept."""
TURNS = np.radians((0.0, 45.0, -45.0, 90.0, -90.0))
MARGIN = np.radians(10.0)
"""Distance of bent joints to their limits (rad)."""
MOST_JOINTS = 6
"""Most joints that are turned; joints nearer to the tip are kept."""
FEWEST_JOINTS = 4
SPACE = 6
"""Number of coordinates of a pose."""
TRIES = 100
"""Postures checked for contacts."""

MOST_OF_ALL = 0.6
"""Share of a robot's joints, without its fingers', from which its longest chain counts as an arm where no
gripper is configured or detected.
"""

Posture = Mapping[str, float]


def ik_rest_posture(
    robot: RobotModel,
    config: ImportConfig,
    rest: Posture,
    checker: ContactChecker | None = None,
    allows: Callable[[Posture], bool] = lambda posture: True,
) -> dict[str, float]:
    """Return the rest posture with stretched arms bent (rad or m).

    The configuration's `default_qpos` is kept, and so are torsos, locked joints and legs.

    Args:
        robot: with its semantics.
        config: of its import.
        rest: the posture before (rad or m).
        checker: of the robot's contacts; a new one by default.
        allows: whether a posture may be taken; all may by default.
    """
    out = dict(rest)
    if config.curobo.default_qpos is not None:
        return out
    description = robot.description
    semantic = robot.semantic
    others = {*semantic.trunk_joints, *semantic.virtual_joints, *config.curobo.lock_joints}
    touches = NewContacts(checker or ContactChecker(description), rest)
    known = {arm.end_effector.link for arm in semantic.arms}
    for effector in semantic.end_effectors:
        arm = arm_of(description, semantic.base_link, effector.link, out, others)
        if arm is None:
            continue
        named = config.curobo.eef_to_gripper_info or effector.gripper_joints or effector.link in known
        if not named and len(arm.own) < MOST_OF_ALL * _driven_before(description, effector.link):
            continue
        out |= ik_posture(arm, out, lambda posture: not allows(posture) or touches(posture))
    return out


def _driven_before(description: RobotDescription, tip: str) -> int:
    """Return the number of driven joints that are not beyond the tip."""
    beyond, todo = set[str](), [tip]
    while todo:
        joints = description.child_joints.get(todo.pop(), ())
        beyond |= {joint.name for joint in joints}
        todo += [joint.child for joint in joints]
    driven = (joint for joint in description.joints if joint.is_moving and joint.mimic is None)
    return sum(joint.name not in beyond for joint in driven)


class NewContacts:
    """Reports whether a posture causes contacts that occur neither at rest nor at zero."""

    def __init__(self, checker: ContactChecker, rest: Posture) -> None:
        """Store the robot's contacts and its rest posture."""
        self._checker, self._rest = checker, rest

    def __call__(self, posture: Posture) -> bool:
        return bool(self._checker.overlaps(posture).keys() - self._usual)

    @cached_property
    def _usual(self) -> set[tuple[str, str]]:
        zero = self._checker.overlaps(dict.fromkeys(self._rest, 0.0))
        return {*zero, *self._checker.overlaps(self._rest)}


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Arm:
    """A chain at rest."""

    chain: ChainArrays
    rest: Array
    """(n,) rad or m"""
    own: tuple[int, ...]
    """Places of the arm's own joints in the chain; the others carry it."""
    reach: float
    """m"""


def arm_of(
    description: RobotDescription, base: str, tip: str, rest: Posture, shared: Collection[str]
) -> Arm | None:
    """The chain from the base to a tip as an arm.

    Args:
        shared: joints that are not the arm's own: a torso's, virtual ones.

    Returns:
        None for fewer than four joints of its own, or none that turn.
    """
    chain = from_description(description, tip, base)
    own = tuple(i for i, name in enumerate(chain.joint_names) if name not in shared)
    if len(own) < FEWEST_JOINTS or any(name not in rest for name in chain.joint_names):
        return None
    at = np.array([rest[name] for name in chain.joint_names])
    frames = forward_kinematics(chain, at, list(chain.links))[:, :3, 3]
    steps = np.linalg.norm(np.diff(frames, axis=0), axis=1)
    reach = float(steps.sum())
    return Arm(chain=chain, rest=at, own=own, reach=reach) if reach > 0 else None


def dexterity(arm: Arm, q: Array) -> float:
    """Return the smallest singular value σ of the arm's own joints at (n,) positions `q` (dimensionless).

    With fewer than six joints only the tip's position counts, since no posture turns it about every axis.
    """
    own = jacobian(arm.chain, q)[:, list(arm.own)]
    own[:3] /= arm.reach
    own = own if len(arm.own) >= SPACE else own[:3]
    return float(np.linalg.svd(own, compute_uv=False)[-1])


def ik_posture(arm: Arm, rest: Posture, touches: Callable[[Posture], bool]) -> dict[str, float]:
    """Return the positions of the joints to turn (rad); empty where the arm is dexterous, or no posture is
    better.

    Args:
        arm: the arm at rest.
        rest: the whole robot's rest posture.
        touches: whether a posture of the robot causes new contacts.
    """
    before = dexterity(arm, arm.rest)
    if before >= ENOUGH:
        return {}
    candidates = _candidates(arm)
    if not len(candidates):
        return {}
    found = np.array([dexterity(arm, q) for q in candidates])
    best = float(found.max())
    if best < max(ENOUGH, 2.0 * before):
        return {}
    frames = forward_kinematics(arm.chain, candidates, list(arm.chain.links))[:, :, :3, 3]
    floor = min(0.0, float(forward_kinematics(arm.chain, arm.rest, list(arm.chain.links))[:, 2, 3].min()))
    low = frames[:, 1:, 2].min(axis=1) - floor
    turned = np.abs(candidates - arm.rest).sum(axis=1) / np.radians(90.0)
    score = found / best - 0.1 * turned + 0.2 * (frames[:, -1, 0] + low) / arm.reach
    score[(found < ENOUGH) | (low < 0.0)] = -np.inf
    for place in np.argsort(-score, kind="stable")[:TRIES]:
        if not np.isfinite(score[place]):
            break
        posture = dict(zip(arm.chain.joint_names, candidates[place].tolist(), strict=True))
        if not touches({**rest, **posture}):
            changed = candidates[place] != arm.rest
            return {name: posture[name] for name, new in zip(posture, changed, strict=True) if new}
    return {}


def _candidates(arm: Arm) -> Array:
    """(k, n) postures with some own joints turned; the first and the last, which σ hardly knows, stay."""
    inner = [i for i in arm.own[1:-1] if not _slides(arm, i)][:MOST_JOINTS]
    if not inner:
        return np.zeros((0, len(arm.rest)))
    choices = []
    for i in inner:
        low, high = arm.chain.lower[i] + MARGIN, arm.chain.upper[i] - MARGIN
        values = [arm.rest[i] + turn for turn in TURNS]
        choices.append([v for v in values if v == arm.rest[i] or low <= v <= high])
    out = np.array(list(product(*choices))).reshape(-1, len(inner))
    postures = np.tile(arm.rest, (len(out), 1))
    postures[:, inner] = out
    return postures


def _slides(arm: Arm, place: int) -> bool:
    return place in arm.chain.q_index[arm.chain.is_prismatic]

"""Rotors of a flying robot: flat parts that turn without limits about upright axes, around the middle."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from roboyard.description.model import Mesh
from roboyard.morphology.skeleton import BASE, Skeleton, is_endless
from roboyard.morphology.words import meanings, share

FEWEST = 3
"""Smallest number of rotors; two may be anything that spins."""
FLAT = 0.5
"""Largest height of a rotor as a share of its width."""
UPRIGHT = 0.8
MOST = 0.7
"""Share of the moving links that are named as a flying robot's, where no name of its base says so."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Rotors:
    """Parts that hold a robot in the air."""

    joints: tuple[str, ...]
    """Empty where the rotors are fixed links."""
    links: tuple[str, ...]
    confidence: float
    evidence: tuple[str, ...]


def find_rotors(skeleton: Skeleton, used: Collection[str] = ()) -> Rotors | None:
    """Return the rotors of a robot; None without.

    Args:
        skeleton: the robot.
        used: joints of its wheels.
    """
    joints = [name for name in skeleton.joint if name not in used and _spins(skeleton, name)]
    named = [name for name in joints if _is_named(name, skeleton.joint[name].child)]
    flat = [name for name in joints if _is_flat(skeleton, name)]
    chosen = named if len(named) >= FEWEST else flat
    if len(chosen) >= FEWEST and _is_around(skeleton, chosen):
        links = tuple(skeleton.joint[name].child for name in chosen)
        evidence = [f"{len(chosen)} parts spin about upright axes around the middle"]
        evidence += ["their names say rotor"] if named else ["they are flat"]
        return Rotors(
            joints=tuple(chosen), links=links, confidence=0.95 if named else 0.75, evidence=tuple(evidence)
        )
    fixed = [link for link in skeleton.links[BASE] if "rotor" in meanings(link)]
    if len(fixed) >= FEWEST and not skeleton.joint:
        text = f"{len(fixed)} links on fixed joints have names of rotors"
        return Rotors(joints=(), links=tuple(fixed), confidence=0.8, evidence=(text,))
    if not used and (said := _said_to_fly(skeleton)):
        return Rotors(
            joints=(), links=(), confidence=0.6, evidence=(f"no rotor is seen, but {said} says so",)
        )
    return None


def _said_to_fly(skeleton: Skeleton) -> str:
    """Return what names the base a flying robot; empty where nothing does."""
    if "flying" in meanings(skeleton.description.name):
        return f'the robot\'s name "{skeleton.description.name}"'
    for name in skeleton.links[BASE]:
        link = skeleton.description.link_by_name[name]
        shapes = (shape.geometry for shape in (*link.visuals, *link.collisions))
        texts = [name, *(shape.uri.rpartition("/")[2] for shape in shapes if isinstance(shape, Mesh))]
        found = next((text for text in texts if "flying" in meanings(text)), "")
        if found:
            return f'the name "{found}"'
    moved = [link for name in skeleton.joint for link in skeleton.links[name]]
    if skeleton.mass(BASE) > 0 and share("flying", moved) > MOST:
        return f'the name of most of its moving links, such as "{moved[0]}",'
    return ""


def _is_named(joint: str, link: str) -> bool:
    return "rotor" in meanings(joint) | meanings(link)


def _spins(skeleton: Skeleton, name: str) -> bool:
    joint = skeleton.joint[name]
    named = _is_named(name, joint.child)
    if skeleton.children[name] or len(skeleton.path(name)) > (3 if named else 1):
        return False
    return (is_endless(joint) or (named and joint.type == "revolute")) and (
        abs(skeleton.axis(name)[2]) > UPRIGHT or named
    )


def _is_flat(skeleton: Skeleton, name: str) -> bool:
    points = skeleton.points(name, visual=True)
    if len(points) < 4:
        return False
    extent = np.ptp(points, axis=0)
    return float(extent[2]) < FLAT * float(max(extent[0], extent[1]))


def _is_around(skeleton: Skeleton, names: list[str]) -> bool:
    """Return whether rotors stand on all sides of their middle, of equal size."""
    spots = np.array([skeleton.origin(name)[:2] for name in names])
    away = spots - spots.mean(axis=0)
    angles = np.sort(np.arctan2(away[:, 1], away[:, 0]))
    gaps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
    return float(np.linalg.norm(away, axis=1).min()) > 1e-3 and float(gaps.max()) < np.pi

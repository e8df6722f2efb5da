"""Robots with one feature each, of primitive shapes; their names are numbers unless more is needed."""

from __future__ import annotations

import math
from collections.abc import Sequence

from small_robots import joint, link, robot

from roboyard.description import RobotDescription

BODY = "box 0.6 0.4 0.1"


def wheel(
    name: str,
    parent: str,
    xyz: str,
    *,
    axis: str = "0 1 0",
    radius: float = 0.1,
    kind: str = "continuous",
    yaw: float = 0.0,
) -> str:
    """A wheel about its y axis, on a joint of its own; `yaw` turns its axle."""
    shape = (
        f'<link name="{name}"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" '
        f'ixz="0" iyz="0"/></inertial><collision><origin rpy="1.5707963267948966 0 0"/><geometry>'
        f'<cylinder radius="{radius}" length="0.05"/></geometry></collision></link>'
    )
    return shape + joint(f"j{name}", parent, name, kind=kind, xyz=xyz, rpy=f"0 0 {yaw}", axis=axis)


def base(height: float = 0.15) -> str:
    """A flat body, above wheels of radius 0.1 m whose axles are at height 0.1 m."""
    return link("b", BODY, 20, origin=f"0 0 {height}")


def swivel(name: str, parent: str, xyz: str, *, limits: tuple[float, float] | None = None) -> str:
    """A link on an upright joint, without limits by default."""
    kind = "continuous" if limits is None else "revolute"
    return link(name, "", 1) + joint(f"j{name}", parent, name, kind=kind, xyz=xyz, limits=limits)


def differential(axis: str = "0 1 0") -> RobotDescription:
    """Two wheels and a caster that trails behind its swivel."""
    return robot(
        base(),
        wheel("1", "b", "0 0.25 0.1", axis=axis),
        wheel("2", "b", "0 -0.25 0.1", axis=axis),
        swivel("3", "b", "-0.25 0 0.1"),
        wheel("4", "3", "-0.03 0 -0.05", radius=0.05),
    )


def suspended() -> RobotDescription:
    """Four wheels, each behind an upright slide."""
    parts = [base()]
    for k, (x, y) in enumerate(((0.2, 0.25), (0.2, -0.25), (-0.2, 0.25), (-0.2, -0.25))):
        place = f"{x} {y} 0.1"
        slide = joint(f"js{k}", "b", f"s{k}", kind="prismatic", xyz=place, limits=(-0.02, 0.02))
        parts += [link(f"s{k}", "", 1), slide, wheel(f"{k}", f"s{k}", "0 0 0")]
    return robot(*parts)


def four_wheels(rollers: int = 0) -> RobotDescription:
    """Four wheels with parallel axles, each with passive rollers on its rim."""
    parts = [base()]
    for k, (x, y) in enumerate(((0.2, 0.25), (0.2, -0.25), (-0.2, 0.25), (-0.2, -0.25))):
        parts.append(wheel(f"{k}", "b", f"{x} {y} 0.1", radius=0.08 if rollers else 0.1))
        for n in range(rollers):
            turn = 2 * math.pi * n / rollers
            place = f"{0.09 * math.cos(turn)} 0 {0.09 * math.sin(turn)}"
            parts.append(link(f"{k}_{n}", "sphere 0.02", 0.05))
            parts.append(
                joint(f"j{k}_{n}", f"{k}", f"{k}_{n}", kind="continuous", xyz=place, axis="0.7 0.7 0")
            )
    return robot(*parts)


def omni() -> RobotDescription:
    """Three wheels whose axles meet in the middle."""
    parts = [base()]
    for k in range(3):
        turn = 2 * math.pi * k / 3
        place = f"{0.25 * math.cos(turn)} {0.25 * math.sin(turn)} 0.1"
        parts.append(wheel(f"{k}", "b", place, yaw=turn - math.pi / 2))
    return robot(*parts)


def swerve() -> RobotDescription:
    """Four wheels, each below an upright motor."""
    parts = [base()]
    for k, (x, y) in enumerate(((0.2, 0.25), (0.2, -0.25), (-0.2, 0.25), (-0.2, -0.25))):
        parts += [swivel(f"s{k}", "b", f"{x} {y} 0.1", limits=(-2, 2)), wheel(f"{k}", f"s{k}", "0 0 0")]
    return robot(*parts)


def ackermann() -> RobotDescription:
    """A car: two steered wheels, which do not drive, in front of two driven ones."""
    return robot(
        base(),
        swivel("s0", "b", "0.25 0.25 0.1", limits=(-0.6, 0.6)),
        wheel("0", "s0", "0 0 0"),
        swivel("s1", "b", "0.25 -0.25 0.1", limits=(-0.6, 0.6)),
        wheel("1", "s1", "0 0 0"),
        wheel("2", "b", "-0.25 0.25 0.1"),
        wheel("3", "b", "-0.25 -0.25 0.1"),
    )


def chain(name: str, parent: str, start: str, axes: tuple[str, ...], step: str = "0 0 -0.2") -> list[str]:
    """A limb: one link of 0.2 m a joint, each a thin box along `step`."""
    x, y, z = (float(value) for value in step.split())
    size = " ".join(str(max(0.04, abs(value))) for value in (x, y, z))
    parts, above, place = [], parent, start
    for k, axis in enumerate(axes):
        child = f"{name}{k}"
        parts.append(link(child, f"box {size}", 1, origin=f"{x / 2} {y / 2} {z / 2}"))
        parts.append(joint(f"j{child}", above, child, xyz=place, axis=axis))
        above, place = child, step
    return parts


def lift_with_one_arm() -> RobotDescription:
    """A differential base, a lift, and an arm of five joints without a hand."""
    slide = joint("jl", "b", "l", kind="prismatic", xyz="0.1 0 0.3", limits=(0, 0.5))
    axes = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0")
    return robot(
        base(),
        wheel("1", "b", "0 0.25 0.1"),
        wheel("2", "b", "0 -0.25 0.1"),
        link("l", "box 0.1 0.1 0.1", 2),
        slide,
        *chain("a", "l", "0.1 0 0", axes, "0.2 0 0"),
    )


HIPS = {"p": (0.25, 0.15), "q": (0.25, -0.15), "r": (-0.25, 0.15), "s": (-0.25, -0.15)}
"""Beginning of a limb's names to x and y of its hip."""


def legs(hips: dict[str, tuple[float, float]], joints: int = 3, *, y_is_up: bool = False) -> RobotDescription:
    """A body on legs of equal links; hip, then knees."""
    axes = ("1 0 0", *["0 1 0"] * (joints - 1))
    step = "0 -0.2 0" if y_is_up else "0 0 -0.2"
    if y_is_up:
        axes = ("1 0 0", *["0 0 1"] * (joints - 1))
    places = {name: f"{x} 0 {-y}" if y_is_up else f"{x} {y} 0" for name, (x, y) in hips.items()}
    body = link("b", "box 0.6 0.1 0.3" if y_is_up else "box 0.6 0.3 0.1", 10)
    return robot(
        body, *[part for name, place in places.items() for part in chain(name, "b", place, axes, step)]
    )


def wheels_on_legs() -> RobotDescription:
    """Four legs of three joints, each with a wheel at its end."""
    parts = [link("b", "box 0.6 0.3 0.1", 10)]
    for name, (x, y) in HIPS.items():
        parts += chain(name, "b", f"{x} {y} 0", ("1 0 0", "0 1 0", "0 1 0"))
        parts.append(wheel(f"w{name}", f"{name}2", "0 0 -0.2"))
    return robot(*parts)


def two_arms_without_hands() -> RobotDescription:
    """A column on the floor with two mirrored arms of six joints, and a pan and a tilt on top."""
    axes = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
    return robot(
        link("b", "box 0.3 0.3 1.2", 50, origin="0 0 0.6"),
        *chain("x", "b", "0 0.2 1", axes, "0.15 0 0"),
        *chain("y", "b", "0 -0.2 1", axes, "0.15 0 0"),
        *chain("h", "b", "0 0 1.25", ("0 0 1", "0 1 0"), "0.05 0 0.05"),
    )


def pan_tilt_between_arms() -> RobotDescription:
    """A column with two arms with two fingers each, and a pan and a tilt far below its top."""
    axes = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
    parts = [link("b", "box 0.3 0.3 1.6", 50, origin="0 0 0.8")]
    for name, y in (("x", 0.2), ("y", -0.2)):
        parts += chain(name, "b", f"0 {y} 1", axes, "0.15 0 0")
        for k, across in enumerate((1, -1)):
            finger = f"{name}f{k}"
            parts.append(link(finger, "box 0.06 0.01 0.02", 0.05, origin="0.03 0 0"))
            place = f"0.15 {0.02 * across} 0"
            slide = joint(
                f"j{finger}",
                f"{name}5",
                finger,
                kind="prismatic",
                xyz=place,
                axis=f"0 {across} 0",
                limits=(0, 0.04),
            )
            parts.append(slide)
    parts += [link("p", "box 0.05 0.05 0.05", 0.3), link("t", "box 0.08 0.1 0.04", 0.3)]
    parts += [joint("jp", "b", "p", xyz="0.2 0 1.1"), joint("jt", "p", "t", xyz="0 0 0.05", axis="0 1 0")]
    return robot(*parts)


def drone() -> RobotDescription:
    """A body with four flat rotors."""
    parts = [link("b", "box 0.2 0.2 0.05", 1)]
    for k, (x, y) in enumerate(((0.2, 0.2), (0.2, -0.2), (-0.2, 0.2), (-0.2, -0.2))):
        parts.append(link(f"{k}", "cylinder 0.1 0.01", 0.01))
        parts.append(joint(f"j{k}", "b", f"{k}", kind="continuous", xyz=f"{x} {y} 0.05"))
    return robot(*parts)


def table() -> RobotDescription:
    """Four legs on fixed joints."""
    parts = [link("top", "box 1 1 0.05", 10, origin="0 0 0.7")]
    for k, (x, y) in enumerate(((0.4, 0.4), (0.4, -0.4), (-0.4, 0.4), (-0.4, -0.4))):
        fixed = joint(f"j{k}", "top", f"leg{k}", kind="fixed", xyz=f"{x} {y} 0.35")
        parts += [link(f"leg{k}", "box 0.05 0.05 0.7", 1), fixed]
    return robot(*parts)


def pendulum() -> RobotDescription:
    """A cart on a rail with a pole that swings freely."""
    return robot(
        link("rail", "box 4 0.05 0.05"),
        link("cart", "box 0.3 0.2 0.1", 1),
        joint("slide", "rail", "cart", kind="prismatic", axis="1 0 0", limits=(-2, 2)),
        link("pole", "box 0.03 0.03 1", 0.1, origin="0 0 0.5"),
        joint("swing", "cart", "pole", kind="continuous", axis="0 1 0"),
    )


def hand_on_a_wrist() -> RobotDescription:
    """Two joints of a wrist, a palm and four fingers of three joints."""
    return robot(link("b", "box 0.05 0.05 0.1", 0.5), *_hand("b", "0 0 0.06", "cdef"))


def two_hands_on_wrists() -> RobotDescription:
    """Two such hands half a metre apart on one root, which has no shape."""
    sides = ((0.25, "cdef"), (-0.25, "ghij"))
    return robot(link("b", ""), *(part for y, names in sides for part in _hand("b", f"0 {y} 0.06", names)))


def hand_on_a_forearm(*names: str) -> RobotDescription:
    """A forearm of half a metre with such a hand, whose fingers have these names."""
    return robot(link("b", "box 0.06 0.06 0.5", 2, origin="0 0 -0.25"), *_hand("b", "0 0 0.06", names))


def _hand(parent: str, place: str, names: Sequence[str]) -> list[str]:
    wrist, palm = f"w{names[0]}", f"p{names[0]}"
    parts = [link(wrist, "", 0.1), link(palm, "box 0.09 0.03 0.08", 0.3)]
    parts += [joint(f"j{wrist}", parent, wrist, xyz=place, axis="0 1 0"), joint(f"j{palm}", wrist, palm)]
    for k, name in enumerate(names):
        finger = chain(name, palm, f"{0.02 * k - 0.03} 0 0.04", ("1 0 0",) * 3, "0 0 0.03")
        parts += [part.replace('"0.04', '"0.01') for part in finger]
    return parts

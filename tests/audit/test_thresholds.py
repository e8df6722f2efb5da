"""Checks with a threshold: a value just inside it has no finding, one just outside it has."""

import math
from pathlib import Path

import pytest
from audit_cases import (
    CUBE,
    INERTIAL,
    arm,
    both,
    collision,
    coloured,
    inertial,
    joint,
    link,
    mesh,
    mimic,
    robot,
    stl,
    two_joints,
    visual,
)

from roboyard.audit import audit_urdf


def codes(text: str, folder: Path) -> tuple[str, ...]:
    file = folder / "arm.urdf"
    file.write_text(text)
    return audit_urdf(file).codes


def limit(lower: float = -1, upper: float = 1, effort: float = 10, velocity: float = 2) -> str:
    return f'<limit lower="{lower!r}" upper="{upper!r}" effort="{effort!r}" velocity="{velocity!r}"/>'


def limited(lower: float, upper: float) -> str:
    return arm(limit=limit(lower, upper))


def axis(x: float, y: float, z: float) -> str:
    return arm(axis=f'<axis xyz="{x!r} {y!r} {z!r}"/>')


def placed(x: float, y: float, z: float) -> str:
    return arm(origin=f'<origin xyz="{x} {y} {z}"/>')


def turned(angle: float) -> str:
    return arm(origin=f'<origin xyz="0 0 0.2" rpy="0 {angle!r} 0"/>')


def with_mass(mass: float, moment: float = 0.01) -> str:
    return arm(tip=inertial(repr(mass), (moment, 0, 0, moment, 0, moment)) + both())


def moments(x: float, y: float, z: float) -> str:
    return arm(tip=inertial("1", (x, 0, 0, y, 0, z)) + both())


def centred(x: float, y: float = 0.0, z: float = 0.0) -> str:
    origin = f'<origin xyz="{x} {y} {z}"/>'
    return arm(tip=inertial("1", (0.01, 0, 0, 0.01, 0, 0.01), origin) + both())


def masses(base: float, tip: float) -> str:
    return robot(link("base", inertial(base) + both()), link("tip", inertial(tip) + both()), joint())


def following(multiplier: float, offset: float = 0.0, kind: str = "revolute") -> str:
    follow = f'<mimic joint="j" multiplier="{multiplier!r}" offset="{offset!r}"/>'
    wide = limit(-1e3, 1e3) if abs(multiplier) > 2 else limit()
    return two_joints(second=follow, second_limit=wide, second_kind=kind)


def shaped(geometry: str) -> str:
    return arm(tip=INERTIAL + visual(geometry) + collision(geometry))


HALF_DIAGONAL = 0.05 * math.sqrt(3)
"""Of the cube of 0.1 m that every link is (m)."""
GYRATION = 4 * HALF_DIAGONAL + 0.02
FACE = 0.05 + HALF_DIAGONAL + 0.02
TURN = 2 * math.pi + 0.01

THRESHOLDS = {
    "an axis 0.1 % too long": ("axis-not-unit", axis(0, 0, 1.0009), axis(0, 0, 1.0011)),
    "an axis 0.1 % too short": ("axis-not-unit", axis(0.9991, 0, 0), axis(0.9989, 0, 0)),
    "an axis of no length": ("axis-zero", axis(0, 0, 1e-11), axis(0, 0, 1e-13)),
    "a range of nothing": ("limit-no-range", limited(0.5, 0.5000001), limited(0.5, 0.5)),
    "a range upside down": ("limit-reversed", limited(1, 1), limited(1, 0.999)),
    "an upper bound of 1000": ("limit-endless", limited(-1, 1000), limited(-1, 1000.01)),
    "a lower bound of -1000": ("limit-endless", limited(-1000, 1), limited(-1000.01, 1)),
    "a lower bound above zero": ("limit-excludes-zero", limited(1e-9, 1), limited(2e-9, 1)),
    "an upper bound below zero": ("limit-excludes-zero", limited(-1, -1e-9), limited(-1, -2e-9)),
    "no effort": ("limit-effort-zero", arm(limit=limit(effort=1e-300)), arm(limit=limit(effort=-0.0))),
    "no speed": ("limit-velocity-zero", arm(limit=limit(velocity=1e-300)), arm(limit=limit(velocity=0.0))),
    "a negative effort": ("limit-negative", arm(limit=limit(effort=0.0)), arm(limit=limit(effort=-1e-300))),
    "a negative speed": ("limit-negative", arm(limit=limit(velocity=0.0)), arm(limit=limit(velocity=-0.1))),
    "degrees over two turns": ("limit-degrees", limited(-12, 12), limited(-12, 13)),
    "degrees up to two full turns": ("limit-degrees", limited(-721, 721), limited(-720, 720)),
    "whole degrees": ("limit-degrees", limited(-90, 90.5), limited(-90, 90)),
    "an angle of over a turn": ("origin-degrees", turned(TURN - 1e-4), turned(TURN + 1e-4)),
    "a negative angle of over a turn": ("origin-degrees", turned(1e-4 - TURN), turned(-TURN - 1e-4)),
    "20 m along an axis": ("origin-far", placed(0, 0, -20), placed(0, 0, -20.01)),
    "20 m across": ("origin-far", placed(12, 16, 0), placed(12, 16, 0.7)),
    "denser than osmium": ("mass-density", with_mass(24.9, 0.1), with_mass(25.1, 0.1)),
    "lighter than air": ("mass-density", with_mass(0.00051, 1e-6), with_mass(0.00049, 1e-6)),
    "a heavy neighbour": ("mass-neighbours", masses(0.01, 5.0), masses(0.01, 5.01)),
    "a robot of 20 t": ("mass-total", masses(10_000, 10_000), masses(10_000, 10_000.5)),
    "a robot of 1 g": ("mass-total", masses(0.0005, 0.0005), masses(0.0005, 0.00049)),
    "moments of a flat body": ("inertia-triangle", moments(0.01, 0.01, 0.02), moments(0.01, 0.01, 0.02003)),
    "moments rounded by 0.1 %": (
        "inertia-triangle",
        moments(0.01, 0.01, 0.02 / 0.99901),
        moments(0.01, 0.01, 0.02 / 0.99899),
    ),
    "a moment of zero": ("inertia-not-positive", moments(1e-9, 0.01, 0.01), moments(0, 0.01, 0.01)),
    "inertia too large": (
        "inertia-out-of-scale",
        moments(*[0.999 * GYRATION**2] * 3),
        moments(*[1.001 * GYRATION**2] * 3),
    ),
    "inertia too small": (
        "inertia-out-of-scale",
        moments(*[1.001 * (HALF_DIAGONAL / 100) ** 2] * 3),
        moments(*[0.999 * (HALF_DIAGONAL / 100) ** 2] * 3),
    ),
    "a centre of mass aside": ("center-of-mass-far", centred(FACE - 1e-4), centred(FACE + 1e-4)),
    "a centre of mass off a corner": (
        "center-of-mass-far",
        centred(*[0.05 + (FACE - 0.05 - 1e-4) / math.sqrt(3)] * 3),
        centred(*[0.05 + (FACE - 0.05 + 1e-4) / math.sqrt(3)] * 3),
    ),
    "a large multiplier": ("mimic-multiplier", following(100), following(100.1)),
    "a large negative multiplier": ("mimic-multiplier", following(-100), following(-100.1)),
    "a small multiplier": ("mimic-multiplier", following(0.01), following(0.0099)),
    "a small multiplier between turns and slides": (
        "mimic-multiplier",
        following(0.001, kind="prismatic"),
        following(0.0, kind="prismatic"),
    ),
    "a follower beyond its limits": ("mimic-range", following(1.019), following(1.021)),
    "a follower that turns the other way": ("mimic-range", following(-1.019), following(-1.021)),
    "a follower moved aside": ("mimic-range", following(0.5, 0.519), following(0.5, -0.521)),
    "a colour above one": ("color-range", coloured("1.0000009 0 0 1"), coloured("1.000002 0 0 1")),
    "a colour below zero": ("color-range", coloured("0 0 0 1"), coloured("0 -1e-9 0 1")),
    "an alpha of zero": ("color-invisible", coloured("1 1 1 1e-9"), coloured("1 1 1 0")),
    "a flat box": ("geometry-size-zero", shaped('<box size="1 1e-9 1"/>'), shaped('<box size="1 9e-10 1"/>')),
    "a capsule without a radius": (
        "geometry-size-zero",
        shaped('<capsule radius="0.1" length="0"/>'),
        shaped('<capsule radius="0" length="0.1"/>'),
    ),
    "a negative radius": (
        "geometry-size-negative",
        shaped('<sphere radius="0"/>'),
        shaped('<sphere radius="-1e-12"/>'),
    ),
    "a primitive of 20 m": (
        "geometry-size-implausible",
        shaped('<sphere radius="20"/>'),
        shaped('<sphere radius="20.1"/>'),
    ),
    "damping below zero": (
        "dynamics-negative",
        arm(more="", limit=limit() + '<dynamics damping="0" friction="0"/>'),
        arm(more="", limit=limit() + '<dynamics damping="0" friction="-1e-9"/>'),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", THRESHOLDS)
def test_a_finding_begins_at_its_threshold(name: str, tmp_path: Path) -> None:
    code, inside, outside = THRESHOLDS[name]
    assert code not in codes(inside, tmp_path)
    assert code in codes(outside, tmp_path)


def cube_arm(size: float, folder: Path, reach: float = 0.2, scale: str = "") -> tuple[str, ...]:
    (folder / "part.stl").write_bytes(stl(size * CUBE))
    origin = f'<origin xyz="0 0 {reach}"/>'
    return codes(arm(tip=INERTIAL + both(mesh("part.stl", scale)), origin=origin), folder)


MESHES = [
    (4.99, 0.2, None),
    (5.01, 0.2, "mesh-units"),
    (5.9, 0.3, None),
    (6.1, 0.3, "mesh-units"),
    (9_990.0, 0.2, "mesh-units"),
    (10_010.0, 0.2, "mesh-huge"),
    (1.01e-3, 0.3, None),
    (0.99e-3, 0.3, "mesh-tiny"),
    (0.6e-3, 0.1, None),
    (0.4e-3, 0.1, "mesh-tiny"),
]


@pytest.mark.parametrize(("size", "reach", "code"), MESHES)
def test_meshes_of_a_wrong_unit_are_known_by_their_size_and_the_reach(
    size: float, reach: float, code: str | None, tmp_path: Path
) -> None:
    found = set(cube_arm(size, tmp_path, reach)) & {"mesh-units", "mesh-huge", "mesh-tiny"}
    assert found == (set() if code is None else {code})


def test_the_size_of_a_mesh_is_that_after_its_scale(tmp_path: Path) -> None:
    assert "mesh-units" in cube_arm(0.1, tmp_path, scale="0.1 60 0.1")
    assert "mesh-units" not in cube_arm(60.0, tmp_path, scale="0.001 -0.001 0.001")


@pytest.mark.parametrize(
    ("ratio", "unit"),
    [
        (1000.0, "millimetres"),
        (1090.0, "millimetres"),
        (910.0, "millimetres"),
        (1110.0, None),
        (890.0, None),
        (100.0, "centimetres"),
        (39.3701, "inches"),
        (25.4, "inches in millimetres"),
        (50.0, None),
        (2.0, None),
    ],
)
def test_shapes_of_one_link_in_two_units_are_known_by_their_ratio(
    ratio: float, unit: str | None, tmp_path: Path
) -> None:
    (tmp_path / "part.stl").write_bytes(stl(0.1 * CUBE))
    large = collision(mesh("part.stl", f"{ratio} {ratio} {ratio}"))
    (tmp_path / "arm.urdf").write_text(arm(tip=INERTIAL + visual(mesh("part.stl")) + large))
    found = audit_urdf(tmp_path / "arm.urdf").of("mesh-units-differ")
    assert [finding.message.partition("ones ")[2] for finding in found] == (
        [] if unit is None else [f"({unit})"]
    )
    assert all(finding.fixable == (unit == "millimetres") for finding in found)


def test_a_long_part_beside_a_round_one_is_no_other_unit(tmp_path: Path) -> None:
    """The ratio must hold along every axis."""
    (tmp_path / "part.stl").write_bytes(stl(0.1 * CUBE))
    long = collision(mesh("part.stl", "1000 1 1"))
    assert "mesh-units-differ" not in codes(arm(tip=INERTIAL + visual(mesh("part.stl")) + long), tmp_path)


def test_a_placeholder_inertial_counts_from_three_links_of_different_size(tmp_path: Path) -> None:
    def sized(*sizes: float) -> str:
        links = [
            link(f"l{i}", INERTIAL + both(f'<box size="{size} 0.1 0.1"/>')) for i, size in enumerate(sizes)
        ]
        joints = [joint(f"j{i}", f"l{i}", f"l{i + 1}") for i in range(len(sizes) - 1)]
        return robot(*links, *joints)

    assert "inertial-copied" not in codes(sized(0.1, 0.3), tmp_path)
    assert "inertial-copied" not in codes(sized(0.1, 0.1, 0.11), tmp_path)
    assert "inertial-copied" in codes(sized(0.1, 0.1, 0.12), tmp_path)


def test_a_chain_of_mimics_is_one_finding_for_each_joint_but_the_first(tmp_path: Path) -> None:
    names = "abcd"
    links = [link(f"l{i}") for i in range(5)]
    joints = [
        joint(name, f"l{i}", f"l{i + 1}", more="" if i == 0 else mimic(names[i - 1]))
        for i, name in enumerate(names)
    ]
    (tmp_path / "arm.urdf").write_text(robot(*links, *joints))
    found = audit_urdf(tmp_path / "arm.urdf").of("mimic-chain")
    assert [finding.element for finding in found] == ['joint "c"', 'joint "d"']

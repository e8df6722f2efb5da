"""Colours of materials that share a name, as real PyBullet 3.2.7 gives them."""

from __future__ import annotations

from pathlib import Path

import pytest

import roboyard.pybullet as p

RED, GREEN, BLUE, WHITE = "1 0 0 1", "0 1 0 1", "0 0 1 1", "1 1 1 1"


def colored(name: str, rgba: str) -> str:
    return f'<material name="{name}"><color rgba="{rgba}"/></material>'


def named(name: str) -> str:
    return f'<material name="{name}"/>'


@pytest.mark.parametrize(
    ("of_robot", "of_links", "seen"),
    [
        ("", [colored("", RED), colored("", GREEN), colored("", BLUE)], [BLUE, BLUE, BLUE]),
        ("", [colored("m", RED), named("m"), colored("n", BLUE)], [RED, RED, BLUE]),
        (colored("m", GREEN), [colored("m", RED), named("m"), named("x"), ""], [RED, RED, WHITE, WHITE]),
        (colored("m", GREEN), [named("m"), colored("n", BLUE)], [GREEN, BLUE]),
        ("", [named("m"), colored("m", RED)], [RED, RED]),
        ("", ["", colored("", RED), "", named(""), colored("m", BLUE)], [RED, RED, RED, RED, BLUE]),
        (colored("", BLUE), ["", named(""), colored("m", RED)], [BLUE, BLUE, RED]),
    ],
)
def test_a_name_has_one_colour(
    client: int, tmp_path: Path, of_robot: str, of_links: list[str], seen: list[str]
) -> None:
    parts = [
        f'<link name="l{i}"><visual><geometry><box size="1 1 1"/></geometry>{material}</visual></link>'
        for i, material in enumerate(of_links)
    ]
    parts += [
        f'<joint name="j{i}" type="fixed"><parent link="l0"/><child link="l{i}"/></joint>'
        for i in range(1, len(of_links))
    ]
    (tmp_path / "robot.urdf").write_text(f'<robot name="r">{of_robot}{"".join(parts)}</robot>')
    robot = p.loadURDF(str(tmp_path / "robot.urdf"))
    found = [row[7] for row in p.getVisualShapeData(robot)]
    assert found == [tuple(map(float, rgba.split())) for rgba in seen]

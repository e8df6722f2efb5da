"""Three small robots: one that drives, one that is bolted down, one that walks."""

from __future__ import annotations

from pathlib import Path

import pytest

from roboyard.description import RobotDescription, load_description


def _link(name: str, mass: float, shape: str, origin: str = "0 0 0") -> str:
    moment = 0.01 * mass
    body = f'<origin xyz="{origin}"/><geometry>{shape}</geometry>'
    return (
        f'<link name="{name}"><inertial><origin xyz="{origin}"/><mass value="{mass}"/>'
        f'<inertia ixx="{moment}" ixy="0" ixz="0" iyy="{moment}" iyz="0" izz="{moment}"/></inertial>'
        f"<visual>{body}</visual><collision>{body}</collision></link>"
    )


def _joint(name: str, kind: str, parent: str, child: str, xyz: str, axis: str, more: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>{more}</joint>'
    )


LIMIT = '<limit lower="{0}" upper="{1}" effort="50" velocity="2"/>'


def cart_urdf() -> str:
    """A box on four wheels that rolls along x, with a mast that can lean out too far and a mimicking flag."""
    parts = [_link("base", 10.0, '<box size="0.6 0.4 0.1"/>')]
    for name, x, y in (("fl", 0.2, 0.25), ("fr", 0.2, -0.25), ("bl", -0.2, 0.25), ("br", -0.2, -0.25)):
        parts.append(_link(f"wheel_{name}", 0.5, '<sphere radius="0.1"/>'))
        parts.append(_joint(f"roll_{name}", "continuous", "base", f"wheel_{name}", f"{x} {y} -0.05", "0 1 0"))
    parts.append(_link("mast", 8.0, '<box size="0.05 0.05 1.0"/>', "0 0 0.5"))
    parts.append(_joint("lean", "revolute", "base", "mast", "0 0 0.05", "0 1 0", LIMIT.format(-1.5, 1.5)))
    parts.append(_link("flag", 0.1, '<box size="0.1 0.01 0.1"/>'))
    mimic = '<mimic joint="lean" multiplier="-2" offset="0.1"/>'
    parts.append(_joint("wave", "revolute", "mast", "flag", "0 0 1", "0 0 1", LIMIT.format(-4, 4) + mimic))
    return f'<robot name="cart">{"".join(parts)}</robot>'


def arm_urdf() -> str:
    """Two links on a small foot, one joint whose range does not hold zero, and a slide."""
    parts = [
        _link("foot", 2.0, '<cylinder radius="0.05" length="0.1"/>', "0 0 0.05"),
        _link("upper", 1.0, '<box size="0.05 0.05 0.4"/>', "0 0 0.2"),
        _link("lower", 1.0, '<box size="0.05 0.05 0.4"/>', "0 0 0.2"),
        _link("finger", 0.1, '<box size="0.02 0.02 0.1"/>', "0 0 0.05"),
        _joint("shoulder", "revolute", "foot", "upper", "0 0 0.1", "0 1 0", LIMIT.format(-2.5, 2.5)),
        _joint("elbow", "revolute", "upper", "lower", "0 0 0.4", "0 1 0", LIMIT.format(0.5, 1.5)),
        _joint("grip", "prismatic", "lower", "finger", "0 0 0.4", "0 0 1", LIMIT.format(0, 0.05)),
    ]
    return f'<robot name="arm">{"".join(parts)}</robot>'


def walker_urdf() -> str:
    """A body on four legs of one joint each."""
    parts = [_link("body", 5.0, '<box size="0.5 0.3 0.1"/>')]
    for name, x, y in (("fl", 0.2, 0.12), ("fr", 0.2, -0.12), ("bl", -0.2, 0.12), ("br", -0.2, -0.12)):
        parts.append(_link(f"leg_{name}", 0.3, '<box size="0.04 0.04 0.3"/>', "0 0 -0.15"))
        parts.append(
            _joint(
                f"hip_{name}", "revolute", "body", f"leg_{name}", f"{x} {y} 0", "0 1 0", LIMIT.format(-1, 1)
            )
        )
    return f'<robot name="walker">{"".join(parts)}</robot>'


@pytest.fixture
def cart() -> RobotDescription:
    return load_description(cart_urdf())


@pytest.fixture
def arm() -> RobotDescription:
    return load_description(arm_urdf())


@pytest.fixture
def walker() -> RobotDescription:
    return load_description(walker_urdf())


@pytest.fixture
def arm_file(tmp_path: Path) -> Path:
    file = tmp_path / "arm.urdf"
    file.write_text(arm_urdf(), encoding="utf-8")
    return file

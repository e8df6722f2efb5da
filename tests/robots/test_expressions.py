"""Numbers with pi."""

from __future__ import annotations

import math

import pytest

from roboyard.robots.definition.expressions import read_number


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("pi/8", math.pi / 8),
        ("-pi/2", -math.pi / 2),
        ("0.5*pi", math.pi / 2),
        ("(pi - 1) / 2", (math.pi - 1) / 2),
        (" 3 ", 3.0),
        ("+1e-3", 1e-3),
        (2, 2.0),
        (0.25, 0.25),
    ],
)
def test_arithmetic(text: object, value: float) -> None:
    assert read_number(text) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        "2**3",
        "__import__('os')",
        "pi.real",
        "e",
        "1,2",
        "",
        "pi pi",
        "1/0",
        "'a'",
        "9" * 101,
        "1e999",
        "True",
        "(" * 90,
    ],
)
def test_anything_else_is_refused_and_never_executed(text: str) -> None:
    with pytest.raises(ValueError, match=r"."):
        read_number(text)


@pytest.mark.parametrize("value", [True, None, [1], math.nan, math.inf])
def test_other_values_are_refused(value: object) -> None:
    with pytest.raises(ValueError, match="must be"):
        read_number(value)

"""Names that formats allow."""

from __future__ import annotations

import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboyard.export.names import free_name, identifier, identifiers, is_identifier


@pytest.mark.parametrize(
    ("name", "expected"),
    [("arm_1", "arm_1"), ("arm.1", "arm_1"), ("1", "_1"), ("Élan", "Elan"), ("", "link"), ("--", "link__")],
)
def test_nearest_identifier(name: str, expected: str) -> None:
    assert identifier(name, "link") == expected


def test_allowed_names_keep_theirs_whatever_comes_before() -> None:
    assert identifiers(["arm.1", "arm-1", "arm_1"]) == {
        "arm.1": "arm_1_2",
        "arm-1": "arm_1_3",
        "arm_1": "arm_1",
    }


def test_taken_names_are_given_to_nobody() -> None:
    assert identifiers(["Looks", "base"], taken=["Looks"]) == {"Looks": "Looks_2", "base": "base"}


def test_free_name_counts_up() -> None:
    assert free_name("a", {"a", "a_2"}) == "a_3"


@given(st.lists(st.text(string.printable + "äß漢\u0301", max_size=6), unique=True, max_size=12))
def test_identifiers_are_distinct_and_allowed(names: list[str]) -> None:
    found = identifiers(names, taken=["visuals"])
    assert list(found) == names
    assert len(set(found.values())) == len(names)
    assert all(is_identifier(name) and name != "visuals" for name in found.values())

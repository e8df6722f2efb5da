"""YAML for people."""

from __future__ import annotations

import pytest
import yaml

from roboyard.config.yaml_text import Column, annotate, dump, number


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.1, "0.1"),
        (0.0612345678, "0.0612346"),
        (15.0, "15.0"),
        (-0.0, "0.0"),
        (1e-7, "1.0e-07"),
        (2e20, "2.0e+20"),
    ],
)
def test_numbers_are_short_and_stay_numbers(value: float, text: str) -> None:
    assert number(value) == text
    read = yaml.safe_load(text)
    assert isinstance(read, float)
    assert read == pytest.approx(value, rel=1e-5)


def test_any_name_survives() -> None:
    names = {"0": "no", "on": "1e3", "a: b": "Ä - ", "": "~", "x#y": "null"}
    text = dump({"names": names})
    assert yaml.safe_load(text) == {"names": names}
    assert text.isascii()


def test_vectors_stand_in_a_row_and_repeat_without_aliases() -> None:
    vector = [1.0, 2.5]
    text = dump({"a": vector, "b": vector})
    assert text == "a: [1.0, 2.5]\nb: [1.0, 2.5]\n"


def test_notes_stand_beside_the_numbers_of_a_column() -> None:
    text = annotate(dump({"q": Column([1.0, -0.25]), "z": 1}), "q", ["elbow", "wrist"])
    assert text == "q:\n- 1.0    # elbow\n- -0.25  # wrist\nz: 1\n"


def test_notes_that_do_not_fit_are_left_out() -> None:
    text = dump({"q": Column([1.0])})
    assert annotate(text, "q", ["a", "b"]) == text

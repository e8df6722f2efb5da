"""Parts of a robot that names mean, in several languages and spellings."""

from __future__ import annotations

import pytest

from roboyard.morphology.words import count, meanings, share, side, tokens


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("LFoot_2Joint", ("l", "foot", "joint")),
        ("leftHipPitch", ("left", "hip", "pitch")),
        ("front-left.wheel", ("front", "left", "wheel")),
        ("Épaule_gauche", ("epaule", "gauche")),
        ("12", ()),
    ],
)
def test_words_of_a_name(name: str, words: tuple[str, ...]) -> None:
    assert tokens(name) == words


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("lefthippitch", {"left", "leg"}),
        ("FL_HAA", {"front", "left", "leg"}),
        ("Rad_links", {"wheel", "left"}),
        ("roue_avant_droite", {"wheel", "front", "right"}),
        ("fr_caster_rotation_joint", {"front", "right", "caster"}),
        ("mecanum_wheel", {"mecanum", "wheel"}),
        ("joint_7", set()),
    ],
)
def test_parts_that_a_name_means(name: str, parts: set[str]) -> None:
    assert meanings(name) >= parts
    if not parts:
        assert not meanings(name)


def test_counts_shares_and_sides() -> None:
    names = ["l_hip", "l_knee", "l_ankle_roll", "sensor"]
    assert (count("leg", names), share("leg", names), share("leg", [])) == (3, 0.75, 0.0)
    assert side(names) == "left"
    assert side(["LARM_SHOULDER_R", "LARM_ELBOW", "LARM_WRIST_Y"]) == "left"
    assert side(["a", "b"]) is None

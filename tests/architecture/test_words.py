"""The field's own words in everything that a person reads."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import words


@pytest.mark.slow
def test_the_words_are_those_of_the_field() -> None:
    left = [str(word) for path in words.files() for word in words.words_of(path)]
    assert not left, "\n".join([f"{len(left)} words left", *left[:200]])


def test_words_are_found_in_names_prose_and_messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "sample.py"
    file.write_text(
        '''"""What waits is not seen."""
def told_once(things): raise ValueError(f"{things} is mended")
def look_at(hand): return hand  # a camera
'''
    )
    monkeypatch.setattr(words, "ROOT", tmp_path)
    found = {word.word for word in words.words_of(file)}  # an f-string's names count twice before Python 3.12
    assert found == {"What waits", "told", "things", "mended"}

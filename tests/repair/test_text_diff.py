"""The diff of a repair: what `patch` makes of it, and how it grows with the length of the texts."""

import random
import shutil
import subprocess
from difflib import unified_diff as of_difflib
from pathlib import Path

import pytest

from roboyard.repair.text_diff import unified_diff


def applied(before: str, diff: str) -> str:
    """The old text with the hunks applied: a reader of the format of its own."""
    was, made, at = before.splitlines(), [], 0
    for line in diff.splitlines()[2:]:
        if line.startswith("@@"):
            first, count = (*line.split()[1][1:].split(","), "1")[:2]
            start = int(first) - (count != "0")
            made += was[at:start]
            at = start
        elif line[0] in " -":
            assert was[at] == line[1:]
            at += 1
            made += [line[1:]] if line[0] == " " else []
        else:
            made.append(line[1:])
    return "\n".join(made + was[at:])


def changed(lines: list[str], draw: random.Random) -> list[str]:
    made = []
    for line in lines:
        kind = draw.random()
        if kind < 0.1:
            continue
        made.append(f"{line}'" if kind < 0.2 else line)
        if kind > 0.9:
            made.append(draw.choice(lines))
    return made


@pytest.mark.parametrize("kinds", [2, 5, 1000])
@pytest.mark.parametrize("count", [1, 7, 60, 400])
def test_a_diff_turns_one_text_into_the_other(kinds: int, count: int) -> None:
    draw = random.Random(7 * count + kinds)
    for _ in range(20):
        lines = [f"<link {draw.randrange(kinds)}>" for _ in range(count)]
        before, after = "\n".join(lines), "\n".join(changed(lines, draw))
        diff = unified_diff(before, after, "a", "b")
        assert applied(before, diff) == after
        assert bool(diff) == (before != after)


def test_a_few_changes_read_as_those_of_difflib() -> None:
    was = [f"line {k}" for k in range(100)]
    now = [*was[:10], "new", *was[11:50], *was[52:90], "more", "and more", *was[90:]]
    diff = unified_diff("\n".join(was), "\n".join(now), "old.urdf", "new.urdf")
    expected = of_difflib(was, now, "old.urdf", "new.urdf", lineterm="", n=2)
    assert diff.splitlines() == list(expected)


@pytest.mark.parametrize(("before", "after"), [("", "a\nb"), ("a\nb", ""), ("a", "a"), ("", "")])
def test_empty_texts(before: str, after: str) -> None:
    diff = unified_diff(before, after, "a", "b")
    expected = of_difflib(before.splitlines(), after.splitlines(), "a", "b", lineterm="", n=2)
    assert diff.splitlines() == list(expected)


@pytest.mark.skipif(shutil.which("patch") is None, reason="patch is not installed")
def test_patch_applies_it(tmp_path: Path) -> None:
    draw = random.Random(3)
    lines = [f"<joint {k}>" if k % 3 else "</joint>" for k in range(300)]
    before, after = "\n".join(lines) + "\n", "\n".join(changed(lines, draw)) + "\n"
    file = tmp_path / "arm.urdf"
    file.write_text(before)
    diff = unified_diff(before, after, "arm.urdf", "arm.urdf")
    subprocess.run(["patch", "-s", str(file)], input=diff, text=True, check=True)
    assert file.read_text() == after


def test_every_other_line_of_many_has_changed() -> None:
    """100,000 lines: difflib alone would take hours."""
    was = [f"<joint {k}>" if k % 2 else f"<mimic {k}>" for k in range(100_000)]
    now = [line if k % 2 else f"{line} changed" for k, line in enumerate(was)]
    diff = unified_diff("\n".join(was), "\n".join(now), "a", "b")
    assert sum(line.startswith("+<mimic") for line in diff.splitlines()) == 50_000
    assert not any(line.startswith("+<joint") for line in diff.splitlines())

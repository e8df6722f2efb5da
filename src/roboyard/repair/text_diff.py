"""The differences of two texts, in time that grows with their length.

`difflib.unified_diff` takes seconds for a few thousand lines of which every other one has changed: it looks
for the longest match again between each two matches. Here the lines that occur once in both texts are matched
first (Bram Cohen's patience diff), and difflib only looks at the few lines between them.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Iterator, Sequence
from difflib import SequenceMatcher
from itertools import pairwise
from typing import Literal

CONTEXT = 2
"""Unchanged lines shown before and after a change."""
MOST_PAIRS = 10_000
"""Pairs of lines that difflib compares at once; a longer part without a line of its own is replaced whole."""
MOST_LEVELS = 8

Span = tuple[int, int, int, int]
"""Lines [first, last) of the old text, and [first, last) of the new one."""
Opcode = tuple[Literal["replace", "delete", "insert", "equal"], int, int, int, int]


def unified_diff(before: str, after: str, old: str, new: str) -> str:
    """The unified diff of two texts, as `patch` reads it; empty where they are equal.

    `old` and `new` are the names in its first two lines.
    """
    was, now = before.splitlines(), after.splitlines()
    lines: list[str] = []
    for group in _Matches(was, now).get_grouped_opcodes(CONTEXT):
        (_, i1, _, j1, _), (_, _, i2, _, j2) = group[0], group[-1]
        lines.append(f"@@ -{_range(i1, i2)} +{_range(j1, j2)} @@")
        for tag, a1, a2, b1, b2 in group:
            if tag == "equal":
                lines += [f" {line}" for line in was[a1:a2]]
            else:
                lines += [f"-{line}" for line in was[a1:a2]]
                lines += [f"+{line}" for line in now[b1:b2]]
    if lines:
        lines = [f"--- {old}", f"+++ {new}", *lines]
    return "".join(f"{line}\n" for line in lines)


class _Matches(SequenceMatcher[str]):
    """Groups the differences that are found here, as difflib does its own."""

    def __init__(self, was: Sequence[str], now: Sequence[str]) -> None:
        super().__init__()
        self._found = list(_opcodes(was, now))

    def get_opcodes(self) -> list[Opcode]:
        return self._found


def _range(first: int, last: int) -> str:
    """Lines of a hunk as the format counts them: from 1; an empty range names the line before it."""
    count = last - first
    if count == 1:
        return str(first + 1)
    return f"{first + 1 if count else first},{count}"


def _opcodes(was: Sequence[str], now: Sequence[str]) -> Iterator[Opcode]:
    """Changes from one list of lines to the other, in the form of `SequenceMatcher.get_opcodes`."""
    i = j = 0
    for i1, i2, j1, j2 in (*_equal_spans(was, now), (len(was), len(was), len(now), len(now))):
        if i < i1 or j < j1:
            yield ("insert" if i == i1 else "delete" if j == j1 else "replace"), i, i1, j, j1
        if i1 < i2:
            yield "equal", i1, i2, j1, j2
        i, j = i2, j2


def _equal_spans(was: Sequence[str], now: Sequence[str]) -> list[Span]:
    """Spans of equal lines, in order; spans that touch are one."""
    found: list[Span] = []
    left = [((0, len(was), 0, len(now)), 0)]
    while left:
        (i1, i2, j1, j2), level = left.pop()
        begin = _equal_from(was, now, i1, i2, j1, j2)
        if begin:
            found.append((i1, i1 + begin, j1, j1 + begin))
        i1, j1 = i1 + begin, j1 + begin
        end = 0
        while end < min(i2 - i1, j2 - j1) and was[i2 - 1 - end] == now[j2 - 1 - end]:
            end += 1
        if end:
            found.append((i2 - end, i2, j2 - end, j2))
        i2, j2 = i2 - end, j2 - end
        if i1 == i2 or j1 == j2:
            continue
        anchors = _lines_of_their_own(was[i1:i2], now[j1:j2]) if level < MOST_LEVELS else []
        if anchors:  # each begins a part, whose first lines are equal then
            cuts = [(i1, j1), *((i1 + a, j1 + b) for a, b in anchors), (i2, j2)]
            left += [((i, k, j, m), level + 1) for (i, j), (k, m) in pairwise(cuts)]
        elif (i2 - i1) * (j2 - j1) <= MOST_PAIRS:
            blocks = SequenceMatcher(None, was[i1:i2], now[j1:j2], autojunk=False).get_matching_blocks()
            found += [(i1 + a, i1 + a + n, j1 + b, j1 + b + n) for a, b, n in blocks if n]
    return _joined(sorted(found))


def _equal_from(was: Sequence[str], now: Sequence[str], i1: int, i2: int, j1: int, j2: int) -> int:
    """Number of equal lines from the two starts on."""
    most = min(i2 - i1, j2 - j1)
    return next((k for k in range(most) if was[i1 + k] != now[j1 + k]), most)


def _joined(spans: Sequence[Span]) -> list[Span]:
    joined: list[Span] = []
    for i1, i2, j1, j2 in spans:
        if joined and joined[-1][1] == i1 and joined[-1][3] == j1:
            i1, _, j1, _ = joined.pop()
        joined.append((i1, i2, j1, j2))
    return joined


def _lines_of_their_own(was: Sequence[str], now: Sequence[str]) -> list[tuple[int, int]]:
    """Places of the lines that occur once in both, as many as have one order in both.

    The longest increasing subsequence, by patience sorting: `ends[k]` is the place in `now` at which the
    chain of k + 1 lines that ends first does so.
    """
    in_was, in_now = Counter(was), Counter(now)
    place = {line: j for j, line in enumerate(now) if in_now[line] == 1}
    pairs = [(i, place[line]) for i, line in enumerate(was) if in_was[line] == 1 and line in place]
    ends: list[int] = []
    last: list[int] = []  # the pair at which the chain ends
    before: list[int] = []  # per pair, the one before it in its chain
    for index, (_, j) in enumerate(pairs):
        k = bisect_left(ends, j)
        ends[k : k + 1] = [j]
        last[k : k + 1] = [index]
        before.append(last[k - 1] if k else -1)
    chain: list[tuple[int, int]] = []
    index = last[-1] if last else -1
    while index >= 0:
        chain.append(pairs[index])
        index = before[index]
    return chain[::-1]

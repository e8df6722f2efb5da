"""Bits of MuJoCo's masks for groups of links that do not collide with all others."""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache
from math import comb

from roboyard.sim.build.masks import ALL_MASKS

Group = tuple[int, int]
"""Group and mask, as bits: two links collide where the group of either shares a bit with the other's mask."""
Masks = tuple[bool, int, int]
"""Whether links meet those without a group, and the bits that contype and conaffinity get."""

WITHOUT: Group = (1, -1)
"""Group and mask of links without any."""
FIRST_BIT, BITS = 19, 12
"""Bits that no link without a group has in either mask."""
CODE_BITS, CODE_SIZE = 18, 9
"""Bits, from the second on, of which codes of bodies consist, and the number of those that each code has."""
MOST = 64
"""Groups that are compared with each other; later ones get no bits."""


def meet(one: Group, other: Group) -> bool:
    """Return whether links of two groups collide."""
    return bool(one[0] & other[1] or other[0] & one[1])


def group_masks(groups: Collection[Group]) -> dict[Group, Masks | None]:
    """Return the bits with which MuJoCo lets those links collide whose groups do.

    Groups that collide with the same groups share a bit in contype, and have those of what they meet in
    conaffinity. Links without a group match any contype but these bits.

    Args:
        groups: different ones, in the order in which they get bits.

    Returns:
        None for a group that collides as links without one. Groups for which no bit is left are missing.
    """
    compared = list(groups)[:MOST]
    rows = {one: tuple(meet(one, other) for other in (WITHOUT, *compared)) for one in compared}
    usual = tuple(meet(WITHOUT, other) for other in (WITHOUT, *compared))
    bits: dict[tuple[bool, ...], int] = {}
    for one in compared:
        if rows[one] != usual and rows[one] not in bits and len(bits) < BITS:
            bits[rows[one]] = 1 << FIRST_BIT + len(bits)
    found: dict[Group, Masks | None] = {}
    for one, row in rows.items():
        if row == usual:
            found[one] = None
        elif row in bits:
            met = 0
            for other, does in zip(compared, row[1:], strict=True):
                if does:
                    met |= bits.get(rows[other], 0)
            found[one] = row[0], bits[row], met
    return found


@lru_cache(65536)
def code_masks(number: int) -> tuple[int, int]:
    """Return contype and conaffinity of the links of a body that do not collide with each other.

    Args:
        number: of the body's code, from 0 on. Codes are sets of equally many bits, so that none is within
            another: two bodies collide by the contype of either alone.
    """
    code, place = 0, number % comb(CODE_BITS, CODE_SIZE)
    for count in range(CODE_SIZE, 0, -1):
        bit = count - 1
        while comb(bit + 1, count) <= place:
            bit += 1
        place -= comb(bit, count)
        code |= 2 << bit
    return code, ALL_MASKS & ~code

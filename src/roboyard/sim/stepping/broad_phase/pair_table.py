"""A table of the places of pairs in a list, looked up by both numbers of a pair.

pairs: (k, n) of which the first two rows have the numbers of each pair, the smaller one first. table: places
in that list at entries that the numbers give, -1 for none; its length is a power of two, at least twice the
number of pairs.
"""

from __future__ import annotations


def note_place(pairs, table, place):
    """Write a pair's place into the table."""
    mask = table.shape[0] - 1
    entry = spread(pairs[0, place], pairs[1, place]) & mask
    while table[entry] >= 0:
        entry = (entry + 1) & mask
    table[entry] = place


def find_place(pairs, table, a, b):
    """Return the place of a pair, a < b, in the list, -1 where there is none."""
    mask = table.shape[0] - 1
    entry = spread(a, b) & mask
    while table[entry] >= 0:
        place = table[entry]
        if pairs[0, place] == a and pairs[1, place] == b:
            return place
        entry = (entry + 1) & mask
    return -1


def note_places(pairs, table, count):
    """Fill the table with the places of so many pairs."""
    for entry in range(table.shape[0]):
        table[entry] = -1
    for place in range(count):
        note_place(pairs, table, place)


def drop_place(pairs, table, place):
    """Remove a pair's place from the table; entries after it move up where they are looked for."""
    mask = table.shape[0] - 1
    entry = spread(pairs[0, place], pairs[1, place]) & mask
    while table[entry] != place:
        entry = (entry + 1) & mask
    hole = entry
    entry = (entry + 1) & mask
    while table[entry] >= 0:
        home = spread(pairs[0, table[entry]], pairs[1, table[entry]]) & mask
        if (entry - home) & mask >= (entry - hole) & mask:
            table[hole] = table[entry]
            hole = entry
        entry = (entry + 1) & mask
    table[hole] = -1


def change_place(pairs, table, old, new):
    """Write the new place of a pair, which is at the old one still, into the table."""
    mask = table.shape[0] - 1
    entry = spread(pairs[0, old], pairs[1, old]) & mask
    while table[entry] != old:
        entry = (entry + 1) & mask
    table[entry] = new


def spread(a, b):
    """Return a number below 2^31 that differs much where a pair differs little."""
    mixed = (int(a) * 2654435761 + int(b) * 40503) & 0x7FFFFFFF
    return mixed ^ (mixed >> 15)

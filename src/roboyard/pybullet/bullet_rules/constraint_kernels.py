"""Forces of a constraint in MuJoCo's memory, in PyBullet's order; see `roboyard.sim.stepping.step_rows`."""

from roboyard.native import compiled
from roboyard.sim.constraints.bounded_rows import HALF_ANGLE
from roboyard.sim.stepping.step_row_kernels import find_rows

PLAIN, SLIDE, POINT = range(3)
"""The forces as they are, those of a prismatic constraint, those of a point, which act on the other side."""


@compiled("i8[::1] i8[::1] i4[::1] i8[::1] i8 i8 i8 i8 i8 i4[::1] f8[::1] i8 i8 f8[::1] -> i8")
def constraint_efforts(
    words, places, counts, starts, address, size, contact, degrees, is_sparse, integers, numbers, equality,
    rule, out,
):  # fmt: skip  # pragma: no cover
    """Write the efforts of an equality in the last step; return 1, or 0 without any.

    words to is_sparse: see `find_rows`. integers, numbers: MuJoCo's block. equality: its row there. rule:
    `PLAIN`, `SLIDE` or `POINT`. out: (1,), (3,), (5,) or (6,) forces (N) and torques (N m), written.
    """
    if find_rows(words, places, counts, starts, address, size, contact, degrees, is_sparse) == 0:
        return 0
    first = -1
    for row in range(counts[1]):
        if integers[starts[1] + row] == equality:
            first = row
            break
    if first < 0:
        return 0
    place = starts[9] + first
    if rule == 1:
        out[0] = numbers[place] + 0.0
        out[1] = numbers[place + 1] + 0.0
        for k in range(2, 5):
            out[k] = HALF_ANGLE * numbers[place + k + 1] + 0.0
        return 1
    for k in range(len(out)):
        if rule == 2:
            out[k] = 0.0 - numbers[place + k]
        elif k < 3:
            out[k] = numbers[place + k] + 0.0
        else:
            out[k] = HALF_ANGLE * numbers[place + k] + 0.0
    return 1

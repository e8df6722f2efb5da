"""Compiled loops over the bytes of plain OBJ files."""

from __future__ import annotations

from roboyard.native import compiled

SPACE, NEWLINE, RETURN, HASH, SLASH, MINUS, PLUS, DOT = 32, 10, 13, 35, 47, 45, 43, 46
MOST_DIGITS = 18
"""Digits of a number that is exact as an int64."""
EXACT_DIGITS = 15
"""Digits of a number that is exact as a float64."""
MOST_CORNERS = 10_000
"""Most corners of a face."""
MOST_POWER = 22
"""Largest power of ten that is exact as a float64."""
LEAST_POWER = -60
TABLE = 61
"""Where the second numbers of powers begin; see `plain_numbers.POWERS`."""
SPLIT = 134217729.0
"""2^27 + 1, by which a float64 is split into two of half as many digits; T. Dekker, 1971."""


def number_at(data, at, powers):  # pragma: no cover
    """Read a number; at: (1,) place of its first byte, moved behind it, or -1 where it is not plain."""
    i, end = at[0], data.shape[0]
    sign = 1.0
    if i < end and (data[i] == MINUS or data[i] == PLUS):
        if data[i] == MINUS:
            sign = -1.0
        i += 1
    digits, mantissa, scale, seen = 0, 0, 0, 0
    after_dot = False
    while i < end:
        c = data[i]
        if 48 <= c <= 57:
            seen = 1
            if mantissa > 0 or c > 48:
                digits += 1
            mantissa = mantissa * 10 + (c - 48)
            if after_dot:
                scale += 1
            if digits > MOST_DIGITS or scale > 60:
                at[0] = -1
                return 0.0
        elif c == DOT and not after_dot:
            after_dot = True
        else:
            break
        i += 1
    power = 0
    if seen == 1 and i < end and (data[i] == 101 or data[i] == 69):
        i += 1
        down = False
        if i < end and (data[i] == MINUS or data[i] == PLUS):
            down = data[i] == MINUS
            i += 1
        count = 0
        while i < end and 48 <= data[i] <= 57 and count < 4:
            power = power * 10 + (data[i] - 48)
            count += 1
            i += 1
        if count == 0:
            seen = 0
        if down:
            power = -power
    power -= scale
    ends = i >= end or data[i] == SPACE or data[i] == NEWLINE or data[i] == RETURN
    if seen == 0 or not ends or power > MOST_POWER or power < LEAST_POWER:
        at[0] = -1
        return 0.0
    if digits > EXACT_DIGITS and power > 0:
        at[0] = -1
        return 0.0
    at[0] = i
    if power >= 0:
        return sign * mantissa * powers[power]
    if digits <= EXACT_DIGITS and power >= -MOST_POWER:
        return sign * mantissa / powers[-power]
    return sign * divided(mantissa, powers[-power], powers[TABLE - power])


def divided(whole, divisor, rest):  # pragma: no cover
    """Return a whole number of at most 18 digits divided by the sum of two numbers, rounded once.

    The quotient of the leading parts is corrected by its remainder, whose product is exact in two halves.
    """
    leading = float(whole)
    quotient = leading / divisor
    a = SPLIT * quotient
    a = a - (a - quotient)
    b = SPLIT * divisor
    b = b - (b - divisor)
    c, d = quotient - a, divisor - b
    product = quotient * divisor
    below = ((a * b - product) + a * d + c * b) + c * d
    left = ((leading - product) - below) - quotient * rest + (whole - int(leading))
    return quotient + left / divisor


def after_spaces(data, i):  # pragma: no cover
    """Return the place of the first byte from i on that is no space."""
    while i < data.shape[0] and data[i] == SPACE:
        i += 1
    return i


def next_number(data, i, at, powers):  # pragma: no cover
    """Read the number after spaces from i on; at as in `number_at`."""
    at[0] = after_spaces(data, i)
    return number_at(data, at, powers)


def index_at(data, at):  # pragma: no cover
    """Read a positive whole number; at as in `number_at`. Returns 0 where there is none."""
    i, end = at[0], data.shape[0]
    value, count = 0, 0
    while i < end and 48 <= data[i] <= 57 and count < 10:
        value = value * 10 + (data[i] - 48)
        count += 1
        i += 1
    at[0] = i
    return value


@compiled(
    "u1[::1] i8 f8[::1] i8[::1] i8[::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] "
    "i8[:,::1] i8[::1] i8[:,::1] -> i8",
    releases_gil=True,
)
def read_lines(  # pragma: no cover
    data, fill, powers, at, counts, positions, uvs, normals, tints, corners, ends, events
):
    """Read the lines of an OBJ file, or count them.

    data: (n,) bytes. fill: 1 to write, 0 to count. powers: (23,) of ten. at: (1,) work array. counts:
    (7,) numbers of vertices, texture coordinates, normals, corners, faces, `usemtl` or `mtllib` lines,
    and colours of vertices, written. positions: (v, 3). uvs: (t, 2). normals: (k, 3). tints: (v or 0, 3).
    corners: (c + 2, 3) zero-based vertex, texture coordinate and normal of each corner, -1 for none.
    ends: (f,) end of each face's corners; faces of one or two have none. events: (e, 4) begin and end of
    a line, the faces before it, 1 for `mtllib`. Returns 1, or 0 for a file that is not plain: tabs,
    continued lines, relative indices, numbers of more than 18 digits, colours of some vertices only.
    """
    for k in range(7):
        counts[k] = 0
    i, end = 0, data.shape[0]
    while i < end:
        i = after_spaces(data, i)
        if i >= end:
            break
        c = data[i]
        second = data[i + 1] if i + 1 < end else NEWLINE
        third = data[i + 2] if i + 2 < end else NEWLINE
        kind, size = -1, 0
        if c == 118:  # v
            if second == SPACE:
                kind, size, i = 0, 3, i + 2
            elif second == 116 and third == SPACE:
                kind, size, i = 1, 2, i + 3
            elif second == 110 and third == SPACE:
                kind, size, i = 2, 3, i + 3
            else:
                return 0
        if kind >= 0:
            row = counts[kind]
            for k in range(size):
                value = next_number(data, i, at, powers)
                if at[0] < 0:
                    return 0
                i = at[0]
                if fill == 1:
                    if kind == 0:
                        positions[row, k] = value
                    elif kind == 1:
                        uvs[row, k] = value
                    else:
                        normals[row, k] = value
            i = after_spaces(data, i)
            if kind == 0:
                if i < end and data[i] != NEWLINE and data[i] != RETURN:
                    if counts[6] != row:
                        return 0
                    for k in range(3):
                        value = next_number(data, i, at, powers)
                        if at[0] < 0:
                            return 0
                        i = at[0]
                        if fill == 1:
                            tints[row, k] = value
                    counts[6] += 1
                    i = after_spaces(data, i)
                elif counts[6] > 0:
                    return 0
            counts[kind] += 1
            if kind == 1 and i < end and data[i] != NEWLINE and data[i] != RETURN:
                at[0] = i
                number_at(data, at, powers)
                if at[0] < 0:
                    return 0
                i = at[0]
                i = after_spaces(data, i)
        elif c == 102 and second == SPACE:  # f
            i += 2
            size = 0
            while True:
                i = after_spaces(data, i)
                if i >= end or data[i] == NEWLINE or data[i] == RETURN:
                    break
                row = counts[3]
                for k in range(3):
                    at[0] = i
                    value = index_at(data, at)
                    if value == 0 and (at[0] > i or k == 0):
                        return 0
                    i = at[0]
                    if fill == 1:
                        corners[row, k] = value - 1
                    if k < 2:
                        if i < end and data[i] == SLASH:
                            i += 1
                        else:
                            if fill == 1:
                                for rest in range(k + 1, 3):
                                    corners[row, rest] = -1
                            break
                if i < end and data[i] != SPACE and data[i] != NEWLINE and data[i] != RETURN:
                    return 0
                counts[3] += 1
                size += 1
            if size > MOST_CORNERS:
                return 0
            if size < 3:  # a point or a line
                counts[3] -= size
            if fill == 1:
                ends[counts[4]] = counts[3]
            counts[4] += 1
        elif c == 102 and second in (NEWLINE, RETURN):
            return 0
        else:
            is_material = c == 117 and second == 115  # us: usemtl
            is_library = c == 109 and second == 116  # mt: mtllib
            begin = i
            while i < end and data[i] != NEWLINE and data[i] != RETURN:
                if data[i] == 9:
                    return 0
                i += 1
            if i > begin and data[i - 1] == 92:  # a backslash continues the line
                return 0
            if is_material or is_library:
                if fill == 1:
                    row = counts[5]
                    events[row, 0], events[row, 1], events[row, 2] = begin, i, counts[4]
                    events[row, 3] = 1 if is_library else 0
                counts[5] += 1
        if i < end and data[i] == RETURN:
            i += 1
            if i < end and data[i] != NEWLINE:
                return 0
        if i < end:
            if data[i] != NEWLINE:
                return 0
            i += 1
    return 1

"""Keeping the points of a step's contacts, the first part of a step."""

from __future__ import annotations

from roboyard.sim.stepping.impulses.records import (
    DONE,
    EXTRA,
    FULL,
    HELD,
    KEEPS_POINTS,
    PAIRS,
    POINTS_ARE_NEW,
    ROOM,
    ROWS_ARE_OLD,
    SEEN,
    TABLE,
)  # fmt: skip
from roboyard.sim.stepping.manifold_kernels import (
    copy_contacts,
    drop_gaps,
    keep_points,
    write_points,
)
from roboyard.sim.stepping.narrow_phase.edge_kernels import place_contacts


def keep(rows, contacts, search, mechanism, state, points, surface, fields, rules):  # pragma: no cover
    """Move contacts and keep their points, before MuJoCo's rows are used; return what is to be done next."""
    contact_count = search.counts[0]
    if contact_count > points.keys.shape[1] or points.notes[FULL] > 0:
        return ROOM
    points.notes[EXTRA] = 0
    moved = 0
    if surface.boxes.shape[0] > 0:
        moved = place_contacts(
            contacts, contact_count, mechanism.geom_type, mechanism.geom_body, state.xpos, state.xmat,
            surface.boxes, surface.rounding, surface.hulls, surface.spans, surface.compound, points.entered,
            surface.margins, 1 if rules[KEEPS_POINTS] > 0.0 else 0, points.fresh,
        )  # fmt: skip
        drop_gaps(
            contacts, contact_count, mechanism.geom_type, mechanism.geom_body, state.xpos, state.xmat,
            surface.margins, surface.parts, surface.compound, 1 if rules[KEEPS_POINTS] > 0.0 else 0,
        )  # fmt: skip
    if contact_count == 0:
        points.notes[PAIRS] = 0
    elif rules[KEEPS_POINTS] > 0.0:
        now = points.notes[TABLE]
        following = 1 - now
        points.notes[EXTRA] = keep_points(
            contacts, contact_count, points.kinds, mechanism.geom_type, mechanism.geom_body, state.xpos,
            state.xmat, surface.margins, surface.reaches, surface.anchors, rules[SEEN],
            points.notes[PAIRS], points.keys[now], points.counts[now], points.points[now],
            points.keys[following], points.counts[following], points.points[following], points.fresh,
            points.source, points.extra, points.slots, points.notes, surface.boxes,
            surface.compound, points.entered, surface.rounding, surface.hulls, surface.spans, fields,
        )  # fmt: skip
        points.notes[TABLE] = following
        if points.notes[HELD] > 0:
            moved = 1
        if points.notes[EXTRA] > 0:
            return ROWS_ARE_OLD if add_points(rows, contacts, search, points) else POINTS_ARE_NEW
    return ROWS_ARE_OLD if moved == 1 else DONE


def add_points(rows, contacts, search, points):
    """Add the points that are kept besides MuJoCo's contacts to these, in its block; return whether it could.

    Does what MuJoCo's `mj_addContact` does: contacts overwrite the rows, which have to be made again.
    """
    before, extra = search.counts[0], points.notes[EXTRA]
    total = before + extra
    if search.places.shape[0] == 0 or total * search.contact > search.size:
        return False
    for k in range(search.counts.shape[0]):
        search.counts[k] = 0
    search.counts[0] = total
    copy_contacts(rows.kind, search.contact // 4, total, extra, points.source)
    write_points(contacts, total, extra, points.extra)
    return True

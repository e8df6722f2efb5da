"""A compiled loop that moves contacts from MuJoCo's shapes to the surfaces, which may be outside them."""

from __future__ import annotations

from roboyard.native import Bundle, compiled
from roboyard.sim.stepping.step_row_kernels import CONTACTS

FOUND = Bundle((CONTACTS,))
"""Contacts as one argument."""


@compiled(CONTACTS, "i8 f8[:]")
def shift_contacts(contacts, contact_count, margins):  # pragma: no cover
    """Move contacts to the surfaces; margins: (ngeom,) widths (m) by which these are outside the shapes."""
    _shift(contacts, contact_count, margins)


@compiled(FOUND, "i4[::1] f8[::1]")
def shift_found(contacts, counts, margins):  # pragma: no cover
    """Do what `shift_contacts` does with as many contacts as the first of `counts` says."""
    _shift(contacts, counts[0], margins)


def _shift(contacts, contact_count, margins):  # pragma: no cover
    for i in range(contact_count):
        a, b = contacts.geom[i, 0], contacts.geom[i, 1]
        first = margins[a] if a >= 0 else 0.0
        second = margins[b] if b >= 0 else 0.0
        contacts.dist[i] -= first + second
        shift = 0.5 * (first - second)
        for k in range(3):
            contacts.position[i, k] += shift * contacts.frame[i, k]

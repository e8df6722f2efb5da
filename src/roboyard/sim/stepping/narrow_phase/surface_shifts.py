"""A compiled loop that moves contacts from MuJoCo's shapes to the surfaces, which may be outside them."""

from __future__ import annotations

from roboyard.native import compiled
from roboyard.sim.stepping.step_row_kernels import CONTACTS


@compiled(CONTACTS, "i8 f8[:]")
def shift_contacts(contacts, contact_count, margins):  # pragma: no cover
    """Move contacts to the surfaces; margins: (ngeom,) widths (m) by which these are outside the shapes."""
    for i in range(contact_count):
        a, b = contacts.geom[i, 0], contacts.geom[i, 1]
        first = margins[a] if a >= 0 else 0.0
        second = margins[b] if b >= 0 else 0.0
        contacts.dist[i] -= first + second
        shift = 0.5 * (first - second)
        for k in range(3):
            contacts.position[i, k] += shift * contacts.frame[i, k]

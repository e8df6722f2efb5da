"""How rigid the contacts of shapes are: by the profile, but soft in a pile."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard.sim.build.records import BuiltLink
from roboyard.sim.build.solver_options import HARD_SOLIMP, PILE_SOLIMP, PILE_SOLREF
from roboyard.sim.build.triangle_windows import HALF_THICKNESS
from roboyard.sim.physics_profile import PhysicsProfile

_BOX = int(mujoco.mjtGeom.mjGEOM_BOX)


def set_contact_law(
    model: Any, profile: PhysicsProfile, records: Sequence[BuiltLink], *, is_pile: bool
) -> None:
    """Write margins and stiffness of all bodies' shapes, and the margins of all bodies.

    Args:
        model: MjModel.
        profile: of the world.
        records: links with descriptions.
        is_pile: whether the world is solved as a pile.
    """
    hard = profile.hard_contacts and not is_pile
    if is_pile or profile.hard_contacts:
        ours = np.array([geom.id for record in records for geom in record.geoms], dtype=np.intp)
        model.geom_margin[ours] = 0.0
        if hard:
            is_box = model.geom_type[ours] == _BOX
            model.geom_margin[ours] = np.where(is_box, profile.box_margin, profile.contact_margin)
        model.geom_solimp[ours] = PILE_SOLIMP if is_pile else HARD_SOLIMP
        if is_pile:
            model.geom_solref[ours] = PILE_SOLREF
    slots = [geom.id for record in records for window in record.windows for geom in window.slots]
    if slots and not hard:  # bodies rest on the triangles, inside the prisms
        model.geom_margin[slots], model.geom_gap[slots] = -HALF_THICKNESS, HALF_THICKNESS
    # pairs of bodies with several shapes are looked at within these margins alone
    model.body_margin[:] = 0.0
    np.maximum.at(model.body_margin, model.geom_bodyid, model.geom_margin + model.geom_gap)


def set_law_of_few(
    model: Any, profile: PhysicsProfile, records: Sequence[BuiltLink], *, is_pile: bool
) -> None:
    """Do what `set_contact_law` does, for links whose shapes alone are new and have no windows."""
    hard = profile.hard_contacts and not is_pile
    margin, gap_of, kind_of = model.geom_margin, model.geom_gap.item, model.geom_type.item
    for record in records:
        geoms = [geom.id for geom in record.geoms]
        if is_pile or profile.hard_contacts:
            for geom in geoms:
                width = profile.box_margin if kind_of(geom) == _BOX else profile.contact_margin
                margin[geom] = width if hard else 0.0
                model.geom_solimp[geom] = PILE_SOLIMP if is_pile else HARD_SOLIMP
                if is_pile:
                    model.geom_solref[geom] = PILE_SOLREF
        geoms += [geom.id for geom in record.visuals]
        widest = max([0.0, *(margin.item(geom) + gap_of(geom) for geom in geoms)])
        model.body_margin[record.element.id] = widest

"""Room among MuJoCo's contacts for the points of shapes on height fields, which `field_kernels` finds.

MuJoCo searches a prism under each triangle and takes most of a step to do so. Where the points are found
here, its function is only asked for as many contacts as a pair keeps, and those are written then. MuJoCo has
one table of functions for the whole process: models with `MARK` among their flags get such contacts, which
are excluded until they are written, and all others get MuJoCo's.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard.native.callbacks import called_by_c
from roboyard.native.views import integers_at, numbers_at, short_numbers_at, words_at
from roboyard.sim.build.mesh_fields import BASE
from roboyard.sim.mujoco_library import mujoco_library
from roboyard.sim.stepping.face_contacts import places_of
from roboyard.sim.stepping.narrow_phase.closest_points import BOX, CAPSULE, CYLINDER, MESH, SPHERE

OF_MODEL = (
    "geom_dataid", "geom_aabb", "hfield_size", "hfield_nrow", "hfield_ncol", "hfield_adr", "hfield_data",
)  # fmt: skip
OF_DATA = ("geom_xpos", "geom_xmat")
MARK = 1 << 30
"""A flag that MuJoCo does not know."""
MOST = 4
"""Most points that a pair keeps."""
AWAY = 1.0
"""Distance (m) of contacts that are not written yet."""
REACH = 0.05
"""Share of a shape's size up to which it is near, besides the margins; a pair keeps points over less."""
KINDS = SPHERE, CAPSULE, CYLINDER, BOX, MESH
"""Types of the shapes whose points are found."""
ELLIPSOID = 4
_TYPES = int(mujoco.mjtGeom.mjGEOM_SDF) + 1
"""Rows and columns of MuJoCo's table."""
_PROBE = """<mujoco><asset><hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/></asset>
    <worldbody><geom type="hfield" hfield="h"/></worldbody></mujoco>"""
PLACES = (0,) * (len(OF_MODEL) + len(OF_DATA) + 1)
"""Bytes to `OF_MODEL`, `OF_DATA` and the flags, once they are looked up."""


@cache
def _library() -> Any:
    """Return MuJoCo's library with its function for height fields, where all is as expected, else None."""
    global PLACES
    library = mujoco_library()
    if library is None:
        return None
    model = mujoco.MjModel.from_xml_string(_PROBE)
    PLACES = places_of(model, mujoco.MjData(model), OF_MODEL, OF_DATA) or PLACES
    table = _table(library)
    found = {table[place] for place in _entries()} if table is not None else {None}
    address = found.pop()
    if not any(PLACES) or found or not address:
        return None
    library.roboyard_mujoco_on_field = ctypes.CFUNCTYPE(ctypes.c_int)(address)
    return library


def _table(library: Any) -> Any:
    try:
        return (ctypes.c_void_p * (_TYPES * _TYPES)).in_dll(library, "mjCOLLISIONFUNC")
    except ValueError:
        return None


def _entries() -> list[int]:
    """Return the places in the table of height fields with all convex shapes."""
    return [int(mujoco.mjtGeom.mjGEOM_HFIELD) * _TYPES + kind for kind in (*KINDS, ELLIPSOID)]


@called_by_c("i8 i8 i8 i4 i4 f8 -> i4", otherwise="roboyard_mujoco_on_field", library=_library)
def leave_room(model, data, contact, field, shape, margin):  # pragma: no cover
    """Write contacts to be written over where a shape is near a height field; return their number.

    model, data: addresses of MjModel and MjData. contact: address of distance, place, normal and tangent of
    each. field, shape: geoms. margin: distance (m) up to which there is a contact. -1: MuJoCo's own contacts
    are wanted. A field of thickness `BASE` represents a mesh and has none of these.
    """
    number = integers_at(words_at(model + PLACES[0], 1)[0] + 4 * field, 1)[0]
    size = numbers_at(words_at(model + PLACES[2], 1)[0] + 32 * number, 4)
    if integers_at(model + PLACES[9], 1)[0] & MARK == 0:
        return 0 if size[3] == BASE else -1
    box = numbers_at(words_at(model + PLACES[1], 1)[0] + 48 * shape, 6)
    rows = integers_at(words_at(model + PLACES[3], 1)[0] + 4 * number, 1)[0]
    columns = integers_at(words_at(model + PLACES[4], 1)[0] + 4 * number, 1)[0]
    places, turns = words_at(data + PLACES[7], 1)[0], words_at(data + PLACES[8], 1)[0]
    p, q = numbers_at(places + 24 * field, 3), numbers_at(places + 24 * shape, 3)
    r, s = numbers_at(turns + 72 * field, 9), numbers_at(turns + 72 * shape, 9)
    x, y, z = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    x += s[0] * box[0] + s[1] * box[1] + s[2] * box[2]
    y += s[3] * box[0] + s[4] * box[1] + s[5] * box[2]
    z += s[6] * box[0] + s[7] * box[1] + s[8] * box[2]
    near = margin + REACH * (box[3] + box[4] + box[5])
    hx = hy = hz = near
    for k in range(3):
        u, v, w = s[k], s[3 + k], s[6 + k]
        hx += box[3 + k] * abs(r[0] * u + r[3] * v + r[6] * w)
        hy += box[3 + k] * abs(r[1] * u + r[4] * v + r[7] * w)
        hz += box[3 + k] * abs(r[2] * u + r[5] * v + r[8] * w)
    x, y, z = r[0] * x + r[3] * y + r[6] * z, r[1] * x + r[4] * y + r[7] * z, r[2] * x + r[5] * y + r[8] * z
    across, along = (columns - 1) / (2.0 * size[0]), (rows - 1) / (2.0 * size[1])
    first = max(int((x - hx + size[0]) * across), 0)
    last = min(int((x + hx + size[0]) * across) + 1, columns - 1)
    low = max(int((y - hy + size[1]) * along), 0)
    high = min(int((y + hy + size[1]) * along) + 1, rows - 1)
    if x - hx > size[0] or x + hx < -size[0] or y - hy > size[1] or y + hy < -size[1]:
        return 0
    if z - hz > size[2] or z + hz < 0.0:
        return 0
    start = integers_at(words_at(model + PLACES[5], 1)[0] + 4 * number, 1)[0]
    heights = short_numbers_at(words_at(model + PLACES[6], 1)[0] + 4 * start, rows * columns)
    least = -1.0 if size[3] == BASE else (z - hz) / size[2]
    for row in range(low, high + 1):
        for column in range(first, last + 1):
            if heights[row * columns + column] >= least:
                out = numbers_at(contact, 10 * MOST)
                for k in range(MOST):
                    for n in range(10):
                        out[10 * k + n] = 0.0
                    out[10 * k] = AWAY
                    out[10 * k + 1], out[10 * k + 2], out[10 * k + 3] = q[0], q[1], q[2]
                    out[10 * k + 4], out[10 * k + 5], out[10 * k + 6] = r[2], r[5], r[8]
                return MOST
    return 0


@cache
def is_installed() -> bool:
    """Put `leave_room` into MuJoCo's table, where that is as expected; return whether it is there."""
    library = _library()
    table = None if library is None else _table(library)
    address = 0 if table is None else leave_room.address()
    if table is None or not address:
        return False
    for place in _entries():
        table[place] = address
    return True


class FieldContacts:
    """Lets MuJoCo leave room for the points of one world whose height fields are searched."""

    def __init__(self) -> None:
        self._known: tuple[Any, ...] = ()
        """Model and forms for which `_finds_room` holds."""
        self._finds_room = False
        self.finds_all = False
        """Whether, after `leaves_room`, the points of all shapes that move are found here."""

    def leaves_room(self, model: Any, forms: Any) -> bool:
        """Return whether the forms of all shapes are known that may touch a height field."""
        known = self._known
        if not known or known[0] is not model or known[1] is not forms:
            self._known = model, forms
            self._finds_room = are_known(model, forms) and is_installed()
            self.finds_all = self._finds_room and not _moving(model)[model.geom_type == ELLIPSOID].any()
        return self._finds_room


def are_known(model: Any, forms: Any) -> bool:
    """Return whether the forms of all shapes of a model are known that move and may touch a height field."""
    if not len(forms.boxes):
        return False
    kinds = model.geom_type
    has_hull = (kinds != MESH) | (forms.spans[:, 1] > 0)
    has_box = (kinds == MESH) | (np.abs(forms.boxes[:, 1:]).max(axis=(1, 2)) < 1e8)
    return bool((has_hull & has_box)[_moving(model) & np.isin(kinds, KINDS)].all())


def _moving(model: Any) -> np.ndarray:
    """Return (ngeom,) which geoms of a model move and may touch others."""
    collides = (model.geom_contype | model.geom_conaffinity) != 0
    moves: np.ndarray = collides & (model.body_weldid[model.geom_bodyid] != 0)
    return moves

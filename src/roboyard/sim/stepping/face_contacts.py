"""Corners of convex meshes over faces of boxes, in place of MuJoCo's general search for the nearest points.

Where one corner of a mesh is nearest to a face of a box, over its inside, it is the contact point, and
neither an iterative search nor an expansion is needed to find it: feet and wheels on a large floor. Where two
corners are as near, unless contacts are placed later, or an edge of the box is, MuJoCo's own function is
called. It is called in worlds that need several points of a pair, too, and for all other shapes.

MuJoCo has one table of functions for the whole process. The one here is given addresses of its structures
alone, and finds their arrays at the places that they have in a model of known arrays.
"""

from __future__ import annotations

import ctypes
from array import array
from functools import cache
from typing import Any

from roboyard._mujoco import mujoco
from roboyard.native.callbacks import called_by_c
from roboyard.native.views import integers_at, numbers_at, short_numbers_at, words_at
from roboyard.sim.mujoco_library import mujoco_library
from roboyard.sim.stepping.shape_forms import PLACED

OF_MODEL = ("geom_size", "geom_rbound", "geom_dataid", "mesh_vertadr", "mesh_vertnum", "mesh_vert")
OF_DATA = ("geom_xpos", "geom_xmat")
_PAGE = 4096
"""Bytes of memory that are there if one of them is."""
_MOST_WORDS = 1500
"""Words of an MjModel, and those of an MjData after the energies, in which arrays are looked for."""
_PROBE = """<mujoco><asset><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset>
    <worldbody><geom type="box" size="1 1 1"/><geom type="mesh" mesh="m"/></worldbody></mujoco>"""
_TYPES = int(mujoco.mjtGeom.mjGEOM_SDF) + 1
"""Rows and columns of MuJoCo's table."""
_FLAGS = 0x2A5A5A
"""A number that no model has as its flags."""
MOST_CORNERS = 512
"""Of meshes with more of them, MuJoCo's walk over the hull is faster than to look at all."""


def places_of(model: Any, data: Any, of_model: tuple[str, ...], of_data: tuple[str, ...]) -> tuple[int, ...]:
    """Return bytes from a model and its data to the addresses of their arrays, and to the model's flags.

    Args:
        model: MjModel in which each of the arrays has a size.
        data: its MjData.
        of_model: names of the model's arrays.
        of_data: names of the arrays of the data.

    Returns:
        () where the installed version of MuJoCo has them elsewhere.
    """
    if not hasattr(model, "_address") or not hasattr(data, "_address"):
        return ()
    start, after = data._address, data.energy.ctypes.data + data.energy.nbytes
    found = [_last_places(model, model._address, of_model), _last_places(data, after, of_data)]
    option = model.opt.gravity.ctypes.data - model._address
    kept, model.opt.disableflags = model.opt.disableflags, _FLAGS
    integers = array("i", ctypes.string_at(model._address, option + 400))
    model.opt.disableflags = kept
    flags = [4 * k for k, value in enumerate(integers) if value == _FLAGS]
    if not all(found) or len(flags) != 1:
        return ()
    return (*found[0], *(place + after - start for place in found[1]), flags[0])


def _last_places(owner: Any, address: int, names: tuple[str, ...]) -> tuple[int, ...]:
    """Return bytes from an address to those of arrays; () where they are not found.

    An array of no size has the address of the next one, which comes after it.
    """
    words = array("q")
    signature = ctypes.c_int64(owner.signature).value
    while signature not in words:
        if len(words) > _MOST_WORDS:
            return ()
        here = address + 8 * len(words)
        words.frombytes(ctypes.string_at(here, _PAGE - here % _PAGE))  # there is more memory to its end
    addresses = [getattr(owner, name).ctypes.data for name in names]
    found = words[: words.index(signature)].tolist()
    if not all(a in found for a in addresses):
        return ()
    return tuple(8 * (len(found) - 1 - found[::-1].index(a)) for a in addresses)


PLACES = (0,) * (len(OF_MODEL) + len(OF_DATA) + 1)
"""Bytes to `OF_MODEL`, `OF_DATA` and the flags, once they are looked up."""
ONE_POINT = int(mujoco.mjtDisableBit.mjDSBL_MULTICCD)
OTHER_SEARCH = int(mujoco.mjtDisableBit.mjDSBL_NATIVECCD)
CLEAR = 1e-6
"""Distance (m) by which one corner is nearer than all others: the error that MuJoCo's search ends with."""


def _library() -> Any:
    """Return MuJoCo's library where its structures are as expected, else None."""
    if not any(PLACES):
        model = mujoco.MjModel.from_xml_string(_PROBE)
        _look_up(model, mujoco.MjData(model))
    return mujoco_library() if any(PLACES) else None


def _look_up(model: Any, data: Any) -> None:
    global PLACES
    PLACES = places_of(model, data, OF_MODEL, OF_DATA) or PLACES


@called_by_c("i8 i8 i8 i4 i4 f8 -> i4", otherwise="mjc_Convex", library=_library)
def touch_face(model, data, contact, box, mesh, margin):  # pragma: no cover
    """Write the contact of a box with a convex mesh; return the number of contacts, -1 where it declines.

    model, data: addresses of MjModel and MjData. contact: address of distance, place, normal and tangent.
    box, mesh: geoms. margin: distance (m) up to which there is a contact.

    With v the nearest corner, at the depth p under the face, all directions but the face's normal need a
    longer way out of the box, where v is at least p away from the other faces.
    """
    flags = integers_at(model + PLACES[8], 1)[0]
    if flags & ONE_POINT == 0 or flags & OTHER_SEARCH != 0:
        return -1
    size = numbers_at(words_at(model + PLACES[0], 1)[0] + 24 * box, 3)
    bound = numbers_at(words_at(model + PLACES[1], 1)[0] + 8 * mesh, 1)[0]
    places = words_at(data + PLACES[6], 1)[0]
    turns = words_at(data + PLACES[7], 1)[0]
    p, q = numbers_at(places + 24 * box, 3), numbers_at(places + 24 * mesh, 3)
    a, b = numbers_at(turns + 72 * box, 9), numbers_at(turns + 72 * mesh, 9)
    x, y, z = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    axis = 0
    over = -1e300
    sign = 1.0
    for k in range(3):
        along = a[k] * x + a[3 + k] * y + a[6 + k] * z
        if abs(along) - size[k] > over:
            over = abs(along) - size[k]
            axis = k
            sign = 1.0 if along >= 0.0 else -1.0
    if over - bound >= margin:
        return 0
    number = integers_at(words_at(model + PLACES[2], 1)[0] + 4 * mesh, 1)[0]
    count = integers_at(words_at(model + PLACES[4], 1)[0] + 4 * number, 1)[0]
    if count > MOST_CORNERS:
        return -1
    first = integers_at(words_at(model + PLACES[3], 1)[0] + 4 * number, 1)[0]
    corners = short_numbers_at(words_at(model + PLACES[5], 1)[0] + 12 * first, 3 * count)
    nx, ny, nz = sign * a[axis], sign * a[3 + axis], sign * a[6 + axis]
    dx = nx * b[0] + ny * b[3] + nz * b[6]
    dy = nx * b[1] + ny * b[4] + nz * b[7]
    dz = nx * b[2] + ny * b[5] + nz * b[8]
    least = following = 1e300
    nearest = 0
    for k in range(count):
        height = dx * corners[3 * k] + dy * corners[3 * k + 1] + dz * corners[3 * k + 2]
        if height < following:
            if height < least:
                following = least
                least = height
                nearest = k
            else:
                following = height
    distance = nx * x + ny * y + nz * z + least - size[axis]
    if distance >= margin:
        return 0
    if (following - least < CLEAR and flags & PLACED == 0) or -distance > size[axis]:
        return -1
    vx, vy, vz = corners[3 * nearest], corners[3 * nearest + 1], corners[3 * nearest + 2]
    x += b[0] * vx + b[1] * vy + b[2] * vz
    y += b[3] * vx + b[4] * vy + b[5] * vz
    z += b[6] * vx + b[7] * vy + b[8] * vz
    for k in range(3):
        if k != axis:
            inside = size[k] - abs(a[k] * x + a[3 + k] * y + a[6 + k] * z)
            if inside < max(-distance, 0.0):
                return -1
    out = numbers_at(contact, 10)
    half = 0.5 * distance
    out[0] = distance
    out[1], out[2], out[3] = p[0] + x - half * nx, p[1] + y - half * ny, p[2] + z - half * nz
    out[4], out[5], out[6] = nx, ny, nz
    out[7] = out[8] = out[9] = 0.0
    return 1


def install(model: Any, data: Any) -> bool:
    """Put `touch_face` into MuJoCo's table, where that is as expected; return whether it is there.

    MuJoCo's functions for other shapes stay, and worlds of others in this process get the same contacts.

    Args:
        model: MjModel with a mesh, to look at; the first call counts.
        data: its MjData.
    """
    if not any(PLACES):
        _look_up(model, data)
    return _install()


@cache
def _install() -> bool:
    library = _library()
    if library is None:
        return False
    try:
        table = (ctypes.c_void_p * (_TYPES * _TYPES)).in_dll(library, "mjCOLLISIONFUNC")
        convex = ctypes.cast(library.mjc_Convex, ctypes.c_void_p).value
    except (AttributeError, ValueError):
        return False
    place = int(mujoco.mjtGeom.mjGEOM_BOX) * _TYPES + int(mujoco.mjtGeom.mjGEOM_MESH)
    last = _TYPES * int(mujoco.mjtGeom.mjGEOM_MESH) + int(mujoco.mjtGeom.mjGEOM_MESH)
    if not convex or table[place] != convex or table[last] != convex:
        return False
    address = touch_face.address()
    if address:
        table[place] = address
    return bool(address)

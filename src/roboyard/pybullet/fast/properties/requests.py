"""Changes of what is only requested yet, as parts of an entry; see `properties.entries`.

A request is a list, into which a command writes all values that it is given.
"""

from __future__ import annotations

REQUESTS = """
@part
def request_of(state, given):
    if word(state, REQUESTS) == word(state, NONE):
        return 0
    scene = attribute(given[0], word(state, SCENE))
    requests = attribute(scene, word(state, REQUESTS)) if scene != 0 else 0
    return found(requests, given[1]) if requests != 0 else 0

@part
def places_of(state, given, place, first):
    at = ITEMS + place - first
    is_default = given[place] == word(word(state, DEFAULTS), at)
    return word(state, NONE) if is_default else word(word(state, REQUEST_PLACES), at)

@part
def can_be_requested(state, given, count, first):
    for place in range(first, count):
        places = places_of(state, given, place, first)
        if places != word(state, NONE) and word(places, SIZE) == 0:
            return False
    return True

@part
def requested_value(state, value, length):
    if length < 3:
        return PyFloat_FromDouble(single(state, value))
    x, y, z = number_in(state, value, 0), number_in(state, value, 1), number_in(state, value, 2)
    w = number_in(state, value, 3) if length > 3 else 0.0
    return tuple_of(state, value, length, x, y, z, w)

@part
def request_change(state, given, count, first, request):
    Py_IncRef(request)  # reading a number may call a function of Python
    for place in range(first, count):
        places = places_of(state, given, place, first)
        if places != word(state, NONE):
            length = PyLong_AsLongLong(word(word(state, LENGTHS), ITEMS + place - first))
            made = requested_value(state, given[place], length)
            for k in range(word(places, SIZE)):
                Py_IncRef(made)
                PyList_SetItem(request, PyLong_AsLongLong(word(places, ITEMS + k)), made)
            Py_DecRef(made)
    Py_DecRef(request)
"""
"""Parts of the entry: a request by the first integer, and whether and how values are written into it."""

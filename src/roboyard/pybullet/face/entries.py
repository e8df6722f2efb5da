"""Machine code in front of all commands: it finds the client and the command without a function of Python.

A public function of a command is a function of Python that looks up the client and calls a method of it. Its
built-in enters this machine code instead after many calls, see `direct_calls`: that gives the command its
client and the arguments as they came. All that it does not know (a keyword of another name, another kind of
client) goes to the public function, which knows all rules and errors.

Answers that change only when bodies, constraints or user data do are kept, by the arguments, until a command
is called that may change these.
"""

from __future__ import annotations

from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature

SOURCE = """
KIND, SIZE, ITEMS, CONTENT = 1, 2, 3, 2  # of any object, tuples and cells, in words
CLIENTS, COMMAND, FAILURE, CLIENT, ZERO, NAMES, REQUIRED, KNOWN, FILLED, CHANGED = range(3, 13)

@part
def is_among(value, values):
    for place in range(word(values, SIZE)):
        if word(values, ITEMS + place) == value:
            return True
    return False

@part
def found(table, key):
    value = PyDict_GetItemWithError(table, key)
    if value == 0 and PyErr_Occurred() != 0:
        PyErr_Clear()
    return value

@part
def forget(filled):
    if PyDict_Size(filled) > 0:
        tables = PyDict_Values(filled)
        for place in range(PyList_Size(tables)):
            PyDict_Clear(PyList_GetItem(tables, place))
        Py_DecRef(tables)
        PyDict_Clear(filled)

@part
def key_of(given, count, number, zero, nothing):
    for place in range(count):
        kind = word(given[place], KIND)
        if kind != word(zero, KIND) and kind != word(nothing, KIND):
            return 0
    if number == zero and count < 2:
        key = given[0] if count == 1 else nothing
        Py_IncRef(key)
        return key
    key = PyTuple_New(count + 1)
    Py_IncRef(number)
    PyTuple_SetItem(key, 0, number)
    for place in range(count):
        Py_IncRef(given[place])
        PyTuple_SetItem(key, place + 1, given[place])
    return key

@part
def without(keywords, named, place):
    others = PyTuple_New(named - 1)
    at = 0
    for one in range(named):
        if one != place:
            name = word(keywords, ITEMS + one)
            Py_IncRef(name)
            PyTuple_SetItem(others, at, name)
            at += 1
    return others

def entry(callee, given, count, keywords):
    call = word(word(PyFunction_GetClosure(callee), ITEMS), CONTENT)
    clients, names, zero = word(call, CLIENTS), word(call, NAMES), word(call, ZERO)
    known, changed = word(call, KNOWN), word(call, CHANGED)
    named, number, left_out = 0, zero, -1
    fits = word(word(call, REQUIRED), SIZE) <= count <= word(names, SIZE)
    if keywords != 0 and fits:
        named = word(keywords, SIZE)
        for place in range(named):
            name = word(keywords, ITEMS + place)
            if name == word(call, CLIENT):
                left_out, number = count + place, given[count + place]
                fits = fits and word(number, KIND) == word(zero, KIND)
            else:
                fits = fits and is_among(name, names)
    key = 0
    if known != clients and fits and named <= (left_out >= 0):
        key = key_of(given, count, number, zero, word(call, CLIENT))
        if key != 0:
            result = found(known, key)
            if result != 0:
                Py_IncRef(result)
                Py_DecRef(key)
                return result
    client = found(clients, number) if fits else 0
    if changed != clients:
        forget(changed)
    if client == 0:
        result = PyObject_Vectorcall(callee, given, count, keywords)
    else:
        passed, others = words(), keywords
        passed[0] = client
        at = 1
        for place in range(count + named):
            if place != left_out:
                passed[at] = given[place]
                at += 1
        if left_out >= 0:
            others = without(keywords, named, left_out - count) if named > 1 else 0
        Py_IncRef(client)
        result = PyObject_Vectorcall(word(call, COMMAND), passed, count + 1, others)
        Py_DecRef(client)
        if others != 0 and others != keywords:
            Py_DecRef(others)
        if result == 0:
            kind, value, trace = words(), words(), words()
            PyErr_Fetch(kind, value, trace)
            PyErr_NormalizeException(kind, value, trace)
            if trace[0] != 0:
                PyException_SetTraceback(value[0], trace[0])
                Py_DecRef(trace[0])
            result = PyObject_Vectorcall(word(call, FAILURE), value, 1, 0)
            Py_DecRef(kind[0])
            Py_DecRef(value[0])
        elif key != 0:
            if PyDict_Size(known) > 1000:
                PyDict_Clear(known)
            PyDict_SetItem(known, key, result)
            PyDict_SetItem(word(call, FILLED), word(call, COMMAND), known)
    if key != 0:
        Py_DecRef(key)
    if changed != clients:
        forget(changed)
    return result
"""


def command_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


FRONT = Front(command_call, EntrySignature(SOURCE))
vars(command_call)["front"] = FRONT

"""Machine code in front of all commands: it finds the client and the command without a function of Python.

A public function of a command is a function of Python that looks up the client and calls a method of it. Its
built-in enters this machine code instead after many calls, see `direct_calls`: that gives the command its
client and all arguments in their places, keywords and defaults, too. All that it does not know (a keyword of
another name, another kind of client) goes to the public function, which knows all rules and errors. Integers
of NumPy become Python's, which everything behind it reads faster.

Answers that change only when bodies, constraints or user data do are kept, by the arguments, until a command
is called that may change these. The first of a kind after such a command is not kept: programs that read one
answer after each change read none twice. A detection of contacts is kept like an answer, until a command is
called that may move something: repeated, it finds the same.

One thread alone calls commands in this way, and counts those that run; see `turns`.

Errors of reading what does not exist are kept in the same way, by the arguments, and raised again as new
exceptions of the same texts. Commands look for one only while there are any.
"""

from __future__ import annotations

from roboyard.native.entry_parts import CALLED, FOUND, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.face.turns import OWNER, RUNNING

SOURCE = f"""
KIND, SIZE, ITEMS, CONTENT = 1, 2, 3, 2  # of any object, tuples and cells, in words
CLIENTS, COMMAND, FAILURE, CLIENT, ZERO, NAMES, DEFAULTS, KNOWN, MARKS, CHANGED = range(3, 13)
ERROR, LONG, SHORT, FAILED, OF_FAILURES, KEEP_FAILURE, NOTES, OLD = range(14, 22)  # after the Python function
TURNS, OTHER_THREAD = 22, 23
MARK, LAST = range(2)  # of a list of marks
FAILURES = 1  # of a list of a mark and failures
RUNNING, OWNER = {RUNNING}, {OWNER}  # of turns

@part
def place_of(value, values):
    for place in range(word(values, SIZE)):
        if word(values, ITEMS + place) == value:
            return place
    return -1

@part
def place_of_old(name, names, pairs):
    for place in range(0, word(pairs, SIZE), 2):
        if word(pairs, ITEMS + place) == name:
            return place_of(word(pairs, ITEMS + place + 1), names)
    return -1
{parts(FOUND, CALLED)}
@part
def forget(changed):
    for place in range(word(changed, SIZE)):
        marks = word(word(changed, ITEMS + place), ITEMS)
        if word(marks, MARK) == word(marks, LAST):
            PyList_SetItem(word(changed, ITEMS + place), MARK, PyFloat_FromDouble(0.0))

@part
def valid_answer(call, key):
    kept = found(word(call, KNOWN), key)
    if kept == 0 or word(kept, ITEMS) != word(word(word(call, MARKS), ITEMS), MARK):
        return 0
    return word(kept, ITEMS + 1)

@part
def keep(call, key, answer):
    known, marks = word(call, KNOWN), word(call, MARKS)
    mark = word(word(marks, ITEMS), MARK)
    if word(word(marks, ITEMS), LAST) != mark:  # the first of its kind since a change
        Py_IncRef(mark)
        PyList_SetItem(marks, LAST, mark)
        return
    if PyDict_Size(known) > 1000:
        PyDict_Clear(known)
    Py_IncRef(mark)  # making a tuple may collect garbage, of which the end may forget all answers
    kept = PyTuple_New(2)
    Py_IncRef(answer)
    PyTuple_SetItem(kept, 0, mark)
    PyTuple_SetItem(kept, 1, answer)
    PyDict_SetItem(known, key, kept)
    Py_DecRef(kept)

@part
def key_of(passed, total, number, zero, nothing):
    for place in range(1, total + 1):
        kind = word(passed[place], KIND)
        if kind != word(zero, KIND) and kind != word(nothing, KIND):
            return 0
    if number == zero and total < 2:
        key = passed[1] if total == 1 else nothing
        Py_IncRef(key)
        return key
    key = PyTuple_New(total + 1)
    Py_IncRef(number)
    PyTuple_SetItem(key, 0, number)
    for place in range(1, total + 1):
        Py_IncRef(passed[place])
        PyTuple_SetItem(key, place, passed[place])
    return key

@part
def fill(passed, count, total, names, defaults):
    missing = word(names, SIZE) - word(defaults, SIZE)
    for place in range(count, total):
        if passed[place + 1] == 0:
            if place < missing:
                return False
            passed[place + 1] = word(defaults, ITEMS + place - missing)
    return True

@part
def plain_numbers(call, passed, total):
    made, long, short = 0, word(call, LONG), word(call, SHORT)
    for place in range(1, total + 1):
        kind = word(passed[place], KIND)
        if kind == long or kind == short:
            passed[place] = PyLong_FromLongLong(PyLong_AsLongLong(passed[place]))
            made |= 1 << place
    return made

@part
def give_up(made, passed, total):
    for place in range(1, total + 1):
        if made & (1 << place) != 0:
            Py_DecRef(passed[place])

@part
def has_failures(call):
    failed = word(call, FAILED)
    if failed == word(call, CLIENTS):
        return False
    mark = word(word(word(call, OF_FAILURES), ITEMS), MARK)
    return word(word(failed, ITEMS), MARK) == mark and PyDict_Size(word(word(failed, ITEMS), FAILURES)) > 0

@part
def raise_again(call, failure):
    error = word(call, ERROR)
    made = called(error, word(failure, ITEMS))
    if made == 0:
        return
    notes = word(failure, ITEMS + 1)
    if word(notes, SIZE) > 0:
        copied = PyList_New(word(notes, SIZE))
        for place in range(word(notes, SIZE)):
            Py_IncRef(word(notes, ITEMS + place))
            PyList_SetItem(copied, place, word(notes, ITEMS + place))
        PyObject_SetAttr(made, word(call, NOTES), copied)
        Py_DecRef(copied)
    PyErr_SetObject(error, made)
    Py_DecRef(made)

@part
def take_exception(kind, value, trace):
    PyErr_Fetch(kind, value, trace)
    PyErr_NormalizeException(kind, value, trace)
    if trace[0] != 0:
        PyException_SetTraceback(value[0], trace[0])

@part
def keep_failure(call, key):
    kind, value, trace, given = words(), words(), words(), words()
    take_exception(kind, value, trace)
    given[0], given[1], given[2], given[3] = word(call, FAILED), word(call, OF_FAILURES), key, value[0]
    done = PyObject_Vectorcall(word(call, KEEP_FAILURE), given, 4, 0)
    if done == 0:
        PyErr_Clear()
    else:
        Py_DecRef(done)
    PyErr_Restore(kind[0], value[0], trace[0])

def entry(callee, given, all_given, keywords):
    count = all_given
    call = word(word(PyFunction_GetClosure(callee), ITEMS), CONTENT)
    Py_IncRef(call)  # the command may replace it
    clients, names, zero = word(call, CLIENTS), word(call, NAMES), word(call, ZERO)
    changed = word(call, CHANGED)
    passed, number = words(), zero
    if count == word(names, SIZE) + 1:  # the last one is the client's number
        number, count = given[count - 1], count - 1
    total = count
    fits = count <= word(names, SIZE) and word(number, KIND) == word(zero, KIND)
    if fits:
        for place in range(count):
            passed[place + 1] = given[place]
    turns = integers(word(call, TURNS))
    if turns[OWNER] != PyThread_get_thread_ident():
        result = PyObject_Vectorcall(word(call, OTHER_THREAD), passed, 0, 0)
        if result == 0:
            Py_DecRef(call)
            return 0
        Py_DecRef(result)
        fits = False
    if keywords != 0 and fits:
        for place in range(count, word(names, SIZE)):
            passed[place + 1] = 0
        for place in range(word(keywords, SIZE)):
            name, value = word(keywords, ITEMS + place), given[all_given + place]
            if name == word(call, CLIENT):
                fits = fits and count == all_given and word(value, KIND) == word(zero, KIND)
                number = value
            else:
                at = place_of(name, names)
                if at < 0:
                    at = place_of_old(name, names, word(call, OLD))
                fits = fits and at >= count and passed[at + 1] == 0
                if fits:
                    passed[at + 1] = value
                    total = max(total, at + 1)
    fits = fits and fill(passed, count, total, names, word(call, DEFAULTS))
    fits = fits and total >= word(names, SIZE) - word(word(call, DEFAULTS), SIZE)
    key = made = 0
    has_answers = word(call, KNOWN) != clients
    if fits:
        made = plain_numbers(call, passed, total)
        if has_answers or has_failures(call):
            key = key_of(passed, total, number, zero, word(call, CLIENT))
    result = valid_answer(call, key) if key != 0 and has_answers else 0
    failure = 0
    if result != 0:
        Py_IncRef(result)
    elif key != 0 and has_failures(call):
        failure = found(word(word(word(call, FAILED), ITEMS), FAILURES), key)
        if failure != 0:
            Py_IncRef(failure)
            raise_again(call, failure)
            Py_DecRef(failure)
    if result != 0 or failure != 0:
        Py_DecRef(key)
        if made != 0:
            give_up(made, passed, total)
        Py_DecRef(call)
        return result
    client = found(clients, number) if fits else 0
    forget(changed)
    if client == 0:
        result = PyObject_Vectorcall(callee, given, all_given, keywords)
    else:
        passed[0] = client
        Py_IncRef(client)
        turns[RUNNING] += 1
        result = PyObject_Vectorcall(word(call, COMMAND), passed, total + 1, 0)
        turns[RUNNING] -= 1
        Py_DecRef(client)
        if result == 0 and PyErr_Occurred() != word(call, ERROR):
            kind, value, trace = words(), words(), words()
            take_exception(kind, value, trace)
            if trace[0] != 0:
                Py_DecRef(trace[0])
            result = PyObject_Vectorcall(word(call, FAILURE), value, 1, 0)
            Py_DecRef(kind[0])
            Py_DecRef(value[0])
        elif result == 0 and word(call, FAILED) != clients:
            if key == 0:
                key = key_of(passed, total, number, zero, word(call, CLIENT))
            if key != 0:
                keep_failure(call, key)
        elif key != 0 and result != 0 and has_answers:
            keep(call, key, result)
    if key != 0:
        Py_DecRef(key)
    if made != 0:
        give_up(made, passed, total)
    forget(changed)
    Py_DecRef(call)
    return result
"""


def command_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


FRONT = Front(command_call, EntrySignature(SOURCE))
vars(command_call)["front"] = FRONT

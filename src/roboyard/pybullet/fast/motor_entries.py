"""Commands of motors as machine code; see `fast_entries`.

One motor takes numbers or lists of one number, several take lists of numbers or of lists of one. A largest
impulse that is another than before is written to the World and to MuJoCo's arrays at once; a function of
Python notes what is switched on or off. A motor of which the impulse is not known goes to the Python
functions.
"""

from __future__ import annotations

from roboyard.native.entry_parts import NUMBER, WHOLE, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.bullet_rules.motor_kernels import write_motor
from roboyard.pybullet.fast.fast_entries import PARTS

_READ = f"""{PARTS}{parts(NUMBER, WHOLE)}
COMMAND, PREPARED, NONE, TRUE, ONE, PENDING, TIME_STEP, FORM, UNSET, TORQUES, IN_USE = range(3, 14)
WRENCHES, EFFORTS, DOFS, ROOM = range(3, 7)  # for torques
FLAT, NESTED, SINGLE, PLAIN = range(4)  # lists of numbers, of lists of one, lists of one number, numbers
COMMANDS, PARAMETERS, MOTORS, TARGETS, ROWS, LIMITS, IMPULSES, READ, FORCE = range(3, 12)
BOUNDS, FRICTIONS, RATE, SWITCH = range(12, 16)
FIXED = -2  # instead of a degree of freedom
JOINT, POSITION, VELOCITY, LIMIT, KP, KD, FASTEST = range(7)
NOT_DONE, DONE, FAILED = range(3)

@part
def number_in(values, k, is_nested):
    if not is_nested:
        return item(values, k)
    inner = PySequence_GetItem(values, k)
    if inner == 0:
        PyErr_Clear()
        return np.nan
    found = item(inner, 0) if has_length(inner, 1) else np.nan
    Py_DecRef(inner)
    return found

@part
def read_plain(given, count, defaults, table):
    for column in range(1, 7):
        table[0, column] = number(given[column + 3]) if column + 3 < count else defaults[column]
    return True

@part
def read_one(given, count, state, defaults, table):
    for column in range(1, 6):
        values = given[column + 3] if column + 3 < count else word(state, NONE)
        if column < 4:
            if values != word(state, NONE) and not has_length(values, 1):
                return False
            table[0, column] = defaults[column] if values == word(state, NONE) else item(values, 0)
        elif column + 3 >= count:
            table[0, column] = defaults[column]
        else:
            if word(values, KIND) != word(word(state, UNSET), KIND):
                return False
            table[0, column] = PyFloat_AsDouble(values)
    return True

@part
def read(given, count, state, length, defaults, table, joints, is_nested):
    for k in range(length):
        index = whole_item(given[2], k)
        if index < 0 or index >= joints:
            return False
        table[k, JOINT], table[k, FASTEST] = index, 0.0
        for column in range(1, 6):
            values = given[column + 3] if column + 3 < count else word(state, NONE)
            if values == word(state, NONE):
                table[k, column] = defaults[column]
            else:
                table[k, column] = number_in(values, k, is_nested and column < 4)
    return True
"""
_TORQUES = """
@part
def read_torques(given, length, room, dofs, form):
    total = 0.0
    for k in range(length):
        index = whole_item(given[2], k) if form < SINGLE else whole(given[2])
        if index < 0 or index >= len(dofs):
            return False
        if (form == NESTED or form == SINGLE) and dofs[index] < 0 and dofs[index] != FIXED:
            return False
        room[k, 0] = index
        room[k, 1] = number(given[6]) if form == PLAIN else number_in(given[6], k, form == NESTED)
        total += room[k, 1]
    return total - total == 0.0

@part
def add_torques(state, given, count, form):
    for place in (4, 5, 7, 8):
        if form != PLAIN and place < count and given[place] != word(state, NONE):
            return False
    bodies = found(word(state, TORQUES), given[0])
    body, length = found(bodies, given[1]) if bodies != 0 else 0, 1
    if body == 0:
        return False
    Py_IncRef(body)
    if form < SINGLE:
        length = PySequence_Size(given[2])
        if length < 0:
            PyErr_Clear()
    fits = length >= 1 and (form == PLAIN or has_length(given[6], length))
    room, dofs = matrix(word(body, ROOM)), integers(word(body, DOFS))
    efforts, wrenches = numbers(word(body, EFFORTS)), word(body, WRENCHES)
    fits = fits and length <= len(room) and read_torques(given, length, room, dofs, form)
    if fits:
        for k in range(length):
            dof = dofs[np.int64(room[k, 0])]
            if dof >= 0:
                efforts[dof] += room[k, 1]
        PyObject_SetAttr(wrenches, word(state, PENDING), word(state, TRUE))
    Py_DecRef(body)
    return fits
"""
_MOTORS = f"""{_READ}{_TORQUES}
@part
def is_known(limit, impulse, known):
    return known >= 0.0 and (impulse > 0.0 or limit == 0.0)

@part
def switch(state, body, joint, is_off):
    passed, index = words(), PyLong_FromLongLong(joint)
    passed[0], passed[1] = index, word(state, TRUE if is_off else NONE)
    done = PyObject_Vectorcall(word(body, SWITCH), passed, 2, 0)
    Py_DecRef(index)
    if done == 0:
        return False
    Py_DecRef(done)
    return True

@part
def fits_table(state, body, table, rows, length, seconds, form):
    impulses, driven = numbers(word(body, IMPULSES)), 0
    for k in range(length):
        total = 0.0
        for column in range(1, 7):
            total += table[k, column]
        joint, limit = np.int64(table[k, JOINT]), table[k, LIMIT]
        if total - total != 0.0 or not limit >= 0.0:
            return False
        if rows[joint] >= 0:
            driven += 1
            if not is_known(limit, limit * seconds, impulses[joint]):
                return False
    return driven > 0 or form == PLAIN or form == FLAT  # where joints of any other kind have no motor

@part
def write_bound(body, joint, row, impulse):
    impulses, bounds = numbers(word(body, IMPULSES)), matrix(word(body, BOUNDS))
    frictions = numbers(word(body, FRICTIONS))
    impulses[joint] = bounds[row, 1] = impulse
    bounds[row, 0] = 0.0
    frictions[row] = impulse * numbers(word(body, RATE))[0]

@part
def write(state, body, table, rows, length, mode, seconds):
    motors, targets = matrix(word(body, MOTORS)), matrix(word(body, TARGETS))
    limits, impulses, is_bound = matrix(word(body, LIMITS)), numbers(word(body, IMPULSES)), False
    for k in range(length):
        joint = np.int64(table[k, JOINT])
        row = rows[joint]
        if row < 0:
            continue
        goal = kp = fastest = 0.0
        if mode == 2:
            goal = min(max(table[k, POSITION], limits[joint, 0]), limits[joint, 1])
            kp, fastest = table[k, KP], max(table[k, FASTEST], 0.0)
        _loop(motors, targets, row, mode, goal, table[k, VELOCITY], kp, table[k, KD], fastest)
        impulse = table[k, LIMIT] * seconds
        if (impulse == 0.0) != (impulses[joint] == 0.0) and not switch(state, body, joint, impulse == 0.0):
            return False
        if impulse != impulses[joint]:
            write_bound(body, joint, row, impulse)
            is_bound = True
    if is_bound:
        PyObject_SetAttr(word(body, COMMANDS), word(state, IN_USE), word(state, NONE))
    return True

@part
def command(state, body, given, count, mode, form):
    length = 1
    if form < SINGLE:
        length = PySequence_Size(given[2])
        if length < 0:
            PyErr_Clear()
    if (mode != 0 or form == NESTED or form == SINGLE) and mode != 2:
        return NOT_DONE
    table, rows = matrix(word(body, READ)), integers(word(body, ROWS))
    if length < 1 or length > len(table):
        return NOT_DONE
    for place in range(4, count if form < SINGLE else 4):
        if given[place] != word(state, NONE) and not has_length(given[place], length):
            return NOT_DONE
    defaults = (0.0, 0.0, 0.0, PyFloat_AsDouble(word(body, FORCE)), 0.1, 1.0, 0.0)
    if form < SINGLE:
        if not read(given, count, state, length, defaults, table, len(rows), form == NESTED):
            return NOT_DONE
    else:
        index = whole(given[2])
        if index < 0 or index >= len(rows):
            return NOT_DONE
        table[0, JOINT], table[0, FASTEST] = index, 0.0
        if form == PLAIN:
            read_plain(given, count, defaults, table)
        elif not read_one(given, count, state, defaults, table):
            return NOT_DONE
    time_step = attribute(word(body, PARAMETERS), word(state, TIME_STEP))
    pending = attribute(word(body, COMMANDS), word(state, PENDING))
    if time_step == 0 or pending == 0 or PyDict_Size(pending) != 0:
        return NOT_DONE
    seconds = PyFloat_AsDouble(time_step)
    if not fits_table(state, body, table, rows, length, seconds, form):
        return NOT_DONE
    return DONE if write(state, body, table, rows, length, mode, seconds) else FAILED

def entry(state, given, count, keywords):
    fits = keywords == 0 and count >= 4 and word(given[3], KIND) == word(word(state, ONE), KIND)
    mode, form = whole(given[3]) if fits else -1, PyLong_AsLongLong(word(state, FORM))
    if mode == 1:
        most = 10 if form == PLAIN else 9 if form == FLAT else 7
        if 7 <= count <= most and add_torques(state, given, count, form):
            Py_IncRef(word(state, NONE))
            return word(state, NONE)
        fits = False
    if count > 9 and form != PLAIN:
        # a largest velocity, and damping of joints that have one degree of freedom here
        fastest = word(state, UNSET if form == SINGLE else NONE)
        fits = fits and count <= (11 if form == SINGLE else 10) and given[9] == fastest
        if count > 10 and fits:
            fits = word(given[10], KIND) == word(word(state, UNSET), KIND)
    if fits and count <= 11:
        body = prepared(state, given[0], given[1])
        if body != 0:
            Py_IncRef(body)
            done = command(state, body, given, count, mode, form)
            Py_DecRef(body)
            if done == FAILED:
                return 0
            if done == DONE:
                Py_IncRef(word(state, NONE))
                return word(state, NONE)
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""
MOTORS = Front(write_motor, EntrySignature(_MOTORS))
"""setJointMotorControl2, setJointMotorControlArray and their forms for joints of any kind."""

vars(MOTORS.core)["front"] = MOTORS

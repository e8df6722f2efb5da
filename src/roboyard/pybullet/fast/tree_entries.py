"""calculateInverseDynamics and calculateMassMatrix as machine code; see `fast_entries`."""

from __future__ import annotations

from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.bullet_rules.tree_kernels import Tree, inverse_dynamics_of, mass_matrix_of
from roboyard.pybullet.fast.fast_entries import PARTS

_ARRAYS = {"rows": "integers", "parents": "integers", "kinds": "integers", "columns": "integers"} | {
    "joints": "integers", "frame": "numbers", "body_mass": "numbers", "jnt_qposadr": "integers",
    "qpos0": "numbers",
}  # fmt: skip
"""Arrays of a tree that are no matrices of numbers."""
_TREE = ", ".join(
    f"{_ARRAYS.get(name, 'matrix')}(word(body, ARRAYS + {place}))"
    for place, name in enumerate(Tree._fields[:-1])
)
_SOURCE = f"""{PARTS}
COMMAND, PREPARED, NONE, TRUE, ZERO, APPLIED, REVISION = range(3, 10)
SCENE, PARAMETERS, GRAVITY, POSE, GIVEN, JOINTS, OUT, MATRIX, FREE, COUNT, FLOATING, ARRAYS = range(3, 15)

@part
def copied(into, first, values, length):
    if not has_length(values, length):
        return False
    total = 0.0
    for k in range(length):
        into[first + k] = item(values, k)
        total += into[first + k]
    return total - total == 0.0

@part
def tuple_of(numbers):
    made = PyTuple_New(len(numbers))
    for k in range(len(numbers)):
        PyTuple_SetItem(made, k, PyFloat_FromDouble(numbers[k]))
    return made

def entry(state, given, count, keywords):
    has_flags = count == LISTS + 3 and given[LISTS + 2] == word(state, ZERO)
    if keywords == 0 and (has_flags or count == LISTS + 2):
        body = prepared(state, given[0], given[1])
        if body != 0:
            Py_IncRef(body)
            made = computed(state, body, given)
            Py_DecRef(body)
            if made != 0:
                return made
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""
_EFFORTS = f"""
LISTS = 3
{_SOURCE}
@part
def computed(state, body, given):
    scene, parameters = word(body, SCENE), word(body, PARAMETERS)
    movable, six = PyLong_AsLongLong(word(body, COUNT)), 6 * PyLong_AsLongLong(word(body, FLOATING))
    whole, speeds = movable + six + (1 if six else 0), movable + six
    if attribute(scene, word(state, APPLIED)) != attribute(parameters, word(state, REVISION)):
        return 0
    numbers_of = numbers(word(body, GIVEN))
    if not (
        copied(numbers_of, 0, given[2], whole)
        and copied(numbers_of, whole, given[3], speeds)
        and copied(numbers_of, whole + speeds, given[4], speeds)
    ):
        return 0
    out = numbers(word(body, OUT))
    _loop(
        {_TREE}, six, numbers(word(body, GRAVITY)), numbers(word(body, POSE)),
        numbers(word(body, JOINTS)), out,
    )
    return tuple_of(out)
"""
EFFORTS = Front(inverse_dynamics_of, EntrySignature(_EFFORTS))
"""calculateInverseDynamics."""
_MASSES = f"""
LISTS = 1
{_SOURCE}
@part
def computed(state, body, given):
    numbers_of, out = numbers(word(body, GIVEN)), matrix(word(body, MATRIX))
    if not copied(numbers_of, 0, given[2], PyLong_AsLongLong(word(body, COUNT))):
        return 0
    six = PyLong_AsLongLong(word(body, FLOATING))
    _loop({_TREE}, six, numbers(word(body, FREE)), numbers_of, out)
    made = PyTuple_New(len(out))
    for k in range(len(out)):
        PyTuple_SetItem(made, k, tuple_of(out[k]))
    return made
"""
MASSES = Front(mass_matrix_of, EntrySignature(_MASSES))
"""calculateMassMatrix."""

for _front in (EFFORTS, MASSES):
    vars(_front.core)["front"] = _front

"""getDynamicsInfo as machine code; see `fast_entries`.

The margin of a link's shapes is known after the Python function has looked it up once.
"""

from __future__ import annotations

from typing import Any

from roboyard._records import NamedTuple
from roboyard.native.entry_parts import ATTRIBUTE, FOUND, WHOLE, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.state.bodies.body_records import RIGID_BODY


class InfoState(NamedTuple):
    """State of the command; the machine code has the same order."""

    command: Any
    none: None = None
    true: bool = True
    base: int = -1
    scene: str = "scene"
    bodies: str = "bodies"
    kind: str = "kind"
    links: str = "links"
    joints: str = "joint_count"
    bounds: str = "_bounds"
    margin: str = "margin"
    is_round: str = "is_round"
    changed: str = "collision_margin"
    frame: str = "frame"
    of_frame: tuple[str, ...] = ("position", "quaternion")
    fields: tuple[str, ...] = (
        *("mass", "friction", "moments", "restitution", "rolling_friction", "spinning_friction"),
        *("contact_damping", "contact_stiffness"),
    )
    """Attributes of a link; those after the third come after the frame."""
    shapes: str = "shapes"


_INFO = f"""
KIND, SIZE, ITEMS = 1, 2, 3  # of any object, tuples and lists, in words
COMMAND, NONE, TRUE, BASE, SCENE, BODIES, BODY_KIND, LINKS, JOINTS, BOUNDS, MARGIN, ROUND = range(3, 15)
CHANGED, FRAME, OF_FRAME, FIELDS, SHAPES = range(15, 20)
{parts(ATTRIBUTE, FOUND, WHOLE)}
@part
def put(made, place, value):
    Py_IncRef(value)
    PyTuple_SetItem(made, place, value)

@part
def margin_of(state, record, link, number):
    box = found(attribute(attribute(record, word(state, SHAPES)), word(state, BOUNDS)), number)
    if box == 0:
        return 0
    changed = attribute(link, word(state, CHANGED))
    is_own = changed == word(state, NONE) or attribute(box, word(state, ROUND)) == word(state, TRUE)
    return attribute(box, word(state, MARGIN)) if is_own else changed

@part
def info(state, record, given):
    kind, number = attribute(record, word(state, BODY_KIND)), given
    if whole(kind) == {RIGID_BODY}:
        number = word(state, BASE)
    place = whole(number)
    if not -1 <= place < whole(attribute(record, word(state, JOINTS))):
        return 0
    link = word(word(attribute(record, word(state, LINKS)), ITEMS), place + 1)
    margin = margin_of(state, record, link, number)
    if margin == 0:
        return 0
    frame, fields = attribute(link, word(state, FRAME)), word(state, FIELDS)
    made = PyTuple_New(12)
    for k in range(3):
        put(made, k, attribute(link, word(fields, ITEMS + k)))
    for k in range(2):
        put(made, 3 + k, attribute(frame, word(word(state, OF_FRAME), ITEMS + k)))
    for k in range(3, 8):
        put(made, 2 + k, attribute(link, word(fields, ITEMS + k)))
    put(made, 10, kind)
    put(made, 11, margin)
    return made

def entry(state, given, count, keywords):
    integer = word(word(state, BASE), KIND)
    fits = keywords == 0 and count == 3
    if fits and word(given[1], KIND) == integer and word(given[2], KIND) == integer:
        scene = attribute(given[0], word(state, SCENE))
        record = found(attribute(scene, word(state, BODIES)), given[1]) if scene != 0 else 0
        made = info(state, record, given[2]) if record != 0 and whole(given[2]) >= -1 else 0
        if made != 0:
            return made
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


def info_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


INFO = Front(info_call, EntrySignature(_INFO))
"""getDynamicsInfo."""
vars(info_call)["front"] = INFO

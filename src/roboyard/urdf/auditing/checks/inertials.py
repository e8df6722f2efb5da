"""Masses, centres of mass and inertia tensors."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from roboyard.poses import Array
from roboyard.shapes.inertia import principal_moments
from roboyard.urdf.auditing.draft import Draft, DraftInertial, DraftLink, Place
from roboyard.urdf.auditing.findings import BLOCKS, MISBEHAVES, UNTIDY
from roboyard.urdf.auditing.registry import Fault, Faults, check
from roboyard.urdf.auditing.solids import link_solid, link_volumes
from roboyard.urdf.xml import line_of

DENSEST, LIGHTEST = 25_000.0, 0.5
"""kg/m³: osmium has 22,600, air 1.2."""
HEAVIEST, LIGHTEST_ROBOT = 20_000.0, 1e-3
"""kg"""


def _inertials(draft: Draft) -> Iterator[tuple[DraftLink, DraftInertial]]:
    return ((link, link.inertial) for link in draft.links if link.inertial is not None)


def _with_tensor(draft: Draft) -> Iterator[tuple[DraftLink, float, Array]]:
    """Links that have mass and a tensor, the tensor in the inertial frame."""
    for link, inertial in _inertials(draft):
        tensor = inertial.matrix()
        if inertial.mass is not None and inertial.mass > 0 and tensor is not None:
            yield link, inertial.mass, tensor


def _line(inertial: DraftInertial) -> int | None:
    return line_of(inertial.element)


def needs_mass(draft: Draft, link: DraftLink) -> bool:
    """True where the link belongs to a moving body that no inertial of which gives any mass.

    A body is a set of links held together by fixed joints; the one that holds the root moves unless the robot
    has no joints at all (then it is an obstacle) or the root is a bare frame.
    """
    body = draft.tree.bodies[draft.tree.body_of[link.name]]
    members = [draft.link_by_name[name] for name in body]
    if any(m.inertial is not None and m.inertial.mass is not None and m.inertial.mass > 0 for m in members):
        return False
    holds_root = any(not draft.tree.parents[name] for name in body)
    return not holds_root


@check(
    "inertial-missing",
    MISBEHAVES,
    remedy="add <inertial>; repair computes it from the link's shapes at 1000 kg/m³",
    mendable=True,
    example="<link> with shapes, on a moving joint, without <inertial>",
)
def inertial_missing(draft: Draft) -> Faults:
    """A moving body has no `<inertial>` in any of its links, though it has shapes to compute one from."""
    for link in draft.links:
        if link.inertial is None and link.name and link.shapes and needs_mass(draft, link):
            mendable = link_solid(link) is not None
            yield Fault(at=link, message="it moves and has shapes but no <inertial>", mendable=mendable)


@check(
    "inertial-missing-frame",
    UNTIDY,
    remedy="give it a small mass and inertia, or join it by a fixed joint",
    example="<link/> without shapes between two moving joints",
)
def inertial_missing_frame(draft: Draft) -> Faults:
    """A moving body consists of bare frames: no mass and no shape anywhere."""
    for body in draft.tree.bodies:
        link = draft.link_by_name[body[0]]
        members = [draft.link_by_name[name] for name in body]
        if not any(member.shapes or member.inertial is not None for member in members) and needs_mass(
            draft, link
        ):
            yield Fault(at=link, message="a moving frame without mass; simulators add a small one or refuse")


@check(
    "mass-missing",
    BLOCKS,
    remedy='add <mass value="..."/>; repair computes it from the link\'s shapes',
    mendable=True,
    example="<inertial><inertia .../></inertial>",
)
def mass_missing(draft: Draft) -> Faults:
    """An `<inertial>` has no mass."""
    for link, inertial in _inertials(draft):
        mass = inertial.element.find("mass")
        if mass is None or not (mass.get("value") or "").strip():
            mendable = link_solid(link) is not None
            yield Fault(at=link, line=_line(inertial), message="<inertial> has no mass", mendable=mendable)


@check("mass-negative", BLOCKS, remedy="give the mass in kg", example='<mass value="-2"/>')
def mass_negative(draft: Draft) -> Faults:
    """A mass is negative."""
    for link, inertial in _inertials(draft):
        if inertial.mass is not None and inertial.mass < 0:
            yield Fault(at=link, line=_line(inertial), message=f"mass is negative ({inertial.mass:g} kg)")


@check(
    "mass-zero",
    MISBEHAVES,
    remedy="give the mass in kg; repair computes it from the link's shapes at 1000 kg/m³",
    mendable=True,
    example='<mass value="0"/> on a link with shapes on a moving joint',
)
def mass_zero(draft: Draft) -> Faults:
    """A moving body's mass is zero."""
    for link, inertial in _inertials(draft):
        if inertial.mass == 0.0 and link.name and needs_mass(draft, link):
            mendable = link_solid(link) is not None
            message = "it moves, but its mass is 0"
            yield Fault(at=link, line=_line(inertial), message=message, mendable=mendable)


@check(
    "inertia-missing",
    MISBEHAVES,
    remedy="add <inertia>; repair computes it from the link's shapes and mass",
    mendable=True,
    example='<inertial><mass value="1"/></inertial>',
)
def inertia_missing(draft: Draft) -> Faults:
    """A link has mass but no inertia tensor, or one without its diagonal."""
    for link, inertial in _inertials(draft):
        element = inertial.element.find("inertia")
        absent = element is None or any(not (element.get(key) or "").strip() for key in ("ixx", "iyy", "izz"))
        if absent and inertial.mass is not None and inertial.mass > 0:
            message = (
                f"mass {inertial.mass:g} kg, but no <inertia>"
                if element is None
                else "<inertia> is incomplete"
            )
            yield Fault(at=link, line=_line(inertial), message=message, mendable=link_solid(link) is not None)


@check(
    "inertia-zero",
    MISBEHAVES,
    remedy="repair computes it from the link's shapes and mass",
    mendable=True,
    example='<mass value="1"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>',
)
def inertia_zero(draft: Draft) -> Faults:
    """A link has mass, but its inertia tensor is zero: simulators refuse it or explode."""
    for link, mass, tensor in _with_tensor(draft):
        if not tensor.any():
            mendable = link_solid(link) is not None
            message = f"inertia is zero at a mass of {mass:g} kg"
            yield Fault(at=link, line=_line_of(link), message=message, mendable=mendable)


def _line_of(link: DraftLink) -> int | None:
    return link.line if link.inertial is None else _line(link.inertial)


@check(
    "inertia-not-positive",
    MISBEHAVES,
    remedy="repair computes it from the link's shapes and mass",
    mendable=True,
    example='<inertia ixx="0.01" ixy="0.05" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>',
)
def inertia_not_positive(draft: Draft) -> Faults:
    """An inertia tensor is not positive definite: turning the body would take or give energy for nothing."""
    for link, _, tensor in _with_tensor(draft):
        moments = principal_moments(tensor)
        if tensor.any() and moments[0] <= 0:
            shown = ", ".join(f"{moment:.3g}" for moment in moments)
            mendable = link_solid(link) is not None
            message = f"inertia is not positive definite (principal moments {shown} kg m²)"
            yield Fault(at=link, line=_line_of(link), message=message, mendable=mendable)


@check(
    "inertia-triangle",
    MISBEHAVES,
    remedy="repair computes it from the link's shapes and mass",
    mendable=True,
    example='<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="3"/>',
)
def inertia_triangle(draft: Draft) -> Faults:
    """One principal moment is larger than the other two together (by over 0.1 %), which no body has."""
    for link, _, tensor in _with_tensor(draft):
        small, middle, large = principal_moments(tensor)
        if small > 0 and small + middle < large * (1.0 - 1e-3):
            shown = f"{small:.3g}, {middle:.3g}, {large:.3g}"
            mendable = link_solid(link) is not None
            message = (
                f"no body has this inertia (principal moments {shown} kg m² break the triangle inequality)"
            )
            yield Fault(at=link, line=_line_of(link), message=message, mendable=mendable)


@check(
    "inertia-out-of-scale",
    MISBEHAVES,
    remedy="give it in kg m² about the centre of mass",
    example="(a 1 kg hand with 500 kg m², given in kg mm²)",
)
def inertia_out_of_scale(draft: Draft) -> Faults:
    """The inertia is far too large or too small for the link's mass and size: wrong units, mostly."""
    for link, mass, tensor in _with_tensor(draft):
        moments = principal_moments(tensor)
        if link.bounds is None or moments[0] <= 0:
            continue
        reach = 0.5 * float(np.linalg.norm(link.bounds[1] - link.bounds[0]))
        gyration = math.sqrt(moments[2] / mass)
        if not 0 < reach < 1e6:
            continue
        if gyration > 4.0 * reach + 0.02 or gyration < reach / 100.0:
            big = "large" if gyration > reach else "small"
            figures = f"radius of gyration {gyration:.3g} m, shapes reach {reach:.3g} m"
            message = f"inertia is too {big} for its size: {figures}"
            yield Fault(at=link, line=_line_of(link), message=message)


@check(
    "center-of-mass-far",
    MISBEHAVES,
    remedy="give the centre of mass in the link frame, in metres",
    example='<inertial><origin xyz="12 0 3"/> on a link of 0.1 m',
)
def center_of_mass_far(draft: Draft) -> Faults:
    """The centre of mass lies far outside the link's shapes (by over half their size)."""
    for link, inertial in _inertials(draft):
        if link.bounds is None or not inertial.mass:
            continue
        lower, upper = link.bounds
        center = inertial.origin[:3, 3]
        slack = 0.5 * float(np.linalg.norm(upper - lower)) + 0.02
        outside = np.maximum(np.maximum(lower - center, center - upper), 0.0)
        distance = float(np.linalg.norm(outside))
        if distance > slack:
            message = f"its centre of mass lies {distance:.3g} m outside its shapes"
            yield Fault(at=link, line=_line(inertial), message=message)


@check(
    "mass-density",
    MISBEHAVES,
    remedy="check the mass (kg) and the size of the shapes (m)",
    example="(50 kg in a cube of 5 cm)",
)
def mass_density(draft: Draft) -> Faults:
    """A link is denser than any metal (over 25,000 kg/m³) or lighter than air (under 0.5 kg/m³)."""
    for link, inertial in _inertials(draft):
        volumes = link_volumes(link)
        if volumes is None or inertial.mass is None or inertial.mass <= 0:
            continue
        smallest, largest = volumes
        if largest > 0 and inertial.mass / largest > DENSEST:
            message = f"{inertial.mass:g} kg in {largest * 1e6:.3g} cm³ is denser than any metal"
            yield Fault(at=link, line=_line(inertial), message=message)
        elif smallest > 1e-6 and inertial.mass / smallest < LIGHTEST:
            message = f"{inertial.mass:g} kg in {smallest:.3g} m³ is lighter than air"
            yield Fault(at=link, line=_line(inertial), message=message)


def _body_masses(draft: Draft) -> dict[int, float]:
    masses: dict[int, float] = {}
    for link in draft.link_by_name.values():
        if link.inertial is not None and link.inertial.mass is not None and link.inertial.mass > 0:
            body = draft.tree.body_of[link.name]
            masses[body] = masses.get(body, 0.0) + link.inertial.mass
    return masses


@check(
    "mass-neighbours",
    MISBEHAVES,
    remedy="check both masses; simulators lose accuracy beyond about 100 to 1",
    example="(a hand of 20 kg on a wrist of 0.01 kg)",
)
def mass_neighbours(draft: Draft) -> Faults:
    """A moving body carries a neighbour over 500 times as heavy as itself."""
    masses = _body_masses(draft)
    tree = draft.tree
    for joint in draft.moving_joints:
        if joint.parent not in tree.body_of or joint.child not in tree.body_of or joint.type == "floating":
            continue
        inner, outer = tree.body_of[joint.parent], tree.body_of[joint.child]
        if inner not in masses or outer not in masses:
            continue
        if masses[outer] > 500.0 * masses[inner]:
            message = f"carries {masses[outer]:g} kg on a body of {masses[inner]:g} kg"
            yield Fault(at=joint, message=message, links=(joint.parent, joint.child))


@check(
    "mass-total",
    MISBEHAVES,
    remedy="give masses in kg",
    example="(an arm whose links sum to 40,000: grams)",
)
def mass_total(draft: Draft) -> Faults:
    """The whole robot weighs under a gram or over 20 t."""
    masses = [link.inertial.mass for link in draft.links if link.inertial is not None and link.inertial.mass]
    total = sum(mass for mass in masses if mass > 0)
    if not any(True for _ in draft.moving_joints) or total == 0:
        return
    if total > HEAVIEST or total < LIGHTEST_ROBOT:
        robot = Place(who="robot", line=line_of(draft.root))
        yield Fault(at=robot, message=f"its links weigh {total:.4g} kg together")


@check(
    "inertial-copied",
    UNTIDY,
    remedy="give each link its own mass and inertia",
    example="(every link with mass 1 and inertia 0.01)",
)
def inertial_copied(draft: Draft) -> Faults:
    """Three or more links of different size have one and the same `<inertial>`: placeholders, mostly."""
    groups: dict[tuple[float, ...], list[DraftLink]] = {}
    for link, mass, tensor in _with_tensor(draft):
        key = (
            mass,
            *tensor.ravel(),
            *np.diag(np.asarray(link.inertial.origin if link.inertial else np.eye(4))),
        )
        groups.setdefault(tuple(float(number) for number in key), []).append(link)
    for links in groups.values():
        sizes = [np.sort(link.bounds[1] - link.bounds[0]) for link in links if link.bounds is not None]
        if len(sizes) < 3:
            continue
        smallest, largest = np.min(sizes, axis=0), np.max(sizes, axis=0)
        if (largest > 1.1 * smallest + 1e-3).any():
            named = ", ".join(f'"{link.name}"' for link in links[:6]) + (", ..." if len(links) > 6 else "")
            yield Fault(
                at=links[0],
                line=_line_of(links[0]),
                links=tuple(link.name for link in links[:50]),
                message=f"{len(links)} links of different size have the same inertial ({named})",
            )

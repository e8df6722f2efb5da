"""Masses and inertia tensors that are missing or impossible."""

from __future__ import annotations

from collections.abc import Iterator

from roboyard.audit.findings import ERROR, INFO, WARNING
from roboyard.audit.registry import Fault, Faults, check
from roboyard.audit.solids import link_solid
from roboyard.description.urdf.elements import InertialElement, LinkElement
from roboyard.description.urdf.parse import UrdfElements
from roboyard.description.urdf.xml import line_of
from roboyard.shapes.inertia import principal_moments
from roboyard.shapes.valid_inertia import rod_inertia
from roboyard.transforms import Array


def inertials_of(urdf: UrdfElements) -> Iterator[tuple[LinkElement, InertialElement]]:
    """Links that have an `<inertial>`."""
    return ((link, link.inertial) for link in urdf.links if link.inertial is not None)


def with_tensor(urdf: UrdfElements) -> Iterator[tuple[LinkElement, float, Array]]:
    """Yield links with their mass (kg) and their (3, 3) tensor in the inertial frame (kg m²)."""
    for link, inertial in inertials_of(urdf):
        tensor = inertial.matrix()
        if inertial.mass is not None and inertial.mass > 0 and tensor is not None:
            yield link, inertial.mass, tensor


def inertial_line(link: LinkElement) -> int | None:
    """Line of the link's `<inertial>`, or of the link."""
    return link.line if link.inertial is None else line_of(link.inertial.element)


_NO_SHAPES = "give it in kg m² about the centre of mass; there are no shapes to compute it from"


def _from_shapes(link: LinkElement) -> tuple[bool, str | None]:
    """Whether repair can compute the link's inertia, and the remedy where it cannot."""
    return (True, None) if link_solid(link) is not None else (False, _NO_SHAPES)


def needs_mass(urdf: UrdfElements, link: LinkElement) -> bool:
    """True where the link belongs to a moving body that no inertial of which gives any mass."""
    return urdf.tree.body_of[link.name] in urdf.massless_bodies


@check(
    "inertial-missing",
    WARNING,
    remedy="add <inertial>; repair computes it from the link's shapes at 1000 kg/m³",
    fixable=True,
    example="<link> with shapes, on a moving joint, without <inertial>",
)
def inertial_missing(urdf: UrdfElements) -> Faults:
    """A moving body has no `<inertial>` in any of its links, though it has shapes to compute one from."""
    body_of = urdf.tree.body_of
    seen = {
        body_of[link.name]
        for link in urdf.links
        if link.name and link.visuals and needs_mass(urdf, link) and link_solid(link) is not None
    }
    for link in urdf.links:
        if link.inertial is None and link.name and link.shapes and needs_mass(urdf, link):
            if not link.visuals and body_of[link.name] in seen:
                continue  # collision shapes alone around a visible link: a safety volume, not mass
            fixable = link_solid(link) is not None
            message = "it moves and has shapes but no <inertial>"
            remedy = None if fixable else "add <inertial>; no size of its shapes is known to compute it from"
            yield Fault(at=link, message=message, fixable=fixable, remedy=remedy)


@check(
    "inertial-missing-frame",
    INFO,
    remedy="give it a small mass and inertia, or join it by a fixed joint",
    example="<link/> without shapes between two moving joints",
)
def inertial_missing_frame(urdf: UrdfElements) -> Faults:
    """A moving body consists of bare frames: no mass and no shape anywhere."""
    for body in urdf.tree.bodies:
        link = urdf.link_by_name[body[0]]
        members = [urdf.link_by_name[name] for name in body]
        if not any(member.shapes or member.inertial is not None for member in members) and needs_mass(
            urdf, link
        ):
            yield Fault(at=link, message="a moving frame without mass; simulators add a small one or refuse")


@check(
    "mass-missing",
    ERROR,
    remedy='add <mass value="..."/>; repair computes it from the link\'s shapes',
    fixable=True,
    example="<inertial><inertia .../></inertial>",
)
def mass_missing(urdf: UrdfElements) -> Faults:
    """An `<inertial>` has no mass."""
    for link, inertial in inertials_of(urdf):
        mass = inertial.element.find("mass")
        if mass is None or not (mass.get("value") or "").strip():
            fixable = link_solid(link) is not None
            yield Fault(
                at=link, line=line_of(inertial.element), message="<inertial> has no mass", fixable=fixable
            )


@check("mass-negative", ERROR, remedy="give the mass in kg", example='<mass value="-2"/>')
def mass_negative(urdf: UrdfElements) -> Faults:
    """A mass is negative."""
    for link, inertial in inertials_of(urdf):
        if inertial.mass is not None and inertial.mass < 0:
            yield Fault(
                at=link, line=line_of(inertial.element), message=f"mass is negative ({inertial.mass:g} kg)"
            )


@check(
    "mass-zero",
    WARNING,
    remedy="give the mass in kg; repair computes it from the link's shapes at 1000 kg/m³",
    fixable=True,
    example='<mass value="0"/> on a link with shapes on a moving joint',
)
def mass_zero(urdf: UrdfElements) -> Faults:
    """A moving body's mass is zero."""
    for link, inertial in inertials_of(urdf):
        if inertial.mass == 0.0 and link.name and needs_mass(urdf, link):
            fixable = link_solid(link) is not None
            message = "it moves, but its mass is 0"
            yield Fault(at=link, line=line_of(inertial.element), message=message, fixable=fixable)


@check(
    "inertia-missing",
    WARNING,
    remedy="add <inertia>; repair computes it from the link's shapes and mass",
    fixable=True,
    example='<inertial><mass value="1"/></inertial>',
)
def inertia_missing(urdf: UrdfElements) -> Faults:
    """A link has mass but no inertia tensor, or one without its diagonal."""
    for link, inertial in inertials_of(urdf):
        element = inertial.element.find("inertia")
        absent = element is None or any(not (element.get(key) or "").strip() for key in ("ixx", "iyy", "izz"))
        if absent and inertial.mass is not None and inertial.mass > 0:
            message = (
                f"mass {inertial.mass:g} kg, but no <inertia>"
                if element is None
                else "<inertia> is incomplete"
            )
            line = line_of(inertial.element)
            fixable, remedy = _from_shapes(link)
            yield Fault(at=link, line=line, message=message, fixable=fixable, remedy=remedy)


@check(
    "inertia-zero",
    WARNING,
    remedy="repair computes it from the link's shapes and mass",
    fixable=True,
    example='<mass value="1"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>',
)
def inertia_zero(urdf: UrdfElements) -> Faults:
    """A link has mass, but its inertia tensor is zero: simulators refuse it or diverge."""
    body_of = urdf.tree.body_of
    turned = {body_of[link.name] for link, _, tensor in with_tensor(urdf) if link.name and tensor.any()}
    for link, mass, tensor in with_tensor(urdf):
        if not tensor.any():
            # fixed to a link that has inertia, a point mass does no harm
            severity = INFO if body_of.get(link.name) in turned else None
            fixable, remedy = _from_shapes(link)
            message = f"inertia is zero at a mass of {mass:g} kg"
            yield Fault(
                at=link,
                line=inertial_line(link),
                message=message,
                fixable=fixable,
                remedy=remedy,
                severity=severity,
            )


@check(
    "inertia-not-positive",
    WARNING,
    remedy="repair computes it from the link's shapes and mass; where a file rounds the least moment of a "
    "rod to zero, it raises that moment",
    fixable=True,
    example='<inertia ixx="0.01" ixy="0.05" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>',
)
def inertia_not_positive(urdf: UrdfElements) -> Faults:
    """An inertia tensor is not positive definite: rotation would have negative energy."""
    for link, _, tensor in with_tensor(urdf):
        moments = principal_moments(tensor)
        if tensor.any() and moments[0] <= 0:
            shown = ", ".join(f"{moment:.3g}" for moment in moments)
            fixable, remedy = (True, None) if rod_inertia(tensor) is not None else _from_shapes(link)
            message = f"inertia is not positive definite (principal moments {shown} kg m²)"
            line = inertial_line(link)
            yield Fault(at=link, line=line, message=message, fixable=fixable, remedy=remedy)


@check(
    "inertia-triangle",
    WARNING,
    remedy="repair computes it from the link's shapes and mass; without shapes it raises the smaller moments",
    fixable=True,
    example='<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="3"/>',
)
def inertia_triangle(urdf: UrdfElements) -> Faults:
    """One principal moment is larger than the other two together (by over 0.1 %), which no body has."""
    for link, _, tensor in with_tensor(urdf):
        small, middle, large = principal_moments(tensor)
        if small > 0 and small + middle < large * (1.0 - 1e-3):
            shown = f"{small:.3g}, {middle:.3g}, {large:.3g}"
            message = (
                f"no body has this inertia (principal moments {shown} kg m² break the triangle inequality)"
            )
            yield Fault(at=link, line=inertial_line(link), message=message)

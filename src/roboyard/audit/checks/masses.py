"""Masses and inertias that are implausible for the link's size or its neighbours."""

from __future__ import annotations

import math

import numpy as np

from roboyard.audit.checks.inertials import inertial_line, inertials_of, with_tensor
from roboyard.audit.findings import INFO, WARNING
from roboyard.audit.registry import Fault, Faults, check
from roboyard.audit.solids import link_volumes
from roboyard.description.urdf.elements import LinkElement
from roboyard.description.urdf.numbers import Location
from roboyard.description.urdf.parse import UrdfElements
from roboyard.description.urdf.xml import line_of
from roboyard.shapes.inertia import principal_moments

DENSEST, LIGHTEST = 25_000.0, 0.5
"""kg/m³: osmium has 22,600, air 1.2."""
HEAVIEST, LIGHTEST_ROBOT = 20_000.0, 1e-3
"""kg"""


@check(
    "inertia-out-of-scale",
    WARNING,
    remedy="give it in kg m² about the centre of mass",
    example="(a 1 kg hand with 500 kg m², given in kg mm²)",
)
def inertia_out_of_scale(urdf: UrdfElements) -> Faults:
    """The inertia is far too large or too small for the link's mass and size: wrong units, mostly."""
    for link, mass, tensor in with_tensor(urdf):
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
            yield Fault(at=link, line=inertial_line(link), message=message)


@check(
    "center-of-mass-far",
    WARNING,
    remedy="give the centre of mass in the link frame, in metres",
    example='<inertial><origin xyz="12 0 3"/> on a link of 0.1 m',
)
def center_of_mass_far(urdf: UrdfElements) -> Faults:
    """The centre of mass is far outside the link's shapes (by over half their size)."""
    for link, inertial in inertials_of(urdf):
        if link.bounds is None or not inertial.mass:
            continue
        lower, upper = link.bounds
        center = inertial.origin[:3, 3]
        slack = 0.5 * float(np.linalg.norm(upper - lower)) + 0.02
        outside = np.maximum(np.maximum(lower - center, center - upper), 0.0)
        distance = float(np.linalg.norm(outside))
        if distance > slack:
            message = f"its centre of mass is {distance:.3g} m outside its shapes"
            yield Fault(at=link, line=line_of(inertial.element), message=message)


@check(
    "mass-density",
    WARNING,
    remedy="check the mass (kg) and the size of the shapes (m)",
    example="(50 kg in a cube of 5 cm)",
)
def mass_density(urdf: UrdfElements) -> Faults:
    """A link is denser than any metal (over 25,000 kg/m³) or lighter than air (under 0.5 kg/m³)."""
    for link, inertial in inertials_of(urdf):
        volumes = link_volumes(link)
        if volumes is None or inertial.mass is None or inertial.mass <= 0:
            continue
        smallest, largest = volumes
        if largest > 0 and inertial.mass / largest > DENSEST:
            message = f"{inertial.mass:g} kg in {largest * 1e6:.3g} cm³ is denser than any metal"
            yield Fault(at=link, line=line_of(inertial.element), message=message)
        elif smallest > 1e-6 and inertial.mass / smallest < LIGHTEST:
            message = f"{inertial.mass:g} kg in {smallest:.3g} m³ is lighter than air"
            yield Fault(at=link, line=line_of(inertial.element), message=message)


def _body_masses(urdf: UrdfElements) -> dict[int, float]:
    masses: dict[int, float] = {}
    for link in urdf.link_by_name.values():
        if link.inertial is not None and link.inertial.mass is not None and link.inertial.mass > 0:
            body = urdf.tree.body_of[link.name]
            masses[body] = masses.get(body, 0.0) + link.inertial.mass
    return masses


@check(
    "mass-neighbours",
    WARNING,
    remedy="check both masses; simulators lose accuracy beyond about 100 to 1",
    example="(a hand of 20 kg on a wrist of 0.01 kg)",
)
def mass_neighbours(urdf: UrdfElements) -> Faults:
    """A moving body carries a neighbour of over 500 times its mass."""
    masses = _body_masses(urdf)
    tree = urdf.tree
    for joint in urdf.moving_joints:
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
    WARNING,
    remedy="give masses in kg",
    example="(an arm whose links sum to 40,000: grams)",
)
def mass_total(urdf: UrdfElements) -> Faults:
    """The total mass is under 1 g or over 20 t."""
    masses = [link.inertial.mass for link in urdf.links if link.inertial is not None and link.inertial.mass]
    total = sum(mass for mass in masses if mass > 0)
    if not any(True for _ in urdf.moving_joints) or total == 0:
        return
    if total > HEAVIEST or total < LIGHTEST_ROBOT:
        robot = Location(who="robot", line=line_of(urdf.root))
        yield Fault(at=robot, message=f"its total mass is {total:.4g} kg")


@check(
    "inertial-copied",
    INFO,
    remedy="give each link its own mass and inertia",
    example="(every link with mass 1 and inertia 0.01)",
)
def inertial_copied(urdf: UrdfElements) -> Faults:
    """Three or more links of different size have one and the same `<inertial>`: placeholders, mostly."""
    groups: dict[tuple[float, ...], list[LinkElement]] = {}
    for link, mass, tensor in with_tensor(urdf):
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
                line=inertial_line(links[0]),
                links=tuple(link.name for link in links[:50]),
                message=f"{len(links)} links of different size have the same inertial ({named})",
            )

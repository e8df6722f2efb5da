"""Masses and inertias, from the link's shapes."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence

import numpy as np

from roboyard.audit.registry import Fault
from roboyard.audit.solids import link_solid
from roboyard.description.model import INERTIA_KEYS
from roboyard.description.urdf.elements import LinkElement
from roboyard.repair.registry import Change, Changes, RepairContext, change, fix, rounded
from roboyard.shapes.inertia import DEFAULT_DENSITY
from roboyard.shapes.valid_inertia import rod_inertia, valid_inertia
from roboyard.transforms import Array


def _links(faults: Sequence[Fault]) -> list[tuple[Fault, LinkElement]]:
    return [(fault, fault.at) for fault in faults if isinstance(fault.at, LinkElement)]


def _child(parent: ET.Element, tag: str) -> ET.Element:
    found = parent.find(tag)
    return ET.SubElement(parent, tag) if found is None else found


def _write_tensor(inertial: ET.Element, tensor: Array) -> None:
    element = _child(inertial, "inertia")
    for key, (row, column) in zip(
        INERTIA_KEYS, ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)), strict=True
    ):
        value = float(tensor[row, column])
        element.set(key, rounded(0.0 if abs(value) < 1e-9 * float(np.trace(tensor)) else value))


def _described(inertial: ET.Element) -> str:
    return " ".join(ET.tostring(inertial, encoding="unicode").split())


def _from_shapes(faults: Sequence[Fault]) -> Changes:
    """Write mass, centre of mass and tensor of the link's shapes at the default density."""
    for fault, link in _links(faults):
        solid = link_solid(link)
        assert solid is not None  # the check found it fixable
        solid = solid.scaled_to(solid.mass * DEFAULT_DENSITY)
        old = link.element.find("inertial")
        before = "no <inertial>" if old is None else _described(old)
        element = ET.Element("inertial") if old is None else old
        for tag in ("origin", "mass", "inertia"):
            for child in element.findall(tag):
                element.remove(child)
        ET.SubElement(element, "origin", xyz=rounded([*solid.center]), rpy="0 0 0")
        ET.SubElement(element, "mass", value=rounded(solid.mass))
        _write_tensor(element, solid.inertia)
        if old is None:
            link.element.insert(0, element)
        yield change(fault, before, f"{_described(element)} ({solid.solid} at {DEFAULT_DENSITY:g} kg/m³)")


@fix("inertial-missing")
def new_inertial(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Write an `<inertial>` of the link's shapes at 1000 kg/m³."""
    yield from _from_shapes(faults)


@fix("mass-missing")
def new_mass(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Write the `<inertial>` of the link's shapes at 1000 kg/m³."""
    yield from _from_shapes(faults)


@fix("mass-zero")
def real_mass(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Write the `<inertial>` of the link's shapes at 1000 kg/m³."""
    yield from _from_shapes(faults)


def _tensor_from_shapes(faults: Sequence[Fault]) -> Changes:
    """Write the tensor of the link's shapes, scaled to the mass that is given; mass and centre stay."""
    for fault, link in _links(faults):
        inertial = link.inertial
        assert inertial is not None
        solid = link_solid(link)
        assert solid is not None
        assert inertial.mass
        solid = solid.scaled_to(inertial.mass)
        turn = inertial.origin[:3, :3]
        before = _described(inertial.element)
        _write_tensor(inertial.element, turn.T @ solid.inertia @ turn)
        yield change(fault, before, f"{_described(inertial.element)} ({solid.solid} at the given mass)")


@fix("inertia-missing")
def new_tensor(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Compute the tensor from the shapes and the mass."""
    yield from _tensor_from_shapes(faults)


@fix("inertia-zero")
def real_tensor(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Compute the tensor from the shapes and the mass."""
    yield from _tensor_from_shapes(faults)


@fix("inertia-not-positive")
def positive_tensor(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Raise a rod's moment that was rounded to zero; else compute the tensor from the shapes and the mass."""
    others = []
    for fault, link in _links(faults):
        tensor = _tensor(link)
        rod = None if tensor is None else rod_inertia(tensor)
        if rod is None:
            others.append(fault)
        else:
            yield _written(fault, link, rod, "a thin rod's")
    yield from _tensor_from_shapes(others)


@fix("inertia-triangle")
def possible_tensor(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Compute the tensor from the shapes and the mass; without shapes raise the two smaller moments."""
    others = []
    for fault, link in _links(faults):
        tensor = None if link_solid(link) is not None else _tensor(link)
        raised = None if tensor is None else valid_inertia(tensor)
        if raised is None:
            others.append(fault)
        else:
            yield _written(fault, link, raised, "its smaller moments raised until a body can have them")
    yield from _tensor_from_shapes(others)


def _tensor(link: LinkElement) -> Array | None:
    return None if link.inertial is None else link.inertial.matrix()


def _written(fault: Fault, link: LinkElement, tensor: Array, why: str) -> Change:
    """Write a tensor; return the change."""
    assert link.inertial is not None
    element = link.inertial.element
    before = _described(element)
    _write_tensor(element, tensor)
    return change(fault, before, f"{_described(element)} ({why})")

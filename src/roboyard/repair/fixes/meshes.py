"""Scales and axes of meshes."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence

from roboyard.audit.checks.mesh_axes import Y_TO_Z, y_up_shapes
from roboyard.audit.checks.mesh_sizes import is_plainly_in_millimetres, unit_slip
from roboyard.audit.registry import Fault
from roboyard.description.urdf.elements import LinkElement, ShapeElement
from roboyard.description.urdf.xml import line_of
from roboyard.repair.registry import Change, Changes, RepairContext, change, fix, rounded, shown, text
from roboyard.transforms import rpy_from_matrix


@fix("mesh-scale-single")
def three_factors(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Write the one factor three times."""
    for fault in faults:
        shape = fault.at
        assert isinstance(shape, ShapeElement)
        assert shape.mesh is not None
        before = shown(shape.mesh.element)
        shape.mesh.element.set("scale", text(shape.mesh.scale))
        yield change(fault, before, shown(shape.mesh.element))


@fix("mesh-units-differ")
def in_metres(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Divide the scale of meshes that are plainly in millimetres by 1000."""
    for fault in faults:
        link = fault.at
        assert isinstance(link, LinkElement)
        for big, small in ((link.collisions, link.visuals), (link.visuals, link.collisions)):
            if unit_slip(big, small) is None or not is_plainly_in_millimetres(big, small):
                continue
            for shape in big:
                assert shape.mesh is not None
                before = shown(shape.mesh.element)
                shape.mesh.element.set("scale", rounded([factor / 1000.0 for factor in shape.mesh.scale]))
                after = shown(shape.mesh.element)
                yield Change(element=shape.who, line=line_of(shape.mesh.element), before=before, after=after)


@fix("mesh-up-axis")
def z_up(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Turn the origins of meshes that are drawn with y up by a quarter turn about x."""
    if not faults:
        return
    for link in context.urdf.links:
        for shape in y_up_shapes(link):
            assert shape.mesh is not None
            origin = shape.element.find("origin")
            if origin is None:
                origin = ET.Element("origin")
                shape.element.insert(0, origin)
            before = shown(origin)
            frame = shape.origin @ Y_TO_Z
            origin.set("xyz", rounded([*frame[:3, 3]]))
            origin.set("rpy", rounded([*rpy_from_matrix(frame[:3, :3])]))
            if len(set(shape.mesh.scale)) > 1:  # its factors are along the turned axes
                x, y, z = shape.mesh.scale
                shape.mesh.element.set("scale", text([x, z, y]))
            yield Change(element=shape.who, line=shape.line, before=before, after=shown(origin))

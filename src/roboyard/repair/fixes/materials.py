"""Colours."""

from __future__ import annotations

from collections.abc import Sequence

from roboyard.audit.registry import Fault
from roboyard.description.urdf.elements import MaterialElement
from roboyard.repair.registry import Changes, RepairContext, change, fix, rounded, shown, text


@fix("color-alpha-missing")
def opaque(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Add an alpha of 1 (or of 255, on that scale)."""
    for fault in faults:
        material = fault.at
        assert isinstance(material, MaterialElement)
        color = material.element.find("color")
        assert color is not None
        assert material.rgba is not None
        before = shown(color)
        color.set("rgba", text((*material.rgba, 1.0)))
        yield change(fault, before, shown(color))


@fix("color-range")
def from_255(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Divide a colour on a scale of 0 to 255 by 255; an alpha within 0 to 1 stays."""
    for fault in faults:
        material = fault.at
        assert isinstance(material, MaterialElement)
        color = material.element.find("color")
        assert color is not None
        assert material.rgba is not None
        before = shown(color)
        red, green, blue, *alpha = material.rgba
        opacity = alpha[0] if alpha else 1.0
        scaled = [red / 255.0, green / 255.0, blue / 255.0, opacity / 255.0 if opacity > 1.0 else opacity]
        color.set("rgba", rounded(scaled))
        yield change(fault, before, shown(color))

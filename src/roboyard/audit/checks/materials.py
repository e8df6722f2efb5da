"""Colours and textures."""

from __future__ import annotations

from roboyard.audit.findings import INFO, WARNING
from roboyard.audit.registry import Fault, Faults, check
from roboyard.description.urdf.elements import MaterialElement
from roboyard.description.urdf.parse import UrdfElements


@check(
    "color-range",
    WARNING,
    remedy="divide by 255; colours run from 0 to 1",
    fixable=True,
    example='<color rgba="255 128 0 255"/>',
)
def color_range(urdf: UrdfElements) -> Faults:
    """A colour runs from 0 to 255, or is negative."""
    for material in urdf.materials:
        rgba = material.rgba
        if rgba is not None and (max(rgba) > 1.0 + 1e-6 or min(rgba) < 0):
            shown = " ".join(f"{value:g}" for value in rgba)
            fixable = runs_to_255(rgba)
            message = f"colour ({shown}) is outside 0 to 1"
            yield Fault(at=material, message=message, fixable=fixable)


def runs_to_255(rgba: tuple[float, ...]) -> bool:
    """True for a colour that can only be meant on a scale of 0 to 255."""
    return min(rgba) >= 0 and 2.0 <= max(rgba[:3]) <= 255.0 and all(v == int(v) for v in rgba[:3])


@check(
    "color-alpha-missing",
    INFO,
    remedy="add 1 for opaque",
    fixable=True,
    example='<color rgba="0.2 0.2 0.2"/>',
)
def color_alpha_missing(urdf: UrdfElements) -> Faults:
    """A colour has three numbers; it is read as opaque."""
    for material in urdf.materials:
        if material.rgba is not None and len(material.rgba) == 3:
            yield Fault(at=material, message="colour of 3 numbers; read as opaque")


@check(
    "color-invisible",
    INFO,
    remedy="give an alpha above 0, or remove the visual",
    example='<color rgba="1 0 0 0"/>',
)
def color_invisible(urdf: UrdfElements) -> Faults:
    """A colour's alpha is zero: the shape is invisible."""
    for material in urdf.materials:
        if material.rgba is not None and len(material.rgba) == 4 and material.rgba[3] == 0:
            yield Fault(at=material, message="alpha is 0; the shape is invisible")


def _is_bare(material: MaterialElement) -> bool:
    return material.element.find("color") is None and material.element.find("texture") is None


@check(
    "material-undefined",
    INFO,
    remedy="define it at the robot's level, or correct the name",
    example='<material name="gray"/> defined nowhere',
)
def material_undefined(urdf: UrdfElements) -> Faults:
    """A visual names a material that is defined nowhere; it gets the default colour."""
    defined = {material.name for material in urdf.materials if not _is_bare(material)}
    reported: set[str] = set()
    for material in urdf.materials:
        if material.link and _is_bare(material) and material.name not in defined | reported:
            reported.add(material.name)
            yield Fault(at=material, message="it is named but defined nowhere")


@check(
    "material-redefined",
    INFO,
    remedy="give each colour its own name",
    example='<material name="m"><color rgba="1 0 0 1"/></material> and again with another colour',
)
def material_redefined(urdf: UrdfElements) -> Faults:
    """One material name has two colours; programs differ on which one counts."""
    first: dict[str, MaterialElement] = {}
    reported: set[str] = set()
    for material in urdf.materials:
        if not material.name or material.rgba is None:
            continue
        known = first.setdefault(material.name, material)
        if known.rgba != material.rgba and material.name not in reported:
            reported.add(material.name)
            yield Fault(at=material, message=f"it has another colour in line {known.line}")


@check(
    "texture-missing",
    INFO,
    remedy="add the image, or remove the <texture>",
    example='<texture filename="gone.png"/>',
)
def texture_missing(urdf: UrdfElements) -> Faults:
    """A texture image is not found in the robot's folders; the plain colour is used."""
    for material in urdf.materials:
        if material.texture is not None and material.texture.path is None:
            texture = material.element.find("texture")
            uri = "" if texture is None else texture.get("filename")
            problem = (material.texture.problem or "").rpartition("; ")[0]
            yield Fault(at=material, message=f"texture {uri!r}: {problem or 'not found'}")

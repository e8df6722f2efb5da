"""Text of small robots made of primitive shapes, for tests of morphology."""

from __future__ import annotations

from roboyard.description import RobotDescription, load_description


def link(name: str, shape: str = "", mass: float = 0.0, centre: str = "0 0 0", origin: str = "0 0 0") -> str:
    """A link with one collision shape (`box x y z`, `sphere r` or `cylinder r l`) and a mass."""
    kind, *sizes = shape.split() or [""]
    fields = {
        "box": f'size="{" ".join(sizes)}"',
        "sphere": f'radius="{"".join(sizes[:1])}"',
        "cylinder": f'radius="{"".join(sizes[:1])}" length="{"".join(sizes[1:2])}"',
    }
    inertial = (
        f'<inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        if mass
        else ""
    )
    collision = (
        f'<collision><origin xyz="{origin}"/><geometry><{kind} {fields[kind]}/></geometry></collision>'
        if kind
        else ""
    )
    return f'<link name="{name}">{inertial}{collision}</link>'


def joint(
    name: str,
    parent: str,
    child: str,
    *,
    kind: str = "revolute",
    xyz: str = "0 0 0",
    rpy: str = "0 0 0",
    axis: str = "0 0 1",
    limits: tuple[float, float] | None = (-1.0, 1.0),
    mimic: str = "",
) -> str:
    """A joint; without `limits` only types that need none are valid."""
    limit = (
        f'<limit lower="{limits[0]}" upper="{limits[1]}" effort="10" velocity="2"/>'
        if limits is not None and kind in ("revolute", "prismatic")
        else ""
    )
    direction = "" if kind == "fixed" else f'<axis xyz="{axis}"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/>{direction}{limit}{mimic}</joint>'
    )


def robot(*parts: str) -> RobotDescription:
    """Parse the parts as one URDF robot."""
    return load_description(f'<robot name="r">{"".join(parts)}</robot>')

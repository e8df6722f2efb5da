"""Load a scene by name, or from an MJCF, URDF or USD file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from roboyard.errors import DescriptionError, RoboyardError, unknown_name
from roboyard.scenes.empty_scene import empty
from roboyard.scenes.flat import home
from roboyard.scenes.scene import Scene, Vector3, world_or_new
from roboyard.scenes.tabletop_scene import tabletop
from roboyard.scenes.terrain_scene import terrain

if TYPE_CHECKING:
    from roboyard.sim import Body, World

SCENES: dict[str, Callable[[World | None], Scene]] = {
    "empty": empty,
    "tabletop": tabletop,
    "terrain": terrain,
    "home": home,
}
"""Built-in scenes by name."""
USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")


def check_scene(source: str | Path) -> None:
    """Check that a scene exists, without loading it.

    Raises:
        RoboyardError: no scene has this name.
        DescriptionError: the file is missing.
    """
    if isinstance(source, str) and source in SCENES:
        return
    path = Path(source)
    if not path.suffix:
        raise RoboyardError(
            f"{unknown_name('scene', str(source), SCENES)}; or give a .xml, .urdf or .usd file"
        )
    if not path.is_file():
        raise DescriptionError(f"no such scene file: {str(path)!r}; check the path", file=path)


def load_scene(source: str | Path, world: World | None = None) -> Scene:
    """Load a built-in scene by its name, or a scene file.

    An MJCF file keeps its joints, motors and free bodies. A URDF file is fixed to the world and keeps its
    joints. A USD stage gives static geometry; `Scene.notes` lists the skipped elements.

    Args:
        source: "empty", "tabletop", "terrain", "home", or the path of an MJCF (.xml, .mjcf), URDF or USD
            file.
        world: the world to add it to; a new one by default.

    Raises:
        RoboyardError: no scene has this name.
        DescriptionError: the file is missing, cannot be read or has no geometry.
        MissingExtraError: a USD file, but OpenUSD is not installed.
    """
    check_scene(source)
    if isinstance(source, str) and source in SCENES:
        return SCENES[source](world)
    path = Path(source)
    ending = path.suffix.lower()
    notes: tuple[str, ...] = ()
    place = world_or_new(world)
    if ending in USD_SUFFIXES:
        from roboyard.scenes.usd import read_usd

        descriptions, notes = read_usd(path)
        bodies = [place.add_description(d, fixed_base=True, drives=False) for d in descriptions]
    elif ending == ".urdf" or (ending == ".xml" and _root_tag(path) == "robot"):
        bodies = [place.add_urdf(path, fixed_base=True)]
    elif ending in (".xml", ".mjcf"):
        bodies = list(place.add_mjcf(path))
    else:
        raise DescriptionError(
            f"unknown scene format {ending!r}; give an MJCF (.xml, .mjcf), URDF or USD file", file=path
        )
    eye, target = _point_of_view(bodies)
    return Scene(
        name=path.stem,
        world=place,
        bodies={body.name: body for body in bodies},
        eye=eye,
        target=target,
        notes=notes,
    )


def _root_tag(path: Path) -> str:
    from roboyard.description.urdf.xml import read_xml

    return read_xml(path)[0].tag


def _point_of_view(bodies: list[Body]) -> tuple[Vector3, Vector3]:
    """Return a camera position that shows all bodies, and their middle (m)."""
    boxes = np.array([body.bounds for body in bodies])
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    middle = (low + high) / 2
    away = max(float(np.linalg.norm(high - low)), 1.0) * 1.15
    eye = middle + away * np.array([0.45, -0.68, 0.58])
    return (float(eye[0]), float(eye[1]), float(eye[2])), (
        float(middle[0]),
        float(middle[1]),
        float(middle[2]),
    )

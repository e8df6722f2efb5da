"""Any scene by name or by file: Roboyard's own, MJCF, URDF, USD."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from roboyard.errors import DescriptionError, RoboyardError, unknown_name
from roboyard.scenes.empty import empty
from roboyard.scenes.home import home
from roboyard.scenes.scene import Scene, Vector3, world_or_new
from roboyard.scenes.tabletop import tabletop
from roboyard.scenes.terrain import terrain

if TYPE_CHECKING:
    from roboyard.sim import Body, World

SCENES: dict[str, Callable[[World | None], Scene]] = {
    "empty": empty,
    "tabletop": tabletop,
    "terrain": terrain,
    "home": home,
}
"""Roboyard's own scenes."""
USD_ENDINGS = (".usd", ".usda", ".usdc", ".usdz")


def load_scene(source: str | Path, world: World | None = None) -> Scene:
    """A scene of Roboyard's own by its name, or anybody's from a file.

    An MJCF file keeps its joints, motors and free bodies. A URDF file is bolted to the world, its joints
    move. Of a USD stage the geometry is taken and stands still; `Scene.notes` says what was left out.

    Args:
        source: "empty", "tabletop", "terrain", "home", or the path of an MJCF (.xml, .mjcf), URDF or USD
            file.
        world: where to put it; a new world by default.

    Raises:
        RoboyardError: no scene of this name.
        DescriptionError: the file is missing, cannot be read, or holds nothing to stand on.
        MissingExtraError: a USD file without OpenUSD installed.
    """
    if isinstance(source, str) and source in SCENES:
        return SCENES[source](world)
    path = Path(source)
    if not path.suffix:
        raise RoboyardError(
            f"{unknown_name('scene', str(source), SCENES)}; or give a .xml, .urdf or .usd file"
        )
    if not path.is_file():
        raise DescriptionError(f"there is no scene file {str(path)!r}", file=path)
    ending = path.suffix.lower()
    notes: tuple[str, ...] = ()
    place = world_or_new(world)
    if ending in USD_ENDINGS:
        from roboyard.scenes.usd import read_usd

        descriptions, notes = read_usd(path)
        bodies = [place.add_description(d, fixed_base=True, drives=False) for d in descriptions]
    elif ending == ".urdf" or (ending == ".xml" and _root_tag(path) == "robot"):
        bodies = [place.add_urdf(path, fixed_base=True)]
    elif ending in (".xml", ".mjcf"):
        bodies = list(place.add_mjcf(path))
    else:
        raise DescriptionError(
            f"a scene is an MJCF (.xml, .mjcf), URDF or USD file; {ending} is none of them", file=path
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
    """Where to stand to see all of it, and its middle."""
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

"""What a shell offers for a robot or a scene; light, since it runs at every press of the tab key."""

from __future__ import annotations


def robot_names(incomplete: str) -> list[str]:
    """Registered robots whose names begin like this."""
    from roboyard.assets import assets_root
    from roboyard.paths import data_folder

    files = [*data_folder().glob("*/models/*/*.yaml"), *assets_root().glob("*/*.yaml")]
    names = {file.stem for file in files if file.stem == file.parent.name}
    return sorted(name for name in names if name.startswith(incomplete))


def viewed_names(incomplete: str) -> list[str]:
    """Registered robots, and bundled robots and things, whose names begin like this."""
    from roboyard.assets import OBJECTS, ROBOTS

    names = {*robot_names(incomplete), *ROBOTS, *OBJECTS}
    return sorted(name for name in names if name.startswith(incomplete))


def scene_names(incomplete: str) -> list[str]:
    """The scenes that have a name, where it begins like this."""
    return [name for name in ("empty", "tabletop", "terrain", "home") if name.startswith(incomplete)]

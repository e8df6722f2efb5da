"""Completions of robots and scenes for a shell; fast, since they run at every press of the Tab key."""

from __future__ import annotations


def robot_names(incomplete: str) -> list[str]:
    """Return the names of registered robots that begin with `incomplete`."""
    from roboyard.assets import assets_root
    from roboyard.paths import data_folder

    files = [*data_folder().glob("*/models/*/*.yaml"), *assets_root().glob("*/*.yaml")]
    names = {file.stem for file in files if file.stem == file.parent.name}
    return sorted(name for name in names if name.startswith(incomplete))


def viewed_names(incomplete: str) -> list[str]:
    """Return the names of all robots and objects, public robots too, that begin with `incomplete`."""
    from roboyard.assets import OBJECTS, ROBOTS
    from roboyard.robots.public_names import public_names

    names = {*robot_names(incomplete), *ROBOTS, *OBJECTS, *public_names()}
    return sorted(name for name in names if name.startswith(incomplete))


def scene_names(incomplete: str) -> list[str]:
    """Return the names of scenes that begin with `incomplete`."""
    return [name for name in ("empty", "tabletop", "terrain", "home") if name.startswith(incomplete)]

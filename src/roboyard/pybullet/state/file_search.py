"""Finding the files that scripts name."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from roboyard.pybullet.face.arguments import text
from roboyard.pybullet.face.commands import command

if TYPE_CHECKING:
    from roboyard.pybullet.connections import Client

_USUAL_FOLDERS = ("data", "../data", "../../data", "../../../data", "../../../../data")


@command()
def setAdditionalSearchPath(client: Client, path: str) -> None:
    """Folder where files are looked for that are not found from the working folder; the last call counts."""
    client.search_path = Path(text(path))


def find_file(client: Client, name: str) -> Path | None:
    """The file a script names: from the working folder, the search path, then a data folder nearby.

    Like Bullet, which puts these folders in front of any name, an absolute one that is not there included.
    """
    given = Path(name)
    if given.is_absolute():
        if given.is_file():
            return given
        given = given.relative_to(given.anchor)
    folders = [Path(), *([client.search_path] if client.search_path else []), *map(Path, _USUAL_FOLDERS)]
    for folder in folders:
        if (folder / given).is_file():
            return (folder / given).absolute()
    return None


def not_found_remedy(client: Client, name: str) -> str:
    """Where a missing file was looked for, and what to do."""
    folder = client.search_path
    looked = f"looked in {Path.cwd()}" + (f" and {folder.absolute()}" if folder else "")
    advice = (
        "check the name"
        if folder
        else "give an absolute path, or call setAdditionalSearchPath(pybullet_data.getDataPath()) first"
    )
    return f"no file {name!r}: {looked}; {advice}"

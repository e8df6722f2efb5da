"""Build a package beside its target folder, and move it in at the end.

    <data>/<dataset>/.import-<name>-<random>/object/    -> <data>/<dataset>/objects/robot/<name>/
    <data>/<dataset>/.import-<name>-<random>/model/     -> <data>/<dataset>/models/<name>/

Until the move nothing of the old import changes; see `roboyard.whole_moves` for the move.
"""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from roboyard.errors import ConfigError
from roboyard.paths import models_folder, objects_folder
from roboyard.whole_moves import (
    exchange,
    is_build_of,
    locked,
    mark_ready,
    marked,
    move_in,
    moves_of,
    put,
)


@dataclass(frozen=True, kw_only=True, slots=True)
class PackageFolders:
    """Where a robot's package goes."""

    data: Path
    dataset: str
    name: str

    @property
    def root(self) -> Path:
        """Folder of the dataset."""
        return self.data / self.dataset

    @property
    def object(self) -> Path:
        """Folder of the import."""
        return objects_folder(self.data, self.dataset, self.name)

    @property
    def model(self) -> Path:
        """Folder of the registered robot."""
        return models_folder(self.data, self.dataset, self.name)

    def moves(self, build: Path) -> tuple[tuple[Path, Path], ...]:
        """Part of a build folder, and where it goes."""
        return moves_of(self.data, self.dataset, self.name, build)


@contextmanager
def building(place: PackageFolders, *, overwrite: bool) -> Iterator[Path]:
    """A fresh build folder with `object/` and `model/`; what is in them is moved in if the block ends well.

    Raises:
        ConfigError: the robot exists and may not be overwritten, or another import of it is under way.
    """
    made = _missing_folders(place)
    try:
        place.root.mkdir(parents=True, exist_ok=True)
        with locked(place.root, place.name) as is_ours:
            if not is_ours:
                raise ConfigError(
                    f"another import of {place.name!r} is under way in {place.root}; wait for it to end"
                )
            _finish_cut_short(place)
            if not overwrite:
                _refuse_existing(place)
            # named before it is made, so that an interrupt in between leaves no folder behind
            build = place.root / f".import-{place.name}-{secrets.token_hex(4)}"
            try:
                build.mkdir(mode=0o700)
                (build / "object").mkdir()
                (build / "model").mkdir()
                yield build
                try:
                    _mark_ready(build)
                    _move_in(place, build)
                except BaseException:
                    if marked(build) is not None:
                        _move_in(place, build)  # half moved in is neither the old package nor the new one
                    raise
            finally:
                _clear(build)
    except BaseException:
        for folder in made:
            with suppress(OSError):
                folder.rmdir()  # only where it is empty
        raise


def _missing_folders(place: PackageFolders) -> list[Path]:
    """Folders above the package that do not exist yet, deepest first."""
    parents = [place.object.parent, place.object.parent.parent, place.model.parent, place.root]
    for folder in (place.data, *place.data.parents):
        parents.append(folder)
    return [folder for folder in dict.fromkeys(parents) if not folder.exists()]


def _refuse_existing(place: PackageFolders) -> None:
    for folder in (place.object, place.model):
        if folder.exists():
            raise ConfigError(
                f"robot {place.name!r} exists already in {folder}; "
                "give --overwrite (or overwrite: true), or another name"
            )


# ------------------------------------------------------------------------------------------------- moving in


def _mark_ready(build: Path) -> None:
    mark_ready(build)


def _move_in(place: PackageFolders, build: Path) -> None:
    move_in(build, place.moves(build), put_part=_put)


def _put(part: Path, target: Path) -> None:
    put(part, target, swap=_exchange)


def _exchange(a: Path, b: Path) -> bool:
    return exchange(a, b)


def _clear(build: Path) -> None:
    """Remove a build folder, unless it is marked: then the next import has a move to finish."""
    try:
        _remove_unmarked(build)
    except BaseException:  # an interrupt leaves nothing behind either
        _remove_unmarked(build)
        raise


def _remove_unmarked(build: Path) -> None:
    if marked(build) is None:
        shutil.rmtree(build, ignore_errors=True)


def _finish_cut_short(place: PackageFolders) -> None:
    """Finish the move of an import that was killed in it, and clear away what others left."""
    for build in sorted(place.root.glob(f".import-{place.name}-*")):
        if not is_build_of(build, place.name):
            continue
        _move_in(place, build)
        shutil.rmtree(build, ignore_errors=True)

"""Bullet's models of MJCF files. A file that has not changed is read once."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from roboyard._records import NamedTuple
from roboyard.pybullet.bullet_rules.models import BodyModel, bullet_model
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.readers.mjcf import UNNAMED, MjcfModel, load_mjcf
from roboyard.pybullet.readers.mjcf_inertia import bullet_bounds, bullet_moments

_CACHE_SIZE = 64


class LoadedModel(NamedTuple):
    """One model of a file."""

    part: MjcfModel
    model: BodyModel
    """That of the file's first reading, which all bodies of it share."""
    names: dict[int, bytes]
    """Joint index to its name, where that has another number than in the first reading."""


class _File(NamedTuple):
    """A file that was read."""

    models: list[tuple[MjcfModel, BodyModel]]
    first: int
    """Number of the first joint or body without a name."""
    counted: int
    """Number of these."""


_files: dict[tuple[Path, int, int, int], _File] = {}
"""By path, modification time, size and flags."""


def read_models(
    path: Path, search_paths: Sequence[Path], flags: int, *, uses_cache: bool
) -> list[LoadedModel]:
    """Return all models of a file, in file order.

    Args:
        path: MJCF file.
        search_paths: folders where meshes are searched after the file's own.
        flags: of loadMJCF.
        uses_cache: whether a file may be as it was when it was read before with the same time and size.

    Raises:
        DescriptionError: the file is not MJCF, or a number is not valid.
    """
    stamp = path.stat()
    key = path, stamp.st_mtime_ns, stamp.st_size, flags
    file = _files.get(key) if uses_cache else None
    if file is None:
        file = _read(path, search_paths, flags)
        if uses_cache and not any(part.names_meshes for part, _ in file.models):
            _files[key] = file
            while len(_files) > _CACHE_SIZE:
                del _files[next(iter(_files))]
        return [LoadedModel(part, model.copied(), {}) for part, model in file.models]
    ahead = UNNAMED.count - file.first
    UNNAMED.count += file.counted
    # a base that is freed is noted in the copy
    return [LoadedModel(part, model.copied(), _renamed(part, model, ahead)) for part, model in file.models]


def _read(path: Path, search_paths: Sequence[Path], flags: int) -> _File:
    first, models = UNNAMED.count, list[tuple[MjcfModel, BodyModel]]()
    for part in load_mjcf(path, search_paths, colors=bool(flags & c.MJCF_COLORS_FROM_FILE)):
        model = bullet_model(
            part.description, flags=flags, moments_of=bullet_moments(flags), bounds_of=bullet_bounds(flags)
        )
        model.has_two_spheres = not flags & c.URDF_USE_IMPLICIT_CYLINDER
        models.append((part, model))
    return _File(models, first, UNNAMED.count - first)


def _renamed(part: MjcfModel, model: BodyModel, ahead: int) -> dict[int, bytes]:
    """Return the names of joints without one in the file, with numbers that are so much larger."""
    names: dict[int, bytes] = {}
    for index, link in enumerate(model.links[1:]):
        counted = None if link.joint is None else part.counted.get(link.joint.name)
        if counted is not None:
            before, number, after = counted
            names[index] = f"{before}{number + ahead}{after}".encode()
    return names

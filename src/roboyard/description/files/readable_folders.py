"""Folders whose files a robot description may read; see `resolver` for what they are and why.

A description is untrusted input: symbolic links are resolved before a file's place is looked at.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path

from roboyard._records import dataclass
from roboyard.description.files.moved_files import is_mesh_or_image
from roboyard.description.files.workspaces import workspace_sources
from roboyard.shapes.cache import mesh_folder
from roboyard.shapes.readers.external_files import MESH_FOLDER

MAX_LEVELS = 8
"""Folders above a description in which packages are looked for."""
_URDF_FOLDERS = {"urdf", "urdfs", "mjcf", "robot", "robots", "xacro", "model", "models", "sdf", "description"}


@dataclass(frozen=True, kw_only=True)
class ReadableFolders:
    """The folders of one description; the arguments are those of `Resolver`."""

    base: Path | None
    real_base: Path | None
    packages: Mapping[str, Path]
    search_paths: Sequence[Path]
    readable: Sequence[Path]
    environment: Mapping[str, str]

    @cached_property
    def given(self) -> tuple[Path, ...]:
        """Folders that the caller or the environment names."""
        folders = [Path(folder) for folder in self.search_paths]
        for variable in ("ROS_PACKAGE_PATH", "GAZEBO_MODEL_PATH"):
            folders += [Path(part) for part in self.environment.get(variable, "").split(os.pathsep) if part]
        folders += self._installed
        return tuple(dict.fromkeys(Path(os.path.abspath(folder)) for folder in folders))  # noqa: PTH100

    @cached_property
    def _installed(self) -> tuple[Path, ...]:
        """Folders of installed packages, from the environment; the targets of their links are trusted."""
        prefixes = self.environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
        return tuple(Path(os.path.abspath(prefix)) / "share" for prefix in prefixes if prefix)  # noqa: PTH100

    @cached_property
    def above(self) -> tuple[Path, ...]:
        """The description's folder and those above it, nearest first, that may hold packages."""
        return () if self.base is None else _folders_above(self.base)

    @cached_property
    def package(self) -> Path | None:
        """The root of the package that the description belongs to."""
        return None if self.base is None else _package_root(self.base)

    @cached_property
    def trusted(self) -> tuple[Path, ...]:
        """Folders whose files are read by any path that leads to them."""
        roots = [*(Path(os.path.abspath(folder)) for folder in self.packages.values()), *self.given]  # noqa: PTH100
        roots += self.readable
        roots.append(Path(os.path.abspath(mesh_folder())))  # noqa: PTH100 - meshes of stages, written by us
        if self.package is not None:
            roots.append(self.package)
        if self.real_base is not None:
            roots.append(_package_root(self.real_base))
        return tuple(dict.fromkeys(roots))

    @cached_property
    def _workspaces(self) -> tuple[Path, ...]:
        return workspace_sources(self.above)

    def hold(self, file: Path, root: Path) -> bool:
        """Return whether a file, symbolic links resolved, is inside `root` or another of the folders."""
        if file.is_relative_to(root) and any(root.is_relative_to(share) for share in self._installed):
            return True
        real = file.resolve()
        try:
            if any(real.is_relative_to(self.real(folder)) for folder in self._readable(root)):
                return True
        except (OSError, RuntimeError, ValueError):  # links in a ring, a name that no file can have
            pass
        return any(_is_in_mesh_folder(real, self.real(folder)) for folder in self.above[1:3])

    def _readable(self, root: Path) -> Iterator[Path]:
        """Yield `root` and all folders whose files may be read; those that are searched for come last."""
        yield root
        yield from self.trusted
        yield from self._workspaces

    def is_own_package(self, folder: Path, root: Path) -> bool:
        """Return whether `folder` is a package, or no link out of `root`."""
        try:
            if self.real(folder).is_relative_to(self.real(root)):
                return True
        except (OSError, RuntimeError, ValueError):  # links in a ring, a name that no file can have
            return False
        return any((folder / manifest).is_file() for manifest in ("package.xml", "model.config"))

    def real(self, folder: Path) -> Path:
        """Return a folder with symbolic links resolved, as they led when it was first asked for."""
        found = self._resolved.get(folder)
        if found is None:
            found = self._resolved[folder] = folder.resolve()
        return found

    @cached_property
    def _resolved(self) -> dict[Path, Path]:
        return {}


def _is_in_mesh_folder(file: Path, folder: Path) -> bool:
    """True where `file` is in a folder beneath `folder` that is called as mesh folders are.

    That is a folder directly below; for files called as meshes and images are, also one up to three levels
    below, as in a collection of robots.
    """
    if not file.is_relative_to(folder):
        return False
    inner = file.relative_to(folder).parts[:-1]
    searched = inner[:3] if is_mesh_or_image(file) else inner[:1]
    return any(MESH_FOLDER.fullmatch(part) for part in searched)


def _folders_above(base: Path) -> tuple[Path, ...]:
    home = Path(os.path.expanduser("~"))  # noqa: PTH111
    folders: list[Path] = []
    for folder in (base, *base.parents)[: MAX_LEVELS + 1]:
        if folder == folder.parent or (folder in (home, home.parent) and folder != base):
            break
        folders.append(folder)
    return tuple(folders)


def _package_root(base: Path) -> Path:
    above = _folders_above(base)
    for folder in above:
        if (folder / "package.xml").is_file():
            return folder
    return base.parent if base.name.lower() in _URDF_FOLDERS and base.parent in above else base

"""Find the files that a robot description names, within the folders that it may read.

A description is untrusted input. A mesh or texture is opened only inside one of these roots, symbolic links
resolved before the check:

- the description's own tree: its package (the nearest folder above with a `package.xml`, at most 8 levels
  up), else its folder, or the parent of its folder where that is called as ROS packages call it (`urdf/`,
  `robots/`, ...); and meshes in folders called as mesh folders are, one or two levels up (`../meshes`,
  `../../arms/panda/meshes`, ...);
- for `package://NAME/...`: a folder called NAME that is, or stands beside, one of the 8 folders above the
  description, or in a `models/` there, as Gazebo's worlds have it (never a file system's root or a user's
  home); a package of that name anywhere in the workspace of the description (see
  `roboyard.description.files.workspaces`);
- what the caller gives: `packages`, `search_paths`; what the environment gives: `ROS_PACKAGE_PATH`,
  `GAZEBO_MODEL_PATH`, `AMENT_PREFIX_PATH`; and packages anywhere below those;
- meshes that Roboyard itself extracted from a USD stage into the user's cache folder.

A file that is in none of these places is looked for in the description's own tree by the end of its path (see
`roboyard.description.files.moved_files`), which finds the files of robots that were moved. Anything else
is reported as not found, with the remedy of naming its folder in `search_paths`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path

from roboyard._lazy import lazy_pattern
from roboyard._records import dataclass
from roboyard.description.files.beside import matching_files, moveit_configurations, nearest_name
from roboyard.description.files.moved_files import LEAST_SHARED, moved_file
from roboyard.description.files.readable_folders import ReadableFolders
from roboyard.description.files.workspaces import (
    package_folders,
    package_name,
    packages_below,
)
from roboyard.shapes.readers.external_files import MESH_FOLDER
from roboyard.untrusted.files import check_file
from roboyard.untrusted.percent_codes import unquoted

MAX_BYTES = 512 * 1024 * 1024
"""Largest file that is handed to another reader (bytes)."""
_DRIVE = lazy_pattern(r"[A-Za-z]:[\\/]")
_SCHEME = lazy_pattern(r"^([A-Za-z][A-Za-z0-9+.-]+)://(.*)$", re.S)


@dataclass(frozen=True, kw_only=True, slots=True)
class Resolved:
    """Where a URI led: `path` is None when it led nowhere, and `problem` then says why and what to do."""

    path: Path | None
    note: str | None = None
    problem: str | None = None


@dataclass(frozen=True, slots=True)
class _Candidate:
    root: Path
    """Folder that the file may not leave."""
    relative: str
    note: str | None = None


@dataclass(frozen=True, kw_only=True)
class Resolver:
    """Turns the URIs of one description into files.

    Args:
        base: folder of the description; None for one made in memory, which then needs roots from the caller.
        real_base: the same where the description's file is a symbolic link: the folder of the file itself.
        packages: package name to folder.
        search_paths: folders searched for relative paths, packages and models.
        readable: folders whose files may be read, but in which nothing is searched.
        environment: where the ROS and Gazebo search paths are looked up; `os.environ` by default.
    """

    base: Path | None = None
    real_base: Path | None = None
    packages: Mapping[str, Path] | None = None
    search_paths: Sequence[Path] = ()
    readable: Sequence[Path] = ()
    environment: Mapping[str, str] | None = None

    @classmethod
    def of_file(
        cls,
        file: Path | None,
        *,
        packages: Mapping[str, Path] | None = None,
        search_paths: Sequence[Path] = (),
        readable: Sequence[Path] = (),
    ) -> Resolver:
        """Return the resolver of a description's file; None for one made in memory."""
        return cls(
            base=None if file is None else Path(os.path.abspath(file)).parent,  # noqa: PTH100
            real_base=None if file is None else _real_base(file),
            packages={name: _path(folder) for name, folder in (packages or {}).items()},
            search_paths=[_path(folder) for folder in search_paths],
            readable=readable,
        )

    def resolve(self, uri: str) -> Resolved:
        """The file that `uri` names: package://, model://, file://, a relative or an absolute path."""
        text = uri.strip()
        if not text or "\0" in text:
            return Resolved(path=None, problem="the file name is blank; name a file")
        match = _SCHEME.match(text)
        scheme, rest = (match[1].lower(), match[2]) if match else ("", text)
        if scheme not in ("", "file", "package", "model"):
            problem = f"{scheme}:// is not fetched; download the file and name it by path or package://"
            return Resolved(path=None, problem=problem)
        seen: list[str] = []
        refused = folder = None
        for spelling, spelling_note in _spellings(rest):
            for candidate in self._candidates(scheme, spelling):
                lexical = Path(os.path.normpath(candidate.root / candidate.relative))
                seen.append(str(lexical))
                found, case_note = _find(lexical)
                if found is None:
                    folder = lexical if folder is None and _is_folder(lexical) else folder
                    continue
                if not self._folders.hold(found, candidate.root):
                    refused = refused or found
                    continue
                notes = [note for note in (candidate.note, spelling_note, case_note) if note]
                return Resolved(path=found, note="; ".join(notes) or None)
        moved = self._moved(scheme, rest)
        if moved is not None:
            return moved
        if refused is not None:
            return Resolved(path=None, problem=_outside(refused))
        if folder is not None:
            return Resolved(path=None, problem=f"{folder} is a folder; name a file")
        return Resolved(path=None, problem=self._not_found(scheme, rest, seen))

    def files_beside(self, pattern: str) -> tuple[Path, ...]:
        """Return the files beside the description that match a pattern such as `*.srdf`, nearest first.

        They are in its folder, in its package (top level, `srdf/`, `config/`), or in `config/` of a MoveIt
        configuration package beside it.
        """
        package = self._folders.package
        if self.base is None or package is None:
            return ()
        around = dict.fromkeys((self.base, self.base.parent if self.base != package else self.base))
        folders = [self.base]
        folders += [place / name for place in (*around, package) for name in ("srdf", "config")]
        folders += [package, *moveit_configurations(package)]
        found: dict[Path, None] = {}
        for folder in dict.fromkeys(folders):
            for file in matching_files(folder, pattern):
                if self._folders.hold(file, folder if folder.is_relative_to(package) else folder.parent):
                    found[file] = None
        return tuple(found)

    def refusal(self, file: Path) -> str | None:
        """Return why a file that another format names by its place is not opened; None where it may be.

        It has to be a regular file in one of the folders that the description may read.
        """
        try:
            check_file(file, MAX_BYTES)
        except FileNotFoundError:
            return f"{str(file)[:200]}: no such file; add it"
        except (OSError, ValueError) as error:
            return f"{str(file)[:200]}: {getattr(error, 'strerror', None) or error}"
        try:
            roots = self._folders.trusted if self.base is None else (self.base, *self._folders.trusted)
            if any(self._folders.hold(file, root) for root in roots):
                return None
        except (OSError, RuntimeError):  # links in a ring
            pass
        return _outside(file)

    def _moved(self, scheme: str, rest: str) -> Resolved | None:
        """The file of the description's own tree that a path from another tree means."""
        package = self._folders.package
        if package is None:
            return None
        path = unquoted(rest).replace("\\", "/")
        absolute = scheme == "file" or path.startswith("/") or _DRIVE.match(path) is not None
        deep = package != self.base or (package / "package.xml").is_file()
        found = moved_file(package, path, deep=deep, least=1 if absolute else LEAST_SHARED)
        if found is None or not self._folders.hold(found, package):
            return None
        where = found.relative_to(package).as_posix()
        return Resolved(path=found, note=f"not found; read from {where!r} in the robot's own folder")

    def _not_found(self, scheme: str, rest: str, seen: Sequence[str]) -> str:
        near = next(filter(None, map(self._nearest, seen)), None)
        if near is not None:
            return f"no such file; did you mean {near.name!r} in {near.parent}?"
        places = list(dict.fromkeys(str(Path(path).parent) for path in seen))
        looked = f" (looked in {', '.join(places[:3])}{', ...' if len(places) > 3 else ''})" if places else ""
        if scheme in ("package", "model"):
            name = rest.lstrip("/").partition("/")[0]
            home = self.package_folder(name)
            if home is not None:
                return (
                    f"no such file in the package's folder {home}; add it (`git lfs pull` fetches large ones)"
                )
            remedy = (
                f"name its folder with --package {name}=FOLDER (in Python pass packages={{{name!r}: folder}} "
                f"or search_paths=[folder that holds {name!r}])"
            )
        else:
            remedy = "add the file or pass its folder in search_paths"
        return f"no such file{looked}; {remedy}"

    def _nearest(self, path: str) -> Path | None:
        """Return the file beside a missing one with nearly its name, in a folder that may be read."""
        missing = Path(path)
        if not any(missing.is_relative_to(folder) for folder in self._folders.trusted):
            return None
        name = nearest_name(missing.parent, missing.name)
        near = None if name is None else missing.with_name(name)
        return near if near is not None and self._folders.hold(near, missing.parent) else None

    def package_folder(self, name: str) -> Path | None:
        """Return the folder of a package; None where it is not known."""
        for candidate in self._in_package(f"{name}/."):
            root = candidate.root
            if candidate.note is None and _is_folder(root) and name in (root.name, package_name(root)):
                return root
        return next((Path(folder) for known, folder in (self.packages or {}).items() if known == name), None)

    # ---------------------------------------------------------------------------------- where to look

    def _candidates(self, scheme: str, rest: str) -> Iterator[_Candidate]:
        if scheme in ("package", "model"):
            yield from self._in_package(rest.lstrip("/"))
        elif scheme == "file" or rest.startswith("/") or _DRIVE.match(rest):
            path = rest if scheme != "file" else "/" + rest.removeprefix("localhost").lstrip("/")
            yield from self._absolute(Path(path))
            if scheme == "file" and not rest.startswith("/"):  # file://meshes/x.stl, as some exporters write
                yield from self._relative(rest, "file:// with a relative path; read as relative to the file")
            for root in self._folders.given if scheme != "file" else ():
                yield _Candidate(root, rest.lstrip("/"), f"not found; read relative to {root.name}/")
        else:
            yield from self._relative(rest, None)

    def _absolute(self, path: Path) -> Iterator[_Candidate]:
        for root in self._folders.trusted:
            yield _Candidate(root, str(path))

    def _relative(self, rest: str, note: str | None) -> Iterator[_Candidate]:
        if self.base is not None:
            yield _Candidate(self.base, rest, note)
        for root in self._folders.given:
            yield _Candidate(root, rest, note)
        if self._folders.package is not None and self._folders.package != self.base:
            folder = self.base
            while folder is not None and folder != self._folders.package and folder != folder.parent:
                folder = folder.parent
                yield _Candidate(folder, rest, f"found relative to {folder.name}/, above the robot's folder")
        for folder in self._folders.above[1:3]:
            if MESH_FOLDER.fullmatch(rest.partition("/")[0]):
                yield _Candidate(folder, rest, f"found relative to {folder.name}/, above the robot's folder")

    def _in_package(self, rest: str) -> Iterator[_Candidate]:
        name, _, tail = rest.partition("/")
        if name in ("", ".", "..") or not tail:
            return
        for known, folder in (self.packages or {}).items():
            if known == name:
                yield _Candidate(Path(folder), tail)
        for root in self._folders.given:
            if self._folders.is_own_package(root / name, root):
                yield _Candidate(root / name, tail)
            if root.name == name or package_name(root) == name:
                yield _Candidate(root, tail)
        if self._folders.package is not None and package_name(self._folders.package) == name:
            yield _Candidate(self._folders.package, tail)
        for folder in self._folders.above:
            if folder.name == name:
                yield _Candidate(folder, tail)
            for place in (folder / name, folder / "models" / name):
                if self._folders.real(place).is_relative_to(self._folders.real(folder)):
                    yield _Candidate(place, tail)
        for root in (*self._folders.given, *package_folders(self._folders.above)):
            package = packages_below(root).get(name)
            if package is not None:
                yield _Candidate(package, tail)
        first, _, more = tail.partition("/")
        own = self._folders.package
        inner = [folder for folder in self._folders.above if more and folder.name == first]  # a part of it
        for folder in (*([] if own is None else [own]), *inner):
            note = f"package {name!r} was not found; its files were found in {folder.name}/"
            yield _Candidate(folder, more if folder in inner else tail, note)
        if self.base is not None:
            yield _Candidate(self.base, tail, f"package {name!r} was not found; read relative to the file")

    @cached_property
    def _folders(self) -> ReadableFolders:
        return ReadableFolders(
            base=self.base,
            real_base=self.real_base,
            packages=self.packages or {},
            search_paths=self.search_paths,
            readable=self.readable,
            environment=os.environ if self.environment is None else self.environment,
        )


def _path(folder: Path | str) -> Path:
    """Return a folder as a path; to make one of a path, of which there may be hundreds, takes long."""
    return folder if isinstance(folder, Path) else Path(folder)


def _outside(file: Path) -> str:
    return (
        f"{file} is outside the robot's folders, so it is not opened; "
        f"move it there or pass its folder in search_paths"
    )


def _real_base(file: Path) -> Path | None:
    """Folder of the file that a symbolic link leads to."""
    try:
        return file.resolve().parent if file.is_symlink() else None
    except (OSError, RuntimeError):  # links in a ring
        return None


def _spellings(rest: str) -> Iterator[tuple[str, str | None]]:
    """The path as written, then with percent codes and backslashes read as exporters mean them."""
    yield rest, None
    decoded = unquoted(rest)
    if decoded != rest and "\0" not in decoded:
        yield decoded, None
    if "\\" in rest:
        yield rest.replace("\\", "/"), 'backslashes in the file name read as "/"'


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def _find(path: Path) -> tuple[Path | None, str | None]:
    """`path` where it is a file; else the one file that differs from it in case alone, with a note."""
    try:
        if path.is_file():
            return path, None
        if path.exists():
            return None, None
    except (OSError, ValueError):
        return None, None
    folder = path.parent
    missing: list[str] = [path.name]
    while not folder.is_dir() and folder != folder.parent and len(missing) < 16:
        missing.insert(0, folder.name)
        folder = folder.parent
    try:
        for part in missing:
            wanted = part.casefold()
            # pathlib takes ten times as long for folders of thousands of files
            matches = [name for name in os.listdir(folder) if name.casefold() == wanted]  # noqa: PTH208
            if len(matches) != 1:
                return None, None
            folder /= matches[0]
        if not folder.is_file():
            return None, None
    except OSError:
        return None, None
    return folder, f"found as {folder.name!r}, which differs in upper and lower case"

"""Check an MJCF file before MuJoCo reads it: the files that it names, what it makes, and its numbers.

MuJoCo opens any file that a model names, waits at named pipes, makes as many copies as `<replicate>` asks for
and ends the process where memory runs out. A file is therefore read by Roboyard first, with its includes in
place; what MuJoCo then reads is that text, or the file itself where both read it alike.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import field
from pathlib import Path

from roboyard._records import dataclass
from roboyard.description.files.resolver import Resolver
from roboyard.description.urdf.xml import line_of, read_xml
from roboyard.errors import DescriptionError
from roboyard.untrusted.files import read_file

MAX_DEPTH = 450
"""Levels of elements; MuJoCo's XML reader has 500."""
MAX_ELEMENTS = 100_000
"""Elements, included files counted."""
MAX_COPIES = 5_000
"""Elements that `<replicate>`, `<composite>` and `<flexcomp>` make; MuJoCo's time grows with the square."""
MAX_PIXELS = 64 * 1024 * 1024
"""Pixels of all textures."""
MAX_HEIGHTS = 4096 * 4096
"""Points of a height field."""
MAX_ASSET_BYTES = 512 * 1024 * 1024
"""All files of meshes, height fields and skins (bytes)."""
MAX_SIZE = 1_000_000
"""Largest value in `<size>`."""
MAX_MEMORY = 2**30
"""Largest arena that a file may ask for (bytes); a world has one of its own."""
MAX_INCLUDES = 1_000
_FILE_KEYS = ("file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback")
_FOLDER_OF = {"mesh": "meshdir", "skin": "meshdir", "flexcomp": "meshdir", "model": "meshdir"}
MAX_MODELS = 50
"""Models that attach one another."""
_INCLUDED = "included-document"
_NOT_FINITE = re.compile(r"[-+]?(?:nan|inf(?:inity)?)", re.IGNORECASE)
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_AMOUNT = re.compile(r"\s*([0-9]+)\s*([KMGTPE]?)\s*", re.IGNORECASE)
_ENCODING = re.compile(rb"<\?xml[^>]*\sencoding\s*=\s*[\"']([^\"']*)[\"']")


@dataclass(frozen=True, kw_only=True, slots=True)
class MjcfSource:
    """The document that MuJoCo reads."""

    text: str | None
    """The document; None where MuJoCo reads the file itself."""
    file: Path | None
    """The file; None for text without one."""


@dataclass(kw_only=True, eq=False)
class _Check:
    """The counts so far of one model and the models that it attaches."""

    resolver: Resolver
    pictures: bool = True
    elements: int = 0
    pixels: int = 0
    bytes: int = 0
    models: dict[Path, int] = field(default_factory=dict)
    """File of an attached model to its number of elements."""


def checked_mjcf(
    source: str | Path, search_paths: Sequence[Path] = (), *, pictures: bool = True
) -> MjcfSource:
    """Check an MJCF file, or text, whose files are then relative to the working folder.

    Args:
        source: path of the file, or the XML itself.
        search_paths: folders whose files it may name besides those of its own.
        pictures: whether textures will be decoded, so that their pixels count.

    Raises:
        DescriptionError: it cannot be read, is no MJCF, names a file outside its folders, holds numbers that
            are not finite, or makes more than a world can hold.
    """
    text = source if isinstance(source, str) and "<mujoco" in source else None
    file = None if text is not None else Path(source)
    resolver = Resolver.of_file(file or Path.cwd() / "model.xml", search_paths=search_paths)
    check = _Check(resolver=resolver, pictures=pictures)
    root, changed = _read(text if text is not None else Path(source), check)
    _check_model(root, check, file, (file or Path.cwd() / "model.xml").absolute().parent)
    if changed:
        return MjcfSource(text=ET.tostring(root, encoding="unicode"), file=file)
    return MjcfSource(text=text, file=file)


def _read(source: str | Path, check: _Check) -> tuple[ET.Element, bool]:
    """The document with its includes in place, and whether MuJoCo would read another one from the source."""
    file = source if isinstance(source, Path) else None
    root, notes = read_xml(source, max_depth=MAX_DEPTH)
    if root.tag != "mujoco":
        remedy = "; use add_urdf" if root.tag == "robot" else ""
        raise DescriptionError(f"the root element is <{str(root.tag)[:40]}>, not <mujoco>{remedy}", file=file)
    changed = bool(notes) or not _is_plain_utf8(source)
    if _includes(root):
        _insert_includes(root, (file or Path.cwd() / "model.xml").absolute().parent, check, file)
        changed = True
    return root, changed


def _is_plain_utf8(source: str | Path) -> bool:
    """True where MuJoCo reads the same document; it takes all files for UTF-8."""
    if isinstance(source, str):
        data = source.encode("utf-8", "surrogatepass")
    else:
        data = read_file(source, MAX_ASSET_BYTES)
    declared = _ENCODING.match(data.removeprefix(b"\xef\xbb\xbf"))
    if declared and declared[1].lower() not in (b"utf-8", b"utf8", b"us-ascii", b"ascii"):
        return False
    try:
        return "\0" not in data.decode("utf-8")
    except UnicodeDecodeError:
        return False


def _includes(root: ET.Element) -> bool:
    return next(root.iter("include"), None) is not None


def _insert_includes(root: ET.Element, folder: Path, check: _Check, file: Path | None) -> None:
    """Replace each `<include>` by what the file holds; paths are relative to the model's folder."""
    seen: set[Path] = set() if file is None else {file.resolve()}
    todo = [(root, file)]
    while todo:
        parent, where = todo.pop()
        kept: list[ET.Element] = []
        for child in parent:
            if child.tag != "include":
                kept.append(child)
                todo.append((child, where))
                continue
            named = folder / child.get("file", "")
            _refuse(check.resolver.refusal(named), child, where)
            real = named.resolve()
            if real in seen or len(seen) > MAX_INCLUDES:
                raise _error("is included already; include each file once", child, where, str(named))
            seen.add(real)
            included, _ = read_xml(named, max_depth=MAX_DEPTH)
            included.tag = _INCLUDED
            todo.append((included, named))
            kept.append(included)
        parent[:] = kept
    _unwrap(root)


def _unwrap(root: ET.Element) -> None:
    """Put the children of included documents in the documents' places."""
    todo = [root]
    while todo:
        parent = todo.pop()
        flat: list[ET.Element] = []
        waiting = list(parent)[::-1]
        while waiting:
            child = waiting.pop()
            if child.tag == _INCLUDED:
                waiting.extend(reversed(list(child)))
            else:
                flat.append(child)
                todo.append(child)
        parent[:] = flat


def _check_model(root: ET.Element, check: _Check, file: Path | None, folder: Path) -> None:
    names = {element.get("name") for element in root.iter()}
    folders = _asset_folders(root, folder)
    for element in root.iter():
        check.elements += 1
        if check.elements > MAX_ELEMENTS:
            raise DescriptionError(f"more than {MAX_ELEMENTS} elements; split the model", file=file)
        for key, value in element.items():
            if _has_not_finite(value) and value not in names and key not in ("name", "class", "model"):
                raise _error(f'{key}="{value[:60]}" is not finite; give finite numbers', element, file)
        if element.tag == "size":
            _check_size(element, file)
        for key in _FILE_KEYS:
            if element.get(key):
                _check_asset(element, key, check, folders, file)
        if element.tag == "texture" and element.get("builtin", "none") != "none":
            faces = 1 if element.get("type") == "2d" else 6
            _count_pixels(check, faces * _whole(element, "width") * _whole(element, "height"), element, file)
        if element.tag == "hfield" and _whole(element, "nrow") * _whole(element, "ncol") > MAX_HEIGHTS:
            raise _error(f"more than {MAX_HEIGHTS} points; give fewer rows and columns", element, file)
    _check_counts(root, check, file)


def _asset_folders(root: ET.Element, folder: Path) -> dict[str, list[Path]]:
    """Folders in which MuJoCo may look for the files of a kind; a later `<compiler>` overrides an earlier."""
    out: dict[str, list[Path]] = {"meshdir": [folder], "texturedir": [folder], "": [folder]}
    for compiler in root.iter("compiler"):
        for key in ("assetdir", "meshdir", "texturedir"):
            named = compiler.get(key)
            for kind in (("meshdir", "texturedir") if key == "assetdir" else (key,)) if named else ():
                out[kind].append(folder / str(named))
    return out


def _check_asset(
    element: ET.Element, key: str, check: _Check, folders: dict[str, list[Path]], file: Path | None
) -> None:
    """Check every place from which MuJoCo may read the file of an asset."""
    name = element.get(key, "")
    kind = "texturedir" if element.tag in ("texture", "hfield") else _FOLDER_OF.get(element.tag, "meshdir")
    bare = name.replace("\\", "/").rpartition("/")[2]  # with strippath
    problem = None
    found: Path | None = None
    places = [folder / part for folder in (*folders[kind], *folders["meshdir"]) for part in (name, bare)]
    for place in dict.fromkeys(places):
        if not _exists(place):
            continue
        found = place
        problem = check.resolver.refusal(place) or problem
    _refuse(problem, element, file)
    if found is None:
        _refuse(check.resolver.refusal(folders[kind][-1] / name), element, file)
        return
    if element.tag == "model":
        _check_attached(found, check, element, file)
        return
    check.bytes += found.stat().st_size
    if check.bytes > MAX_ASSET_BYTES:
        raise _error("its files hold more than 512 MiB; reduce them", element, file)
    if element.tag in ("texture", "hfield"):
        pixels = _picture_size(found)
        if element.tag == "hfield" and not pixels:
            pixels = _heights(found, element, file)
        if element.tag == "hfield" and pixels > MAX_HEIGHTS:
            raise _error(f"{name[:60]}: more than {MAX_HEIGHTS} points; reduce it", element, file)
        _count_pixels(check, pixels, element, file)


def _check_attached(found: Path, check: _Check, element: ET.Element, file: Path | None) -> None:
    """Check a model that this one attaches; MuJoCo reads its file itself."""
    real = found.resolve()
    if real in check.models:
        return
    if len(check.models) >= MAX_MODELS:
        raise _error(f"more than {MAX_MODELS} models are attached; merge some", element, file)
    check.models[real] = 0
    before = check.elements
    root, changed = _read(found, check)
    if changed:
        raise _error(
            f"{found.name}: an attached model needs well-formed XML in UTF-8 without <include>",
            element,
            file,
        )
    _check_model(root, check, found, found.absolute().parent)
    check.models[real] = check.elements - before


def _check_counts(root: ET.Element, check: _Check, file: Path | None) -> None:
    """Bound the elements that MuJoCo makes of those that ask for copies."""
    made = 0
    stack: list[tuple[ET.Element, int]] = [(root, 1)]
    while stack:
        element, copies = stack.pop()
        if element.tag == "replicate":
            copies *= max(_whole(element, "count"), 1)
        elif element.tag in ("composite", "flexcomp"):
            counts = [max(int(float(word)), 1) for word in _finite_words(element.get("count", ""))]
            made += copies * math.prod(counts)
        elif element.tag == "attach":
            made += copies * max(check.models.values(), default=1)
        if copies > 1:
            made += copies
        if made > MAX_COPIES or copies > MAX_COPIES:
            raise _error(f"makes more than {MAX_COPIES} elements; reduce the counts", element, file)
        stack.extend((child, copies) for child in element)


def _check_size(element: ET.Element, file: Path | None) -> None:
    for key, value in element.items():
        amount = _AMOUNT.fullmatch(value)
        if amount is None:
            continue
        bytes_per = 1024 ** " KMGTPE".index(amount[2].upper() or " ")
        wanted = int(amount[1][:30]) * bytes_per
        largest = MAX_MEMORY if key in ("memory", "nstack") else MAX_SIZE
        if wanted > largest:
            raise _error(f'{key}="{value[:40]}" is too large (at most {largest})', element, file)


def _count_pixels(check: _Check, pixels: int, element: ET.Element, file: Path | None) -> None:
    check.pixels += pixels if check.pictures or element.tag == "hfield" else 0
    if check.pixels > MAX_PIXELS:
        raise _error(f"textures of more than {MAX_PIXELS} pixels in all; reduce them", element, file)


def _picture_size(file: Path) -> int:
    """Pixels that an image declares; 0 for a file that is none."""
    with file.open("rb") as stream:
        head = stream.read(26)
    if head.startswith(b"\x89PNG\r\n\x1a\n"):
        return int.from_bytes(head[16:20], "big") * int.from_bytes(head[20:24], "big")
    return 0


def _heights(found: Path, element: ET.Element, file: Path | None) -> int:
    """Points of MuJoCo's binary height field, whose header must agree with its size."""
    with found.open("rb") as stream:
        head = stream.read(8)
    rows, columns = int.from_bytes(head[:4], "little"), int.from_bytes(head[4:], "little")
    size = found.stat().st_size
    if size != 8 + 4 * rows * columns:
        raise _error(f"{found.name}: {size} bytes do not hold {rows} x {columns} points", element, file)
    return rows * columns


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def _whole(element: ET.Element, key: str) -> int:
    words = _finite_words(element.get(key, "0"))
    return int(float(words[0])) if words else 0


def _finite_words(text: str) -> list[str]:
    return [word for word in text.split()[:8] if _NUMBER.fullmatch(word) and math.isfinite(float(word))]


def _has_not_finite(text: str) -> bool:
    if "n" not in text and "N" not in text:  # as in nan and inf
        return False
    words = text.split()
    wrong = [word for word in words if _NOT_FINITE.fullmatch(word)]
    return bool(wrong) and all(_NUMBER.fullmatch(w) or _NOT_FINITE.fullmatch(w) for w in words)


def _refuse(problem: str | None, element: ET.Element, file: Path | None) -> None:
    if problem is not None:
        raise _error(problem, element, file)


def _error(message: str, element: ET.Element, file: Path | None, subject: str = "") -> DescriptionError:
    name = element.get("name")
    who = f'{element.tag} "{name[:60]}"' if name else f"<{element.tag}>"
    return DescriptionError(
        f"{subject[:200]} {message}".strip(), file=file, line=line_of(element), element=who
    )

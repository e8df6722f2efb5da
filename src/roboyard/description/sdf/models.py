"""The models of an SDF file, with those that it includes from other files, within bounds."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import field
from pathlib import Path

from roboyard._records import dataclass
from roboyard.description.files.resolver import Resolver
from roboyard.description.sdf.values import is_true, made, text_of
from roboyard.description.urdf.xml import line_of, read_xml
from roboyard.errors import DescriptionError

MAX_DEPTH = 16
"""Models within models."""
MAX_MODELS = 1000
"""Models and includes of one file, counted as often as they are read."""
MAX_ELEMENTS = 500_000
"""Elements of all these models together."""
OLDEST = (1, 2)
"""The first version with `<pose>` elements."""
_REMOTE = re.compile(r"(https?|fuel|ign|gz)://", re.IGNORECASE)

Version = tuple[int, int]


@dataclass(kw_only=True, eq=False)
class SdfModel:
    """A model as its file writes it."""

    element: ET.Element
    """`<model>`."""
    placed: ET.Element
    """The element that holds its `<pose>`: `<include>` where that gives one, else the model."""
    name: str
    version: Version
    """Of the file that holds it."""
    prefix: str
    """Of the names of files in it (see `description.sdf.parts`)."""
    is_static: bool
    placement_frame: str = ""
    """Frame of the model that has the pose; empty for the model's own."""
    is_merged: bool = False
    """Whether its parts belong to the model around it."""
    nested: list[SdfModel] = field(default_factory=list)
    missing: dict[str, str] = field(default_factory=dict)
    """Names of models that could not be included, and why."""
    extra: list[ET.Element] = field(default_factory=list)
    """Plugins that the `<include>` adds."""


@dataclass(kw_only=True)
class ModelReader:
    """Reads the models of one file.

    Args:
        resolver: of the first file; it finds those that are included.
        note: takes each note on what is omitted.
    """

    resolver: Resolver
    note: Callable[[str], None]
    missing: dict[str, str] = field(default_factory=dict)
    """As `SdfModel.missing`, of the file."""
    _models: int = 0
    _elements: int = 0
    _open: list[Path] = field(default_factory=list)
    _files: dict[str, Path | None] = field(default_factory=dict)
    """Name to the file found."""

    def models_of(self, root: ET.Element, file: Path | None) -> list[SdfModel]:
        """Return the models of an `<sdf>` element and of its worlds, in file order.

        Raises:
            DescriptionError: the file is older than 1.2, or beyond the bounds of this module.
        """
        if file is not None:
            self._open.append(file.resolve())
        version = _version(root)
        found: list[SdfModel] = []
        for place in (root, *root.findall("world")):
            found += self._models_in(place, version, "", 0, self.missing)
        return found

    def _models_in(
        self, place: ET.Element, version: Version, prefix: str, depth: int, missing: dict[str, str]
    ) -> list[SdfModel]:
        found: list[SdfModel] = []
        for child in place:
            if child.tag == "model":
                found.append(self._model(child, version, prefix, depth))
            elif child.tag == "include":
                included = self._included(child, prefix, depth)
                if isinstance(included, SdfModel):
                    included.is_merged &= depth > 0
                    found.append(included)
                else:
                    uri = (text_of(child, "uri") or "").rstrip("/")
                    missing[text_of(child, "name") or uri.rpartition("/")[2]] = included
                    self.note(f"{included}; it is omitted")
        return found

    def _model(self, element: ET.Element, version: Version, prefix: str, depth: int) -> SdfModel:
        self._models += 1
        if depth > MAX_DEPTH or self._models > MAX_MODELS:
            raise _too_many(element)
        missing: dict[str, str] = {}
        return SdfModel(
            element=element,
            placed=element,
            name=element.get("name") or "",
            version=version,
            prefix=prefix,
            is_static=is_true(element, "static"),
            placement_frame=element.get("placement_frame", ""),
            nested=self._models_in(element, version, prefix, depth + 1, missing),
            missing=missing,
        )

    def _included(self, include: ET.Element, prefix: str, depth: int) -> SdfModel | str:
        """Return an included model, or why there is none."""
        uri = text_of(include, "uri") or ""
        self._models += 1
        if self._models > MAX_MODELS:
            raise _too_many(include)
        found = self._find(uri, prefix)
        if found is None and re.fullmatch(r"[\w.+-]+", uri):  # Gazebo looks for a bare name as for `model://`
            found = self._find(f"model://{uri}", prefix)
        if found is None:
            what = f"<include> {uri[:200]!r} is not found"
            if _REMOTE.match(uri):
                what = f"<include> {uri[:200]!r} is not fetched"
            name = uri.rstrip("/").rpartition("/")[2][:60] or "NAME"
            return f"{what}: name the model's folder with --package {name}=FOLDER"
        file, inner = found
        if file.resolve() in self._open:
            raise DescriptionError(f"<include> {uri[:200]!r} includes itself", line=line_of(include))
        root, _ = read_xml(file)
        self._elements += sum(1 for _ in root.iter())
        if self._elements > MAX_ELEMENTS:
            raise _too_many(include)
        element = root.find("model")
        if root.tag != "sdf" or element is None:
            return f"<include> {uri[:200]!r} holds no model"
        self._open.append(file.resolve())
        model = self._model(_without_lines(element), _version(root, file), inner, depth)
        self._open.pop()
        model.name = text_of(include, "name") or model.name
        if text_of(include, "pose") is not None:
            model.placed = include
            model.placement_frame = ""
        model.placement_frame = text_of(include, "placement_frame") or model.placement_frame
        if include.find("static") is not None:
            model.is_static = is_true(include, "static")
        model.is_merged = include.get("merge", "false").lower() in ("1", "true")
        model.extra = list(include.findall("plugin"))
        return model

    def _find(self, uri: str, prefix: str) -> tuple[Path, str] | None:
        """Return the file of an included model, and the prefix of the names of files in it."""
        name = uri if "://" in uri or uri.startswith("/") else prefix + uri
        name = name.rstrip("/")
        if not name or _REMOTE.match(uri):
            return None
        if name.lower().endswith((".sdf", ".xml")):
            file = self._file(name)
            return None if file is None else (file, name.rpartition("/")[0] + "/" * ("/" in name))
        config = self._file(f"{name}/model.config")
        listed = "model.sdf" if config is None else _listed(config)
        file = self._file(f"{name}/{listed}")
        if file is None:
            return None
        return file, f"{name}/{listed}".rpartition("/")[0] + "/"

    def _file(self, name: str) -> Path | None:
        """Return the file with a name; None where only a file of another folder is like it."""
        if name not in self._files:
            self._files[name] = self._looked_up(name)
        return self._files[name]

    def _looked_up(self, name: str) -> Path | None:
        found = self.resolver.resolve(name).path
        scheme, _, rest = name.rpartition("://")
        parts = [part for part in rest.split("/") if part not in ("", ".", "..")]
        if found is None or len(parts) < 2:
            return found
        folder = found.parent
        place = (self.resolver.packages or {}).get(parts[0]) if scheme else None
        same = [part.casefold() for part in folder.parts[-len(parts) + 1 :]] == [
            part.casefold() for part in parts[:-1]
        ]
        return found if same or (place is not None and folder.is_relative_to(place)) else None


def _too_many(element: ET.Element) -> DescriptionError:
    return DescriptionError(
        f"the models and what they include are beyond any robot (at most {MAX_DEPTH} within each other, "
        f"{MAX_MODELS} models, {MAX_ELEMENTS} elements of other files); give a smaller model",
        line=line_of(element),
    )


def _listed(config: Path) -> str:
    """Return the newest SDF file that a `model.config` lists."""
    root, _ = read_xml(config)
    files = [
        (_pair(each.get("version", "")) or (0, 0), (each.text or "").strip()) for each in root.findall("sdf")
    ]
    named = [(version, name) for version, name in files if name and "://" not in name and "\0" not in name]
    return max(named, key=lambda each: each[0])[1] if named else "model.sdf"


def _pair(text: str) -> Version | None:
    match = re.match(r"\s*(\d{1,3})\.(\d{1,3})", text)
    return None if match is None else (int(match[1]), int(match[2]))


def _version(root: ET.Element, file: Path | None = None) -> Version:
    version = _pair(root.get("version", ""))
    if version is None:
        return (1, 7)
    if version < OLDEST:
        raise DescriptionError(
            f'SDF {root.get("version", "")[:20]} is too old to be read; convert it with "gz sdf -p"',
            file=file,
            line=line_of(root),
        )
    return version


def _without_lines(element: ET.Element) -> ET.Element:
    """Return a copy whose elements have no lines, since they are not those of the first file."""
    copied = made(element.tag, ET.Element("x"), **element.attrib)
    stack = [(element, copied)]
    while stack:
        original, copy = stack.pop()
        copy.text = original.text
        for child in original:
            new = made(child.tag, ET.Element("x"), **child.attrib)
            copy.append(new)
            stack.append((child, new))
    return copied

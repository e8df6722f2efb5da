"""Frames of SDF models: names within each other, and where each frame is in the outermost model.

Everything that has a name in a model is a frame: the model itself (`__model__`), its links, joints, `<frame>`
elements and nested models (`arm::wrist`). A frame's pose is relative to another one; a frame is attached to a
link. Both chains end, or the file is refused.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import field
from typing import Literal

import numpy as np

from roboyard._records import dataclass
from roboyard.description.sdf.models import SdfModel
from roboyard.description.sdf.values import pose_of, text_of
from roboyard.description.urdf.xml import line_of
from roboyard.errors import DescriptionError, unknown_name
from roboyard.transforms import Array

MODEL = "__model__"
SEPARATOR = "::"
WORLD = "world"
MAX_CHAIN = 1000
"""Frames relative to each other, one after the other."""
MAX_FRAMES = 50_000
"""Frames of the outermost model and all models in it."""
_SHOWN = 200
_SUGGESTED = 500
"""Known names among which an error looks for one like an unknown name."""


@dataclass(kw_only=True, eq=False)
class Frame:
    """Something with a name and a pose."""

    name: str
    """Within the outermost model, as in `arm::wrist`."""
    kind: Literal["model", "link", "joint", "frame"]
    element: ET.Element
    scope: Scope
    """The model that it is in; for a model its own scope."""
    pose: Array
    """(4, 4), relative to `base`."""
    relative_to: str = ""
    """Name of the frame that `pose` is relative to, in `scope` (for a model in the one around it)."""
    outer_pose: Array | None = None
    """(4, 4), in the outermost model, once it is known."""


@dataclass(kw_only=True, eq=False)
class Scope:
    """One model's names."""

    model: SdfModel
    prefix: str
    """Of the names of its frames in the outermost model: empty, or as in `arm::`."""
    around: Scope | None
    frames: dict[str, Frame] = field(default_factory=dict)
    """Name in this model to frame; of merged models together with the model around."""
    nested: dict[str, Scope] = field(default_factory=dict)
    own: Frame = field(init=False)
    """The model's own frame."""

    def find(self, name: str, element: ET.Element) -> Frame:
        """Return the frame with a name, as it is written in this model.

        Raises:
            DescriptionError: there is none.
        """
        if name == MODEL:
            return self.own
        if name in self.frames:
            return self.frames[name]
        scope, rest = self, name
        while SEPARATOR in rest:
            first, _, rest = rest.partition(SEPARATOR)
            if first not in scope.nested:
                break
            scope = scope.nested[first]
            if rest == MODEL:
                return scope.own
            if rest in scope.frames:
                return scope.frames[rest]
        known = list(self.frames)[:_SUGGESTED]
        message = unknown_name("frame", name[:_SHOWN], known)
        lacking = next(iter(self.model.missing.values()), "")
        message += f"; {lacking}" if lacking else ""
        raise DescriptionError(message, line=line_of(element))

    def is_missing(self, name: str) -> bool:
        """Return whether a name is in a model that could not be included."""
        scope, rest = self, name
        while True:
            first, _, rest = rest.partition(SEPARATOR)
            if first in scope.model.missing:
                return True
            if not rest or first not in scope.nested:
                return False
            scope = scope.nested[first]


def scopes_of(model: SdfModel) -> list[Scope]:
    """Return the scope of a model and of all models in it, outer ones first."""
    outer = _scope(model, None)
    found, todo, count = [], [outer], 0
    while todo:
        scope = todo.pop(0)
        found.append(scope)
        count += len(scope.model.element)
        if count > MAX_FRAMES:
            raise DescriptionError(
                f"more than {MAX_FRAMES} links, joints and frames are beyond any robot; give a smaller model",
                line=line_of(scope.model.element),
            )
        todo += [_scope(each, scope) for each in scope.model.nested]
    return found


def _scope(model: SdfModel, around: Scope | None) -> Scope:
    merged = model.is_merged and around is not None
    if around is None:
        prefix = ""
    else:
        prefix = around.prefix if merged else f"{around.prefix}{model.name}{SEPARATOR}"
    scope = Scope(model=model, prefix=prefix, around=around)
    if around is not None and merged:
        scope.frames, scope.nested = around.frames, around.nested
    scope.own = Frame(
        name=prefix.removesuffix(SEPARATOR) or MODEL,
        kind="model",
        element=model.element,
        scope=scope,
        pose=pose_of(model.placed),
        relative_to=_relative_to(model.placed),
    )
    if around is not None and not merged:
        around.nested[model.name] = scope
        _add(around, model.name, scope.own)
    for kind in ("link", "joint", "frame"):
        for element in model.element.findall(kind):
            name = element.get("name") or ""
            frame = Frame(
                name=f"{prefix}{name}",
                kind=kind,
                element=element,
                scope=scope,
                pose=pose_of(element),
                relative_to=_relative_to(element),
            )
            _add(scope, name, frame)
    return scope


def _add(scope: Scope, name: str, frame: Frame) -> None:
    if not name:
        raise DescriptionError(
            f"a <{frame.element.tag}> has no name; give it a unique name", line=line_of(frame.element)
        )
    if name in scope.frames:
        other = scope.frames[name]
        if other.kind == frame.kind or scope.model.version >= (1, 7):
            raise DescriptionError(
                f"two elements are called {frame.name[:_SHOWN]!r} (<{other.element.tag}> and "
                f"<{frame.element.tag}>); give each a name of its own",
                line=line_of(frame.element),
            )
        name = f"{name} ({frame.kind})"  # before 1.7 a joint might be called as its link
    scope.frames[name] = frame


def _relative_to(element: ET.Element) -> str:
    pose = element.find("pose")
    if pose is None:
        return ""
    return (pose.get("relative_to") or pose.get("frame") or "").strip()


def base(frame: Frame) -> Frame | None:
    """Return the frame that a frame's pose is relative to; None for the outermost model.

    Raises:
        DescriptionError: a name of a frame is not known.
    """
    scope = frame.scope
    if frame.kind == "model":
        if scope.around is None:
            return None
        return scope.around.find(frame.relative_to, frame.element) if frame.relative_to else scope.around.own
    if frame.relative_to and not (scope.model.version < (1, 7) and frame.relative_to == WORLD):
        return scope.find(frame.relative_to, frame.element)
    if frame.kind == "joint":
        return scope.find(text_of(frame.element, "child") or "", frame.element)
    if frame.kind == "frame" and (frame.element.get("attached_to") or "").strip():
        return scope.find((frame.element.get("attached_to") or "").strip(), frame.element)
    return scope.own


def pose_of_frame(frame: Frame) -> Array:
    """Return the (4, 4) pose of a frame in the outermost model.

    Raises:
        DescriptionError: frames are relative to each other in a ring, or to one that is not known.
    """
    chain, at = [], frame
    while at.outer_pose is None:
        chain.append(at)
        above = base(at)
        if above is None:
            at.outer_pose = np.eye(4)
            chain.pop()
            break
        at = above
        if len(chain) > MAX_CHAIN:
            raise _ring(frame)
    for each in reversed(chain):
        above = base(each)
        if above is not None and above.outer_pose is not None:
            each.outer_pose = above.outer_pose @ _placed(each)
    return np.eye(4) if frame.outer_pose is None else frame.outer_pose


def _pose_in(frame: Frame, model: Frame) -> Array:
    """Return the (4, 4) pose of a frame in the frame of a model that it is in."""
    pose, at = np.eye(4), frame
    for _ in range(MAX_CHAIN):
        if at is model:
            return pose
        pose = _placed(at) @ pose
        above = base(at)
        if above is None:
            return pose
        at = above
    raise _ring(frame)


def link_of(frame: Frame) -> Frame:
    """Return the link that a frame is attached to.

    Raises:
        DescriptionError: frames are attached to each other in a ring, or to one that is not known.
    """
    at = frame
    for _ in range(MAX_CHAIN):
        if at.kind == "link":
            return at
        at = _attached(at)
    raise _ring(frame)


def _attached(frame: Frame) -> Frame:
    scope, element = frame.scope, frame.element
    if frame.kind == "joint":
        return scope.find(text_of(element, "child") or "", element)
    if frame.kind == "frame":
        name = (element.get("attached_to") or "").strip()
        return scope.find(name, element) if name else scope.own
    name = (element.get("canonical_link") or "").strip()
    if name:
        return scope.find(name, element)
    first = next(_first_links(scope), None)
    if first is None:
        raise DescriptionError(f'model "{frame.name[:_SHOWN]}" has no link; add one', line=line_of(element))
    return first


def _first_links(scope: Scope) -> Iterator[Frame]:
    """Yield the first link of a model and of the models in it, its own first."""
    todo = [scope]
    while todo:
        at = todo.pop(0)
        yield from (frame for frame in at.frames.values() if frame.kind == "link")
        todo += at.nested.values()


def _placed(frame: Frame) -> Array:
    """Return the (4, 4) pose of a frame in the one that its pose is relative to."""
    placement = frame.scope.model.placement_frame if frame.kind == "model" else ""
    if not placement or frame.scope.around is None:
        return frame.pose
    part = frame.scope.find(placement, frame.element)
    return frame.pose @ np.linalg.inv(_pose_in(part, frame))


def _ring(frame: Frame) -> DescriptionError:
    return DescriptionError(
        f"frames are relative or attached to each other in a ring ({frame.name[:_SHOWN]!r}); "
        "make one of them relative to the model",
        line=line_of(frame.element),
    )

"""Check the layers that a USD stage refers to before OpenUSD composes it, which opens any file.

Each layer is opened on its own, without composition; the files that it names (sublayers, references and
payloads, of all variants) have to be where the description may read, as for meshes of URDF.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

from roboyard.description.files.resolver import Resolver
from roboyard.errors import DescriptionError

MAX_LAYERS = 1_000
"""Layers of a stage."""
_ARGUMENTS = ":SDF_FORMAT_ARGS:"


def check_layers(path: Path, resolver: Resolver | None = None) -> tuple[Path, ...]:
    """Return the files of all layers of a stage, its own first, after checking each.

    A file that does not exist is left to OpenUSD, which reports it.

    Args:
        path: the stage's file.
        resolver: the folders that it may read; by default those of its own place.

    Raises:
        DescriptionError: a layer cannot be read, names a file outside these folders, or computes names.
        ImportError: OpenUSD is not installed.
    """
    Sdf: Any = import_module("pxr.Sdf")
    Tf: Any = import_module("pxr.Tf")
    allowed = resolver or Resolver.of_file(path)
    found: dict[Path, None] = {}
    todo = [path]
    while todo:
        file = todo.pop()
        real = file.resolve()
        if real in found:
            continue
        problem = allowed.refusal(file) if file.exists() or file == path else None
        if problem is not None:
            raise DescriptionError(problem, file=path)
        if not file.exists():
            continue
        found[real] = None
        if len(found) > MAX_LAYERS:
            raise DescriptionError(f"more than {MAX_LAYERS} layers; flatten the stage", file=path)
        try:
            is_known = Sdf.Layer.Find(str(file)) is not None  # perhaps as it was before the file changed
            layer = (Sdf.Layer.OpenAsAnonymous if is_known else Sdf.Layer.FindOrOpen)(str(file))
        except Tf.ErrorException as error:
            raise DescriptionError(f"OpenUSD cannot read it: {reason_of(error)}", file=file) from None
        if layer is None:
            continue
        todo += _named_files(layer, file, path)
    return tuple(found)


def reason_of(error: Exception) -> str:
    """Return what an error of OpenUSD says, without the place in OpenUSD's own sources."""
    text = " ".join(str(error).split())
    said = re.split(r" at line \d+ in file \S+ : ", text)[-1].strip("' ")
    return (said or text or type(error).__name__)[:300]


def _named_files(layer: Any, file: Path, stage: Path) -> list[Path]:
    """The files that a layer composes with."""
    clips: list[str] = []

    def visit(place: Any) -> None:
        spec = layer.GetObjectAtPath(place)
        if place.IsPrimPath() and spec is not None and spec.HasInfo("clips"):
            clips.append(str(place))

    layer.Traverse(layer.pseudoRoot.path, visit)
    if clips:
        raise DescriptionError(f"{clips[0]}: value clips are not read; flatten the stage", file=stage)
    files: list[Path] = []
    for name in layer.GetCompositionAssetDependencies():
        text = str(name).partition(_ARGUMENTS)[0]
        if text.startswith("`") or "\0" in text:
            raise DescriptionError(f"{text[:80]!r}: computed file names are not read; write it", file=stage)
        outer = text.partition("[")[0]  # a layer within a usdz package
        if outer:
            files.append(file.parent / outer)
    return files

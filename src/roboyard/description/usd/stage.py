"""Open an untrusted USD stage: its layers checked, its size bounded, its units known."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from roboyard.description.files.resolver import Resolver
from roboyard.description.files.usd_layers import check_layers, reason_of
from roboyard.description.usd.library import Tf, Usd, UsdGeom, UsdPhysics, UsdUtils
from roboyard.errors import DescriptionError
from roboyard.transforms import Array

MAX_PRIMS = 200_000
"""Prims of a stage, those of instances counted."""


@dataclass(frozen=True, kw_only=True, eq=False)
class OpenStage:
    """A stage and its units."""

    stage: Any
    file: Path
    prims: tuple[Any, ...]
    """All that are active and defined, in the stage's order."""
    metres: float
    """Of one unit of length."""
    kilograms: float
    """Of one unit of mass."""
    up: Array
    """(3, 3) rotation to z up."""

    @property
    def T_world_stage(self) -> Array:
        """(4, 4) from the stage's coordinates to metres, z up."""
        out = np.eye(4)
        out[:3, :3] = self.up * self.metres
        return out


def open_stage(
    file: Path, resolver: Resolver | None = None, *, unstated_metres: float | None = None
) -> OpenStage:
    """Open a stage.

    Args:
        file: its root layer, or a package (`.usdz`).
        resolver: the folders that it may read; by default those of its own place.
        unstated_metres: a unit of length where the stage states none (m); USD's 0.01 by default.

    Raises:
        DescriptionError: it cannot be opened, refers to missing files or files outside its folders, or is too
            large.
    """
    check_layers(file, resolver)
    try:
        stage = Usd.Stage.Open(str(file))
        stage.Reload()  # layers that OpenUSD still holds, and whose files have changed
    except Tf.ErrorException as error:
        raise DescriptionError(f"OpenUSD cannot read it: {reason_of(error)}", file=file) from None
    errors = [" ".join(str(each).split())[:300] for each in stage.GetCompositionErrors()]
    if errors:
        raise DescriptionError(f"the stage does not compose: {errors[0]}", file=file)
    prims = []
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        prims.append(prim)
        if len(prims) > MAX_PRIMS:
            raise DescriptionError(f"more than {MAX_PRIMS} prims; open a smaller stage", file=file)
    up = np.eye(3)
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y:
        up = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    metres = float(UsdGeom.GetStageMetersPerUnit(stage))
    if unstated_metres is not None and not UsdGeom.StageHasAuthoredMetersPerUnit(stage):
        metres = unstated_metres
    kilograms = float(UsdPhysics.GetStageKilogramsPerUnit(stage))
    for name, value in (("metersPerUnit", metres), ("kilogramsPerUnit", kilograms)):
        if not 1e-9 < value < 1e9:
            raise DescriptionError(f"{name} is {value:g}; give a positive number", file=file)
    return OpenStage(stage=stage, file=file, prims=tuple(prims), metres=metres, kilograms=kilograms, up=up)


@contextmanager
def quiet() -> Iterator[None]:
    """Drop OpenUSD's warnings, which it prints itself, one for each prim; errors stay exceptions."""
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        delegate.TakeUncoalescedDiagnostics()
        del delegate

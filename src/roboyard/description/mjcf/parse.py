"""Parse a checked MJCF file with MuJoCo."""

from __future__ import annotations

import itertools
from typing import Any

import roboyard._mujoco  # noqa: F401 - first: MuJoCo without its windows
from roboyard.description.mjcf.checked import MjcfSource


def parse_mjcf(source: MjcfSource) -> Any:
    """Return the `mujoco.MjSpec` of a checked file or text; every body and joint gets a name.

    Raises:
        Exception: MuJoCo rejects it, with one of several types.
    """
    import mujoco

    if source.text is None:
        spec = mujoco.MjSpec.from_file(str(source.file))
    else:
        spec = mujoco.MjSpec.from_string(source.text)
        if source.file is not None:
            spec.modelfiledir = f"{source.file.absolute().parent}/"
    _name_everything(spec)
    return spec


def _name_everything(spec: Any) -> None:
    """Name all unnamed bodies and joints, so that handles have names: `body0`, `joint3`, ..., each once."""
    for prefix, elements, known in (
        ("body", spec.worldbody.bodies, spec.bodies),
        ("body", spec.bodies, spec.bodies),
        ("joint", spec.joints, spec.joints),
    ):
        taken = {element.name for element in known}
        for k, element in enumerate(elements):
            if not element.name:
                element.name = next(new for i in itertools.count(k) if (new := f"{prefix}{i}") not in taken)
                taken.add(element.name)

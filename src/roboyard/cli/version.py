"""`roboyard version`: the installed versions, for a bug report."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed
from typing import Annotated

import typer

from roboyard._version import __version__
from roboyard.untrusted.text import json_text

_PACKAGES = ("mujoco", "numpy", "scipy", "numba", "trimesh", "pillow")
_EXTRAS = {"viser": "gui", "usd-core": "usd", "coacd": "convex", "imageio-ffmpeg": "video", "torch": "torch"}
"""Package to the extra that installs it."""


def version(
    as_json: Annotated[bool, typer.Option("--json", help="Print the versions as JSON.")] = False,
) -> None:
    """Print the versions of Roboyard and its dependencies."""
    rows = [("roboyard", __version__), ("python", platform.python_version())]
    rows += [(package, _installed(package) or "not installed") for package in _PACKAGES]
    rows += [
        (package, _installed(package) or f"not installed (extra {extra})")
        for package, extra in _EXTRAS.items()
    ]
    rows.append(("system", f"{platform.system()} {platform.machine()}"))
    if as_json:
        print(json_text(dict(rows)))
        return
    for name, value in rows:
        print(f"{name:<16}{value}")


def _installed(package: str) -> str | None:
    try:
        return installed(package)
    except PackageNotFoundError:
        return None

"""`roboyard version`: what is installed, for a bug report."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed

from roboyard import __version__

_PACKAGES = ("mujoco", "numpy", "scipy", "numba", "trimesh", "pillow")


def version() -> None:
    """Print the versions of Roboyard and of what it stands on."""
    rows = [("roboyard", __version__), ("python", platform.python_version())]
    for package in _PACKAGES:
        try:
            rows.append((package, installed(package)))
        except PackageNotFoundError:
            rows.append((package, "not installed"))
    rows.append(("system", f"{platform.system()} {platform.machine()}"))
    for name, value in rows:
        print(f"{name:<10}{value}")

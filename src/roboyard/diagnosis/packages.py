"""Whether the packages that Roboyard needs are there, in versions that it works with."""

from __future__ import annotations

import platform
import shutil
import sys
from collections.abc import Iterator
from importlib import metadata

from packaging.requirements import Requirement

from roboyard.diagnosis.check import Check
from roboyard.errors import install_command

EXTRAS = {
    "gui": "pages in the browser: view, drive --browser, connect(GUI)",
    "usd": "USD files of an import",
    "convex": "collision shapes by CoACD",
    "video": "MP4 films",
    "torch": "controllers on tensors",
    "learn": "training with Stable-Baselines3",
    "datasets": "episodes in LeRobot's layout",
    "minari": "episodes for Minari",
    "cluster": "environments and imports on Ray",
    "warp": "environments on MuJoCo Warp",
}
"""Extra to what it is for."""
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "firefox")


def package_checks() -> Iterator[Check]:
    """Yield Python, each required package, and each extra."""
    yield Check(
        name="python",
        status="ok",
        detail=f"{platform.python_version()} on {platform.system()} {platform.machine()}, {sys.executable}",
    )
    needed: dict[str, list[Requirement]] = {}
    for text in metadata.requires("roboyard") or ():
        requirement = Requirement(text)
        marker = requirement.marker
        if marker is None or marker.evaluate({"extra": ""}):
            yield _required(requirement)
            continue
        for extra in EXTRAS:
            if marker.evaluate({"extra": extra}):
                needed.setdefault(extra, []).append(requirement)
    for extra, what_for in EXTRAS.items():
        yield _extra(extra, what_for, needed.get(extra, []))
    found = [name for name in BROWSERS if shutil.which(name)]
    yield Check(
        name="browser",
        status="ok" if found else "missing",
        detail=found[0] if found else "no browser on this machine's path",
        remedy="" if found else "open the printed address in a browser of a machine that can reach this one",
    )


def _required(requirement: Requirement) -> Check:
    """Return the check of a package without which Roboyard does not work."""
    problem, version = _problem(requirement)
    return Check(
        name=requirement.name,
        status="failed" if problem else "ok",
        detail=problem or version,
        remedy=f'pip install "{requirement.name}{requirement.specifier}"' if problem else "",
    )


def _extra(extra: str, what_for: str, requirements: list[Requirement]) -> Check:
    """Return the check of an extra."""
    found = [(requirement.name, *_problem(requirement)) for requirement in requirements]
    problems = [problem for _, problem, _ in found if problem]
    versions = ", ".join(f"{name} {version}" for name, _, version in found)
    return Check(
        name=f"extra {extra}",
        status="missing" if problems else "ok",
        detail=f"{what_for}; {problems[0] if problems else versions}",
        remedy=install_command(extra) if problems else "",
    )


def _problem(requirement: Requirement) -> tuple[str, str]:
    """Return what is wrong with an installed package, empty for nothing, and its version."""
    try:
        version = metadata.version(requirement.name)
    except metadata.PackageNotFoundError:
        return f"{requirement.name} is not installed", ""
    if not requirement.specifier.contains(version, prereleases=True):
        return f"{requirement.name} {version} is installed, {requirement.specifier} is needed", version
    return "", version

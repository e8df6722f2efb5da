"""The package as a whole: what it exports, what it loads, and what must not be in it."""

from __future__ import annotations

import contextlib
import importlib
import pkgutil
import re
import subprocess
import sys
import tomllib
import types
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed_version
from pathlib import Path

import pytest

import roboyard
from roboyard.errors import MissingExtraError

ROOT = Path(__file__).resolve().parents[1]
HEAVY = (
    "mujoco",
    "numba",
    "trimesh",
    "scipy",
    "matplotlib",
    "PIL",
    "pxr",
    "collada",
    "typer",
    "rich",
    "pydantic",
)


PUBLIC = {
    "Camera",
    "Robot",
    "RobotDescription",
    "RobotModel",
    "RoboyardError",
    "Viewer",
    "World",
    "__version__",
    "add_robot",
    "audit_urdf",
    "import_robot",
    "list_robots",
    "load_scene",
    "load_description",
    "repair_urdf",
    "validate",
}


def test_every_exported_name_imports() -> None:
    assert set(roboyard.__all__) == PUBLIC
    for name in roboyard.__all__:
        assert getattr(roboyard, name) is not None
    assert set(roboyard.__all__) <= set(dir(roboyard))


def _modules() -> list[str]:
    def without_its_extra(name: str) -> None:
        assert isinstance(sys.exc_info()[1], MissingExtraError), name

    found = pkgutil.walk_packages(roboyard.__path__, "roboyard.", onerror=without_its_extra)
    return [module.name for module in found]


def test_every_room_exports_what_it_names() -> None:
    for name in _modules():
        if name.endswith("__main__"):
            continue
        try:
            module = importlib.import_module(name)
        except MissingExtraError:
            continue
        for exported in getattr(module, "__all__", ()):
            assert hasattr(module, exported), f"{name}.{exported}"


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no_such_name"):
        roboyard.no_such_name  # noqa: B018


def test_import_loads_nothing_heavy() -> None:
    code = f"import sys, roboyard; print([n for n in {HEAVY!r} if n in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_version_is_the_installed_one() -> None:
    assert re.fullmatch(r"\d+\.\d+\.\d+", roboyard.__version__)
    try:
        installed = installed_version("roboyard")
    except PackageNotFoundError:
        pytest.skip("run from the sources, not installed")
    assert installed == roboyard.__version__


def test_the_changelog_knows_this_version() -> None:
    assert f"[{roboyard.__version__}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def _tracked_text_files() -> list[Path]:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if listed.returncode != 0:
        pytest.skip("not a git checkout")
    paths = [ROOT / name for name in listed.stdout.decode().split("\0") if name]
    binary = {".png", ".gif", ".jpg", ".stl", ".glb", ".npz"}
    return [path for path in paths if path.is_file() and path.suffix.lower() not in binary]


def test_no_file_names_a_place_on_somebodys_machine() -> None:
    places = ("home", "Users", "work", "root")
    personal = re.compile(rf"(?<![\w.])/({'|'.join(places)})/\w+|[A-Z]:\\\\Users")
    parts = (*(f"/{place}/" for place in places), r"\\Users")  # plain texts are found much sooner
    found = []
    for path in _tracked_text_files():
        text = path.read_text(encoding="utf-8", errors="replace")
        lines = text.splitlines() if any(part in text for part in parts) else []
        for number, line in enumerate(lines, start=1):
            if path != Path(__file__).resolve() and personal.search(line):
                found.append(f"{path.relative_to(ROOT)}:{number}: {line.strip()[:80]}")
    assert found == []


def test_constraints_are_plain_pins_within_the_bounds() -> None:
    from packaging.requirements import Requirement

    pins = {}
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            continue
        match = re.fullmatch(r"([A-Za-z0-9_.-]+)==([A-Za-z0-9_.]+)", line)
        assert match, line
        pins[re.sub(r"[-_.]+", "-", match[1]).lower()] = match[2]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    for wanted in [*project["dependencies"], *extras["test"], *extras["dev"]]:
        requirement = Requirement(wanted)
        pinned = pins[re.sub(r"[-_.]+", "-", requirement.name).lower()]
        assert requirement.specifier.contains(pinned), f"{requirement.name} {pinned}"


@pytest.mark.parametrize("package", ["roboyard.robots", "roboyard.scenes", "roboyard.description"])
def test_public_names_are_what_they_are_whatever_was_imported_first(package: str) -> None:
    """A submodule of the same name must not stand in a function's place."""
    home = importlib.import_module(package)
    for module in pkgutil.iter_modules(home.__path__, f"{package}."):
        with contextlib.suppress(MissingExtraError):
            importlib.import_module(module.name)
    assert not [name for name in home.__all__ if isinstance(getattr(home, name), types.ModuleType)]

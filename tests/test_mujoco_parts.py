"""MuJoCo's Python module without its enumerations: the same names and numbers; programs get it whole."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import mujoco
import pytest

from roboyard._mujoco_parts import Enumeration

FACES = """
import sys
from roboyard._mujoco import mujoco as ours
assert "mujoco._enums" not in sys.modules and "mujoco" not in sys.modules
"""


def output_of(code: str, cache: Path) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "XDG_CACHE_HOME": str(cache)},
    )
    assert not done.returncode, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache folder that one process has filled."""
    folder = tmp_path_factory.mktemp("cache")
    output_of("import roboyard._mujoco", folder)
    return folder


def test_all_numbers_are_those_of_the_enumerations(cache: Path) -> None:
    asked = {
        name: {member: int(value) for member, value in enumeration.__members__.items()}
        for name, enumeration in vars(mujoco).items()
        if name.startswith("mjt") and hasattr(enumeration, "__members__")
    }
    assert len(asked) > 50
    code = f"""
asked = {asked!r}
for name, members in asked.items():
    for member, number in members.items():
        assert getattr(getattr(ours, name), member) == number, (name, member)
assert "mujoco._enums" not in sys.modules
print(ours.mjtGeom(6).name, ours.mjtGeom.mjGEOM_BOX == ours.mjtGeom(6), ours.mjtGeom.__name__)
"""
    assert output_of(FACES + code, cache).split() == ["mjGEOM_BOX", "True", "mjtGeom"]


def test_properties_give_members_and_are_the_packages_own_again(cache: Path) -> None:
    code = """
spec = ours.MjSpec()
geom = spec.worldbody.add_geom(type=ours.mjtGeom.mjGEOM_BOX, size=[1, 1, 1])
geom.type = ours.mjtGeom.mjGEOM_ELLIPSOID
made = [vars(ours.MjsGeom)["type"], vars(ours.MjsJoint)["limited"]]
assert "mujoco._enums" not in sys.modules
print(geom.type.name, [vars(ours.MjsGeom)["type"], vars(ours.MjsJoint)["limited"]] != made)
import mujoco
print(geom.type == mujoco.mjtGeom.mjGEOM_ELLIPSOID, spec.compile().geom_type[0])
"""
    assert output_of(FACES + code, cache).split() == ["mjGEOM_ELLIPSOID", "True", "True", "4"]


def test_a_program_gets_the_whole_package(cache: Path) -> None:
    code = """
import importlib.util
assert importlib.util.find_spec("mujoco").origin.endswith("__init__.py")
import mujoco
print(mujoco is ours, mujoco.MjModel is ours.MjModel, mujoco.__version__ == ours.__version__)
print(set(vars(ours)) - set(vars(mujoco)), bool(mujoco.PLUGIN_HANDLES))
print(mujoco._functions.mj_step is mujoco.mj_step, mujoco.MjModel.bind is ours.MjModel.bind)
print(ours.HEADERS_DIR == mujoco.HEADERS_DIR, hasattr(ours, "nonsense"), ours.__file__ == mujoco.__file__)
import mujoco.batch
"""
    given = output_of(FACES + code, cache).split()
    assert given == ["False", "True", "True", "set()", *["True"] * 4, "False", "True"]


def test_a_package_that_was_imported_before_is_used_as_it_is(cache: Path) -> None:
    code = "import mujoco; from roboyard._mujoco import mujoco as ours; print(ours is mujoco)"
    assert output_of(code, cache).split() == ["True"]


@pytest.mark.parametrize("damage", [b"", b"roboyard 1\n", b"\xff"])
def test_damaged_numbers_are_written_again(tmp_path: Path, damage: bytes) -> None:
    output_of("import roboyard._mujoco", tmp_path)
    (file,) = (tmp_path / "roboyard" / "mujoco").iterdir()
    whole = file.read_bytes()
    file.write_bytes(damage or whole[: len(whole) // 2])
    output_of("from roboyard._mujoco import mujoco; assert mujoco.mjtGeom.mjGEOM_BOX == 6", tmp_path)
    assert file.read_bytes() == whole


def test_numbers_that_others_may_write_are_not_read(tmp_path: Path) -> None:
    output_of("import roboyard._mujoco", tmp_path)
    (file,) = (tmp_path / "roboyard" / "mujoco").iterdir()
    file.chmod(0o666)
    code = "import sys, roboyard._mujoco; print('mujoco._enums' in sys.modules)"
    assert output_of(code, tmp_path).split() == ["True"]


def test_an_enumeration_knows_its_numbers_without_the_package() -> None:
    made = Enumeration("mjtNone", {"mjONE": 1})
    assert made.mjONE == 1
    with pytest.raises(AttributeError, match="mjtNone"):
        print(made.mjTWO)

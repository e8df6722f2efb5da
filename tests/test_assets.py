"""The bundled files as a whole: findable, complete, physical, small, and made by the generator."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from roboyard.assets import OBJECTS, ROBOTS, SOURCE_CONFIGS, STAND_INS, asset_path, assets_root
from roboyard.errors import RoboyardError

ROOT = assets_root()
GENERATOR = Path(__file__).resolve().parents[1] / "tools" / "make_assets.py"
PACKAGES = [f"{name}/urdf/{name}.urdf" for name in SOURCE_CONFIGS]
"""URDFs of finished packages; `test_assets_packages.py` compares them with a fresh import."""
URDFS = sorted({p.relative_to(ROOT).as_posix() for p in ROOT.rglob("*.urdf")} - set(PACKAGES))


def in_package(path: Path) -> bool:
    """Whether a file belongs to a finished package, which holds all that an import writes."""
    name, folder, *_ = (*path.relative_to(ROOT).parts, "")
    return name in SOURCE_CONFIGS and folder in ("curobo", "mjcf", "urdf")


def mesh_file(urdf: Path, uri: str) -> Path:
    if uri.startswith("package://r1_description/"):
        return ROOT / "r1" / uri.removeprefix("package://")
    return urdf.parent / uri


def test_names_lead_to_files() -> None:
    for name in ROBOTS | OBJECTS:
        assert asset_path(name).suffix == ".urdf"
    assert asset_path("husky/husky.urdf") == asset_path("husky")
    stand_ins = [name for name in STAND_INS if name.endswith(".urdf")]
    assert sorted([*(ROBOTS | OBJECTS).values(), *stand_ins]) == URDFS


@pytest.mark.parametrize("name", ["r2", "../errors.py", "/etc/passwd", ""])
def test_unknown_names_say_what_there_is(name: str) -> None:
    with pytest.raises(RoboyardError, match=r"available: arm7, cartpole, husky, r1, r2d2, rover, walker"):
        asset_path(name)


@pytest.mark.parametrize("urdf", [*URDFS, *PACKAGES])
def test_every_mesh_and_texture_is_there(urdf: str) -> None:
    path = ROOT / urdf
    for element in ET.parse(path).getroot().iter("mesh"):
        file = mesh_file(path, element.get("filename"))
        assert file.is_file(), file
        if file.suffix == ".obj":
            library = re.search(r"^mtllib (.+)$", file.read_text(), re.M)
            if library:
                text = (file.parent / library[1]).read_text()
                assert set(re.findall(r"^usemtl (\S+)", file.read_text(), re.M)) <= set(
                    re.findall(r"^newmtl (\S+)", text, re.M)
                )
                for texture in re.findall(r"^map_Kd (.+)$", text, re.M):
                    with Image.open(file.parent / texture) as image:
                        assert image.convert("RGB").getextrema() != ((0, 0), (0, 0), (0, 0))


def test_no_mesh_is_unused() -> None:
    used = set()
    for urdf in URDFS:
        used |= {
            mesh_file(ROOT / urdf, e.get("filename")) for e in ET.parse(ROOT / urdf).getroot().iter("mesh")
        }
    meshes = {p for p in ROOT.rglob("*") if p.suffix in (".obj", ".stl", ".dae") and not in_package(p)}
    assert meshes <= used


@pytest.mark.parametrize("urdf", [*URDFS, *PACKAGES])
def test_inertias_are_physical(urdf: str) -> None:
    for inertial in ET.parse(ROOT / urdf).getroot().iter("inertial"):
        mass = float(inertial.find("mass").get("value"))
        values = {k: float(v) for k, v in inertial.find("inertia").attrib.items()}
        if mass == 0.0:
            assert not any(values.values())
            continue
        xx, xy, xz, yy, yz, zz = (values[k] for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
        low, middle, high = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        assert low > 0
        assert low + middle >= high * (1 - 1e-9)


@pytest.mark.parametrize("urdf", URDFS)
def test_header_names_the_licence(urdf: str) -> None:
    text = (ROOT / urdf).read_text()
    assert "<!-- Roboyard, Apache-2.0." in text
    assert 'filename="/' not in text


def read_obj(path: Path) -> tuple[np.ndarray, np.ndarray]:
    lines = path.read_text().splitlines()
    vertices = np.array([[float(x) for x in s.split()[1:]] for s in lines if s.startswith("v ")])
    faces = np.array([[int(c.split("/")[0]) - 1 for c in s.split()[1:]] for s in lines if s.startswith("f ")])
    return vertices, faces


OBJS = sorted(
    p.relative_to(ROOT).as_posix()
    for p in ROOT.rglob("*.obj")
    if p.parent.name != "ground" and "mjcf" not in p.parts  # with a vertex for each corner
)


@pytest.mark.parametrize("name", OBJS)
def test_meshes_are_closed_and_turned_outwards(name: str) -> None:
    vertices, faces = read_obj(ROOT / name)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forward = np.sort(edges[:, 0] * len(vertices) + edges[:, 1])
    backward = np.sort(edges[:, 1] * len(vertices) + edges[:, 0])
    assert np.array_equal(forward, backward), "an edge has no partner"
    p = vertices[faces]
    assert np.einsum("ij,ij->", p[:, 0], np.cross(p[:, 1], p[:, 2])) > 0


def test_package_stays_small() -> None:
    assert sum(p.stat().st_size for p in ROOT.rglob("*") if p.is_file() and p.suffix != ".pyc") < 8e6


@pytest.mark.skipif(
    not GENERATOR.exists(), reason="the generator is part of the repository, not of the package"
)
def test_generator_writes_the_same_bytes() -> None:
    done = subprocess.run(
        [sys.executable, str(GENERATOR), "--check"],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONHASHSEED": "7"},
    )
    assert done.returncode == 0, done.stdout + done.stderr

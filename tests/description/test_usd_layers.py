"""The layers of a USD stage are read in its own folders only."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

pytest.importorskip("pxr")

from pxr import Usd  # pyright: ignore[reportMissingImports]

from roboyard.description.files.resolver import Resolver
from roboyard.description.files.usd_layers import check_layers
from roboyard.errors import DescriptionError
from roboyard.scenes import load_scene

CUBE = '#usda 1.0\n(defaultPrim = "a")\ndef Cube "a" {}\n'


def usda(body: str = "", head: str = "") -> str:
    return f'#usda 1.0\n(\n    defaultPrim = "s"\n{head}\n)\ndef Xform "s"\n{{\n{body}\n}}\n'


def prim(kind: str, name: str) -> str:
    return f'    def "x" ({kind} = @{name}@)\n    {{\n    }}'


@pytest.fixture
def stage(tmp_path: Path) -> Path:
    (tmp_path / "private").mkdir()
    (tmp_path / "private" / "secret.usda").write_text(CUBE)
    folder = tmp_path / "scene_7"
    folder.mkdir()
    (folder / "part.usda").write_text(CUBE)
    (folder / "link.usda").symlink_to(tmp_path / "private" / "secret.usda")
    os.mkfifo(folder / "pipe.usda")
    return folder / "stage.usda"


@pytest.mark.parametrize("kind", ["references", "payload"])
@pytest.mark.parametrize("name", ["../private/secret.usda", "{out}/secret.usda", "link.usda", "pipe.usda"])
def test_layers_outside_are_refused(stage: Path, kind: str, name: str) -> None:
    name = name.format(out=stage.parents[1] / "private")
    stage.write_text(usda(prim(kind, name)))
    with pytest.raises(DescriptionError):
        load_scene(stage)
    stage.write_text(usda(head=f"    subLayers = [@{name}@]"))
    with pytest.raises(DescriptionError):
        check_layers(stage)


def test_layers_outside_within_variants_and_parts_are_refused(stage: Path) -> None:
    variants = """    def Xform "x" (variants = {string v = "a"}
        prepend variantSets = "v")
    {
        variantSet "v" = {
            "a" {}
            "b" (references = @../private/secret.usda@) {}
        }
    }"""
    stage.write_text(usda(variants))
    with pytest.raises(DescriptionError, match="outside"):
        check_layers(stage)
    (stage.parent / "deep.usda").write_text(usda(prim("references", "../private/secret.usda")))
    stage.write_text(usda(prim("references", "deep.usda")))
    with pytest.raises(DescriptionError, match="outside"):
        check_layers(stage)


def test_own_layers_are_read_and_named_folders_too(stage: Path) -> None:
    stage.write_text(usda(prim("references", "./part.usda")))
    assert [file.name for file in check_layers(stage)] == ["stage.usda", "part.usda"]
    assert len(load_scene(stage).bodies) == 1
    stage.write_text(usda(prim("references", "../private/secret.usda")))
    private = stage.parents[1] / "private"
    files = check_layers(stage, Resolver.of_file(stage, search_paths=[private]))
    assert files[1] == private / "secret.usda"


def test_value_clips_and_computed_names_are_refused(stage: Path) -> None:
    values = "dictionary default = {asset[] assetPaths = [@/etc/passwd@]}"
    clips = f'    def Xform "x" (clips = {{{values}}})\n    {{\n    }}'
    stage.write_text(usda(clips))
    with pytest.raises(DescriptionError, match="clips"):
        check_layers(stage)


def test_a_stage_that_changed_while_another_holds_it_is_read_anew(stage: Path) -> None:
    stage.write_text(usda(prim("references", "./part.usda")))
    held = Usd.Stage.Open(str(stage))
    os.utime(stage, (1, 1))
    stage.write_text(usda(prim("references", "../private/secret.usda")))
    with pytest.raises(DescriptionError, match=r"secret\.usda"):
        load_scene(stage)
    allowed = Resolver.of_file(stage, search_paths=[stage.parents[1]])
    assert [file.name for file in check_layers(stage, allowed)] == ["stage.usda", "secret.usda"]
    part = prim("references", "./part.usda")
    stage.write_text(usda(part + "\n" + part.replace('"x"', '"y"')))
    assert len(load_scene(stage).bodies) == 2
    assert held

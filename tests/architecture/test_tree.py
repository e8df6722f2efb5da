"""The tree of folders explains itself: a sentence a folder, few files in it, no name for two things."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from house import SOURCE, modules, outline

MOST_FILES = 25


def folders() -> list[Path]:
    return [path for path in modules().values() if path.name == "__init__.py"]


def test_every_folder_says_what_it_holds() -> None:
    silent = [str(path.relative_to(SOURCE)) for path in folders() if not outline(path).docstring]
    assert not silent


def test_every_file_says_what_it_is_for() -> None:
    silent = [name for name, path in modules().items() if not outline(path).docstring]
    assert not silent


def test_folders_have_few_files() -> None:
    crowded = {
        str(path.parent.relative_to(SOURCE)): count
        for path in folders()
        if (count := len(list(path.parent.glob("*.py")))) > MOST_FILES
    }
    assert not crowded


def test_no_module_is_named_like_what_its_folder_exports() -> None:
    """`from roboyard.robots import load_definition` must not mean a function or a module by turns."""
    clashes = []
    for name, path in modules().items():
        if path.name != "__init__.py":
            continue
        own = {other.rpartition(".")[2] for other in modules() if other.rpartition(".")[0] == name}
        clashes += [f"{name}.{export}" for export in outline(path).exports & own]
    assert not clashes


def test_no_export_comes_from_a_module_of_its_own_name() -> None:
    clashes = []
    for name, path in modules().items():
        for home, imported in outline(path).imports_from:
            if imported in outline(path).exports and imported == home.rpartition(".")[2]:
                clashes.append(f"{name}: {imported}")
    assert not clashes

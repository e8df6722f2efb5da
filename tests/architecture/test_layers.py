"""Lower layers never import upper ones, and no files import one another in a circle."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from house import LAYERS, Import, circles, folder, imports, modules

LAYER = {name: number for number, names in enumerate(LAYERS) for name in names}


def test_every_folder_has_a_layer() -> None:
    assert {folder(module) for module in modules()} <= set(LAYER)


def test_imports_lead_downwards() -> None:
    upward = [
        f"{edge.importer}:{edge.line} imports {edge.imported}"
        for edge in imports()
        if folder(edge.importer) != folder(edge.imported)
        and LAYER[folder(edge.imported)] >= LAYER[folder(edge.importer)]
    ]
    assert not upward, "\n".join(upward)


def test_no_files_import_one_another() -> None:
    found = circles(imports())
    assert not found, "\n".join(", ".join(group) for group in found)


def test_a_circle_is_found_where_there_is_one() -> None:
    edges = [Import("a", "b", 1), Import("b", "c", 1), Import("c", "a", 1), Import("c", "d", 1)]
    assert circles(edges) == [["a", "b", "c"]]
    assert circles(edges[:2]) == []


def test_nothing_but_main_imports_the_package_itself() -> None:
    importers = {edge.importer for edge in imports() if edge.imported == "roboyard"}
    assert importers <= {"roboyard.__main__"}

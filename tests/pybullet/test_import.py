"""Modules that `import roboyard.pybullet` loads: none that a script may never use."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = ("numba", "scipy", "matplotlib", "pydantic", "typer", "rich", "viser", "trimesh", "roboyard.cli")


@pytest.mark.parametrize(
    "statement", ["import roboyard.pybullet", "from roboyard.pybullet import bullet_client"]
)
def test_importing_the_module_loads_nothing_heavy(statement: str) -> None:
    code = f"import sys; {statement}; print(*(name for name in {HEAVY!r} if name in sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    assert done.stdout.split() == []

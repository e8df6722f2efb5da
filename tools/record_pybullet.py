"""Record what PyBullet returns for the `record_...` functions of tests/pybullet/api.

    python tools/record_pybullet.py

needs pybullet 3.2.7 besides Roboyard. Each function gets the module and an empty folder, and returns plain
values. They are stored in tests/pybullet/data/recorded_api.json, with which the tests compare Roboyard's
results. The tests themselves need no pybullet.
"""

from __future__ import annotations

import json
import runpy
import sys
import tempfile
from pathlib import Path
from typing import Any

TESTS = Path(__file__).parents[1] / "tests" / "pybullet"


def main() -> int:
    """Write the file and return the exit code."""
    import pybullet

    plain = runpy.run_path(str(TESTS / "conftest.py"))["plain"]
    recorded: dict[str, Any] = {}
    for file in sorted((TESTS / "api").rglob("test_*.py")):
        for name, scenario in runpy.run_path(str(file)).items():
            if not name.startswith("record_"):
                continue
            pybullet.connect(pybullet.DIRECT)
            with tempfile.TemporaryDirectory() as folder:
                recorded[f"{file.stem}.{name}"] = plain(scenario(pybullet, Path(folder)))
            pybullet.disconnect()
    target = TESTS / "data" / "recorded_api.json"
    lines = ",\n".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in sorted(recorded.items()))
    target.write_text("{\n" + lines + "\n}\n", encoding="utf-8")
    print(f"{len(recorded)} results in {target.name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

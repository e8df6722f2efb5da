"""Print what ROS's own xacro makes of a file; run by `xacro_repositories.py` where `xacro` is installed.

Standard input is JSON: `file`, `arguments` and `packages` (name to folder), which stand in for ROS's index.
"""

from __future__ import annotations

import json
import sys
from types import ModuleType


def main() -> None:
    """Read the question and print the document."""
    question = json.load(sys.stdin)

    def get_package_share_directory(name: str) -> str:
        return question["packages"][name]

    index, packages = ModuleType("ament_index_python"), ModuleType("ament_index_python.packages")
    packages.get_package_share_directory = get_package_share_directory  # type: ignore[attr-defined]
    packages.PackageNotFoundError = KeyError  # type: ignore[attr-defined]
    sys.modules |= {"ament_index_python": index, "ament_index_python.packages": packages}
    import xacro

    print(xacro.process_file(question["file"], mappings=question["arguments"]).toxml())


if __name__ == "__main__":
    main()

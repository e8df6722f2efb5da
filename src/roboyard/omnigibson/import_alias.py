"""Let scripts that import OmniGibson's URDF helpers run without OmniGibson.

    from roboyard.description import install_omnigibson_alias

    install_omnigibson_alias()
    from omnigibson.utils.urdf_preprocessing import sanitize_names

`roboyard run SCRIPT` does this by itself. The finder stands last: an installed OmniGibson is preferred.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

_PACKAGES = ("omnigibson", "omnigibson.utils")
_MODULES = ("omnigibson.utils.urdf_preprocessing", "omnigibson.macros")


class _Alias:
    """Finds the few modules of OmniGibson that Roboyard stands in for.

    It has the methods of finders and loaders without their base classes, which take long to load.
    """

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname not in (*_PACKAGES, *_MODULES):
            return None
        parent = sys.modules.get(fullname.rpartition(".")[0])
        if parent is not None and not isinstance(getattr(parent, "__loader__", None), _Alias):
            return None  # a real OmniGibson without this module
        loader: Any = self
        return ModuleSpec(fullname, loader, origin="roboyard", is_package=fullname in _PACKAGES)

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        """Let Python create the module."""
        return None

    def exec_module(self, module: ModuleType) -> None:
        name = module.__name__
        module.__doc__ = f"Roboyard's stand-in for {name}."
        if name == "omnigibson.utils.urdf_preprocessing":
            from roboyard.omnigibson import urdf_helpers

            module.__dict__.update({key: getattr(urdf_helpers, key) for key in urdf_helpers.__all__})
            module.__dict__["__all__"] = list(urdf_helpers.__all__)
        elif name == "omnigibson.macros":
            module.__dict__["gm"] = SimpleNamespace(DATA_PATH=str(_data_path()))


def install_omnigibson_alias() -> None:
    """Make `omnigibson.utils.urdf_preprocessing` importable where OmniGibson is not installed.

    Also `omnigibson.macros.gm.DATA_PATH` (the folder ROBOYARD_DATA, or Roboyard's data folder). A second call
    does nothing.
    """
    if not any(isinstance(finder, _Alias) for finder in sys.meta_path):
        sys.meta_path.append(_Alias())


def _data_path() -> Path:
    from platformdirs import user_data_path

    given = os.environ.get("ROBOYARD_DATA")
    return Path(given) if given else user_data_path("roboyard")

# MuJoCo ships no stubs for its compiled modules: every name is taken as it is.
from typing import Any

def __getattr__(name: str) -> Any: ...

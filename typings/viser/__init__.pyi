# An optional dependency: the type checker has to pass without it.
from typing import Any

def __getattr__(name: str) -> Any: ...

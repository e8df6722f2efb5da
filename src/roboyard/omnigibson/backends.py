"""NumPy arrays by default, torch tensors where requested."""

from __future__ import annotations

from typing import Any, Literal

from roboyard.errors import MissingExtraError, RoboyardError
from roboyard.transforms import Array

Backend = Literal["numpy", "torch"]
"""Kind of array that getters return."""


def as_backend(array: Array, backend: Backend) -> Any:
    """Return an array (...,) of any shape unchanged, or as a torch tensor of float32 (as OmniGibson's are).

    Raises:
        MissingExtraError: torch is not installed.
        RoboyardError: the backend is unknown.
    """
    if backend == "numpy":
        return array
    if backend != "torch":
        raise RoboyardError(f'backend {backend!r} is unknown; choose "numpy" or "torch"')
    try:
        import torch  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise MissingExtraError("torch", "torch", "tensors") from None
    return torch.as_tensor(array, dtype=torch.float32)


def as_numpy(values: Any) -> Any:
    """Return a torch tensor as a NumPy array of the same shape; anything else unchanged."""
    if hasattr(values, "detach"):
        return values.detach().cpu().numpy()
    return values

"""NumPy by default, torch tensors where asked."""

from __future__ import annotations

from typing import Any, Literal

from roboyard.errors import MissingExtraError, RoboyardError
from roboyard.transforms import Array

Backend = Literal["numpy", "torch"]


def as_backend(array: Array, backend: Backend) -> Any:
    """The array as it is, or as a torch tensor (float32, as OmniGibson has them).

    Raises:
        MissingExtraError: torch is not installed.
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
    """A torch tensor as a NumPy array; anything else as it is."""
    if hasattr(values, "detach"):
        return values.detach().cpu().numpy()
    return values

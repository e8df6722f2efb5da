"""Compiled functions that a C library calls, in place of one of its own."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

from roboyard.native.signatures import DTYPES, CallbackSignature


class Callback:
    """A function for C; it is compiled or loaded when its address is asked for."""

    def __init__(self, core: FunctionType, signature: CallbackSignature, library: Callable[[], Any]) -> None:
        """Create the function from Python source that numba can compile; see `called_by_c`."""
        self.core, self.signature, self._library = core, signature, library

    @property
    def is_stored(self) -> bool:
        """Whether it is stored, so that loading it compiles nothing."""
        from roboyard.native import objects

        self._library()  # which may write constants that the code depends on
        return objects.is_stored(self.core, self.signature)

    @property
    def is_cheap(self) -> bool:
        """Whether it is stored, or is compiled once and for all."""
        from roboyard.native import objects

        self._library()
        return objects.can_be_kept(self.core, self.signature)

    def address(self) -> int:
        """Return the address of the machine code; 0 where it cannot be executed, or without a library."""
        from roboyard.native import kernels, objects
        from roboyard.native.memory import images_can_be_loaded, offer

        library = self._library()
        if library is None or not images_can_be_loaded():
            return 0
        offer(library)
        with kernels.loading:
            return objects.address_of(self.core, self.signature)


def called_by_c(text: str, *, otherwise: str, library: Callable[[], Any]) -> Callable[[Any], Callback]:
    """Return a decorator that makes a function of whole numbers and numbers one that C calls.

    It may read and write memory with the functions of `roboyard.native.views`, and knows nothing of Python.

    Args:
        text: arguments and result, such as "i8 i8 i4 f8 -> i4"; i8 is an address, too.
        otherwise: name of the C function with the same arguments that is called where the result is
            negative.
        library: returns the `ctypes.CDLL` that has it, or None.

    Raises:
        TypeError: the function has another number of arguments.
    """
    before, _, after = text.partition("->")
    signature = CallbackSignature(
        tuple(DTYPES[word] for word in before.split()), DTYPES[after.strip()], otherwise
    )

    def decorate(function: Any) -> Callback:
        given = function.__code__.co_argcount
        if given != len(signature.arguments):
            raise TypeError(f"{function.__name__} has {given} arguments, its signature {text!r} has others")
        return Callback(function, signature, library)

    return decorate

"""Machine code in front of a Python function: it takes plain calls with numbers and vectors.

Such a function is called with sequences of numbers and returns tuples of them. The machine code reads the
arguments as Python's C interface does, calls a compiled core and makes the tuples. Irregular calls (an
unknown keyword, a wrong length, text, a number that is not finite) go to the Python function, which knows all
rules and errors.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any, TypeVar, cast

from roboyard.native.signatures import DTYPES, EntrySignature, FrontSignature, Numbers

F = TypeVar("F", bound=Callable[..., Any])


class Front:
    """The compiled part of a function: from a few numbers to a tuple of numbers."""

    def __init__(self, core: FunctionType, signature: FrontSignature | EntrySignature) -> None:
        """Create the front; it is compiled or loaded when its address is asked for.

        Args:
            core: Python source with one argument for each number; numba can compile it. Of a front that is
                its own entry any function beside whose source file the code is stored.
            signature: the vectors that the numbers come from and go to.
        """
        self.core, self.signature = core, signature

    @property
    def is_stored(self) -> bool:
        """Whether it is stored, so that loading it compiles nothing."""
        from roboyard.native import objects

        return objects.is_stored(self.core, self.signature)

    @property
    def is_cheap(self) -> bool:
        """Whether it is stored, or is compiled once and for all."""
        from roboyard.native import objects

        return objects.can_be_kept(self.core, self.signature)

    def address(self) -> int:
        """Return the address of the machine code, a METH_FASTCALL | METH_KEYWORDS function; 0 for none.

        Its first argument is the Python function that takes irregular calls.
        """
        from roboyard.native import kernels, objects

        with kernels.loading:
            return objects.address_of(self.core, self.signature)


def fronted(core: Any, text: str, *, ignored: str = "") -> Callable[[F], F]:
    """Return a decorator that gives a function its front, as the attribute `front`.

    Args:
        core: function of all numbers of the arguments that returns a tuple of all numbers of the results, in
            Python that numba can compile.
        text: arguments and results, such as "f8:3 f8 -> f8:4" for a vector of three and a number to a vector
            of four; f4 for numbers that are rounded to 32 bits. Several results become a tuple.
        ignored: name of a keyword that changes nothing.

    Raises:
        TypeError: the core has another number of arguments.
    """
    before, _, after = text.partition("->")
    arguments, results = _numbers(before), _numbers(after)
    signature = FrontSignature(arguments, results, ignored)
    wanted = sum(max(1, given.length) for given in signature.arguments)
    if core.__code__.co_argcount != wanted:
        raise TypeError(f"{core.__name__} has {core.__code__.co_argcount} arguments, {text!r} has {wanted}")

    def decorate(function: F) -> F:
        names: tuple[str, ...] = cast(FunctionType, function).__code__.co_varnames[: len(arguments)]
        vars(function)["front"] = Front(core, FrontSignature(arguments, results, ignored, names))
        return function

    return decorate


def _numbers(text: str) -> tuple[Numbers, ...]:
    words = (word.partition(":") for word in text.split())
    return tuple(Numbers(DTYPES[dtype], int(length or 0)) for dtype, _, length in words)

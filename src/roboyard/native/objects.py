"""Machine code of compiled loops: stored in files, loaded into the process."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from roboyard._bootstrap import user_cache
from roboyard._digests import blake2b
from roboyard._lazy import paused_collection
from roboyard.native.called import source_of
from roboyard.native.known_places import KnownPlaces
from roboyard.native.memory import (
    images_can_be_loaded,
    load_image,
    load_stored,
    missing_functions,
    stored_image,
)
from roboyard.native.processor import processor
from roboyard.native.signatures import (
    Bundle,
    CallbackSignature,
    EntrySignature,
    FrontSignature,
    Signature,
    Words,
)

AnySignature = Signature | FrontSignature | EntrySignature | CallbackSignature
_LAYOUT = 11
"""Increased whenever arguments are passed, or loops compiled, in another way."""
_DIGEST = 32
"""Bytes of the hash before the machine code: LLVM ends the process at damaged code."""
_DATA, _COUNT, _SHAPE, _STRIDES, _DTYPE = 2, 3, 4, 5, 7
"""Places of the addresses in NumPy's array objects, in words."""
_IMAGE = b"image of roboyard"
_engines: list[Any] = []  # they own the machine code


def address_of(function: FunctionType, signature: AnySignature) -> int:
    """Return the address of a loop's machine code, stored or compiled now; 0 where it cannot be used."""
    if not code_is_used():
        return 0
    known = _known_places()
    found = known.find(function, signature)
    if found is not None and found[2] is not None and images_can_be_loaded():
        address = load_stored(found[0], found[2])
        if address:
            return address
    path, name = _place_of(function, signature)
    content = _stored(path)
    if content is None:
        content = _built(function, signature, name)
        _store(path, content)
    if content.startswith(_IMAGE):
        from roboyard.native.images import image_from_bytes

        image = image_from_bytes(content[len(_IMAGE) :])
        stored = stored_image(image, _DIGEST + len(content))
        if known.find(function, signature) is not None:  # so that the compiler need not be loaded to know it
            known.add_image(function, signature, stored)
        else:
            known.add(function, signature, str(path), name, stored)
        return load_image(image)
    return _load(content, name)


def known_address(module: str, name: str) -> int:
    """Return the address of a loop's machine code by its module, imported or not; 0 if it is not known."""
    if not code_is_used() or not images_can_be_loaded():
        return 0
    found = _known_places().find_closed(module, name)
    return 0 if found is None else load_stored(*found)


def code_is_used() -> bool:
    """Return whether loops are machine code here, stored or compiled."""
    return not compiler_is_off() and arrays_have_the_known_layout()


def compiler_is_off() -> bool:
    """Return whether numba's own switch makes all loops plain Python."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


def is_stored(function: FunctionType, signature: AnySignature) -> bool:
    """Return whether a loop's machine code is stored, so that loading it compiles nothing."""
    return _place_of(function, signature)[0].exists()


def can_be_kept(function: FunctionType, signature: AnySignature) -> bool:
    """Return whether a loop is stored, or can be compiled and stored for later processes."""
    if not code_is_used():
        return False
    path, _ = _place_of(function, signature)
    folder = path.parent
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return path.exists() or os.access(folder, os.W_OK)


def _built(function: FunctionType, signature: AnySignature, name: str) -> bytes:
    """Compile a loop and return its image, or an object file where this machine does not execute images.

    Raises:
        TypeError: the loop calls functions of numba, which later processes do not load.
    """
    with paused_collection():  # numba's objects are many, and few of them are garbage
        return _built_now(function, signature, name)


def _built_now(function: FunctionType, signature: AnySignature, name: str) -> bytes:
    from roboyard.native.building import machine_code
    from roboyard.native.images import image_of

    if images_can_be_loaded():
        image = image_of(machine_code(function, signature, name, is_small=True), name)
        missing = [] if image is None else missing_functions(image)
        if missing:
            name = f"{function.__module__}.{function.__qualname__}"
            raise TypeError(
                f"{name} calls {', '.join(missing)} of numba, which is not loaded with stored code; "
                "do without it (`reshape` is such: pass the array in its final shape)"
            )
        if image is not None and load_image(image):
            return _IMAGE + image.to_bytes()
    return machine_code(function, signature, name, is_small=False)


def jitted(function: FunctionType, signature: Signature) -> Callable[..., Any]:
    """Return the loop as numba's own function, where stored code cannot be used."""
    from roboyard.native.building import jit

    loop = jit(function, fast_math=signature.fast_math, no_nan=signature.no_nan)
    if not any(isinstance(argument, Bundle) for argument in signature.arguments):
        return loop

    def call(*values: Any) -> Any:
        return loop(*(v for value in values for v in (value.records if type(value) is Words else (value,))))

    return call


@cache
def arrays_have_the_known_layout() -> bool:
    """Return whether NumPy's array objects have their fields where machine code reads them."""
    if sys.implementation.name != "cpython" or ctypes.sizeof(ctypes.c_void_p) != 8:
        return False
    probe = np.zeros((2, 3, 4))[:, ::2, 1:]
    words = ctypes.cast(id(probe), ctypes.POINTER(ctypes.c_int64))
    shape, strides = (ctypes.cast(words[k], ctypes.POINTER(ctypes.c_int64)) for k in (_SHAPE, _STRIDES))
    return (
        words[_DATA] == probe.ctypes.data
        and words[_COUNT] & 0xFFFFFFFF == probe.ndim
        and words[_DTYPE] == id(probe.dtype)
        and tuple(shape[k] for k in range(3)) == probe.shape
        and tuple(strides[k] for k in range(3)) == probe.strides
    )


def _place_of(function: FunctionType, signature: AnySignature) -> tuple[Path, str]:
    """Return what `_stored_at` returns, from what earlier processes found where nothing has changed."""
    known = _known_places()
    found = known.find(function, signature)
    if found is not None:
        return Path(found[0]), found[1]
    path, name = _stored_at(function, signature)
    known.add(function, signature, str(path), name)
    return path, name


@cache
def _known_places() -> KnownPlaces:
    return KnownPlaces(_LAYOUT)


def _stored_at(function: FunctionType, signature: AnySignature) -> tuple[Path, str]:
    """Return the file of a loop's machine code, and the name of the function in it.

    All versions of Python execute the same code: it uses functions of Python that they all have. Builds whose
    objects are laid out in another way (debug, without the global lock) have code of their own.
    """
    import llvmlite

    source = Path(function.__code__.co_filename)
    parts = (
        *(_LAYOUT, getattr(sys, "abiflags", ""), np.__version__, llvmlite.__version__),
        *(processor(), function.__name__, signature),
    )
    key = blake2b(repr(parts).encode() + b"".join(source_of(function)), digest_size=8).hexdigest()
    return _folder(
        source
    ) / f"{source.stem}.{function.__name__}.{key}.o", f"roboyard_{function.__name__}_{key}"


def _folder(source: Path) -> Path:
    """Return where machine code is stored: beside numba's and Python's own compiled files, if possible."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        return Path(given)
    beside = source.parent / "__pycache__"
    if os.access(beside if beside.exists() else source.parent, os.W_OK):
        return beside
    return Path(user_cache()) / "native"


def _stored(path: Path) -> bytes | None:
    """Return the content of a file; None where there is none, or a crash has cut it."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    digest, content = data[:_DIGEST], data[_DIGEST:]
    return content if blake2b(content, digest_size=_DIGEST).digest() == digest else None


def _store(path: Path, content: bytes) -> None:
    """Write a file that other processes may read at the same time; without a place for it, do nothing."""
    new = path.with_name(f"{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        new.write_bytes(blake2b(content, digest_size=_DIGEST).digest() + content)
        new.replace(path)
    except OSError:
        with suppress(OSError):
            new.unlink()


def _load(content: bytes, name: str) -> int:
    """Return the address of a function in an object file."""
    with paused_collection():
        import llvmlite.binding as llvm

    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(content))
    engine.finalize_object()
    _engines.append(engine)
    return engine.get_function_address(name)


def _machine() -> Any:
    """Return LLVM's description of this machine."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(), codemodel="jitdefault", jit=True
    )

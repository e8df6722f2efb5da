"""Compiling loops with numba. Import only where no stored machine code is found."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from types import FunctionType
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numba import carray, cfunc, njit, types
from numba.core import cgutils, config
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target
from numba.extending import intrinsic
from numba.np import arrayobj

from roboyard.native.c_functions import CFunction
from roboyard.native.called import called_functions
from roboyard.native.code_library import without_machine_code
from roboyard.native.memory import function_address
from roboyard.native.python_functions import PYTHON, WORD
from roboyard.native.signatures import (
    Argument,
    Bundle,
    CallbackSignature,
    EntrySignature,
    FrontSignature,
    Record,
    Signature,
)
from roboyard.native.views import integers_at, numbers_at, short_numbers_at, words_at

_WORDS = Argument("int64", 1, is_contiguous=True)
"""A bundle's addresses and integers."""
FAST_MATH = {"reassoc", "contract", "arcp", "nsz"}
"""LLVM's freedoms that keep infinite and undefined numbers as they are."""
WITHIN: dict[str, Any] = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Options of functions that compiled ones call: what numba adds for calls from elsewhere takes it longer."""


_target: Any = cpu_target
# numba does so before it compiles; processes that are forked from this one need not
_target.typing_context.refresh()
_target.target_context.refresh()

_made: dict[tuple[FunctionType, bool, bool, bool, bool], Any] = {}
"""Source and options to numba's function, which several loops may call."""


def jit(
    function: FunctionType,
    *,
    fast_math: bool = False,
    no_nan: bool = False,
    is_part: bool = False,
    from_start: bool = False,
) -> Any:
    """Return a Python function compiled by numba, with the functions of its package that it calls.

    Args:
        function: its Python source.
        fast_math: whether LLVM may change the order of sums and products; see `FAST_MATH`.
        no_nan: whether LLVM may assume that no number is undefined.
        is_part: whether it becomes part of those that call it, which are compiled, too. A call would copy
            nine words for each array that is passed, a hundred and more for a record of arrays.
        from_start: whether it is compiled within `_indices_from_start`, apart from where it is not.
    """
    key = function, fast_math, no_nan, is_part, from_start
    if key not in _made:
        names = dict(function.__globals__)
        for name, source in called_functions(function):
            names[name] = jit(source, fast_math=fast_math, no_nan=no_nan, is_part=True, from_start=from_start)
        for name in function.__code__.co_names:
            value = function.__globals__.get(name)
            if isinstance(value, FunctionType) and value in _VIEWS:
                names[name] = _VIEWS[value]
            elif isinstance(value, CFunction):
                llvm.add_symbol(value.name, function_address(value.name))
                kinds = (getattr(types, kind) for kind in value.arguments)
                names[name] = types.ExternalFunction(value.name, getattr(types, value.returns)(*kinds))
        copy = FunctionType(function.__code__, names, function.__name__, function.__defaults__)
        freedoms = (FAST_MATH if fast_math else set()) | ({"nnan"} if no_nan else set())
        # Arrays that are passed have no owner here, and none are created: references are not counted.
        options: dict[str, Any] = dict(WITHIN) if is_part else {"error_model": "numpy"}
        options |= {"fastmath": freedoms or False, "_nrt": False, "forceinline": is_part}
        _made[key] = njit(**options)(copy)
    return _made[key]


def machine_code(
    function: FunctionType,
    signature: Signature | FrontSignature | EntrySignature | CallbackSignature,
    name: str,
    *,
    is_small: bool,
) -> bytes:
    """Return an object file with a loop as the function `name`, which has no other public name.

    The function is what Python calls METH_FASTCALL: its arguments are the object None, the address of a list
    of objects and their number; it returns an object, or 0 after it has set an exception. Of a front the
    first is the Python function, and the fourth the tuple of keywords or 0. A callback has the arguments and
    the result that its signature says.

    Args:
        function: Python source of the loop.
        signature: its arguments.
        name: name in the object file.
        is_small: whether code and constants stand within 2 GiB of each other, else anywhere.
    """
    if isinstance(signature, EntrySignature):
        own: dict[str, Any] = {
            "part": njit(**WITHIN, forceinline=True),
            "words": _words,
            "word": _word,
            "np": np,
        }
        own |= {"_loop": jit(function, is_part=True), "matrix": _view(Argument("float64", 2))}
        own |= {"numbers": _view(Argument("float64", 1)), "integers": _view(Argument("int64", 1))}
        return _compiled(signature.source, own | PYTHON, 4, name, is_small)
    from_start = isinstance(signature, Signature) and signature.from_start
    loop = jit(
        function,
        fast_math=signature.fast_math,
        no_nan=signature.no_nan,
        from_start=from_start,
        is_part=True,
    )
    values: dict[str, Any] = {"_loop": loop, "np": np, **PYTHON}
    if isinstance(signature, FrontSignature):
        from roboyard.native.front_entries import front_source, helpers

        options: dict[str, Any] = {**WITHIN, "_nrt": False}
        values |= helpers(njit(**options), _word) | {"words": _words}
        return _compiled(front_source(signature), values, 4, name, is_small)
    if isinstance(signature, CallbackSignature):
        return _compiled_callback(signature, values, name, is_small)
    for k, argument in enumerate(signature.arguments):
        records = (argument,) if isinstance(argument, Record) else getattr(argument, "records", ())
        for j, record in enumerate(records):
            values[f"_record{k}_{j}"] = record.made_by
        fields = [field for record in records for field in record.fields]
        if isinstance(argument, Bundle):
            fields.append(_WORDS)
        for a in [argument] if isinstance(argument, Argument) else fields:
            if a.dimensions and _view_name(a) not in values:
                values[_view_name(a)] = _view(a)
    with _indices_from_start() if from_start else nullcontext(), _joined(signature.joins_lines):
        return _compiled(_entry_source(signature), values, 3, name, is_small)


def _compiled(source: str, values: dict[str, Any], count: int, name: str, is_small: bool) -> bytes:
    """Return an object file of the function `entry` of a source, whose second argument is an address."""
    exec(compile(source, f"<{name}>", "exec"), values)  # noqa: S102 - our own source
    words = [WORD] * count
    words[1] = types.CPointer(WORD)
    with without_machine_code():
        made: Any = cfunc(WORD(*words), error_model="numpy")(values["entry"])
    function = made.native_name.removeprefix("cfunc.")
    entry = _entry(function, ["ptr" if k == 1 else "i64" for k in range(count)], name, "i64")
    return _object_file(made.inspect_llvm(), entry, name, is_small)


def _compiled_callback(
    signature: CallbackSignature, values: dict[str, Any], name: str, is_small: bool
) -> bytes:
    """Return an object file of a function for C, which calls the loop, and another one where it declines.

    Raises:
        TypeError: there is no such other one.
    """
    other = function_address(signature.otherwise)
    if not other:
        raise TypeError(f"{name} calls {signature.otherwise}, which no library has that was offered")
    llvm.add_symbol(signature.otherwise, other)
    kind = getattr(types, signature.returns)(*(getattr(types, a) for a in signature.arguments))
    given = ", ".join(f"a{k}" for k in range(len(signature.arguments)))
    source = f"""def entry({given}):
    result = _loop({given})
    return {signature.returns}(result) if result >= 0 else {signature.otherwise}({given})
"""
    values |= {
        signature.otherwise: types.ExternalFunction(signature.otherwise, kind),
        signature.returns: getattr(np, signature.returns),
    }
    exec(compile(source, f"<{name}>", "exec"), values)  # noqa: S102 - our own source
    with without_machine_code():
        made: Any = cfunc(kind, error_model="numpy")(values["entry"])
    function = made.native_name.removeprefix("cfunc.")
    words = {"int64": "i64", "int32": "i32", "float64": "double"}
    arguments = [words[a] for a in signature.arguments]
    entry = _entry(function, arguments, name, words[signature.returns])
    return _object_file(made.inspect_llvm(), entry, name, is_small)


@contextmanager
def _indices_from_start() -> Iterator[None]:
    """Let numba take indices as they are; it adds the length of the array to negative ones otherwise.

    Of each index of a loop that may be negative for all LLVM knows, that takes three instructions. Other
    threads compile nothing meanwhile. Where numba has no such function, indices stay as they are.
    """

    def as_given(context: Any, builder: Any, kind: Any, index: Any, size: Any) -> Any:
        return context.cast(builder, index, kind, types.intp if kind.signed else types.uintp)

    with global_compiler_lock:
        kept = getattr(arrayobj, "fix_integer_index", None)
        if kept is not None:
            arrayobj.fix_integer_index = as_given
        try:
            yield
        finally:
            if kept is not None:
                arrayobj.fix_integer_index = kept


@contextmanager
def _joined(joins_lines: bool) -> Iterator[None]:
    """Let LLVM make vector instructions of equal operations that are written out; numba leaves it off."""
    settings: Any = config
    with global_compiler_lock:
        kept = settings.SLP_VECTORIZE
        settings.SLP_VECTORIZE = int(joins_lines) or kept
        try:
            yield
        finally:
            settings.SLP_VECTORIZE = kept


def _entry_source(signature: Signature) -> str:
    """Return the source of the function that converts Python's objects and calls the loop."""
    lines = [f"if count != {len(signature.arguments)}:", "    PyErr_BadArgument()", "    return 0"]
    passed: list[str] = []
    for k, argument in enumerate(signature.arguments):
        if isinstance(argument, Argument):
            lines += _read(argument, f"a{k}", f"given[{k}]")
            passed.append(f"a{k}")
            continue
        is_bundle = isinstance(argument, Bundle)
        if is_bundle:
            lines.append(f"words{k} = {_view_name(_WORDS)}(given[{k}])")
        place = 0
        for j, record in enumerate(argument.records if is_bundle else (argument,)):
            names = []
            for field in record.fields:
                name = f"a{k}_{place}"
                names.append(name)
                if not is_bundle:
                    lines += _read(field, name, f"PyTuple_GetItem(given[{k}], {place})")
                elif field.dimensions:
                    lines.append(f"{name} = {_view_name(field)}(words{k}[{place}])")
                else:
                    lines.append(f"{name} = np.{field.dtype}(words{k}[{place}])")
                place += 1
            passed.append(f"a{k}_{j}_")
            lines.append(f"{passed[-1]} = _record{k}_{j}({', '.join(names)})")
    call = f"_loop({', '.join(passed)})"
    lines += ["thread = PyEval_SaveThread()"] if signature.releases_gil else []
    lines.append(f"result = {call}" if signature.returns else call)
    lines += ["PyEval_RestoreThread(thread)"] if signature.releases_gil else []
    if signature.returns:
        kind = "PyFloat_FromDouble" if signature.returns.startswith("f") else "PyLong_FromLongLong"
        lines.append(f"return {kind}(result)")
    else:
        lines += ["Py_IncRef(none)", "return none"]
    return "\n    ".join(["def entry(none, given, count):", *lines])


def _read(argument: Argument, name: str, given: str) -> list[str]:
    """Return the lines that convert one object of Python; `given` is its address."""
    if argument.dimensions:
        return [f"{name} = {_view_name(argument)}({given})"]
    read = "PyFloat_AsDouble" if argument.dtype.startswith("f") else "PyLong_AsLongLong"
    return [
        *(f"n_{name} = {read}({given})", f"if n_{name} == -1 and PyErr_Occurred() != 0:", "    return 0"),
        f"{name} = np.{argument.dtype}(n_{name})",
    ]


def _object_file(assembly: str, entry: str, name: str, is_small: bool) -> bytes:
    """Return the object file of a function, `entry`, that calls a module, without what it does not use."""
    module = llvm.parse_assembly(_UNUSED.sub(r"define void @\1(\2 %0) { ret void }", assembly) + entry)
    for other in (*module.functions, *module.global_variables):
        if other.name != name and not other.is_declaration:
            other.linkage = "internal"
    machine = llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(),
        features=llvm.get_host_cpu_features().flatten(),
        opt=3,
        reloc="pic",
        codemodel="small" if is_small else "jitdefault",
        jit=not is_small,
    )
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options()))
    return machine.emit_object(module)


def _entry(function: str, arguments: list[str], name: str, returns: str) -> str:
    """Return the public function, which calls numba's: that takes places of result and error first."""
    given = ", ".join(f"{kind} %a{k}" for k, kind in enumerate(arguments))
    return f"""
define {returns} @{name}({given}) {{
  %result = alloca {returns}
  %problem = alloca ptr
  store {returns} zeroinitializer, ptr %result
  %status = call i32 @"{function}"(ptr %result, ptr %problem, {given})
  %object = load {returns}, ptr %result
  ret {returns} %object
}}
"""


_UNUSED = re.compile(r"declare void @(NRT_MemInfo_call_dtor)\((ptr|i8\*)[^)]*\)[^\n]*")
"""Called by numba for the last owner of an array's memory; arrays that are passed have no owner here."""


@intrinsic
def _pointer(context: Any, address: Any) -> Any:
    """Return an address as a pointer."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))

    return types.voidptr(address), generate


WORDS = 64
"""Words of memory that an entry gets from `words()`."""


@intrinsic
def _words(context: Any) -> Any:
    """Return the address of `WORDS` words of memory that last until the function returns."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return cgutils.alloca_once(builder, context.get_value_type(WORD), size=WORDS)

    return types.CPointer(WORD)(), generate


@intrinsic
def _word(context: Any, address: Any, place: Any) -> Any:
    """Return the word at a place behind an address."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        start = builder.inttoptr(arguments[0], context.get_value_type(WORD).as_pointer())
        return builder.load(builder.gep(start, [arguments[1]]))

    return WORD(WORD, WORD), generate


def _memory_at(kind: Any) -> Any:
    """Return a function of compiled code that gives so many numbers at an address as an array."""
    result = types.Array(kind, 1, "C")

    @intrinsic
    def memory_at(context: Any, address: Any, count: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            given = [
                context.cast(builder, a, t, WORD) for a, t in zip(arguments, signature.args, strict=True)
            ]
            array = arrayobj.make_array(result)(context, builder)
            size = context.get_constant(types.intp, kind.bitwidth // 8)
            data = builder.inttoptr(given[0], array.data.type)
            arrayobj.populate_array(array, data, [given[1]], [size], size, meminfo=None)
            return array._getvalue()

        return result(address, count), generate

    return memory_at


_VIEWS = {
    numbers_at: _memory_at(types.float64),
    short_numbers_at: _memory_at(types.float32),
    integers_at: _memory_at(types.int32),
    words_at: _memory_at(types.int64),
}
"""Functions that see memory to what they are in compiled code."""


def _view_name(argument: Argument) -> str:
    return f"_view{argument.dimensions}_{argument.dtype}_{int(argument.is_contiguous)}"


def _view(argument: Argument) -> Any:
    """Return a compiled function that gives the array of an array object's address."""
    dimensions = argument.dimensions
    kind = getattr(np, argument.dtype)
    shape = ", ".join(f"shape[{k}]" for k in range(dimensions))
    strides = ", ".join(f"strides[{k}]" for k in range(dimensions))
    source = f"""def view(address):
    words = carray(_pointer(address), (6,), np.int64)
    shape = carray(_pointer(words[4]), ({dimensions},), np.int64)
"""
    if argument.is_contiguous:
        source += f"    return carray(_pointer(words[2]), ({shape},), kind)"
    else:
        source += f"""    strides = carray(_pointer(words[5]), ({dimensions},), np.int64)
    flat = carray(_pointer(words[2]), (1,), kind)
    return np.lib.stride_tricks.as_strided(flat, ({shape},), ({strides},))"""
    values: dict[str, Any] = {"carray": carray, "_pointer": _pointer, "np": np, "kind": kind}
    exec(compile(source, "<view>", "exec"), values)  # noqa: S102 - our own source
    return njit(**WITHIN)(values["view"])

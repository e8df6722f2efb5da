"""Compiling loops with numba. Import only where no stored machine code is found."""

from __future__ import annotations

import re
from types import FunctionType
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numba import carray, cfunc, njit, types
from numba.extending import intrinsic

from roboyard.native.called import called_functions
from roboyard.native.objects import FIRST_ITEM
from roboyard.native.signatures import Argument, Signature

FAST_MATH = {"reassoc", "contract", "arcp", "nsz"}
"""LLVM's freedoms that keep infinite and undefined numbers as they are."""


def jit(function: FunctionType, *, fast_math: bool = False) -> Any:
    """Return a Python function compiled by numba, with the functions of its package that it calls.

    Args:
        function: its Python source.
        fast_math: whether LLVM may change the order of sums and products; see `FAST_MATH`.
    """
    return _jit(function, fast_math, {})


def _jit(function: FunctionType, fast_math: bool, made: dict[FunctionType, Any]) -> Any:
    if function not in made:
        names = dict(function.__globals__)
        for name, source in called_functions(function):
            names[name] = _jit(source, fast_math, made)
        copy = FunctionType(function.__code__, names, function.__name__, function.__defaults__)
        made[function] = njit(error_model="numpy", fastmath=FAST_MATH if fast_math else False)(copy)
    return made[function]


def machine_code(function: FunctionType, signature: Signature, name: str) -> bytes:
    """Return an object file with a loop as the function `name`, which has no other public name.

    Its arguments are: place of the result, place of an error, a tuple of all arrays, the numbers.
    """
    arguments = signature.arguments
    passed, names, kinds = [], ["arrays"], [types.CPointer(types.int64)]
    for k, argument in enumerate(arguments):
        if argument.dimensions:
            place = FIRST_ITEM + k - (len(names) - 1)
            passed.append(f"{_view_name(argument)}(carray(_pointer(arrays[{place}]), (6,), np.int64))")
        else:
            names.append(f"number{k}")
            passed.append(names[-1])
            kinds.append(getattr(types, argument.dtype))
    values: dict[str, Any] = {"_loop": jit(function, fast_math=signature.fast_math)}
    values |= {"carray": carray, "_pointer": _pointer, "np": np}
    values |= {_view_name(a): _view(a) for a in set(arguments) if a.dimensions}
    source = f"def {name}({', '.join(names)}):\n    return _loop({', '.join(passed)})"
    exec(compile(source, f"<{name}>", "exec"), values)  # noqa: S102 - our own source
    result = types.float64 if signature.returns_number else types.void
    made: Any = cfunc(result(*kinds), error_model="numpy")(values[name])
    return _object_file(made.inspect_llvm(), made.native_name.removeprefix("cfunc."), name)


def _object_file(assembly: str, function: str, name: str) -> bytes:
    """Return the object file of one function of a module, without what the function does not use."""
    assembly = assembly.replace(f'"{function}"', f'"{name}"').replace(f"@{function}(", f"@{name}(")
    module = llvm.parse_assembly(_UNUSED.sub(r"define void @\1(\2 %0) { ret void }", assembly))
    for other in (*module.functions, *module.global_variables):
        if other.name != name and not other.is_declaration:
            other.linkage = "internal"
    machine = llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(),
        features=llvm.get_host_cpu_features().flatten(),
        opt=3,
        reloc="pic",
        codemodel="jitdefault",
        jit=True,
    )
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options()))
    return machine.emit_object(module)


_UNUSED = re.compile(r"declare void @(NRT_MemInfo_call_dtor)\((ptr|i8\*)[^)]*\)[^\n]*")
"""Called by numba for the last owner of an array's memory; arrays that are passed have no owner here."""


@intrinsic
def _pointer(context: Any, address: Any) -> Any:
    """Return an address as a pointer."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))

    return types.voidptr(address), generate


def _view_name(argument: Argument) -> str:
    return f"_view{argument.dimensions}_{argument.dtype}_{int(argument.is_contiguous)}"


def _view(argument: Argument) -> Any:
    """Return a compiled function that gives the array of an array object's address."""
    dimensions = argument.dimensions
    kind = getattr(np, argument.dtype)
    shape = ", ".join(f"shape[{k}]" for k in range(dimensions))
    strides = ", ".join(f"strides[{k}]" for k in range(dimensions))
    source = f"""def view(words):
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
    return njit(error_model="numpy")(values["view"])

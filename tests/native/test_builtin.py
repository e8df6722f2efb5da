"""Builtin functions, which Python may free after all modules."""

import ctypes
import sys

import pytest

from roboyard.native import builtin
from roboyard.pybullet.face import calling


@pytest.mark.skipif(sys.implementation.name != "cpython", reason="counts references as CPython does")
@pytest.mark.parametrize("module", [builtin, calling])
def test_definitions_outlive_the_functions_that_python_reads_them_for(module):
    def function(a):
        return a

    address = ctypes.cast(ctypes.pythonapi.PyObject_Vectorcall, ctypes.c_void_p).value
    assert address is not None
    made = builtin.bound_function("f", address, function), calling.builtin(function)
    assert [call(1) for call in made] == [1, 1]
    definitions = module._definitions
    of_module_and_of_this_test = 3  # with the argument of the function that counts
    assert sys.getrefcount(definitions) > of_module_and_of_this_test

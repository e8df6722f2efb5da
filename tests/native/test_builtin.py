"""Builtin functions that Python frees after all modules."""

import subprocess
import sys

_LATE = """
import builtins, ctypes, weakref
from roboyard.native import builtin
from roboyard.pybullet.face import calling

def function(a):
    return a

address = ctypes.cast(ctypes.pythonapi.PyObject_Vectorcall, ctypes.c_void_p).value
builtins.kept = builtin.bound_function("f", address, function), calling.builtin(function)
freed = print
builtins.watched = [weakref.ref(one, lambda _: freed("freed")) for one in (
    builtin._definitions[-1], calling._definitions[-1])]
assert builtins.kept[0](1) == builtins.kept[1](2) - 1 == 1
print("called")
"""


def test_definitions_outlive_the_functions_that_python_reads_them_for():
    done = subprocess.run([sys.executable, "-c", _LATE], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["called"]

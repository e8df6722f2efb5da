"""Names, values and calling forms of the whole interface."""

from __future__ import annotations

import inspect
import json
import pickle
import types
from pathlib import Path

import pytest

import roboyard.pybullet as p
from roboyard.pybullet.face.calling import _BuiltinProxy

INTERFACE = json.loads((Path(__file__).parent / "data/interface.json").read_text())
IRREGULAR = {"connect", "loadURDF"}  # several calling forms
HERE = sorted(set(INTERFACE["functions"]) & set(p.__all__))


def test_every_constant_has_its_value() -> None:
    assert {name: getattr(p, name, None) for name in INTERFACE["constants"]} == INTERFACE["constants"]


@pytest.mark.parametrize("name", [n for n in HERE if n not in IRREGULAR])
def test_arguments_have_their_names_and_order(name: str) -> None:
    parameters = [
        q
        for q in inspect.signature(getattr(p, name)).parameters.values()
        if q.kind == q.POSITIONAL_OR_KEYWORD
    ]
    names = [q.name for q in parameters if q.name != "eventName"]  # has no usable keyword in PyBullet
    wanted = INTERFACE["functions"][name]
    assert names == wanted["names"]
    assert parameters[-1].default == 0
    if all(q.kind != q.KEYWORD_ONLY for q in inspect.signature(getattr(p, name)).parameters.values()):
        assert sum(q.default is q.empty for q in parameters) == wanted["required"]


@pytest.mark.parametrize("name", HERE)
def test_functions_are_builtins_with_documentation(name: str) -> None:
    function = getattr(p, name)
    assert inspect.isbuiltin(function)
    assert isinstance(function, types.BuiltinFunctionType)
    assert function.__name__ == name
    assert function.__doc__
    assert pickle.loads(pickle.dumps(function)) is function


def test_wrong_calls_raise_type_errors(client: int) -> None:
    for call in (
        lambda: p.setGravity(0, 0),
        lambda: p.setGravity(0, 0, 0, nope=1),
        lambda: p.setGravity(0, 0, 0, 0, 0),
        lambda: p.setGravity(0, 0, "down"),
        lambda: p.setAdditionalSearchPath(3),
        lambda: p.getPhysicsEngineParameters("first"),
        lambda: p.getPhysicsEngineParameters(1.5),
        lambda: p.setRealTimeSimulation(0.5),
    ):
        with pytest.raises(TypeError):
            call()


def test_the_stand_in_for_other_interpreters_passes_for_a_builtin() -> None:
    def double(number: int, physicsClientId: int = 0) -> int:
        """Twice."""
        return 2 * number

    made = _BuiltinProxy(double)
    assert inspect.isbuiltin(made)
    assert made(4) == made(number=4) == 8
    assert (made.__name__, made.__doc__) == ("double", "Twice.")
    assert list(inspect.signature(made).parameters) == ["number", "physicsClientId"]

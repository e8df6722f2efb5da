"""How arguments of scripts are checked and converted."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.pybullet.face import arguments, calling, wire
from roboyard.pybullet.face.errors import failure, unavailable


@pytest.mark.parametrize(
    "values", [(1, 2, 3), [1.0, 2.0, 3.0], np.array([1, 2, 3]), range(1, 4), iter([1, 2, 3])]
)
def test_vectors_come_from_any_sequence(values: Any) -> None:
    found = arguments.vector3(values, "message")
    assert found == (1.0, 2.0, 3.0)
    assert all(type(value) is float for value in found)


@pytest.mark.parametrize("values", [(1, 2), (1, 2, 3, 4), [], 5, None])
def test_vectors_of_another_length_raise_with_the_message(values: Any) -> None:
    with pytest.raises(p.error, match="position needs") as caught:
        arguments.vector3(values, "position needs 3")
    assert "expected 3 numbers" in caught.value.__notes__[0]


@pytest.mark.parametrize("values", [("a", 1, 2), (None, 1, 2), ([1], 1, 2), "abc"])
def test_elements_that_are_not_numbers_are_type_errors(values: Any) -> None:
    with pytest.raises(TypeError):
        arguments.vector3(values, "message")


def test_quaternions_are_not_normalised() -> None:
    assert arguments.quaternion([0, 0, 0, 2], "message") == (0, 0, 0, 2)
    with pytest.raises(p.error):
        arguments.quaternion([0, 0, 1], "message")


@pytest.mark.parametrize(("value", "found"), [(3, 3.0), (2.5, 2.5), (np.float32(0.5), 0.5), (True, 1.0)])
def test_numbers(value: Any, found: float) -> None:
    assert arguments.number(value) == found


@pytest.mark.parametrize("value", ["1", b"1", None, [1]])
def test_texts_and_lists_are_not_numbers(value: Any) -> None:
    with pytest.raises(TypeError):
        arguments.number(value)


@pytest.mark.parametrize(("value", "found"), [(3, 3), (np.int64(7), 7), (True, 1)])
def test_integers(value: Any, found: int) -> None:
    assert arguments.whole(value) == found


@pytest.mark.parametrize("value", [1.0, "1", None])
def test_floats_are_not_integers(value: Any) -> None:
    with pytest.raises(TypeError):
        arguments.whole(value)


def test_joint_indices_are_truncated() -> None:
    assert arguments.indices([0, 1.7, np.int32(2), "x", None]) == [0, 1, 2, -1, -1]
    with pytest.raises(p.error, match="expected a sequence"):
        arguments.indices(5)  # type: ignore[arg-type]


def test_names_of_files_are_texts() -> None:
    assert arguments.text("a.urdf") == "a.urdf"
    for value in (Path("a.urdf"), b"a.urdf", 3):
        with pytest.raises(TypeError, match="must be str"):
            arguments.text(value)


def test_errors_carry_their_remedies_as_notes() -> None:
    problem = failure("text of PyBullet", "first remedy", "second")
    assert str(problem) == "text of PyBullet"
    assert problem.__notes__ == ["first remedy", "second"]
    assert "vhacd is not available: no" in str(unavailable("vhacd", "no"))
    assert type(problem) is p.error
    assert p.error.__module__ == "roboyard.pybullet"


class Recorder:
    def __init__(self) -> None:
        self.calls: list[tuple[Any, ...]] = []

    def move(self, *args: Any) -> str:
        self.calls.append(args)
        return "moved"


def move(client: Any, body: int, speed: float = 2.0) -> None:
    """Move a body."""


def test_public_functions_pass_arguments_in_order() -> None:
    clients = {0: Recorder(), 3: Recorder()}
    function = calling.public(move, clients, {}, "somewhere")
    assert function(5) == "moved"
    function(5, speed=1.0, physicsClientId=3)
    assert clients[0].calls == [(5, 2.0)]
    assert clients[3].calls == [(5, 1.0)]
    assert list(inspect.signature(function).parameters) == ["body", "speed", "physicsClientId"]
    with pytest.raises(TypeError):
        function()
    with pytest.raises(TypeError):
        function(1, 2, 3, 4)


def test_aliases_are_keywords_too() -> None:
    clients = {0: Recorder()}
    function = calling.public(move, clients, {"bodyIndex": "body"}, "somewhere")
    function(bodyIndex=4)
    function(body=6)
    assert clients[0].calls == [(4, 2.0), (6, 2.0)]
    with pytest.raises(TypeError, match="missing 1 required argument: 'body'"):
        function(speed=3)


def test_built_ins_keep_name_signature_and_text() -> None:
    function = calling.builtin(calling.public(move, {0: Recorder()}, {}, __name__))
    assert inspect.isbuiltin(function)
    assert function.__name__ == "move"
    assert function.__doc__ == "Move a body."
    assert str(inspect.signature(function)) == "(body, speed=2.0, physicsClientId=0)"
    assert function(1) == "moved"


@pytest.mark.parametrize(
    "message",
    [
        None, 5, 2.5, "text", b"bytes", [1, [2, 3]], {"a": [1]}, True, float("inf"),
        np.arange(6, dtype=np.int32).reshape(2, 3), np.zeros((0, 3)), np.float64(1.5),
        np.ones((2, 2), np.uint8),
    ],
)  # fmt: skip
def test_messages_survive_the_wire(message: Any) -> None:
    found = wire.decode(wire.encode(message))
    if isinstance(message, np.ndarray):
        assert found.dtype == message.dtype
        assert found.tolist() == message.tolist()
        assert found.shape == message.shape
    else:
        assert found == message


@pytest.mark.parametrize("value", [object(), np.array(["text"]), 2**70])
def test_other_values_cannot_be_sent(value: Any) -> None:
    with pytest.raises(TypeError):
        wire.encode([value])


@pytest.mark.parametrize("body", [b"", b"\xc1", b"\x92\x01"])
def test_other_bytes_are_no_message(body: bytes) -> None:
    with pytest.raises(wire.WireError, match="not a message"):
        wire.decode(body)


def test_frames_have_a_limit() -> None:
    frame = wire.frame([1, "two"])
    assert wire.body_length(frame[: wire.PREFIX.size]) == len(frame) - wire.PREFIX.size
    with pytest.raises(wire.WireError, match="too long"):
        wire.body_length(wire.PREFIX.pack(wire.MAX_BODY + 1))


def test_both_sides_need_the_same_version() -> None:
    wire.check_hello(list(wire.HELLO))
    for message in (["roboyard", 99], "hello", None):
        with pytest.raises(wire.WireError, match="both sides need the same Roboyard"):
            wire.check_hello(message)


def test_lists_become_tuples() -> None:
    assert wire.tupled([1, [2, {"a": [3]}]]) == (1, (2, {"a": (3,)}))

"""`roboyard serve`: two clients see one world, and nothing that arrives brings it down."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import roboyard
import roboyard.pybullet as p
from roboyard.pybullet.face import wire
from roboyard.pybullet.remote import datagram

SOURCE = str(Path(roboyard.__file__).parents[1])
KEY = 31337 + os.getpid() % 1000


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    words = [sys.executable, "-m", "roboyard", "serve", "--port", "0", "--key", str(KEY)]
    server = subprocess.Popen(
        words, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": SOURCE}
    )
    assert server.stdout is not None
    said = server.stdout.readline()
    found = re.search(r", (\d+)\)", said)
    assert found, said
    yield int(found[1])
    server.terminate()
    assert server.wait(20) == 0
    server.stdout.close()


@pytest.fixture
def pair(port: int) -> Iterator[tuple[int, int]]:
    first, second = p.connect(p.TCP, "127.0.0.1", port), p.connect(p.UDP, hostName="127.0.0.1", port=port)
    assert first >= 0
    assert second >= 0
    yield first, second
    for number in (first, second):
        p.disconnect(number)


def test_two_clients_see_one_world(pair: tuple[int, int]) -> None:
    tcp, udp = pair
    third = p.connect(p.SHARED_MEMORY, KEY)
    assert p.getConnectionInfo(third)["connectionMethod"] == p.SHARED_MEMORY
    p.setGravity(1, 2, -3, physicsClientId=tcp)
    for number in (udp, third):
        assert p.getPhysicsEngineParameters(number)["gravityAccelerationZ"] == -3.0
    slider = p.addUserDebugParameter("a", 0, 1, 0.25, physicsClientId=udp)
    assert p.readUserDebugParameter(slider, physicsClientId=tcp) == 0.25
    p.disconnect(third)


def test_errors_cross_the_wire_with_their_notes(pair: tuple[int, int]) -> None:
    for number in pair:
        with pytest.raises(p.error, match=r"(?m)^Failed to read parameter\.$") as caught:
            p.readUserDebugParameter(4242, physicsClientId=number)
        assert "4242" in caught.value.__notes__[0]
        with pytest.raises(TypeError):
            p.setGravity(0, 0, "down", physicsClientId=number)
        with pytest.raises(TypeError, match="cannot be sent"):
            p.setGravity(0, 0, object(), physicsClientId=number)


def test_large_arrays_cross_in_many_datagrams(pair: tuple[int, int]) -> None:
    _, udp = pair
    points = np.random.default_rng(1).random((20000, 3))  # 960 kB with colours
    number = p.addUserDebugPoints(points, points, physicsClientId=udp)
    assert number >= 0
    p.removeUserDebugItem(number, physicsClientId=udp)


JUNK = [
    b"GET / HTTP/1.1\r\n\r\n",
    b"\x00\x00\x00\x04abcd",
    b"\xff" * 64,
    wire.frame(["another program", 1]),
    wire.frame(wire.HELLO) + wire.frame([1, "__import__", ["os"]]),
    wire.frame(wire.HELLO) + wire.frame({"no": "request"}),
    wire.frame(wire.HELLO) + b"\x00\x00\xff\xff" + b"\x91" * 65535,
    wire.frame(wire.HELLO) + b"\x00\x00\x00\x06\xc7\x03\x01\x93\xa2<f",
    wire.frame(wire.HELLO) + b"\x00\x01",
]


@pytest.mark.parametrize("junk", JUNK)
def test_junk_is_refused_and_the_server_goes_on(port: int, pair: tuple[int, int], junk: bytes) -> None:
    with socket.create_connection(("127.0.0.1", port), timeout=10) as stranger:
        stranger.sendall(junk)
        stranger.shutdown(socket.SHUT_WR)
        while stranger.recv(4096):
            pass
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for data in (b"", b"RY", junk[:1400], datagram.Datagram(1, 7, 1, 0, 1, junk[:1000]).packed()):
            stranger.sendto(data, ("127.0.0.1", port))
    for number in pair:
        assert p.getAPIVersion() == 202010061
        assert p.getPhysicsEngineParameters(number)["numSolverIterations"] > 0


def test_a_clients_death_leaves_the_server_running(port: int, pair: tuple[int, int]) -> None:
    code = (
        "import os, roboyard.pybullet as p\n"
        f"p.connect(p.TCP, '127.0.0.1', {port})\n"
        "p.setTimeStep(0.125)\n"
        "os._exit(9)\n"
    )
    environment = {**os.environ, "PYTHONPATH": SOURCE}
    assert subprocess.run([sys.executable, "-c", code], env=environment, timeout=60).returncode == 9
    assert p.getPhysicsEngineParameters(pair[0])["fixedTimeStep"] == 0.125


def test_nobody_there_is_minus_one(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as holder:
        holder.bind(("127.0.0.1", 0))
        assert p.connect(p.TCP, "127.0.0.1", holder.getsockname()[1]) == -1
    assert "roboyard serve" in capsys.readouterr().err


@pytest.mark.parametrize(
    "value",
    [
        np.arange(12, dtype=np.uint8).reshape(2, 3, 2),
        np.linspace(0, 1, 7, dtype=np.float32),
        np.zeros((0, 3)),
        [1, -(2**62), 0.5, None, True, "é", b"\x00\xff", (), {"a": (1, 2)}, {3: 4}],
    ],
)
def test_values_survive_the_wire(value: object) -> None:
    got = wire.decode(wire.encode(value))
    if isinstance(value, np.ndarray):
        assert got.dtype == value.dtype
        np.testing.assert_array_equal(got, value)
        got[...] = 0  # the receiver owns it
    else:
        assert wire.tupled(got) == wire.tupled(value)


def test_arrays_that_lie_about_their_size_are_refused() -> None:
    import msgspec

    for dtype, shape, raw in (
        ("<f8", [10], b"1234"),
        ("|O", [1], b"12345678"),
        ("<f8", [-1], b""),
        ("x", [1], b"1"),
    ):
        ext = msgspec.msgpack.Ext(1, msgspec.msgpack.encode([dtype, shape, raw]))
        with pytest.raises(wire.WireError):
            wire.decode(msgspec.msgpack.encode(ext))
    with pytest.raises(wire.WireError):
        wire.decode(msgspec.msgpack.encode(msgspec.msgpack.Ext(9, b"")))

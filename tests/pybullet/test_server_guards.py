"""Rules for the clients of a server: greetings, tokens, one folder for files, numbers, and memory."""

from __future__ import annotations

import asyncio
import json
import os
import re
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

import roboyard
import roboyard.pybullet as p
from roboyard.errors import ConfigError
from roboyard.pybullet.face import wire
from roboyard.pybullet.face.constants import STATE_LOGGING_GENERIC_ROBOT, STATE_LOGGING_PROFILE_TIMINGS
from roboyard.pybullet.remote import access, datagrams, rendezvous
from roboyard.pybullet.remote.client import StreamChannel
from roboyard.pybullet.remote.datagram import GOT, PART, REFUSED, Datagram
from roboyard.pybullet.remote.datagram_channel import DatagramChannel
from roboyard.pybullet.remote.dispatch import Dispatcher
from roboyard.pybullet.remote.server import Server
from roboyard.pybullet.state.output_files import OutputFiles

SOURCE = str(Path(roboyard.__file__).parents[1])


def with_server(
    use: Callable[[Server], object], token: str = "", output_files: OutputFiles | None = None
) -> object:
    """The result of a blocking function beside a running server."""

    async def run() -> object:
        server = Server(token=token, output_files=output_files)
        await server.start()
        try:
            return await asyncio.wait_for(asyncio.to_thread(use, server), 60)
        finally:
            await server.stop()

    return asyncio.run(run())


def ask(channel: StreamChannel | DatagramChannel, name: str, *arguments: object) -> list[object]:
    answer = wire.decode(channel.exchange(wire.encode([1, name, list(arguments)])))
    assert isinstance(answer, list)
    return answer


@pytest.mark.parametrize("kind", [StreamChannel, DatagramChannel])
def test_a_token_is_needed_where_there_is_one(kind: type, capsys: pytest.CaptureFixture[str]) -> None:
    def use(server: Server) -> None:
        for wrong in ("", "another", "secret2", "secre"):
            with pytest.raises(wire.WireError, match="token"):
                kind("127.0.0.1", server.port, wrong)
        channel = kind("127.0.0.1", server.port, "secret")
        assert ask(channel, "getPhysicsEngineParameters")[1] == "ok"
        channel.close()

    with_server(use, token="secret")
    assert "refused" in capsys.readouterr().err


def test_an_address_that_others_reach_gets_a_token(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(access.VARIABLE, raising=False)
    for host in ("127.0.0.1", "localhost", "::1", "127.9.9.9"):
        assert access.server_token(host) == ""
    for host in ("0.0.0.0", "::", "192.168.1.2", "robot.example", "", "127.0.0.1.example"):
        assert len(access.server_token(host)) >= 20
    assert access.server_token("127.0.0.1", "mine") == "mine"
    for bad in ("a b", "x" * 300, "a\nb"):
        with pytest.raises(ConfigError):
            access.server_token("127.0.0.1", bad)


def test_serve_beyond_this_machine_prints_a_token_that_connect_takes(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": SOURCE, "XDG_CACHE_HOME": str(tmp_path)}
    words = [sys.executable, "-m", "roboyard", "serve", "--host", "0.0.0.0", "--port", "0"]
    server = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment)
    try:
        assert server.stdout is not None
        said = server.stdout.readline()
        found = re.search(r", (\d+), options='(--token=[^']+)'\)", said)
        assert found, said
        assert p.connect(p.TCP, "127.0.0.1", int(found[1])) == -1
        for method in (p.TCP, p.UDP):
            number = p.connect(method, "127.0.0.1", int(found[1]), found[2])
            assert number >= 0
            p.disconnect(number)
    finally:
        server.terminate()
        server.wait(20)
        server.stdout.close()  # type: ignore[union-attr]


def test_clients_write_in_the_named_folder_only(tmp_path: Path) -> None:
    folder, outside = tmp_path / "folder", tmp_path / "outside"
    folder.mkdir()
    outside.mkdir()
    (folder / "link").symlink_to(outside)
    (folder / "file").symlink_to(outside / "x")
    os.mkfifo(folder / "pipe")
    names = (str(outside / "x"), "../outside/x", "link/x", "file", "pipe", "", ".", "..", "a\0b")

    def use(server: Server) -> None:
        channel = StreamChannel("127.0.0.1", server.port)
        for name in names:
            for answer in (
                ask(channel, "saveBullet", name),
                ask(channel, "saveWorld", name),
                ask(channel, "startStateLogging", STATE_LOGGING_GENERIC_ROBOT, name),
                ask(channel, "startStateLogging", p.STATE_LOGGING_ALL_COMMANDS, name),
                ask(channel, "startStateLogging", p.STATE_LOGGING_VIDEO_MP4, name),
                ask(channel, "startStateLogging", p.STATE_LOGGING_CONTACT_POINTS, name),
            ):
                assert answer[1] == "error", (name, answer)
        outer = str(outside / "timings")
        assert ask(channel, "startStateLogging", STATE_LOGGING_PROFILE_TIMINGS, outer)[1] == "error"
        for name in ("w.py", str(folder / "v.py")):
            assert ask(channel, "saveWorld", name) == [1, "ok", None]
        assert ask(channel, "startStateLogging", STATE_LOGGING_GENERIC_ROBOT, "log.bin")[1] == "ok"
        channel.close()

    with_server(use, output_files=OutputFiles(is_free=False, folder=folder))
    assert {file.name for file in folder.iterdir() if file.is_file()} == {"w.py", "v.py", "log.bin"}
    assert list(outside.iterdir()) == []


def test_clients_write_nothing_where_no_folder_is_named(tmp_path: Path) -> None:
    answer = wire.decode(Dispatcher().answer([1, "saveWorld", [str(tmp_path / "w.py")]]))
    assert answer[1] == "error"
    assert "--folder" in answer[3][0]


@pytest.mark.parametrize(
    "arguments",
    [
        [0, 0, float("nan")],
        [[0, {"a": [float("nan")]}]],
        [np.array([1.0, np.nan])],
        [np.array([np.nan], np.float32)],
    ],
)
def test_nan_is_refused(arguments: list[object]) -> None:
    request = wire.decode(wire.encode([7, "setGravity", arguments]))
    answer = wire.decode(Dispatcher().answer(request))
    assert answer[:2] == [7, "error"]
    assert "NaN" in answer[2]


def test_stray_datagrams_end_no_session_and_leave_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    greeting = wire.encode(wire.HELLO)

    def use(server: Server) -> int:
        channel = DatagramChannel("127.0.0.1", server.port)
        first = os.getpid()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.connect(("127.0.0.1", server.port))
            for i in range(1000):
                junk = (
                    Datagram(PART, first + i, 1, 0, 1, b"junk"),
                    Datagram(PART, first + i, 1, 0, 200_000, b"x" * 1200),
                    Datagram(GOT + i % 5, first + i, i, i, i),
                    Datagram(PART, first + i, 1, 0, 1, greeting[:-1]),
                )
                stranger.send(junk[i % 4].packed())
                if i % 50 == 0:  # the session answers in between
                    assert ask(channel, "getPhysicsEngineParameters")[1] == "ok"
            for i in range(2 * datagrams.MAX_SESSIONS):  # even with valid greetings
                stranger.send(Datagram(PART, i, 1, 0, 1, greeting).packed())
        assert ask(channel, "getPhysicsEngineParameters")[1] == "ok"
        protocol = server._datagrams.get_protocol()  # type: ignore[union-attr]
        assert isinstance(protocol, datagrams.DatagramServer)
        assert sum(len(s.body) + len(s.arrived) for s in protocol.sessions.values()) < 10_000
        before = len(protocol.sessions)
        channel.close()
        deadline = time.monotonic() + 60
        while len(protocol.sessions) == before and time.monotonic() < deadline:
            time.sleep(0.01)
        return before - len(protocol.sessions)

    assert with_server(use) == 1  # a session ends with its channel
    assert len(capsys.readouterr().err.splitlines()) < 5


def test_a_refused_greeting_says_why() -> None:
    def use(server: Server) -> bytes:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.connect(("127.0.0.1", server.port))
            stranger.settimeout(5)
            stranger.send(Datagram(PART, 3, 1, 0, 1, wire.encode(["another program", 1] + [0] * 90)).packed())
            got = Datagram.read(stranger.recv(2000))
            assert got is not None
            assert got.kind == REFUSED
            return got.payload

    assert b"expected" in bytes(with_server(use))  # type: ignore[call-overload]


def test_large_messages_are_bounded_while_they_arrive() -> None:
    """Unfinished messages of many clients hold no more than the budget, and it is free afterwards."""

    async def run() -> tuple[bytes, int]:
        server = Server()
        await server.start()

        async def half(count: int) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
            reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
            writer.write(wire.frame(wire.HELLO) + struct.pack(">I", count))
            await reader.readexactly(4 + len(wire.encode(wire.HELLO)))
            return reader, writer

        opened = [await half(wire.MAX_BODY) for _ in range(3)]
        answer = await asyncio.wait_for(opened[2][0].read(), 5)
        for _, writer in opened:
            writer.close()
        while server._budget.used:
            await asyncio.sleep(0.01)
        await server.stop()
        return answer, server._budget.used

    answer, used = asyncio.run(asyncio.wait_for(_within(run), 20))
    assert b"try again" in answer
    assert used == 0


async def _within(run: Callable[[], Awaitable[tuple[bytes, int]]]) -> tuple[bytes, int]:
    return await run()


@pytest.mark.parametrize("item", [b"\x90", b"\xc0", b"\x80", b"\x91\x90"])
def test_a_message_of_very_many_values_is_refused_at_once(item: bytes) -> None:
    count = 60_000_000 // len(item)
    body = b"\xdd" + struct.pack(">I", count) + item * count
    start = time.process_time()
    with pytest.raises(wire.WireError, match="too many values"):
        wire.decode(body)
    assert time.process_time() - start < 3


def test_a_large_array_is_not_counted_by_its_bytes() -> None:
    points = np.random.default_rng(0).random((500_000, 3))
    np.testing.assert_array_equal(wire.decode(wire.encode([1, "x", [points]]))[2][0], points)


def test_the_shape_of_an_array_is_short() -> None:
    packed = msgspec.msgpack.encode(["<f8", [1] * 100_000, bytes(8)])
    with pytest.raises(wire.WireError):
        wire.decode(msgspec.msgpack.encode(msgspec.msgpack.Ext(1, packed)))


RENDEZVOUS = [
    b"", b"{", b"[]", b"null", b"\xff\xfe", b"[" * 100_000, b"1" * 70_000,
    b'{"host": 1, "port": 1}', b'{"host": "127.0.0.1", "port": 99999999}',
    b'{"host": "127.0.0.1", "port": true}', b'{"host": "127.0.0.1", "port": -1}',
    b'{"host": "127.0.0.1", "port": "6667"}', b'{"host": "127.0.0.1", "port": 1, "token": 5}',
]  # fmt: skip


@pytest.mark.parametrize("content", RENDEZVOUS)
def test_a_malformed_rendezvous_file_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], content: bytes
) -> None:
    monkeypatch.setattr(rendezvous, "user_cache_path", lambda _: tmp_path)
    file = tmp_path / "servers" / "7.json"
    file.parent.mkdir()
    file.write_bytes(content)
    assert p.connect(p.SHARED_MEMORY, 7) == -1
    said = capsys.readouterr().err
    assert str(file) in said
    assert "delete it" in said
    assert len(said.splitlines()) == 1


def test_only_the_user_reads_a_rendezvous_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(rendezvous, "user_cache_path", lambda _: tmp_path)
    address = rendezvous.Address(host="127.0.0.1", port=77, token="t")
    with rendezvous.announced(7, address):
        file = tmp_path / "servers" / "7.json"
        assert file.stat().st_mode & 0o077 == 0
        assert json.loads(file.read_text())["port"] == 77
        assert rendezvous.find(7) == address
    assert not file.exists()
    monkeypatch.setattr(rendezvous, "user_cache_path", lambda _: Path("/proc/nothing"))
    with rendezvous.announced(7, address):
        pass
    assert "use its port" in capsys.readouterr().err


def test_substeps_are_bounded() -> None:
    number = p.connect(p.DIRECT)
    with pytest.raises(p.error, match="setPhysicsEngineParameter failed"):
        p.setPhysicsEngineParameter(numSubSteps=10**9, physicsClientId=number)
    p.setPhysicsEngineParameter(numSubSteps=20, physicsClientId=number)
    p.disconnect(number)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_settings_are_finite(value: float) -> None:
    number = p.connect(p.DIRECT)
    for call in (
        lambda: p.setGravity(0, 0, value, physicsClientId=number),
        lambda: p.setTimeStep(value, physicsClientId=number),
        lambda: p.addUserDebugPoints([value], [1, 1, 1], physicsClientId=number),
    ):
        with pytest.raises(p.error):
            call()
    if value > 0:
        with pytest.raises(p.error):
            p.setPhysicsEngineParameter(fixedTimeStep=value, physicsClientId=number)
    p.stepSimulation(physicsClientId=number)
    with pytest.raises(p.error):
        p.loadURDF("n" * 5000, physicsClientId=number)
    p.disconnect(number)

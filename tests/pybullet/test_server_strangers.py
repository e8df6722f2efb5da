"""Connections that never greet: they keep no client out, and what they send first is small."""

from __future__ import annotations

import asyncio
import struct

import pytest

from roboyard.pybullet.face import wire
from roboyard.pybullet.remote import server as remote
from roboyard.pybullet.remote.server import Server


async def greet(port: int) -> bool:
    """Whether a client is accepted within two seconds."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(wire.frame(wire.HELLO))
    length = wire.PREFIX.unpack(await asyncio.wait_for(reader.readexactly(4), 2))[0]
    answer = wire.decode(await reader.readexactly(length))
    writer.close()
    return answer == wire.HELLO


def test_silent_connections_keep_no_client_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remote, "MAX_STRANGERS", 20)

    async def run() -> bool:
        server = Server()
        await server.start()
        silent = [await asyncio.open_connection("127.0.0.1", server.port) for _ in range(70)]
        accepted = await greet(server.port)
        for _, writer in silent:
            writer.close()
        await server.stop()
        return accepted

    assert asyncio.run(run())


@pytest.mark.parametrize("sent", [b"", struct.pack(">I", 1 << 20), struct.pack(">I", 20) + b"x"])
def test_a_connection_without_a_hello_ends_soon(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], sent: bytes
) -> None:
    monkeypatch.setattr(remote, "HELLO_TIMEOUT", 0.3)

    async def run() -> bytes:
        server = Server()
        await server.start()
        reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
        writer.write(sent)
        answer = await asyncio.wait_for(reader.read(), 5)
        assert await greet(server.port)
        writer.close()
        await server.stop()
        return answer

    assert b"refused" in asyncio.run(run())
    assert "a client was refused" in capsys.readouterr().err

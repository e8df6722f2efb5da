"""Requests of foreign pages to a viewer are rejected."""

from __future__ import annotations

import urllib.error
import urllib.request

import pytest

from roboyard.sim import World
from roboyard.viewer import Viewer
from roboyard.viewer.page.origins import VARIABLE, refusal

pytest.importorskip("viser")


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        (None, "127.0.0.1:8080"),
        ("http://127.0.0.1:8080", "127.0.0.1:8080"),
        ("http://localhost:9000", "localhost:9000"),  # a forwarded port
        ("http://[::1]:8080", "[::1]:8080"),
    ],
)
def test_the_own_page_is_accepted(origin: str | None, host: str) -> None:
    assert refusal(origin, host, loopback=True) is None


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        ("https://evil.example", "127.0.0.1:8080"),
        ("http://127.0.0.1:3000", "127.0.0.1:8080"),
        ("null", "127.0.0.1:8080"),
        (
            "http://evil.example:8080",
            "evil.example:8080",
        ),  # DNS rebinding: a foreign name that resolves to this machine
        (None, "evil.example"),
        ("http://127.0.0.1.evil.example", "127.0.0.1.evil.example"),
    ],
)
def test_a_foreign_page_is_rejected(origin: str | None, host: str) -> None:
    assert VARIABLE in str(refusal(origin, host, loopback=True))


def test_the_environment_variable_adds_origins(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "https://hub.example.org/, http://other")
    assert refusal("https://hub.example.org", "localhost:8080", loopback=True) is None
    assert refusal("https://hub.example.org", "hub.example.org", loopback=True) is None
    assert refusal("https://evil.example", "localhost:8080", loopback=True) is not None


def test_a_server_open_to_the_network_accepts_any_host_name() -> None:
    assert refusal("http://robot.lan:8080", "robot.lan:8080", loopback=False) is None
    assert refusal("https://evil.example", "robot.lan:8080", loopback=False) is not None


def test_the_server_rejects_the_handshake_of_a_foreign_page() -> None:
    import viser
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    with Viewer(World(), port=0, quiet=True) as viewer:
        protocols = [f"viser-v{viser.__version__}"]
        with pytest.raises(InvalidStatus, match="403"):
            connect(f"ws://127.0.0.1:{viewer.port}", origin="https://evil.example", subprotocols=protocols)
        with connect(f"ws://127.0.0.1:{viewer.port}", origin=viewer.url, subprotocols=protocols):
            pass
        request = urllib.request.Request(viewer.url, headers={"Host": "evil.example"})
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(request, timeout=5)
        with urllib.request.urlopen(viewer.url, timeout=5) as answer:
            assert answer.status == 200

"""The HTML of a viewer in a notebook, here and behind the proxy of a hub."""

from __future__ import annotations

import contextlib
import json
import re
import socket
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from roboyard.viewer.notebook import HUB, VARIABLE, frame_html, shown_address

sys.path.insert(0, str(Path(__file__).parent))
import chromium
from chromium import until

NOTEBOOK = Path(__file__).parents[2] / "examples" / "pybullet_tutorial.ipynb"
LOCAL = "http://127.0.0.1:8123"


@pytest.fixture(autouse=True)
def no_hub(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (HUB, VARIABLE):
        monkeypatch.delenv(name, raising=False)


def test_the_address_is_escaped_in_html(monkeypatch: pytest.MonkeyPatch) -> None:
    assert '"><script>' not in frame_html('http://x"><script>')
    monkeypatch.setenv(VARIABLE, '"><script>/{port}')
    assert '"><script>' not in frame_html(LOCAL)


def test_a_page_on_this_machine_is_embedded_by_its_own_address() -> None:
    assert shown_address(LOCAL) == LOCAL
    assert f'src="{LOCAL}"' in frame_html(LOCAL)
    assert "ssh -L 8123:localhost:8123" in frame_html(LOCAL)


def test_a_hub_and_a_named_proxy_are_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(HUB, "/user/me/")
    assert shown_address(LOCAL) == "/user/me/proxy/8123/"
    assert "ssh" not in frame_html(LOCAL)
    monkeypatch.setenv(VARIABLE, "https://lab.example.org/at/{port}/")
    assert shown_address(LOCAL) == "https://lab.example.org/at/8123/"


class Hub:
    """A server for one notebook page and, at /user/me/proxy/PORT/, for ports of this machine."""

    def __init__(self) -> None:
        self.page = b""
        self.paths: list[str] = []
        self._socket = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://localhost:{self._socket.getsockname()[1]}"
        self._open: list[socket.socket] = [self._socket]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                client, _ = self._socket.accept()
                threading.Thread(target=self._answer, args=(client,), daemon=True).start()

    def _answer(self, client: socket.socket) -> None:
        self._open.append(client)
        with contextlib.suppress(OSError):
            head = b""
            while b"\r\n\r\n" not in head:
                head += (more := client.recv(1 << 16))
                if not more:
                    return
            path = head.split(b" ", 2)[1].decode()
            self.paths.append(path)
            found = re.match(r"/user/me/proxy/(\d+)(/.*)?$", path)
            if found is None:
                size = len(self.page)
                kind = b"Content-Type: text/html\r\nConnection: close\r\nContent-Length: %d\r\n\r\n" % size
                client.sendall(b"HTTP/1.1 200 OK\r\n" + kind + self.page)
                client.close()
                return
            server = socket.create_connection(("127.0.0.1", int(found[1])))
            self._open.append(server)
            server.sendall(head.replace(path.encode(), (found[2] or "/").encode(), 1))
            threading.Thread(target=_pass, args=(server, client), daemon=True).start()
            _pass(client, server)

    def close(self) -> None:
        for one in self._open:
            one.close()


def _pass(source: socket.socket, target: socket.socket) -> None:
    with contextlib.suppress(OSError):
        while data := source.recv(1 << 16):
            target.sendall(data)
        target.shutdown(socket.SHUT_WR)


@pytest.fixture
def hub() -> Iterator[Hub]:
    opened = Hub()
    yield opened
    opened.close()


@pytest.mark.slow
@pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium")
def test_the_tutorial_opens_its_page_behind_a_proxy(
    hub: Hub, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pytest.importorskip("viser")
    import roboyard.pybullet as p
    from roboyard.pybullet.connections import CLIENTS
    from roboyard.viewer import Viewer

    monkeypatch.setenv(HUB, "/user/me/")
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    codes = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    names: dict[str, Any] = {}
    viewer = page = None
    try:
        for code in codes[:2]:  # the connection, and the bodies
            exec(code, names)
        client: Any = CLIENTS[max(CLIENTS)]
        viewer = Viewer(client.scene.world, port=0, quiet=True)
        html = viewer._repr_html_()  # what the notebook shows of `viewer` at the end of a cell
        hub.page = f"<!doctype html><body>{html}</body>".encode()
        page = chromium.Page(f"{hub.url}/user/me/lab", tmp_path / "profile")
        until(lambda: viewer.watchers == 1)
        inner = "document.querySelector('iframe').contentWindow"
        shown = f"Object.keys({inner}.__viserMutable?.nodeRefFromName ?? {{}}).join()"
        until(lambda: "r2d2" in page.evaluate(shown))
        until(lambda: page.evaluate(f"!!{inner}.document.querySelector('[data-bar=play]')"))
        assert page.evaluate("location.origin") == hub.url
        assert all(path.startswith("/user/me/") or path == "/favicon.ico" for path in hub.paths)
    finally:
        if page is not None:
            page.close()
        if viewer is not None:
            viewer.close()
        p.disconnect()

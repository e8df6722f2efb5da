from __future__ import annotations

import socket
import sys

import pytest

from roboyard.errors import ConfigError, MissingExtraError
from roboyard.sim import World
from roboyard.viewer import Viewer
from roboyard.viewer.page.server import free_port

pytest.importorskip("viser")


def test_the_next_free_port_is_taken() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert port < free_port("127.0.0.1", port) <= port + 100
        with Viewer(World(), port=port, quiet=True) as viewer:
            assert viewer.port > port
            assert viewer.url == f"http://127.0.0.1:{viewer.port}"


def test_the_server_listens_on_this_machine_only() -> None:
    with Viewer(World(), port=0, quiet=True) as viewer:
        socket.create_connection(("127.0.0.1", viewer.port), timeout=2).close()
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.2", viewer.port), timeout=2).close()


@pytest.mark.parametrize(
    ("host", "port", "words"),
    [
        ("127.0.0.1", 70000, "port 70000"),
        ("no.such.host.invalid", 8080, "no such address"),
        ("192.0.2.1", 8080, "cannot listen"),
    ],
)
def test_an_invalid_address_or_port_raises(host: str, port: int, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        Viewer(World(), host, port, quiet=True)


def test_without_viser_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(MissingExtraError, match='the extra "gui": pip install "viser'):
        Viewer(World(), quiet=True)


def test_no_page_can_have_a_share_link(browser, wait) -> None:
    with Viewer(World(), port=0, quiet=True) as viewer:
        page = browser(viewer)
        wait(lambda: viewer.watchers == 1)
        page.send(type="ShareUrlRequest")
        assert viewer.server.request_share_url() is None
        viewer.server.scene.add_label("/still here", "still here")
        page.listen(lambda m: m.get("name") == "/still here")
        assert not any(m["type"] == "ShareUrlUpdated" and m.get("share_url") for m in page.messages)


def test_the_address_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    with Viewer(World(), port=0, title="My robot") as viewer:
        pass
    assert capsys.readouterr().out == f"My robot is at {viewer.url}\n"


@pytest.mark.parametrize("accepted", ["gzip", "identity"])
def test_the_page_runs_the_early_script_first(accepted: str) -> None:
    """The document is viser's own but for one script at its head, compressed or not."""
    import gzip
    from pathlib import Path
    from urllib.request import Request, urlopen

    import viser

    own = (Path(viser.__file__).parent / "client" / "build" / "index.html").read_bytes()
    with Viewer(World(), "localhost", port=0, quiet=True) as viewer:
        for path in ("/", "/index.html", "/?darkMode"):
            request = Request(viewer.url + path, headers={"Accept-Encoding": accepted})
            with urlopen(request, timeout=10) as answer:
                body = answer.read()
                assert int(answer.headers["Content-Length"]) == len(body)
                if answer.headers["Content-Encoding"] == "gzip":
                    body = gzip.decompress(body)
            begin = body.index(b"<script>") + len(b"<script>")
            end = body.index(b"</script>", begin)
            assert b"antialias: false" in body[begin:end]
            assert body.index(b"<head>") + len(b"<head><script>") == begin
            assert body[: begin - len(b"<script>")] + body[end + len(b"</script>") :] == own

"""A headless browser, controlled through its debugging port."""

from __future__ import annotations

import atexit
import base64
import io
import json
import shutil
import subprocess
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

PROGRAM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader"),
    *("--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *(
        "--disable-component-update",
        "--disable-sync",
        "--remote-allow-origins=*",
        "--remote-debugging-port=0",
    ),
)
TRACK = "[...document.querySelectorAll('[class*=Slider-track]')].find(e => e.getClientRects().length)"
"""JavaScript for the first slider that is not in a closed folder."""

AT_REST = """(() => {
  const find = () => %s, x = %f, y = %f, began = performance.now();
  const at = () => {
    const box = find()?.getBoundingClientRect();
    return box?.width ? [box.x + x * box.width, box.y + y * box.height] : null;
  };
  const isDocked = () => window.__viserMutable?.canvas?.clientWidth < innerWidth - 100;
  const first = at();
  let frames = 0;
  return new Promise(resolve => {
    const look = () => {
      const now = at();
      if (!first || !now || first[0] !== now[0] || first[1] !== now[1] || !isDocked()) return resolve(null);
      frames += 1;
      if (frames < 5 || performance.now() - began < 400) return requestAnimationFrame(look);
      const element = find(), hit = document.elementFromPoint(...now);
      resolve(hit && (element.contains(hit) || hit.contains(element)) ? now : null);
    };
    requestAnimationFrame(look);
  });
})()"""
"""JavaScript for a point of an element after 0.4 s and five frames in which it did not move."""


def slider(name: str) -> str:
    """Return JavaScript for the slider whose name begins so; the order of sliders on a page is not fixed."""
    return f"document.querySelector('[role=slider][aria-label^={json.dumps(name)}]')"


def until(so: Callable[[], Any], seconds: float = 180.0, tick: Callable[[], None] | None = None) -> Any:
    """Return what a function returns once it is true; run `tick` meanwhile. Fails if that takes too long."""
    end = time.monotonic() + seconds
    while not (found := so()):
        assert time.monotonic() < end, "waited in vain"
        if tick is not None:
            tick()
        time.sleep(0.03)
    return found


class Page:
    """One page in its own browser; `close` ends both."""

    def __init__(self, url: str, profile: Path, size: tuple[int, int] = (900, 600)) -> None:
        from websockets.sync.client import connect

        assert PROGRAM is not None
        self._process = subprocess.Popen(
            [
                PROGRAM,
                *FLAGS,
                f"--user-data-dir={profile}",
                f"--window-size={size[0]},{size[1]}",
                "about:blank",
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        atexit.register(self._process.terminate)  # also where a test fails before it can close the page
        port = self._debugging_port(profile / "DevToolsActivePort")
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json", timeout=60) as answer:
            tabs = json.load(answer)
        address = next(tab["webSocketDebuggerUrl"] for tab in tabs if tab["type"] == "page")
        self._socket = connect(address, max_size=None)
        self._number = 0
        self._call("Page.enable")
        self._call("Page.navigate", url=url)

    def _debugging_port(self, file: Path) -> int:
        end = time.monotonic() + 60
        while time.monotonic() < end:
            words = file.read_text().split() if file.exists() else []
            if words:
                return int(words[0])
            time.sleep(0.1)
        raise TimeoutError("the browser did not start")

    def _call(self, method: str, **parameters: Any) -> Any:
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._socket.recv(timeout=60))
            if answer.get("id") == self._number:
                return answer.get("result")

    def evaluate(self, script: str) -> Any:
        """Return the value of a JavaScript expression."""
        return self._call("Runtime.evaluate", expression=script, returnByValue=True)["result"].get("value")

    def place_at_rest(self, element: str, x: float = 0.5, y: float = 0.5) -> tuple[float, float] | None:
        """Return a point of an element that stays there, for a click.

        None: it moves, something covers it, or the panel is not docked yet, which moves everything.
        """
        if self.place_of(element) is None:
            return None
        return self._call(
            "Runtime.evaluate", expression=AT_REST % (element, x, y), returnByValue=True, awaitPromise=True
        )["result"].get("value")

    def click_on(
        self, element: str, x: float = 0.5, y: float = 0.5, *, tick: Callable[[], None] | None = None
    ) -> None:
        """Click on a point of an element once it stays where it is; run `tick` until then."""
        self.click(*until(lambda: self.place_at_rest(element, x, y), tick=tick))

    def choose_quality(self, name: str) -> bool:
        """Choose the quality of the picture; return whether the bar was there, with a quality of its own."""
        return self.evaluate(
            "((s, k) => !!s?.dataset.chosen && (s.value = k, s.dispatchEvent(new Event('change')), true))"
            f"(document.querySelector('[data-bar=quality]'), {name!r})"
        )

    def picture(self) -> np.ndarray:
        """Return the page as (h, w, 3) int16."""
        from PIL import Image

        for _ in range(20):  # a loading page has no picture
            answer = self._call("Page.captureScreenshot", format="png")
            if answer is not None:
                break
            time.sleep(0.5)
        data = base64.b64decode(answer["data"])
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(np.int16)

    def resize(self, width: int, height: int) -> None:
        """Change the size of the window (pixels)."""
        self._call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def hover(self, x: float, y: float) -> None:
        self._call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)

    def click(self, x: float, y: float) -> None:
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            self.mouse(kind, x, y)

    def mouse(self, kind: str, x: float, y: float) -> None:
        """Send one event of the left button: mouseMoved, mousePressed or mouseReleased."""
        self._call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def press(self, key: str) -> None:
        """Press and release a named key, such as "Home"."""
        codes = {"Home": 36, "End": 35, "ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40}
        codes |= {"Enter": 13, "Tab": 9}
        for kind in ("rawKeyDown", "keyUp"):
            self._call(
                "Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=codes[key]
            )

    def save_downloads_in(self, folder: Path) -> None:
        """Store the files that the page lets the user download in a folder."""
        folder.mkdir(parents=True, exist_ok=True)
        self._call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))

    def place_of(self, script: str, x: float = 0.5, y: float = 0.5) -> tuple[float, float] | None:
        """Return a point of the element of a JavaScript expression; None: there is no element."""
        box = self.evaluate(
            f"(() => {{ const e = {script}; if (!e) return null; e.scrollIntoView({{block: 'nearest'}});"
            "const b = e.getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; })()"
        )
        return None if box is None else (box[0] + x * box[2], box[1] + y * box[3])

    def with_text(self, text: str) -> str:
        """Return JavaScript for the innermost element with exactly this text."""
        return (
            "[...document.querySelectorAll('button,label,span,p,div')]"
            f".filter(e => e.textContent.trim() === {json.dumps(text)}).pop()"
        )

    def close(self) -> None:
        if self._process.poll() is not None:
            return
        self._socket.close()
        self._process.terminate()
        self._process.wait(timeout=20)
        atexit.unregister(self._process.terminate)

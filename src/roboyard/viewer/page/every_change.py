"""Every change of a control reaches the server, however quickly one follows another.

A page of viser keeps one limit of 20 messages a second for all controls together and sends only the newest
message: of two controls changed within 50 ms the first one, a click on a button too, would be lost.
"""

from __future__ import annotations

from typing import Any

from roboyard.viewer.page.page_script import PageScript

PAUSE = 50
"""Time between two messages of one slider that is dragged (ms); also the pause of viser's own limit."""

_SCRIPT = """
  const page = window.__viserMutable, later = window.setTimeout;
  const isLimited = value => typeof value === "number" || Array.isArray(value);
  let raw = page.sendMessage, isArmed = false, last = null, waiting = null, pause = 0;
  const flush = () => {
    clearTimeout(pause);
    if (waiting) raw?.(waiting);
    pause = waiting ? later(flush, PAUSE) : 0;
    if (!waiting) last = null;
    waiting = null;
  };
  const send = message => {
    const canvas = page.canvas;
    // the size in which the mouse counts, which differs from the resolution of the picture
    if (message.type === "ViewerCameraMessage" && canvas?.clientWidth)
      message = {...message, image_width: canvas.clientWidth, image_height: canvas.clientHeight};
    if (!message.type.startsWith("Gui")) return raw(message);
    // viser starts its pause right after this call; it ends at once, and the limit below replaces it
    isArmed = true;
    queueMicrotask(() => { isArmed = false; });
    if (isLimited(message.updates?.value) && message.uuid === last) { waiting = message; return; }
    if (waiting) flush();  // in the order of the changes
    clearTimeout(pause);
    last = isLimited(message.updates?.value) ? message.uuid : null;
    pause = last === null ? 0 : later(flush, PAUSE);
    raw(message);
  };
  const timeout = function (call, time, ...rest) {
    const ends = isArmed && time === PAUSE;
    isArmed = false;
    if (!ends) return later.call(window, call, time, ...rest);
    call();
    return 0;
  };
  window.setTimeout = timeout;
  window.__roboyardSend = message => raw?.(message);
  Object.defineProperty(page, "sendMessage", {
    configurable: true, enumerable: true, get: () => raw && send, set: value => {
      raw = value;
      // without a connection viser sets a function that only logs this
      window.__roboyardClosed?.(/is not connected/.test(String(value)));
    },
  });
  return () => {
    flush();
    if (window.setTimeout === timeout) window.setTimeout = later;
    delete window.__roboyardSend;
    Object.defineProperty(page, "sendMessage", {
      configurable: true, enumerable: true, writable: true, value: raw,
    });
  };
"""


def send_every_change(server: Any) -> None:
    """Make the pages of a `viser.ViserServer` send each change, in order; call it before any other script.

    A slider, number or vector that changes faster than every 50 ms sends its first and its newest value; they
    are sent before the next change of another control.
    """
    PageScript(server, "changes", _SCRIPT.replace("PAUSE", str(PAUSE)), lambda *_: None)

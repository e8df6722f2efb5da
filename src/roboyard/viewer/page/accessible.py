"""Names of sliders and fields for screen readers, readable labels, and the browser's dark mode."""

from __future__ import annotations

from typing import Any

from roboyard.viewer.page.page_script import PageScript

_SCRIPT = """
  const style = document.createElement("style");
  // colour only: another width of letters would move what a mouse is about to press
  style.textContent = "label, label * { color: var(--mantine-color-text) !important; }" +
    "[role=slider]:focus-visible { outline: 2px solid #2660a4; outline-offset: 2px; }";
  document.head.appendChild(style);
  const controls = "[role=slider], input:not([type=hidden]), select, textarea";
  const labelOf = e => {
    for (let up = e.parentElement, k = 0; up && k < 8; up = up.parentElement, k++) {
      const found = [...up.querySelectorAll("label")].filter(l => l.textContent.trim());
      if (found.length) return found.length === 1 ? found[0].textContent.trim() : null;
    }
    return null;
  };
  const name = () => {
    for (const e of document.querySelectorAll(controls)) {
      if (e.getAttribute("aria-label") && !e.dataset.named) continue;
      if (!e.dataset.named && e.labels?.length) continue;
      const text = labelOf(e);
      if (text && e.getAttribute("aria-label") !== text) {
        e.dataset.named = "1";
        e.setAttribute("aria-label", text);
      }
    }
  };
  const dark = window.matchMedia("(prefers-color-scheme: dark)"), root = document.documentElement;
  const KEY = "data-mantine-color-scheme";
  let before = null;
  const paint = () => {
    if (dark.matches && root.getAttribute(KEY) !== "dark") {
      before = root.getAttribute(KEY);
      root.setAttribute(KEY, "dark");
    } else if (!dark.matches && before !== null) {
      root.setAttribute(KEY, before);
      before = null;
    }
  };
  const again = () => { name(); paint(); };
  const timer = setInterval(again, 1000);
  dark.addEventListener("change", paint);
  again();
  return () => {
    clearInterval(timer);
    dark.removeEventListener("change", paint);
    style.remove();
  };
"""


def make_accessible(server: Any) -> None:
    """Name the controls of all pages of a `viser.ViserServer`, and follow the browser's dark mode.

    viser's sliders have no accessible name, and its labels are pale.
    """
    PageScript(server, "accessible", _SCRIPT, lambda *_: None)

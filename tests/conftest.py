"""The order of tests: those of a browser first, one after another."""

from __future__ import annotations

import pytest


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put the tests of a browser first, and on one worker: two browsers slow each other down.

    They mostly wait. `--dist loadgroup` keeps them together; the other workers use the processors meanwhile.
    """
    items.sort(key=_needs_no_browser)  # the others stay in their order
    if config.pluginmanager.hasplugin("xdist"):
        for item in items:
            if not _needs_no_browser(item):
                item.add_marker(pytest.mark.xdist_group("browser"))


def _needs_no_browser(item: pytest.Item) -> bool:
    return not hasattr(getattr(item, "module", None), "chromium")

"""Sliders and buttons of addUserDebugParameter in the page's panel."""

from __future__ import annotations

from collections.abc import Mapping
from math import floor, isfinite, log10
from typing import Any

from roboyard.pybullet.state.debug_items import Parameter
from roboyard.viewer.page.callbacks import in_order

PARTS = 1000
"""Smallest number of positions of a slider."""


class Sliders:
    """The panel's elements for a client's parameters, whose values they set."""

    def __init__(self, server: Any) -> None:
        """Add sliders to the panel of a server."""
        self._server = server
        self._gui = server.gui
        self._elements: dict[int, tuple[Parameter, Any]] = {}

    def show(self, parameters: Mapping[int, Parameter]) -> None:
        """Show exactly these parameters."""
        for number in [n for n, (shown, _) in self._elements.items() if parameters.get(n) is not shown]:
            self._elements.pop(number)[1].remove()
        for number, parameter in parameters.items():
            if number not in self._elements:
                with self._server.atomic():  # no page sees an element before its callback is set
                    self._elements[number] = parameter, self._add(parameter)

    def _add(self, parameter: Parameter) -> Any:
        if parameter.is_button:
            button = self._gui.add_button(parameter.name or " ")

            def clicked(_: Any) -> None:
                parameter.value += 1.0

            button.on_click(in_order(clicked))
            return button
        lower, upper = parameter.lower, parameter.upper
        start = min(max(parameter.value, lower), upper)
        slider = self._gui.add_slider(
            parameter.name,
            min=lower,
            max=upper if upper > lower else lower + 1.0,
            step=step_of(upper - lower),
            initial_value=start,
            disabled=not upper > lower,
        )

        def moved(_: Any) -> None:
            value = float(slider.value)
            if isfinite(value):
                parameter.value = min(max(value, lower), upper)

        slider.on_update(in_order(moved))
        return slider


def step_of(width: float) -> float:
    """Return the power of ten that divides a range into at least `PARTS` steps."""
    return 10.0 ** floor(log10(width / PARTS)) if width > 0 else 0.1

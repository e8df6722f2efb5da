"""Moulds by description: compiled once, or cast from one that differs in numbers only."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from roboyard.description.model import RobotDescription
from roboyard.sim.build.records import ALL_MASKS, BuildOptions
from roboyard.sim.pool.analytic_templates import analytic_template, numbers_of
from roboyard.sim.pool.templates import BodyTemplate, make_template

KEPT, KEPT_COMPILED = 256, 16
_FAMILIES: dict[Any, BodyTemplate] = {}
"""Compiled moulds of bodies that differ in numbers only, by what those have in common; of all worlds."""


class TemplateCache:
    """The moulds that one world has used lately."""

    def __init__(self) -> None:
        self._moulds: dict[tuple[int, BuildOptions], tuple[RobotDescription, BodyTemplate]] = {}
        """By id of a description, which is kept so that no other can have that id."""
        self._compiled: list[BodyTemplate] = []
        """Of bodies that are not told by numbers."""

    def find(self, description: RobotDescription, options: BuildOptions) -> BodyTemplate | None:
        """The mould of a description; None where there can be none (see `make_template`)."""
        if options.contype != 1:  # masks of its own are a body's, not a mould's
            options = replace(options, contype=1, conaffinity=ALL_MASKS)
        key = (id(description), options)
        known = self._moulds.get(key)
        if known is not None and known[1].is_current():
            return known[1]
        numbers = numbers_of(description, options)
        found = None
        if numbers is None:
            found = self._find_compiled(description, options)
        elif numbers.signature in _FAMILIES:
            found = analytic_template(_FAMILIES[numbers.signature], numbers, description)
        else:
            found = make_template(description, options)
            if found is not None:
                _keep(_FAMILIES, numbers.signature, found)
        if found is not None:
            _keep(self._moulds, key, (description, found))
        return found

    def _find_compiled(self, description: RobotDescription, options: BuildOptions) -> BodyTemplate | None:
        for template in self._compiled:
            if template.is_of(description, options):
                return template
        made = make_template(description, options)
        if made is not None:
            self._compiled = [made, *self._compiled[: KEPT_COMPILED - 1]]
        return made


def _keep(templates: dict[Any, Any], key: Any, value: Any) -> None:
    templates[key] = value
    while len(templates) > KEPT:
        del templates[next(iter(templates))]

"""Templates by description, compiled once or computed from one that differs in numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from roboyard.description.model import RobotDescription
from roboyard.sim.build.masks import ALL_MASKS
from roboyard.sim.build.records import BuildOptions
from roboyard.sim.pool.analytic_templates import Numbers, analytic_template, numbers_of
from roboyard.sim.pool.templates import BodyTemplate, make_template

KEPT, KEPT_COMPILED = 256, 16
_FAMILIES: dict[Any, BodyTemplate] = {}
"""Compiled templates of bodies that differ in numbers only, by their common signature; for all worlds."""


class TemplateCache:
    """The templates that one world has used recently."""

    def __init__(self) -> None:
        self._templates: dict[tuple[int, BuildOptions], tuple[RobotDescription, BodyTemplate]] = {}
        """By id of a description, which is kept so that no other object can have that id."""
        self._compiled: list[BodyTemplate] = []
        """Templates of bodies without a signature of numbers."""

    def find(self, description: RobotDescription, options: BuildOptions) -> BodyTemplate | None:
        """Return the template of a description; None where there is none (see `make_template`)."""
        if options.contype != 1:  # collision masks belong to a body, not to its template
            options = replace(options, contype=1, conaffinity=ALL_MASKS)
        key = (id(description), options)
        known = self._templates.get(key)
        if known is not None and known[1].is_current():
            return known[1]
        numbers = numbers_of(description, options)
        if numbers is None:
            found = self._find_compiled(description, options)
        else:
            found = self.of_numbers(numbers, description, options)
        if found is not None:
            _keep(self._templates, key, (description, found))
        return found

    def of_numbers(
        self, numbers: Numbers, description: RobotDescription, options: BuildOptions
    ) -> BodyTemplate | None:
        """Return the template of a description with these numbers; None where there is none."""
        if options.contype != 1:
            return self.find(description, options)
        family = _FAMILIES.get(numbers.signature)
        if family is not None:
            return analytic_template(family, numbers, description)
        found = make_template(description, options)
        if found is not None:
            _keep(_FAMILIES, numbers.signature, found)
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

"""Collect the errors and notes of a file, so that one run reports everything."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path

from roboyard.description.model import Source
from roboyard.description.urdf.numbers import NumberFault
from roboyard.description.urdf.xml import line_of
from roboyard.errors import DescriptionError

MAX_REPORTED = 100


class Problems:
    """Errors and notes of building one description, in file order.

    Args:
        file: the description's file; None for XML made in memory.
        number_faults: recorded by the parser; each is reported when its number is used.
        strict: treat notes as errors.
    """

    def __init__(
        self, file: Path | None, number_faults: Iterable[NumberFault] = (), *, strict: bool = False
    ) -> None:
        self.file = file
        self.strict = strict
        self.errors: list[DescriptionError] = []
        self.notes: list[str] = []
        self._faults: dict[ET.Element, list[NumberFault]] = {}
        for fault in number_faults:
            self._faults.setdefault(fault.element, []).append(fault)

    def use(self, element: ET.Element | None, key: str | None = None) -> bool:
        """Report the faults of an element's numbers, or of one attribute's; True if all could be read."""
        faults = () if element is None else self._faults.get(element, ())
        is_readable = True
        for fault in faults:
            if key is None or fault.key == key:
                report = self.error if fault.is_error else self.note
                report(element, fault.at.who, fault.text)
                is_readable &= not fault.is_error
        return is_readable

    def error(self, at: ET.Element | int | None, element: str, message: str) -> None:
        """Add an error at an XML element or a line; `element` is as in `joint "elbow"`."""
        self.errors.append(self._located(at, element, message))

    def note(self, at: ET.Element | int | None, element: str, message: str) -> None:
        """Add a note on a correction; in strict mode an error."""
        located = self._located(at, element, message)
        if self.strict:
            self.errors.append(located)
        else:
            self.notes.append(str(located))

    def source(self, element: ET.Element) -> Source:
        """Return the file and line of an element."""
        return Source(file=self.file, line=line_of(element))

    def raise_errors(self) -> None:
        """Raise one error that lists all errors, if there are any.

        Raises:
            DescriptionError: there are errors; `problems` lists at most 100 of them.
        """
        if not self.errors:
            return
        listed = self.errors[:MAX_REPORTED]
        if len(self.errors) > MAX_REPORTED:
            more = len(self.errors) - MAX_REPORTED
            listed.append(DescriptionError(f"{more} more problems", file=self.file))
        raise DescriptionError.collect(listed)

    def _located(self, at: ET.Element | int | None, element: str, message: str) -> DescriptionError:
        line = line_of(at) if isinstance(at, ET.Element) else at
        return DescriptionError(message, file=self.file, line=line, element=element or None)

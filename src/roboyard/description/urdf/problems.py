"""Collect what is wrong with a file, so that one run reports everything."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from roboyard.description.model import Source
from roboyard.description.urdf.xml import line_of
from roboyard.errors import DescriptionError

MAX_REPORTED = 100


class Problems:
    """Errors and notes of one reading, in the order in which they were met."""

    def __init__(self, file: Path | None, *, strict: bool = False, words_are_zero: bool = False) -> None:
        self.file = file
        self.strict = strict
        self.words_are_zero = words_are_zero
        """Whether a word among numbers counts as 0, as C's strtod has it, instead of being wrong."""
        self.errors: list[DescriptionError] = []
        self.notes: list[str] = []

    def error(self, at: ET.Element | int | None, element: str, message: str) -> None:
        """`at` is the XML element at fault or its line; `element` reads like `joint "elbow"`."""
        self.errors.append(self._located(at, element, message))

    def note(self, at: ET.Element | int | None, element: str, message: str) -> None:
        """Something was put right; in strict mode this is an error."""
        located = self._located(at, element, message)
        if self.strict:
            self.errors.append(located)
        else:
            self.notes.append(str(located))

    def source(self, element: ET.Element) -> Source:
        return Source(file=self.file, line=line_of(element))

    def raise_errors(self) -> None:
        """Raise one DescriptionError that lists all errors, if there are any."""
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

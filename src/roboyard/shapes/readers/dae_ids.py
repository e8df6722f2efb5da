"""Elements of a COLLADA document by tag and id: some exporters give a scene and its node the same id."""

from __future__ import annotations

import xml.etree.ElementTree as ET


class ElementIds:
    """All elements that have an id; of several with the same tag and id the first one counts."""

    def __init__(self, root: ET.Element) -> None:
        """Look up the ids of a document whose tags have no namespace."""
        self._elements: dict[tuple[str, str], ET.Element] = {}
        for element in root.iter():
            name = element.get("id")
            if name:
                self._elements.setdefault((element.tag, name), element)

    def find(self, reference: str | None, *tags: str) -> ET.Element | None:
        """Return the element of a local reference such as "#name" with one of these tags, else None."""
        name = (reference or "").removeprefix("#")
        return next((found for tag in tags if (found := self._elements.get((tag, name))) is not None), None)

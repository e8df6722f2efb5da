"""Write docs/findings.md: `python tools/findings_doc.py > docs/findings.md`."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from roboyard.audit.findings import Audit, Facts, Finding, Severity
from roboyard.audit.registry import CHECKS
from roboyard.repair import FIXES

_TITLES = {
    "file": "The file",
    "xml": "Elements, attributes, numbers",
    "tree": "The tree of links and joints",
    "joints": "Joints",
    "limits": "Joint limits",
    "mimics": "Joints that follow others",
    "inertials": "Inertials",
    "masses": "Plausible masses and inertias",
    "geometries": "Shapes",
    "meshes": "Mesh files",
    "mesh_sizes": "Mesh scales and sizes",
    "mesh_axes": "Mesh axes",
    "collisions": "Collision shapes",
    "names": "Names",
    "materials": "Colours and textures",
    "units": "Units",
    "run": "Anything else",
}

_HEAD = """\
# Findings of an audit

`roboyard audit ROBOT.urdf` reports findings; `roboyard.audit.audit_urdf(path)` returns the same as an
`Audit`. Each has a code from the tables below, a severity, the element with its line, the fault,
and the remedy.

| severity | meaning |
|---|---|
| error | the robot cannot be used until this is fixed |
| warning | the robot loads, but will not move or collide as intended, or has a wrong mass |
| info | harmless here; other programs may refuse it, or work is wasted |

"Repair" states whether `roboyard repair ROBOT.urdf --out DIR` fixes it without guessing; where it needs
the link's shapes (inertias), only links that have some are fixed. The exit code of `audit` is 0 when the
robot can be used as it is or after the fixes it names, and 1 when it cannot.
"""


def findings_document() -> str:
    """The whole page."""
    return "\n".join([_HEAD, *_tables(), *_fixes(), *_json()]) + "\n"


def _cell(text: str) -> str:
    """Text for a table: tags as code, so that they are shown."""
    plain = text.replace("|", "\\|").replace("\n", " ")
    return re.sub(r"(?<!`)<[^<>]+>(?!`)", r"`\g<0>`", plain)


def _example(text: str) -> str:
    if text.startswith("(") and text.endswith(")"):
        return _cell(text[1:-1])
    plain = text.replace("|", "\\|")
    return f"`{plain}`"


def _tables() -> Iterator[str]:
    for topic, title in _TITLES.items():
        yield f"## {title}\n"
        yield "| code | severity | what | example | remedy | repair |"
        yield "|---|---|---|---|---|---|"
        for check in CHECKS.values():
            if check.topic == topic:
                fixable = "yes" if check.fixable else ""
                cells = (
                    f"`{check.code}`",
                    check.severity.label,
                    _cell(check.about),
                    _example(check.example),
                    _cell(check.remedy),
                    fixable,
                )
                yield f"| {' | '.join(cells)} |"
        yield ""


def _fixes() -> Iterator[str]:
    yield "## Fixes, in the order in which they are made\n"
    yield "`--only CODE` and `--keep CODE` choose; files are copied beside the new URDF in any case.\n"
    for number, (code, function) in enumerate(FIXES.items(), 1):
        yield f"{number}. `{code}`: {(function.__doc__ or '').strip().splitlines()[0]}"
    yield ""


def _json() -> Iterator[str]:
    finding = Finding(code="", severity=Severity.INFO, element="", message="", remedy="")
    audit = Audit(file=Path("robot.urdf"), robot="", findings=(), facts=Facts())
    yield "## `--json`\n"
    yield "One object. These keys stay; more may come.\n"
    yield f"- audit: {', '.join(f'`{key}`' for key in audit.to_json())}"
    yield "- `status`: `ok`, `usable`, `usable after repair` or `not usable`; `usable`: not the last"
    yield f"- `counts`: {', '.join(f'`{severity.label}`' for severity in Severity)}"
    yield f"- `facts`: {', '.join(f'`{key}`' for key in Facts().to_json())} (mass in kg, null where unknown)"
    yield "- of a configuration (`.yaml`): `file`, `usable`, `problems` and `notes`, a line of text each"
    yield f"- each of `findings`, worst first: {', '.join(f'`{key}`' for key in finding.to_json())}"


if __name__ == "__main__":
    print(findings_document(), end="")

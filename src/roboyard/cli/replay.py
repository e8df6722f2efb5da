"""`roboyard replay`: summarise a state log, or render it as a video."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from roboyard.untrusted.text import json_text, one_line, say

EXAMPLES = """
Examples:

\b
  roboyard replay drive.npz                      list the moving joints
  roboyard replay drive.npz --record again.gif
"""

MOVED = 1e-3
"""A coordinate that changes by more has moved (m or rad)."""


def replay(
    log: Annotated[Path, typer.Argument(help="State log (.npz).", metavar="LOG", show_default=False)],
    record: Annotated[
        Path | None, typer.Option("--record", help="Video to write (.gif or .mp4).", show_default=False)
    ] = None,
    fps: Annotated[float, typer.Option("--fps", help="Pictures a second of the video.")] = 20.0,
    width: Annotated[
        int, typer.Option("--width", min=16, max=4096, help="Width of the video (pixels).")
    ] = 480,
    height: Annotated[
        int, typer.Option("--height", min=16, max=4096, help="Height of the video (pixels).")
    ] = 360,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> None:
    """Summarise a state log, or render it as a video.

    With --record, the log's scene is built again and shown in each recorded state.
    """
    from roboyard.recording import load_log

    found = load_log(log)
    seconds = float(found.time[-1] - found.time[0]) if len(found) else 0.0
    low, high = found.positions.min(axis=0), found.positions.max(axis=0)
    moving = [
        {"name": name, "min": float(low[k]), "max": float(high[k]), "unit": found.position_units[k]}
        for k, name in enumerate(found.position_names)
        if high[k] - low[k] > MOVED
    ]
    if not as_json:
        _print_summary(log.name, len(found), seconds, found.setup, moving)
    count = None
    if record is not None:
        from roboyard.recording.replay import replay_video

        count = replay_video(found, record, fps=fps, width=width, height=height)
    if as_json:
        files = [] if record is None else [str(record)]
        data = {"states": len(found), "seconds": seconds, "setup": found.setup, "moving": moving}
        print(json_text({**data, "pictures": count, "files": files}))
    elif record is not None:
        say(f"{record}: {count} pictures")


def _print_summary(
    name: str, states: int, seconds: float, setup: Mapping[str, Any], moving: Sequence[Mapping[str, Any]]
) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    words = ", ".join(f"{key} {value}" for key, value in setup.items() if isinstance(value, str))
    say(f"{name}: {states} states in {seconds:.2f} s; {words or 'no scene setup'}")
    table = Table("coordinate", "min", "max", "unit", box=None)
    for row in moving:
        cells = (row["name"], f"{row['min']:.3f}", f"{row['max']:.3f}", row["unit"])
        table.add_row(*(Text(one_line(str(cell))) for cell in cells))
    Console().print(table)

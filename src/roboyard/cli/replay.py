"""`roboyard replay`: summarise a state log, or render it as a video."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboyard.untrusted.text import one_line, say

EXAMPLES = """
Examples:

\b
  roboyard replay drive.npz                      list the moving joints
  roboyard replay drive.npz --record again.gif
"""


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
) -> None:
    """Summarise a state log, or render it as a video.

    With --record, the log's scene is built again and shown in each recorded state.
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from roboyard.recording import load_log

    found = load_log(log)
    console = Console()
    seconds = float(found.time[-1] - found.time[0]) if len(found) else 0.0
    setup = ", ".join(f"{name} {value}" for name, value in found.setup.items() if isinstance(value, str))
    say(f"{log.name}: {len(found)} states in {seconds:.2f} s; {setup or 'no scene setup'}")
    table = Table("coordinate", "min", "max", "unit", box=None)
    for k, name in enumerate(found.position_names):
        low, high = (float(v) for v in (found.positions[:, k].min(), found.positions[:, k].max()))
        if high - low > 1e-3:
            cells = (name, f"{low:.3f}", f"{high:.3f}", found.position_units[k])
            table.add_row(*(Text(one_line(cell)) for cell in cells))
    console.print(table)
    if record is None:
        return
    from roboyard.recording.replay import replay_video

    count = replay_video(found, record, fps=fps, width=width, height=height)
    say(f"{record}: {count} pictures")

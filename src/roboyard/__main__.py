"""`python -m roboyard` is `roboyard`; an interruption is quiet from the first import on."""

from __future__ import annotations

import sys


def main() -> int:
    """Run the command line with the words of the process; see `roboyard.cli.main`."""
    try:
        from roboyard.cli import main as run

        return run()
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())

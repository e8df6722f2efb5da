"""`python -m roboyard`: the `roboyard` command; Ctrl-C exits quietly, also while modules are imported."""

from __future__ import annotations

import sys


def main() -> int:
    """Run the command line with the arguments of the process and return its exit code.

    See `roboyard.cli.main`; an interruption while it is imported returns 130.
    """
    try:
        from roboyard.cli import main as run

        return run()
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())

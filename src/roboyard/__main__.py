"""`python -m roboyard`: the `roboyard` command; Ctrl-C exits quietly, also while modules are imported."""

from __future__ import annotations

import sys
from pathlib import Path

from roboyard._libraries import store_libraries


def main() -> int:
    """Run the command line with the arguments of the process and return its exit code.

    See `roboyard.cli.main`; an interruption while it is imported returns 130.
    """
    try:
        if _is_script(sys.argv[1:]):  # most programs are short: the command line's own modules take longer
            store_libraries()
            from roboyard.pybullet.running import run_script

            return run_script(sys.argv[2], sys.argv[3:])
        from roboyard.cli import main as run

        return run()
    except KeyboardInterrupt:
        return 130
    finally:
        # Python remembers an interruption within eval or exec, as dataclasses have it, and would then end by
        # the signal instead of 130; the next eval makes it forget
        eval("0")  # noqa: S307


def _is_script(arguments: list[str]) -> bool:
    """Return whether the arguments are those of `roboyard run SCRIPT [ARGS]...` with a script that exists."""
    return len(arguments) > 1 and arguments[0] == "run" and Path(arguments[1]).is_file()


if __name__ == "__main__":
    sys.exit(main())

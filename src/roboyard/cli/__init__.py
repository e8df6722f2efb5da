"""The `roboyard` command.

Each command is one module of this package holding one function of the same name, light to import: what a
command needs of MuJoCo, numba or trimesh it imports when it runs, so that `roboyard --help` answers at once.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Annotated

import typer

from roboyard.cli.help_text import EXAMPLES, GROUPS, GroupedHelp
from roboyard.errors import RoboyardError

COMMANDS = tuple(name for names in GROUPS.values() for name in names)
"""In the order of the help text; `name` is the function `name` of the module `roboyard.cli.name`."""

_RENAMED = {"import": "importing"}  # a word of the language cannot name a module's function

_DEBUG_VARIABLE = "ROBOYARD_DEBUG"
MOST_LINES = 12
"""Problems that are told one by one."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    0: done; 1: bad input, one line for each problem on standard error (the first dozen of many); 2: wrong
    usage; 130: interrupted.
    With the environment variable ROBOYARD_DEBUG set to 1, errors come with their traceback.

    Args:
        arguments: the words after `roboyard`; those of the process by default.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    debug = os.environ.get(_DEBUG_VARIABLE, "") not in ("", "0")
    try:
        return _run(words)
    except KeyboardInterrupt:
        _complain(["interrupted"])
        return 130
    except RoboyardError as error:
        if debug:
            raise
        _complain(str(error).splitlines() or [type(error).__name__])
    except BrokenPipeError:
        # whoever read the output, as in `| head`, has seen enough; what is still in the buffer goes nowhere
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        if debug:
            raise
        where = f"{error.filename}: " if error.filename else ""
        _complain([f"{where}{error.strerror or error}"])
    except Exception as error:
        if debug:
            raise
        told = " ".join(str(error).split())
        _complain(
            [f"unexpected {type(error).__name__}: {told} ({_DEBUG_VARIABLE}=1 shows where; please report it)"]
        )
    return 1


def _run(words: list[str]) -> int:
    """Give the words to typer; only the modules that are needed get imported."""
    app = typer.Typer(
        name="roboyard",
        cls=GroupedHelp,
        help="Turn any robot description into a robot you can drive.",
        epilog=EXAMPLES,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
    )
    app.callback()(_options)
    named = words[0] if words else ""
    for name in (named,) if named in COMMANDS else COMMANDS:
        home = _RENAMED.get(name, name)
        module = import_module(f"{__name__}.{home}")
        settings = getattr(module, "CONTEXT_SETTINGS", None)
        app.command(name, context_settings=settings, epilog=getattr(module, "EXAMPLES", None))(
            getattr(module, home)
        )
    try:
        typer.main.get_command(app)(words, prog_name="roboyard")
    except SystemExit as leave:
        return leave.code if isinstance(leave.code, int) else int(leave.code is not None)
    return 0


def _show_version(asked: bool) -> None:
    if asked:
        from roboyard._version import __version__

        print(f"roboyard {__version__}")
        raise typer.Exit


def _options(
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version and leave.", callback=_show_version, is_eager=True),
    ] = False,
) -> None:
    """Options that stand before the command."""


def _complain(lines: Sequence[str]) -> None:
    shown = lines if len(lines) <= MOST_LINES + 1 else lines[:MOST_LINES]
    for line in shown:
        print(f"roboyard: error: {line}", file=sys.stderr)
    if len(shown) < len(lines):
        print(f"roboyard: error: ... and {len(lines) - len(shown)} more", file=sys.stderr)

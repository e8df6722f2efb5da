"""The `roboyard` command.

Each command is one module of this package with one function of the same name. A command imports MuJoCo, numba
or trimesh when it runs, so that `roboyard --help` is fast.
"""

from __future__ import annotations

import errno
import io
import os
import shutil
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Annotated

import typer

from roboyard.cli.help_text import EXAMPLES, GROUPS, GroupedHelp
from roboyard.errors import RoboyardError
from roboyard.untrusted.text import say

COMMANDS = tuple(name for names in GROUPS.values() for name in names)
"""Commands in the order of the help text; each is the function of its name in the module of its name."""

_RENAMED = {"import": "importing", "import-all": "import_all"}  # no names of Python

_DEBUG_VARIABLE = "ROBOYARD_DEBUG"
MOST_LINES = 12
"""Largest number of errors that are printed one by one."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    0: success; 1: bad input, with one line for each error on standard error (the first dozen of many);
    2: wrong usage; 130: interrupted.
    With the environment variable ROBOYARD_DEBUG set to 1, errors are raised with their traceback.

    Args:
        arguments: the arguments after `roboyard`; those of the process by default.
    """
    _open_closed_streams()
    given = list(sys.argv[1:] if arguments is None else arguments)
    debug = os.environ.get(_DEBUG_VARIABLE, "") not in ("", "0")
    try:
        return _run(given)
    except KeyboardInterrupt:
        _print_errors(["interrupted"])
        return 130
    except RoboyardError as error:
        if debug:
            raise
        _print_errors(str(error).splitlines() or [type(error).__name__])
    except BrokenPipeError:
        # the reader of a pipe, as in `| head`, closed it; the rest of the buffer is discarded
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        if debug:
            raise
        _print_errors([_line_of(error)])
    except Exception as error:
        if debug:
            raise
        message = " ".join(str(error).split())
        _print_errors(
            [
                f"unexpected {type(error).__name__}: {message} "
                f"({_DEBUG_VARIABLE}=1 prints the traceback; please report it)"
            ]
        )
    return 1


def _line_of(error: OSError) -> str:
    """Return the system's words about a file, with the file's name and what helps where a disk is full."""
    text, place = error.strerror or str(error), error.filename
    files = error.args[0] if isinstance(error, shutil.Error) and error.args else None
    if isinstance(files, list) and files:  # of a folder that is copied: each source, target, problem
        _, place, text = files[0]
    for number in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        if os.strerror(number) in text:
            text = f"{os.strerror(number)}; make room, or write to another place"
    return f"{place}: {text}" if place else text


def _run(arguments: list[str]) -> int:
    """Pass the arguments to typer; only the module of the named command is imported."""
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
    named = arguments[0] if arguments else ""
    for name in (named,) if named in COMMANDS else COMMANDS:
        home = _RENAMED.get(name, name)
        module = import_module(f"{__name__}.{home}")
        settings = getattr(module, "CONTEXT_SETTINGS", None)
        app.command(name, context_settings=settings, epilog=getattr(module, "EXAMPLES", None))(
            getattr(module, home)
        )
    try:
        typer.main.get_command(app)(arguments, prog_name="roboyard")
    except SystemExit as leave:
        return leave.code if isinstance(leave.code, int) else int(leave.code is not None)
    return 0


def _open_closed_streams() -> None:
    """Replace streams that the program was started without, and show what their encoding lacks as codes."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115, PTH123
        elif isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")


def _show_version(asked: bool) -> None:
    if asked:
        from roboyard._version import __version__

        print(f"roboyard {__version__}")
        raise typer.Exit


def _options(
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version and exit.", callback=_show_version, is_eager=True),
    ] = False,
) -> None:
    """Options before the command."""


def _print_errors(lines: Sequence[str]) -> None:
    shown = lines if len(lines) <= MOST_LINES + 1 else lines[:MOST_LINES]
    for line in shown:
        say(f"roboyard: error: {line}", to_errors=True)
    if len(shown) < len(lines):
        say(f"roboyard: error: ... and {len(lines) - len(shown)} more", to_errors=True)

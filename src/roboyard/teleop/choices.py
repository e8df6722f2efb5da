"""Questions in the terminal for options that were not given."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

from roboyard.errors import ConfigError


def choose(
    question: str, options: Sequence[str], default: str, ask: Callable[[str], str] | None = None
) -> str:
    """Ask for one of some options, by number or name, and return it; an empty answer selects the default.

    Args:
        question: the question to print.
        options: the options; a single one is returned without a question.
        default: the option for an empty answer.
        ask: prints a prompt and returns the answer; by default `input`, where the process has a terminal.

    Raises:
        ConfigError: there is no terminal to ask on, or the input ended before an answer.
    """
    if len(options) == 1:
        return options[0]
    if ask is None:
        if not has_terminal():
            raise ConfigError(
                f"there is no terminal to ask {question!r} on; give it as an argument or option, one of: "
                + ", ".join(options)
            )
        ask = input
    print(f"\n{question}")
    for k, option in enumerate(options, start=1):
        print(f"  [{k}] {option}{' (default)' if option == default else ''}")
    while True:
        try:
            answer = ask("Choose by number or name: ").strip()
        except EOFError:
            raise ConfigError(f"no answer to {question!r}; give it as an option") from None
        if not answer:
            return default
        if answer in options:
            return answer
        if answer.isdecimal() and 1 <= int(answer) <= len(options):
            return options[int(answer) - 1]
        print(f"{answer!r} is not one of them.")


def has_terminal() -> bool:
    """Return whether a question can be asked: standard input is a terminal."""
    return sys.stdin is not None and sys.stdin.isatty()

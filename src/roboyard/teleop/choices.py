"""Questions in the terminal for options that were not given."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from roboyard.errors import ConfigError


def choose(question: str, options: Sequence[str], default: str, ask: Callable[[str], str] = input) -> str:
    """Ask for one of some options, by number or name, and return it; an empty answer selects the default.

    Args:
        question: the question to print.
        options: the options; a single one is returned without a question.
        default: the option for an empty answer.
        ask: prints a prompt and returns the answer.

    Raises:
        ConfigError: the input ended before an answer.
    """
    if len(options) == 1:
        return options[0]
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

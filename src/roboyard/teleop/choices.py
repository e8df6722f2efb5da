"""Questions in the terminal for what no flag says."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from roboyard.errors import ConfigError


def choose(question: str, options: Sequence[str], default: str, ask: Callable[[str], str] = input) -> str:
    """One of some options, by number or name; an empty answer takes the default.

    Raises:
        ConfigError: nobody answers.
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
            raise ConfigError(f"nobody answered {question!r}; say it by a flag") from None
        if not answer:
            return default
        if answer in options:
            return answer
        if answer.isdecimal() and 1 <= int(answer) <= len(options):
            return options[int(answer) - 1]
        print(f"{answer!r} is none of them.")

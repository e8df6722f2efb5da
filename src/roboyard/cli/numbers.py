"""Options that are several numbers, separated by commas."""

from __future__ import annotations

from collections.abc import Container

from roboyard.errors import ConfigError


def read_numbers(option: str, text: str, counts: Container[int], form: str) -> list[float]:
    """Return the numbers of an option.

    Args:
        option: its name, for the error.
        text: the numbers, separated by commas.
        counts: how many there may be.
        form: what to give, for the error.

    Raises:
        ConfigError: they are not numbers, or not as many.
    """
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts:
        raise ConfigError(f"{option} {text}: give {form}")
    return numbers

"""Translate pydantic's validation errors into messages for the author of a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def format_validation_error(detail: Mapping[str, Any]) -> str | None:
    """Return the predicate of a message that starts with the field; None for kinds that depend on the field.

    Args:
        detail: one of pydantic's `ValidationError.errors()`.
    """
    context = detail.get("ctx", {})
    match detail["type"]:
        case "value_error":
            return str(context.get("error", detail["msg"]))
        case "bool_type" | "bool_parsing":
            return "must be true or false"
        case "int_type" | "int_parsing" | "int_from_float":
            return "must be a whole number"
        case "greater_than_equal":
            return f"must be at least {context['ge']}"
        case "less_than_equal":
            return f"must be at most {context['le']}"
        case "string_type":
            return "must be text; quote it"
        case "string_too_short":
            return "must not be empty"
        case "dict_type" | "model_type" | "model_attributes_type":
            return "must be a mapping of keys to values"
        case _:
            return None


_QUOTED = ("_type", "_parsing", "_error", "_equal", "_than", "_float", "finite_number")
"""Ends of the kinds of error that a single value causes."""
_LONGEST = 60


def quoted_input(detail: Mapping[str, Any]) -> str:
    """Return "; got 'many'" with the rejected value; empty for sections, lists and messages that quote it.

    Args:
        detail: one of pydantic's `ValidationError.errors()`.
    """
    value = detail.get("input")
    if not isinstance(value, str | int | float) or not detail["type"].endswith(_QUOTED):
        return ""
    shown = repr(value)
    if detail["type"] == "value_error" and str(value) in str(detail["msg"]):
        return ""
    return f"; got {shown if len(shown) <= _LONGEST else shown[:_LONGEST] + '...'}"

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

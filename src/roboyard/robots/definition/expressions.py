"""Numbers in definition files, which may contain pi: `"pi/8"`, `"-pi/2"`, `"0.5*pi"`, `"(pi - 1) / 2"`."""

from __future__ import annotations

import ast
import math
from typing import Any

MAX_LENGTH = 100
"""Longest text (characters)."""


def read_number(value: Any) -> float:
    """Return a finite float from a number, or from a text with numbers, pi, + - * / and parentheses.

    The text is parsed, never executed.

    Raises:
        ValueError: the value is anything else.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"must be a number, or a text such as 'pi/2', got {value!r}"[:MAX_LENGTH])
    if isinstance(value, str):
        value = _evaluate(value)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ValueError(f"must be a finite number, got {number}")
    return number


def _evaluate(text: str) -> float:
    shown = text if len(text) <= MAX_LENGTH else text[:20] + "..."
    wrong = ValueError(f"{shown!r} is not a number; write a number or pi with + - * / and parentheses")
    if len(text) > MAX_LENGTH:
        raise wrong
    try:
        return _value(ast.parse(text.strip(), mode="eval").body)
    except ZeroDivisionError:
        raise ValueError(f"{shown!r} divides by zero") from None
    except (SyntaxError, ValueError, OverflowError, RecursionError, MemoryError):
        raise wrong from None


def _value(node: ast.expr) -> float:
    match node:
        case ast.Constant(value=value) if type(value) in (int, float):
            return float(value)  # type: ignore[arg-type]
        case ast.Name(id="pi"):
            return math.pi
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_value(operand)
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _value(operand)
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return _value(left) + _value(right)
        case ast.BinOp(left=left, op=ast.Sub(), right=right):
            return _value(left) - _value(right)
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            return _value(left) * _value(right)
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            return _value(left) / _value(right)
        case _:
            raise ValueError(f"{type(node).__name__} is not allowed")

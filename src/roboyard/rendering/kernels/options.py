"""How kernels are compiled."""

FAST = {"contract", "arcp", "nsz", "reassoc", "afn"}
"""Rounding may differ by a last bit; infinities and NaN keep their meaning."""

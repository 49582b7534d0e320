"""A propagated study on paper: verdict, tables, page and figures."""

from .text import plan_text, speed

__all__ = ["plan_text", "speed"]

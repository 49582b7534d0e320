"""Report on a propagated study: verdict, tables, page and figures."""

from .text import plan_text, speed

__all__ = ["plan_text", "speed"]

"""The former name of `pneusma_jax.section.outline`, for programs that were written for it."""

from pneusma_jax.section.outline import Outline

__all__ = ["Outline"]

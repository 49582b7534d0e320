"""The former name of `pneusma_jax.pipeline`, for programs that were written for it."""

from pneusma_jax.pipeline import Effect, Known, Pipeline, Switched

Chain = Pipeline

__all__ = ["Chain", "Effect", "Known", "Switched"]

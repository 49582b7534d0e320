"""The explicit float64 switch, and the on-disk cache of compiled programs.

Nothing in the package switches precision on import; entry points (the command line, notebooks, tests, your
script) call `enable_float64()` once, before they build any model.
"""

import os
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import PyTree


def enable_float64(cache: bool = True) -> None:
    """Use float64 everywhere and, unless told otherwise, keep compiled programs on disk.

    Args:
        cache: also switch on JAX's persistent compilation cache, so that a second run of the same command
            starts faster. It lives in the user's cache folder, or in `PNEUSMA_CACHE` if that is set
            (`PNEUSMA_CACHE=off` for none). An already configured JAX cache is left alone.
    """
    jax.config.update("jax_enable_x64", True)
    place = os.environ.get("PNEUSMA_CACHE", "")
    if not cache or place == "off" or jax.config.jax_compilation_cache_dir:  # type: ignore[attr-defined]
        return
    if not place:
        import platformdirs

        place = str(Path(platformdirs.user_cache_dir("pneusma-jax")) / "compiled")
    jax.config.update("jax_compilation_cache_dir", place)
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def require_float64() -> None:
    """Refuse to solve in float32.

    Raises:
        RuntimeError: if `enable_float64()` has not been called.
    """
    if not jax.config.jax_enable_x64:  # type: ignore[attr-defined]
        raise RuntimeError(
            "The equilibrium is solved to 1e-10, which float32 cannot hold: "
            "call pneusma_jax.enable_float64() before building a model."
        )


def require_doubles(model: PyTree) -> None:
    """Refuse a model that was built in single precision.

    Raises:
        RuntimeError: if a number of the model is not of float64.
    """
    if any(leaf.dtype == jnp.float32 for leaf in jax.tree.leaves(model) if eqx.is_array(leaf)):
        raise RuntimeError(
            "The model was built in single precision: call pneusma_jax.enable_float64() before building it."
        )

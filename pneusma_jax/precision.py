"""The explicit float64 switch, and the on-disk cache of compiled programs.

Nothing in the package switches precision on import; entry points (the command line, notebooks, tests, your
script) call `enable_float64()` once, before they build any model.
"""

import os
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import platformdirs
from jaxtyping import PyTree


def enable_float64(cache: bool = True) -> None:
    """Use float64 everywhere and, unless told otherwise, keep compiled programs on disk.

    If none was compiled before, programs for the processor also compile in about half the time, see `SOONER`,
    and histories run in a quarter of it, see `WHOLE_LOOPS`.

    Args:
        cache: also switch on JAX's persistent compilation cache, so that a second run of the same command
            starts faster. It lives in the user's cache folder, or in `PNEUSMA_CACHE` if that is set
            (`PNEUSMA_CACHE=off` for none). An already configured JAX cache is left alone.
    """
    jax.config.update("jax_enable_x64", True)
    _compile_sooner()
    place = os.environ.get("PNEUSMA_CACHE", "")
    if not cache or place == "off" or jax.config.jax_compilation_cache_dir:  # type: ignore[attr-defined]
        return
    if not place:
        place = str(Path(platformdirs.user_cache_dir("pneusma-jax")) / "compiled")
    jax.config.update("jax_compilation_cache_dir", place)
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


SOONER = {"xla_cpu_use_fusion_emitters": "false"}
"""Settings of XLA under which small programs compile sooner and run as fast. A root-find of 64 rows took 0.9
s instead of 1.6 s to compile. It took 1.35 ms instead of 1.41 ms to run (jaxlib 0.10.2, processor time)."""
WHOLE_LOOPS = {
    "xla_cpu_experimental_ynn_fusion_type": "",
    "xla_backend_extra_options": (
        "xla_cpu_small_while_loop_byte_threshold=10000000,"
        "xla_cpu_disable_loop_unrolling,xla_cpu_disable_slp_vectorizer"
    ),
}
"""Settings of XLA under which a loop of less than 10 MB is one compiled function.

XLA otherwise calls a function for every operation of every turn, and in histories these calls take most of
the time. Loops with calls to a library for matrix products stay as they are, so the first setting keeps these
out. A history's row took 20 us instead of 79 us, and a run of an actuator's diagnosis 32 ms instead of 91 ms.
A batch of 8,192 equilibria took 21 us a row instead of 28 us (jaxlib 0.10.2, processor time, loaded machine).
"""
KNOWN_TO = ((0, 10), (0, 10))
"""First and last version of jaxlib that these settings were tried with. XLA ends a process whose
settings it does not know."""


def _compile_sooner() -> None:
    """Add settings to what the environment says to XLA, which reads it when the first program is compiled."""
    version = tuple(int(part) for part in jax.lib.__version__.split(".")[:2])
    given = os.environ.get("XLA_FLAGS", "")
    if KNOWN_TO[0] <= version <= KNOWN_TO[1]:
        more = [f"--{name}={value}" for name, value in (SOONER | WHOLE_LOOPS).items() if name not in given]
        os.environ["XLA_FLAGS"] = " ".join([given, *more]).strip()


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

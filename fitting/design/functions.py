"""Objectives and constraints of a user's own: a Python function of solved states."""

import runpy
from collections.abc import Callable
from pathlib import Path

from pneusma_jax.errors import InputError, nearest


def load_function(file: Path, name: str) -> Callable:
    """A function from a Python file, which is executed.

    It is called as `function(states, parameters)`: the solved states by name (`bodies.Solved`), and the
    values of the free parameters [SI] by name. It returns one number, made with `jax.numpy`.

    Raises:
        InputError: if the file cannot be executed, or has no such function.
    """
    if not file.is_file():
        raise InputError(f"{file}: there is no such file")
    try:
        found = runpy.run_path(str(file))
    except Exception as error:  # whatever the user's file does
        raise InputError(f"{file}: cannot be executed ({type(error).__name__}: {error})") from None
    functions = [n for n, x in found.items() if callable(x) and not n.startswith("__")]
    if name not in functions:
        raise InputError(f"{file}: there is no function {name!r}, {nearest(name, functions)}")
    return found[name]

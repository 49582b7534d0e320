"""Objectives and constraints of a user's own: a Python function of solved states."""

import functools
import runpy
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp

from pneusma_jax.errors import InputError, nearest


def load_function(file: Path, name: str) -> Callable:
    """A function from a Python file, which is executed.

    It is called as `function(states, parameters)`: the solved states by name (`bodies.Solved`), and the
    values of the free parameters [SI] by name. It returns one number, made with `jax.numpy`.

    Raises:
        InputError: if the file cannot be executed, or has no such function. The function that is returned
            raises it, too, where the user's ends in an error or returns anything but one real number.
    """
    if not file.is_file():
        raise InputError(f"{file}: there is no such file")
    try:
        found = runpy.run_path(str(file))
    except (Exception, SystemExit) as error:  # whatever the user's file does
        raise InputError(f"{file}: cannot be executed ({_first_line(error)})") from None
    functions = [n for n, x in found.items() if callable(x) and not n.startswith("__")]
    if name not in functions:
        raise InputError(f"{file}: there is no function {name!r}, {nearest(name, functions)}")
    return _checked(found[name], f"{file}: function {name!r}")


def _checked(function: Callable, where: str) -> Callable:
    """The function, whose errors and results that are no number become one line."""

    @functools.wraps(function)
    def called(states: Mapping[str, Any], parameters: Mapping[str, Any]) -> Any:
        try:
            value = function(states, parameters)
        except jax.errors.JAXTypeError:  # such as `float` or `math.sin` of a value that has derivatives
            raise InputError(
                f"{where} needs plain numbers somewhere; make all of it with jax.numpy, so that it has "
                "derivatives"
            ) from None
        except (Exception, SystemExit) as error:
            raise InputError(f"{where} ends in {_first_line(error)}; {_given(states, parameters)}") from None
        if not _is_real_number(value):
            shown = value if not hasattr(value, "dtype") else f"{value.dtype} of shape {value.shape}"
            raise InputError(f"{where} must return one real number, but it returns {shown!s}")
        return value

    return called


def _is_real_number(value: Any) -> bool:
    try:
        found = jnp.asarray(value)
    except (TypeError, ValueError, OverflowError):  # such as a text, nothing, or a huge whole number
        return False
    real = jnp.issubdtype(found.dtype, jnp.floating) or jnp.issubdtype(found.dtype, jnp.integer)
    return found.size == 1 and real


def _given(states: Mapping[str, Any], parameters: Mapping[str, Any]) -> str:
    return f"it is called with states {', '.join(states)} and parameters {', '.join(parameters)}"


def _first_line(error: BaseException) -> str:
    lines = str(error).splitlines()
    return f"{type(error).__name__}: {lines[0]}" if lines else type(error).__name__

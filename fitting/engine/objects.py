"""Results as bytes, and back without running code from a file.

A pickled file can name any function of any package and have it called. Reading allows classes of this
project, and the few constructors of NumPy, JAX, Equinox, jaxtyping and the standard library that results
hold. Everything else is refused, functions of this project included.
"""

import copyreg
import importlib
import io
import pickle
from types import ModuleType
from typing import Any

from fitting.data.sealed import check_seal, remains, sealed
from pneusma_jax.errors import InputError, reason_of

OWN = ("fitting", "pneusma_jax", "validation")
"""Packages whose classes results are made of."""
CONSTRUCTORS = {
    ("builtins", name) for name in ("set", "frozenset", "slice", "complex", "bytearray", "range", "object")
} | {
    ("copyreg", "_reconstructor"),
    ("collections", "OrderedDict"),
    ("collections", "Counter"),
    ("pathlib", "Path"),
    ("pathlib", "PosixPath"),
    ("pathlib", "WindowsPath"),
    ("pathlib._local", "Path"),
    ("pathlib._local", "PosixPath"),
    ("numpy", "dtype"),
    ("numpy", "ndarray"),
    ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.multiarray", "scalar"),
    ("numpy._core.numeric", "_frombuffer"),
    ("jax._src.array", "_reconstruct_array"),
    ("types", "MappingProxyType"),
    ("fitting.calibrate.elastomer.laws", "_named"),  # a law by its name
}
"""Functions and classes that a result is rebuilt with beside its own classes; none runs what a file says."""
MODULE = "_own_module"


def _own_module(name: str) -> ModuleType:
    """A module of this project by name; results name modules of their kind.

    Raises:
        InputError: for any other module.
    """
    if name.split(".")[0] not in OWN:
        raise InputError(f"module {name} is none of this project's")
    return importlib.import_module(name)


copyreg.pickle(ModuleType, lambda module: (_own_module, (module.__name__,)))


class _Reader(pickle.Unpickler):
    """Unpickles only what is named above."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in CONSTRUCTORS or (module == __name__ and name == MODULE):
            return super().find_class(module, name)
        found = super().find_class(module, name) if module.split(".")[0] in OWN else None
        if not (isinstance(found, type) and found.__module__.split(".")[0] in OWN):
            raise InputError(f"the stored result names {module}.{name}, which no result is made of")
        return found


def dump(result: Any) -> bytes:
    """A result as bytes that `load` reads.

    Raises:
        InputError: if it holds something that `load` would refuse, or that has no bytes.
    """
    try:
        content = pickle.dumps(result)
    except (pickle.PicklingError, TypeError, AttributeError) as error:
        raise InputError(f"a result cannot be kept: {error}") from None
    load(content)
    return sealed(content)


def load(content: bytes) -> Any:
    """The result of bytes.

    Raises:
        InputError: if they are damaged, or name what no result is made of.
    """
    whole = check_seal(content, "the stored result")
    try:
        stream = io.BytesIO(content)
        result = _Reader(stream).load()
    except InputError:
        raise
    except Exception as error:  # what damaged bytes raise differs
        raise InputError(f"the stored result is damaged: {reason_of(error)}") from None
    if not whole and (count := len(stream.read())):
        raise InputError(f"the stored result: {remains(count)}")
    return result

"""Cache of traced programs on disk, beside the compiled ones that JAX keeps.

Tracing a program with the laws of every effect takes several times as long as loading its compiled form.
JAX's own cache keeps only the latter. A cached program is identified by everything that it depends on. That
is the source of the packages, the structure and shapes of its arguments, the kind of device and JAX's
version. A program of a class or function from elsewhere, such as a law of a user's own, is not stored, since
its source may change.
"""

import contextlib
import dataclasses
import functools
import hashlib
import importlib.metadata
import itertools
import json
import os
import threading
import time
import weakref
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jax import export

from .errors import InputError
from .files import write_whole

FOLDER = "traced"
DIGEST = 32
"""Number of bytes of the SHA-256 before a stored program."""
UNUSED = 90 * 86400.0
"""Maximum age of an unused program [s]."""
PACKAGES = ("pneusma_jax", "fitting", "validation")
"""Packages whose source identifies a program."""
KNOWN = {*PACKAGES, "builtins", "collections", "equinox", "jax", "jaxlib", "numpy", "pathlib"}
"""Packages whose types may be among the arguments of a stored program."""
TRACING, COMPILING, LOADING = "tracing", "compiling", "loading"
"""Steps by which a program is made ready. A program that is loaded was traced before; where its compiled form
is lost, it is compiled again."""
_listeners: list[Callable[[int, str, str], None]] = []
_numbers = itertools.count(1)
_of_process: weakref.WeakValueDictionary[tuple, Callable] = weakref.WeakValueDictionary()
"""Programs by file and compiler options, while anything holds them. A diagnosis of the same shapes makes
another function, but the same program."""


@contextlib.contextmanager
def made_ready(listener: Callable[[int, str, str], None]) -> Iterator[None]:
    """Tell a listener of every program that is made ready meanwhile, in any thread.

    A program that this process has already is never told of. One whose traced form is on disk is not traced.

    Args:
        listener: called with a number of the program, its name, and the step that begins in words. The number
            is the same for all steps of one program.
    """
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def _tell(number: int, name: str, step: str) -> None:
    for listener in tuple(_listeners):
        listener(number, name, step)


def cached_program(
    function: Callable, name: str, options: Mapping[str, bool | int] | None = None, keep: bool = True
) -> Callable:
    """`jax.jit(function)`, traced once per source, structure and shapes, and not once per process.

    It is plain `jax.jit` without a compilation cache, and where an array is not on the default device. The
    same holds where a static part of the arguments has no lasting name or comes from another package.

    Args:
        function: pure function of pytrees of arrays; returns dictionaries, tuples and lists of arrays. It
            must depend on nothing but its arguments, `name` and the source of the two packages.
        name: name of the function, with every number that it closes over.
        options: compiler options; left out where the version or device does not know them.
        keep: false if it closes over laws from elsewhere, see `of_package`; it is then compiled only.
    """
    return _Cached(function, name, options, keep)


class _Cached:
    """What `cached_program` returns: a function and the programs of all arguments that it was called with."""

    def __init__(
        self, function: Callable, name: str, options: Mapping[str, bool | int] | None, keep: bool
    ) -> None:
        self._function, self._name, self._options, self._keep = function, name, options, keep
        self._ready: dict[tuple, Callable] = {}
        self._first: dict[tuple, threading.Lock] = {}

    @functools.cached_property
    def _usable(self) -> dict[str, Any] | None:
        """Compiler options that this version accepts. The compiler is asked on first use, which keeps imports
        fast."""
        return _known(tuple(sorted(self._options.items()))) if self._options else None

    @functools.cached_property
    def _plain(self) -> Callable:
        return jax.jit(self._function, compiler_options=self._usable)

    def __call__(self, *arguments: Any) -> Any:
        leaves, structure = jax.tree.flatten(arguments)
        folder = jax.config.jax_compilation_cache_dir  # type: ignore[attr-defined]
        if not _at_home(leaves) or any(isinstance(leaf, jax.core.Tracer) for leaf in leaves):
            return self._plain(*arguments)
        leaves = [_typed_fully(leaf) for leaf in leaves]
        key = (folder, jax.config.jax_enable_x64, structure, *map(_form, leaves))  # type: ignore[attr-defined]
        if key in self._ready:
            return self._ready[key](*leaves)
        with self._first.setdefault(key, threading.Lock()):  # or every thread would trace and compile it
            if key not in self._ready:
                number = next(_numbers)
                made, step = self._stored(folder, leaves, structure, number)
                if step:
                    _tell(number, self._name, step)
                found = made(*leaves)
                self._ready[key] = made
                return found
        return self._ready[key](*leaves)

    def _stored(
        self, folder: str | None, leaves: list, structure: jax.tree_util.PyTreeDef, number: int
    ) -> tuple[Callable, str]:
        """The program of these arguments, from disk or written there, and the step that its first run begins
        with. It is empty where this process has the program. Untold ones are only compiled."""
        whole = lambda *leaves: self._plain(*jax.tree.unflatten(structure, leaves))  # noqa: E731
        shapes = [jax.typeof(leaf) for leaf in leaves]
        words = f"{self._name}|{structure}|{shapes}"
        lasting = " at 0x" not in words and "..." not in words  # or a long array that is not told in full
        if not (self._keep and folder and lasting and _ours(structure)):
            return whole, COMPILING
        path = _path(Path(folder) / FOLDER, words)
        key = (path, *sorted((self._usable or {}).items()))
        if (known := _of_process.get(key)) is not None:
            return known, ""
        step = LOADING

        def tracing() -> None:
            nonlocal step
            step = COMPILING
            _tell(number, self._name, TRACING)

        try:
            program = _program(path, self._function, structure, shapes, tracing)
        except NotImplementedError:  # a check inside the program that calls back cannot be stored
            return whole, COMPILING
        made = _of_process[key] = jax.jit(program.call, compiler_options=self._usable)
        return made, step


def stored_jit(*returns: type) -> Callable[[Callable], Callable]:
    """Decorator in place of `eqx.filter_jit`: a program is traced once per source, and not once per process.

    Arrays among the arguments are traced; all else is static and a part of the program's name. Under another
    transformation, such as `jax.grad`, the function is `eqx.filter_jit`.

        >>> @stored_jit(Found)
        ... def search(body: Body, goals: tuple[str, ...], start: jax.Array) -> Found: ...

    Args:
        returns: types of Equinox modules and named tuples in the result.
    """
    kinds = {kind.__name__: kind for kind in returns}

    def decorate(function: Callable) -> Callable:
        name = f"{function.__module__}.{function.__qualname__}"
        traced = eqx.filter_jit(function)
        programs: dict[Any, Callable] = {}

        @functools.wraps(function)
        def call(*arguments: Any, **words: Any) -> Any:
            arrays, rest = eqx.partition((arguments, words), _is_array)
            if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(arrays)):
                return traced(*arguments, **words)
            leaves, structure = jax.tree.flatten(rest)
            key = (structure, *leaves, *map(type, leaves))
            if key not in programs:
                programs[key] = cached_program(
                    functools.partial(_called, function, rest, kinds), f"{name}|{structure}|{leaves}"
                ) if _ours(structure) and _ours(leaves) else None
            program = programs[key]
            return traced(*arguments, **words) if program is None else _typed(program(arrays), kinds)

        return call

    return decorate


def of_package(law: type) -> bool:
    """True if a type is of these packages, whose source identifies stored programs."""
    return law.__module__.partition(".")[0] in PACKAGES


def _ours(value: Any) -> bool:
    """True if nothing of a tree's structure or of static values comes from another package."""
    if isinstance(value, jax.tree_util.PyTreeDef):
        node = value.node_data()
        return node is None or (_ours(node) and all(map(_ours, value.children())))
    if isinstance(value, tuple | list | set | frozenset):
        return all(map(_ours, value))
    if isinstance(value, dict):
        return all(map(_ours, value.values()))
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        if not all(_ours(getattr(value, field.name)) for field in dataclasses.fields(value)):
            return False
    named = isinstance(value, type) or callable(value)
    return str(getattr(value if named else type(value), "__module__", "")).partition(".")[0] in KNOWN


def _at_home(leaves: list[Any]) -> bool:
    """True if all arrays are on the one device for which programs are stored."""
    if jax.config.jax_default_device is not None:  # type: ignore[attr-defined]
        return False
    devices = jax.devices()
    if len(devices) == 1 and devices[0].platform == "cpu":  # there is no other
        return True
    used = set().union(*(leaf.devices() for leaf in leaves if isinstance(leaf, jax.Array)))
    return used <= {devices[0]}


def _form(leaf: Any) -> Any:
    """What a program depends on of an argument. Of an array it is told here in a tenth of JAX's time."""
    weak = isinstance(leaf, jax.Array) and getattr(leaf, "weak_type", True)  # a key has none
    plain = isinstance(leaf, np.ndarray | jax.Array) and not weak
    return (leaf.dtype, leaf.shape) if plain else jax.typeof(leaf)


def _typed_fully(leaf: Any) -> Any:
    """A number without JAX's weak type. A stored program does not depend on it, but it would be loaded anew
    for every combination of such numbers."""
    weak = leaf.weak_type if isinstance(leaf, jax.Array) and hasattr(leaf, "weak_type") else _is_number(leaf)
    return np.asarray(leaf) if weak else leaf


def _is_number(leaf: Any) -> bool:
    return isinstance(leaf, bool | int | float)


def _called(function: Callable, rest: Any, kinds: dict[str, type], arrays: Any) -> Any:
    """Result of a function as a stored program returns it, from its arguments' arrays and their rest."""
    arguments, words = eqx.combine(arrays, rest)
    return _plain(function(*arguments, **words), kinds)


def _is_array(leaf: Any) -> bool:
    return isinstance(leaf, jax.Array | np.ndarray | np.generic)


def _plain(tree: Any, kinds: dict[str, type]) -> Any:
    """A tree with its modules and named tuples as dictionaries, which a stored program can return.

    Raises:
        TypeError: if a type is not among `kinds`, or a static field is more than words, numbers and tuples.
    """
    if isinstance(tree, eqx.Module) or hasattr(tree, "_fields"):
        name, fields, static = type(tree).__name__, _fields(tree), _static(tree)
        if kinds.get(name) is not type(tree) or _tuples(json.loads(json.dumps(static))) != static:
            raise TypeError(f"a stored program cannot return {name} with {static}")
        return {json.dumps([name, static]): {key: _plain(getattr(tree, key), kinds) for key in fields}}
    if isinstance(tree, dict):
        return {key: _plain(value, kinds) for key, value in tree.items()}
    if isinstance(tree, list | tuple):
        return type(tree)(_plain(value, kinds) for value in tree)
    return tree


def _typed(tree: Any, kinds: dict[str, type]) -> Any:
    """The inverse of `_plain`."""
    if isinstance(tree, dict):
        (first, *others) = tree or [""]
        if first.startswith("[") and not others:
            name, static = json.loads(first)
            return kinds[name](**_typed(tree[first], kinds), **_tuples(static))
        return {key: _typed(value, kinds) for key, value in tree.items()}
    if isinstance(tree, list | tuple):
        return type(tree)(_typed(value, kinds) for value in tree)
    return tree


def _static(tree: Any) -> dict[str, Any]:
    """Static fields of a module."""
    if not isinstance(tree, eqx.Module):
        return {}
    return {f.name: getattr(tree, f.name) for f in dataclasses.fields(tree) if f.metadata.get("static")}


def _fields(tree: Any) -> list[str]:
    """Names of the fields that hold arrays."""
    names = getattr(tree, "_fields", None) or [field.name for field in dataclasses.fields(tree)]
    return [name for name in names if name not in _static(tree)]


def _tuples(value: Any) -> Any:
    """A JSON value with tuples for lists."""
    if isinstance(value, dict):
        return {key: _tuples(inner) for key, inner in value.items()}
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def _path(folder: Path, words: str) -> Path:
    """File of the traced program that is called by some words."""
    wide = jax.config.jax_enable_x64  # type: ignore[attr-defined]  # which arrays made inside depend on
    key = hashlib.sha256(f"{_versions()}|{jax.default_backend()}|{wide}|{_source()}|{words}".encode())
    return folder / f"{key.hexdigest()[:32]}.stablehlo"


def _program(
    path: Path,
    function: Callable,
    structure: Any,
    shapes: list[Any],
    tracing: Callable[[], None],
) -> export.Exported:
    """The traced program, from disk if it is stored; `tracing` is called before it is traced."""
    try:
        program = export.deserialize(bytearray(_checked(path.read_bytes())))
        with contextlib.suppress(OSError):  # a file of another user
            os.utime(path)
        return program
    except FileNotFoundError:
        pass
    except Exception:  # a damaged file is written again
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)
    tracing()
    flat = lambda *leaves: function(*jax.tree.unflatten(structure, leaves))  # noqa: E731
    program = export.export(jax.jit(flat))(*(jax.ShapeDtypeStruct(s.shape, s.dtype) for s in shapes))
    content = bytes(program.serialize())
    _write(path, hashlib.sha256(content).digest() + content)
    return program


def _checked(stored: bytes) -> bytes:
    """A program without its leading digest. A damaged one could end the process inside the compiler.

    Raises:
        ValueError: if the digest is not that of the program.
    """
    digest, content = stored[:DIGEST], stored[DIGEST:]
    if hashlib.sha256(content).digest() != digest:
        raise ValueError("the stored program is damaged")
    return content


def _write(path: Path, content: bytes) -> None:
    """Write a file whole or not at all. A folder that cannot be written to only costs time."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, content)
        for other in path.parent.glob("*.stablehlo"):
            if time.time() - other.stat().st_mtime > UNUSED:
                other.unlink(missing_ok=True)
    except (OSError, InputError):
        pass


def _known(options: tuple[tuple[str, bool | int], ...]) -> dict[str, bool | int]:
    """Those compiler options that this version and device accept, each asked alone."""
    return {name: value for name, value in options if _accepted(name, value)}


@functools.cache
def _accepted(name: str, value: bool | int) -> bool:
    """True if the compiler knows an option; its versions drop some."""
    try:
        jax.jit(lambda x: x + 1.0, compiler_options={name: value}).lower(0.0).compile()
    except Exception:  # the type of the exception differs between versions
        return False
    return True


def _versions() -> str:
    """Versions of the libraries whose own functions are traced."""
    return f"{jax.__version__} {eqx.__version__} {importlib.metadata.version('optimistix')}"


@functools.cache
def _source() -> str:
    """Digest of the source of the packages, and of the tables that are shipped with them."""
    found = hashlib.sha256()
    for name, files in [*((package, "*.py") for package in PACKAGES), ("calibration_data", "*.toml")]:
        package = Path(__file__).parents[1] / name
        for path in sorted(package.rglob(files)):
            found.update(str(path.relative_to(package)).encode() + path.read_bytes())
    return found.hexdigest()

"""Cache of traced programs on disk, beside the compiled ones that JAX keeps.

Tracing a program with the laws of every effect takes several times as long as loading its compiled form.
JAX's own cache keeps only the latter. A cached program is identified by everything that it depends on. That
is the source of both packages, the structure and shapes of its arguments, the kind of device and JAX's
version.
"""

import contextlib
import functools
import hashlib
import os
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import jax
from jax import export

import pneusma_jax
from pneusma_jax.errors import InputError
from pneusma_jax.files import write_whole

FOLDER = "traced"
DIGEST = 32
"""Number of bytes of the SHA-256 before a stored program."""
UNUSED = 90 * 86400.0
"""Maximum age of an unused program [s]."""


def cached_program(
    function: Callable, name: str, options: Mapping[str, bool | int] | None = None
) -> Callable:
    """`jax.jit(function)`, traced once per source, structure and shapes, and not once per process.

    Without a compilation cache, or where a static part of the arguments has no lasting name, it is plain
    `jax.jit`.

    Args:
        function: pure function of pytrees of arrays; returns dictionaries, tuples and lists of arrays. It
            must depend on nothing but its arguments, `name` and the source of the two packages.
        name: name of the function, with every number that it closes over.
        options: compiler options; left out where the version or device does not know them.
    """
    ready: dict[tuple, Callable] = {}

    @functools.cache
    def usable() -> dict[str, Any] | None:
        """Compiler options that this version accepts. The compiler is asked on first use, which keeps imports
        fast."""
        return _known(tuple(sorted(options.items()))) if options else None

    @functools.cache
    def plain() -> Callable:
        return jax.jit(function, compiler_options=usable())

    def call(*arguments: Any) -> Any:
        leaves, structure = jax.tree.flatten(arguments)
        shapes = [jax.typeof(leaf) for leaf in leaves]
        folder = jax.config.jax_compilation_cache_dir
        key = (folder, structure, *shapes)
        if key not in ready:
            words = f"{name}|{structure}|{shapes}"
            if not folder or " at 0x" in words:
                return plain()(*arguments)
            program = _program(Path(folder) / FOLDER, words, function, structure, shapes)
            ready[key] = jax.jit(program.call, compiler_options=usable())
        return ready[key](*leaves)

    return call


def _program(
    folder: Path, words: str, function: Callable, structure: Any, shapes: list[Any]
) -> export.Exported:
    """The traced program, from disk if it is stored."""
    key = hashlib.sha256(f"{jax.__version__}|{jax.default_backend()}|{_source()}|{words}".encode())
    path = folder / f"{key.hexdigest()[:32]}.stablehlo"
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


@functools.cache
def _known(options: tuple[tuple[str, bool | int], ...]) -> dict[str, bool | int]:
    """Compiler options, or none where this version or device refuses them."""
    try:
        jax.jit(lambda x: x + 1.0, compiler_options=dict(options)).lower(0.0).compile()
    except Exception:  # the type of the exception differs between versions
        return {}
    return dict(options)


@functools.cache
def _source() -> str:
    """Digest of the source of both packages."""
    found = hashlib.sha256()
    for package in (Path(pneusma_jax.__file__).parent, Path(__file__).parents[1]):
        for path in sorted(package.rglob("*.py")):
            found.update(str(path.relative_to(package)).encode() + path.read_bytes())
    return found.hexdigest()

"""Storage of chains in an HDF5 file that is never half-written.

A kill while HDF5 writes would leave an unreadable file, and a disk that fills then ends the process inside
HDF5. So each checkpoint is made in memory, written beside the last one, and renamed when it is complete.
"""

import io
import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from fitting.data import hdf5, sealed
from pneusma_jax.errors import InputError
from pneusma_jax.files import write_durably

SCHEMA = "pneusma-chain/1"
SAME_MODEL = 1e-6
"""Maximum difference of a stored from a recomputed log-density of the same model: of its size, and [1]."""
AGAIN = "; start over in another folder, or replace it with --force"
"""Remedy for a chain that cannot be continued."""
SAMPLER = "sampler"
"""Setting that names the sampler; files without it were written by emcee."""


@dataclass(frozen=True)
class Header:
    """Metadata of every chain file.

    Attributes:
        fingerprint: hash of the sampled target.
        settings: settings that must stay the same.
        counters: numbers of evaluations and failures so far.
        why: sentence about the choice of the sampler; empty in older files.
    """

    fingerprint: str
    settings: dict[str, Any]
    counters: dict[str, int]
    why: str = ""


def write(path: Path, header: Header, fill: Callable[[h5py.File], None]) -> None:
    """Replace the chain file atomically: it is the old one or the new one, whenever the machine stops.

    Args:
        path: path of the file.
        header: metadata of the file.
        fill: function that writes the chains into the open file.

    Raises:
        InputError: if the place cannot be written.
    """
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        file.attrs["schema"] = SCHEMA
        file.attrs["fingerprint"] = header.fingerprint
        file.attrs["settings"] = json.dumps(header.settings)
        file.attrs["counters"] = json.dumps(header.counters)
        file.attrs["why"] = header.why
        fill(file)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_durably(path, sealed.sealed(stream.getvalue()))
    except OSError as error:
        raise InputError(f"{path}: cannot be written here ({error.strerror or error})") from None


def opened(path: Path) -> AbstractContextManager[h5py.File]:
    """A chain file, open for reading; whatever fails in the `with` block ends in one line.

    Raises:
        FileNotFoundError: if there is none.
        InputError: if it was damaged or is no chain.
    """
    return hdf5.opened(path, str(path), "a chain", AGAIN)


def header_of(path: Path) -> Header:
    """Metadata of a chain file.

    Raises:
        InputError: if the file is no chain, or was damaged.
    """
    try:
        with opened(path) as file:
            if file.attrs.get("schema") != SCHEMA:
                raise InputError(f"{path}: this is no chain of `pneusma posterior`; start in another folder")
            settings = {SAMPLER: "emcee", **json.loads(file.attrs["settings"])}
            counters = {name: int(count) for name, count in json.loads(file.attrs["counters"]).items()}
            why = str(file.attrs.get("why", ""))
            return Header(str(file.attrs["fingerprint"]), settings, counters, why)
    except FileNotFoundError:
        raise InputError(f"{path}: there is no chain to resume; run once without --resume") from None


def counter(path: Path, header: Header, name: str) -> int:
    """A number of evaluations or failures so far.

    Raises:
        InputError: if the header lacks it.
    """
    if name not in header.counters:
        raise InputError(f"{path}: damaged, its counters have no {name!r}{AGAIN}")
    return header.counters[name]


def settings_of(path: Path) -> dict[str, Any]:
    """Settings of a stored chain.

    Raises:
        InputError: if the file is no chain.
    """
    return header_of(path).settings


def same_model(path: Path, stored: np.ndarray | float, again: np.ndarray | float) -> None:
    """Refuse to continue a chain whose stored log-densities differ from those that the model now gives.

    Args:
        path: path of the chain file.
        stored: log-densities in the file.
        again: log-densities of the same points, of the same shape.

    Raises:
        InputError: if any of them differs.
    """
    if not np.allclose(stored, again, rtol=SAME_MODEL, atol=SAME_MODEL):
        raise InputError(
            f"{path}: this chain was sampled with another model: the same parameters now have other "
            "probabilities; start over in another folder, or replace it with --force"
        )


def same_settings(path: Path, stored: dict[str, Any], wanted: dict[str, Any]) -> None:
    """Refuse to continue a chain with other settings.

    Args:
        path: path of the chain file.
        stored: settings of the stored chain.
        wanted: requested settings; None where nothing was requested.

    Raises:
        InputError: if one of them differs.
    """
    for name, value in wanted.items():
        if value is not None and stored.get(name) != value:
            raise InputError(
                f"{path}: this chain was run with {name} = {stored.get(name)}, not {value}; "
                "resume with the same, or start over elsewhere"
            )


def same_chain(path: Path, stored: Header, fingerprint: str, wanted: dict[str, Any]) -> None:
    """Refuse to continue a chain of another target.

    Raises:
        InputError: if data, priors or settings differ.
    """
    same_settings(path, stored.settings, wanted)
    if stored.fingerprint != fingerprint:
        raise InputError(
            f"{path}: this chain was sampled from other data, priors or bounds; start over in another "
            "folder, or replace it with --force"
        )

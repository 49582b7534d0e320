"""Chains on disk: an HDF5 file that emcee reads (`HDFBackend(file, name="ensemble_1")`), never half-written.

A kill while HDF5 writes would leave a file that nothing opens, so each checkpoint is written beside the last
one and takes its name when it is complete.
"""

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import emcee
import h5py
import numpy as np

from pneusma_jax.errors import InputError

SCHEMA = "pneusma-chain/1"


@dataclass(frozen=True)
class Checkpoint:
    """What a chain file holds.

    Attributes:
        backends: one of emcee's for each ensemble, in memory, random state included.
        fingerprint: of the target that was sampled.
        settings: that must stay the same.
        counters: evaluations and failures so far.
        signs: for each coordinate, 0 if the chain holds the target's own, 1 if its logarithm, -1 if that of
            its negative.
    """

    backends: list[emcee.backends.Backend]
    fingerprint: str
    settings: dict[str, int]
    counters: dict[str, int]
    signs: list[int]


def write(path: Path, checkpoint: Checkpoint) -> None:
    """Replace the chain file; it is the old one or the new one, whenever the machine stops.

    Raises:
        InputError: if the place cannot be written.
    """
    draft = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with h5py.File(draft, "w") as file:
            file.attrs["schema"] = SCHEMA
            file.attrs["fingerprint"] = checkpoint.fingerprint
            file.attrs["settings"] = json.dumps(checkpoint.settings)
            file.attrs["counters"] = json.dumps(checkpoint.counters)
            file.attrs["logarithm"] = checkpoint.signs
            for k, backend in enumerate(checkpoint.backends, start=1):
                _write_ensemble(file.create_group(f"ensemble_{k}"), backend)
            file.flush()
        with open(draft, "rb") as file:
            os.fsync(file.fileno())
        os.replace(draft, path)
    except OSError as error:
        draft.unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from None


def _write_ensemble(group: h5py.Group, backend: emcee.backends.Backend) -> None:
    """One ensemble in the layout of emcee's own backend, extendable."""
    count = backend.iteration
    walkers, dimension = backend.shape
    group.attrs["version"] = emcee.__version__
    group.attrs["nwalkers"], group.attrs["ndim"] = walkers, dimension
    group.attrs["has_blobs"], group.attrs["iteration"] = False, count
    for k, part in enumerate(backend.random_state):
        group.attrs[f"random_state_{k}"] = part
    group.create_dataset("accepted", data=backend.accepted)
    chain, log_prob = backend.chain[:count], backend.log_prob[:count]
    group.create_dataset("chain", data=chain, maxshape=(None, walkers, dimension))
    group.create_dataset("log_prob", data=log_prob, maxshape=(None, walkers))


def _attributes(path: Path) -> dict[str, Any]:
    """What a chain file says of itself."""
    try:
        with h5py.File(path, "r") as file:
            if file.attrs.get("schema") != SCHEMA:
                raise InputError(f"{path}: this is no chain of `pneusma posterior`; start in another folder")
            return {name: file.attrs[name] for name in ("settings", "counters", "fingerprint", "logarithm")}
    except FileNotFoundError:
        raise InputError(f"{path}: there is no chain to resume; run once without --resume") from None
    except (OSError, KeyError) as error:
        raise InputError(f"{path}: cannot be read as a chain ({error})") from None


def settings_of(path: Path) -> dict[str, Any]:
    """Settings that a chain was begun with.

    Raises:
        InputError: if the file is no chain.
    """
    return json.loads(_attributes(path)["settings"])


def read(path: Path) -> Checkpoint:
    """Read a chain file.

    Raises:
        InputError: if it is not one.
    """
    said = _attributes(path)
    settings, counters = json.loads(said["settings"]), json.loads(said["counters"])
    fingerprint, signs = str(said["fingerprint"]), [int(sign) for sign in said["logarithm"]]
    backends = [_read_ensemble(path, f"ensemble_{k}") for k in range(1, settings["ensembles"] + 1)]
    return Checkpoint(backends, fingerprint, settings, counters, signs)


def _read_ensemble(path: Path, name: str) -> emcee.backends.Backend:
    """An ensemble in memory, from emcee's own reader."""
    stored = emcee.backends.HDFBackend(str(path), name=name, read_only=True)
    backend = emcee.backends.Backend()
    backend.reset(*(int(size) for size in stored.shape))
    backend.chain, backend.log_prob = stored.get_chain(), stored.get_log_prob()
    backend.accepted, backend.iteration = stored.accepted, int(stored.iteration)
    algorithm, keys, position, has_gauss, gauss = stored.random_state
    backend.random_state = (str(algorithm), np.asarray(keys), int(position), int(has_gauss), float(gauss))
    return backend


def same_settings(path: Path, stored: dict[str, Any], wanted: dict[str, Any]) -> None:
    """Refuse to continue a chain with other settings than it was begun with.

    Args:
        path: of the chain file.
        stored: its settings.
        wanted: those asked for; None where nothing was.

    Raises:
        InputError: if one of them differs.
    """
    for name, value in wanted.items():
        if value is not None and stored.get(name) != value:
            raise InputError(
                f"{path}: this chain was run with {name} = {stored.get(name)}, not {value}; "
                "resume with the same, or start over elsewhere"
            )


def same_chain(path: Path, stored: Checkpoint, fingerprint: str, wanted: dict[str, Any]) -> None:
    """Refuse to continue a chain of something else.

    Raises:
        InputError: if data, priors or settings differ.
    """
    same_settings(path, stored.settings, wanted)
    if stored.fingerprint != fingerprint:
        raise InputError(
            f"{path}: this chain was sampled from other data, priors or bounds; start over in another "
            "folder, or replace it with --force"
        )

"""Layout of the chain file of emcee ensembles: how it is written, and how it is read back.

The ensembles are stored as emcee's own backend stores them, so that emcee can open the file as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import emcee
import h5py
import numpy as np

from . import checkpoint
from .bend import BentChart
from .chart import Chart
from .independent import Proposals
from .plateaus import store_plateaus, stored_plateaus

SIGN = "logarithm"
"""Attribute with `Chart.sign`, which says what parameters move by their logarithm."""
BENT = "bent"
"""Group with the map of a bent chart. The chains of such a file are in whitened coordinates, not in
constants."""
PROPOSALS = "proposals"
"""Group with the proposals about the fit. Chains without such proposals have none, nor have older files."""


@dataclass(frozen=True)
class Contents:
    """Contents of a chain file beside its header.

    Attributes:
        chart: chart in which walkers move.
        proposals: proposals about the fit, or None.
        log_evidence: log-evidence of the run from the prior of each ensemble; empty without such runs.
        backends: chains of each ensemble.
    """

    chart: Chart
    proposals: Proposals | None
    log_evidence: list[float]
    backends: Sequence[emcee.backends.Backend]


def fill(file: h5py.File, contents: Contents) -> None:
    """Write contents into an open file."""
    chart = contents.chart
    file.attrs[SIGN] = chart.sign.tolist()
    file.attrs["log_evidence"] = contents.log_evidence
    store_plateaus(file, chart.plateaus)
    if isinstance(chart, BentChart):
        group = file.create_group(BENT)
        for name in ("centre", "root", "bend"):
            group.create_dataset(name, data=getattr(chart, name))
    if contents.proposals is not None:
        group = file.create_group(PROPOSALS)
        for name, value in vars(contents.proposals).items():
            group.create_dataset(name, data=value)
    for k, backend in enumerate(contents.backends):
        _fill_ensemble(file.create_group(_name(k)), backend)


def contents_of(path: Path, ensembles: int) -> Contents:
    """Contents of a chain file with so many ensembles.

    Raises:
        InputError: if the file was damaged or holds no chains.
    """
    with checkpoint.opened(path) as file:
        sign, plateaus = np.asarray(file.attrs[SIGN], int), stored_plateaus(file)
        return Contents(
            chart=BentChart(sign, plateaus=plateaus, **_arrays(file[BENT]))
            if BENT in file
            else Chart(sign, plateaus),
            proposals=Proposals(**_arrays(file[PROPOSALS])) if PROPOSALS in file else None,
            log_evidence=[float(value) for value in file.attrs.get("log_evidence", [])],
            backends=[_ensemble(path, _name(k)) for k in range(ensembles)],
        )


def _name(ensemble: int) -> str:
    return f"ensemble_{ensemble + 1}"


def _arrays(group: h5py.Group) -> dict[str, np.ndarray]:
    return {name: part[()] for name, part in group.items()}


def _fill_ensemble(group: h5py.Group, backend: emcee.backends.Backend) -> None:
    """One ensemble in the layout of `emcee.backends.HDFBackend(file, name="ensemble_1")`."""
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


def _ensemble(path: Path, name: str) -> emcee.backends.Backend:
    """One ensemble in memory, by emcee's own reader."""
    stored = emcee.backends.HDFBackend(str(path), name=name, read_only=True)
    backend = emcee.backends.Backend()
    backend.reset(*(int(size) for size in stored.shape))
    backend.chain, backend.log_prob = stored.get_chain(), stored.get_log_prob()
    if not (np.all(np.isfinite(backend.chain)) and np.all(np.isfinite(backend.log_prob))):
        raise ValueError("some walkers or their log-densities are not finite")
    backend.accepted, backend.iteration = stored.accepted, int(stored.iteration)
    algorithm, keys, position, has_gauss, gauss = stored.random_state
    backend.random_state = (str(algorithm), np.asarray(keys), int(position), int(has_gauss), float(gauss))
    np.random.RandomState().set_state(backend.random_state)  # raises an error for one that is damaged
    return backend

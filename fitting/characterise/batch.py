"""Many campaigns, one after the other: a table over specimens and what they say together.

A campaign that cannot be used, or whose fit fails in any way, is reported beside the others and stops none.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fitting.models.rows import MARK
from fitting.recordings import read_campaign
from pneusma_jax.errors import InputError
from pneusma_jax.units import from_si

from .pooling import Pooled, pool, without_prior
from .registry import characterise
from .result import Characterisation, Estimate


@dataclass(frozen=True)
class Member:
    """One campaign of a batch.

    Attributes:
        name: of its folder, made unique.
        path: of the campaign.
        kind: of its recordings; empty where they could not be read.
        result: of its fit; None where there is none.
        problem: why there is none, in a line; empty otherwise.
    """

    name: str
    path: Path
    kind: str
    result: Characterisation | None
    problem: str


@dataclass(frozen=True)
class Batch:
    """Characterised campaigns.

    Attributes:
        members: in the order given.
        pooled: every constant that two or more specimens inform, by name.
        left_out: why estimates do not take part in `pooled`, a line each.
    """

    members: tuple[Member, ...]
    pooled: dict[str, Pooled]
    left_out: tuple[str, ...]

    @property
    def done(self) -> list[Member]:
        """Members with a result."""
        return [member for member in self.members if member.result is not None]

    def report(self) -> str:
        """The whole result as plain text."""
        from fitting.report.batch_sheet import text

        return text(self)

    def plot(self) -> dict[str, Figure]:
        """Figures by name: `specimens`."""
        from fitting.report.batch_sheet import figures

        return figures(self)

    def documents(self) -> dict[str, str | bytes]:
        """Content of the files about all of them, by file name; each member's own are in its folder."""
        from fitting.report.batch_sheet import documents

        return documents(self)

    def save(self, folder: str | Path, force: bool = False) -> list[Path]:
        """Write the table and summary; they appear together or not at all."""
        from fitting.report.publish import publish

        return publish(folder, self.documents, force)


def characterise_batch(
    campaigns: Sequence[str | Path],
    finished: Callable[[Member], None] = lambda _: None,
    progress: Callable[[str], None] = lambda _: None,
    **options: Any,
) -> Batch:
    """Characterise campaigns one after the other; float64 must be on.

    Args:
        campaigns: folders or single CSVs.
        finished: called with each member as it is done, such as to save it.
        progress: called with a word for each step of each fit.
        **options: of the pipelines; those that a kind does not know are left out for it.

    Raises:
        InputError: if none could be characterised; names the first reason.
    """
    names = _names([Path(path) for path in campaigns])
    members = []
    for name, path in zip(names, campaigns, strict=True):
        member = _member(name, Path(path), progress, options)
        finished(member)
        members.append(member)
    if not any(member.result is not None for member in members):
        raise InputError(
            f"none of {len(members)} campaigns could be characterised; {members[0].path}: "
            f"{members[0].problem}"
        )
    pooled, left_out = _pooled([member for member in members if member.result is not None])
    return Batch(tuple(members), pooled, tuple(left_out))


def _names(paths: Sequence[Path]) -> list[str]:
    names: list[str] = []
    for path in paths:
        own = path.resolve().stem if path.is_file() else path.resolve().name
        count = sum(known == own or known.rpartition("_")[0] == own for known in names)
        names.append(own if not count else f"{own}_{count + 1}")
    return names


def _member(name: str, path: Path, progress: Callable[[str], None], options: dict[str, Any]) -> Member:
    kind = ""
    try:
        campaign = read_campaign(path)
        kind = campaign.kinds[0]
        result = characterise(campaign, progress=lambda word: progress(f"{name}: {word}"), **options)
        return Member(name, path, kind, result, "")
    except Exception as error:  # noqa: BLE001  one bad specimen never stops the others
        words = " ".join(str(error).split()) or type(error).__name__
        known = isinstance(error, InputError)
        return Member(name, path, kind, None, words if known else f"{type(error).__name__}: {words}")


def _pooled(done: Sequence[Member]) -> tuple[dict[str, Pooled], list[str]]:
    """Constants by name, each over the specimens that inform it."""
    columns: dict[str, dict[str, tuple[float, float]]] = {}
    left_out = []
    for member in done:
        for name, estimate in member.result.parameters.items():
            stem, _, number = name.partition(MARK)
            specimen = f"{member.name} {number}".strip()
            told = _measured(member.result, name, estimate)
            if told is None:
                why = "at a bound" if estimate.at_bound else "not informed by the data"
                left_out.append(f"{specimen}: {stem} is {why}")
                continue
            columns.setdefault(stem, {})[specimen] = told
    pooled = {}
    for stem, found in columns.items():
        if len(found) > 1:
            pooled[stem] = pool(list(found), *np.array(list(found.values())).T)
    return pooled, left_out


def _measured(result: Characterisation, name: str, estimate: Estimate) -> tuple[float, float] | None:
    """Value and error that the data alone give, in the unit of files; None where they give none."""
    if estimate.at_bound or not np.isfinite(estimate.sd) or not estimate.sd > 0.0:
        return None
    entry = getattr(result, "fitted", {}).get(name) if hasattr(result, "fitted") else None
    if entry is None or entry.prior is None:
        return estimate.value, estimate.sd
    width = entry.unit == "K"
    mean = float(from_si(entry.prior.mean, entry.unit, width))
    return without_prior(
        estimate.value, estimate.sd, mean, float(from_si(entry.prior.sd, entry.unit, difference=True))
    )

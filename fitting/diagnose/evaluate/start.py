"""The base model that recordings are compared with, where their alloy or material is to be identified.

It is what `characterise` finds from all of its starts. Its intervals, profiles and zeros of instruments are
left out: they say nothing of a law that may miss the recordings, and a diagnosis fits all constants again.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fitting.calibrate import characterise
from fitting.calibrate.elastomer.laws import LAWS
from fitting.calibrate.elastomer.material import material
from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation
from fitting.calibrate.general import characterise_general
from fitting.calibrate.registry import own_pipeline, own_search
from fitting.calibrate.result import Estimate
from fitting.data.recordings import Campaign
from fitting.inference.notes import joined
from fitting.specimens import specimen_of
from fitting.specimens.priors import identifies
from fitting.specimens.rows import MARK
from fitting.specimens.silicones import FACTOR, UNKNOWN
from pneusma_jax.calibration.records import Calibration, Prior
from pneusma_jax.errors import InputError
from pneusma_jax.units import constant_to_si

from ..settings import DEFAULT
from .base_tables import BaseTable
from .unknowns import Unknowns

SCALING = DEFAULT.scaling


@dataclass(frozen=True)
class Start:
    """Start of a diagnosis.

    Attributes:
        words: description of the base model, for a sentence; empty for the published model.
        tables: tables to start from, as `Program.of` takes them.
        held: names of constants that are not free beside these tables.
        notes: cautions for the reader.
        constants: tables whose constants the base model has, apart from `tables`.
    """

    words: str = ""
    tables: Mapping[str, Calibration] = field(default_factory=dict)
    held: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    constants: tuple[BaseTable, ...] = ()


def start_of(campaign: Campaign, kind: str, progress: Callable[[str], None] = lambda _: None) -> Start:
    """The base model of a campaign. A coupon of an unknown silicone gets the law that predicts it best.

    The law of one specimen has moduli as open as a factor on its stress, so the factor is held. Of several
    specimens the first that is fitted is what the law is of: its factor is held, and others differ from it.

    Args:
        campaign: recordings of one kind.
        kind: kind of the recordings.
        progress: receives a line of text at every step.
    """
    specimen = specimen_of(kind)
    asked = [key for key in specimen.identified if identifies(campaign.recordings, [key])]
    if not asked:
        return Start(_named(campaign, kind))
    if not specimen.several_laws:
        return Start(f"the published model, its {joined(asked)} identified from these recordings")
    progress("fitting laws of the silicone")
    try:
        found = characterise(campaign)
    except InputError as problem:
        said = f"No law could be fitted to start from, so the source's silicone was taken ({problem})"
        return Start("the source's silicone, its stiffness identified from these recordings", notes=(said,))
    specimens = list(campaign.specimens().values())
    first = next(k for k, own in enumerate(specimens, 1) if any(r.role == "fit" for r in own))
    held = (FACTOR if len(specimens) == 1 else f"{FACTOR}{MARK}{first}",)
    words = f"a law fitted to these recordings: {found.best.law.label}"
    return Start(words, {"material": loosened(found)}, held)


def loosened(found: ElastomerCharacterisation) -> Calibration:
    """The table of a fitted law whose constants are as open as those of a silicone that nobody knows.

    Its standard errors are no knowledge beside the recordings that they come from.
    """
    table, positive = material(found.whole, found.samples, found.title), _positive(found.law)
    quantities = dict(table.quantities)
    for name in found.parameters:
        value = quantities[name].value
        low = SCALING.minimum_positive_share * value if name in positive and value > 0.0 else -np.inf
        prior = Prior(value, max(UNKNOWN * abs(value), np.finfo(float).tiny), low, np.inf)
        quantities[name] = replace(quantities[name], prior=prior)
    return replace(table, quantities=quantities)


def _positive(law: str) -> set[str]:
    return {constant.name for constant in LAWS[law].constants if constant.min > -np.inf}


def _named(campaign: Campaign, kind: str) -> str:
    """A table of one's own that recordings name."""
    own = dict.fromkeys(
        str(r.geometry[key])
        for r in campaign.recordings
        for key in ("alloy", "material")
        if key in r.geometry
    )
    return f"the published model with {joined(own)}" if own else ""


def characterised(
    campaign: Campaign, kind: str, progress: Callable[[str], None]
) -> Iterator[Mapping[str, Estimate]]:
    """Constants that `characterise` finds, by name: those found soonest first, from all of its starts last.

    Each is fitted when it is asked for. There are none where nothing is to be identified, or these recordings
    cannot be characterised. Nor are there any of an actuator: `characterise` reads its phases in another way.

    Args:
        campaign: recordings of one kind.
        kind: kind of the recordings.
        progress: receives a line of text at every step.
    """
    specimen = specimen_of(kind)
    if specimen.several_laws or not identifies(campaign.recordings, specimen.identified):
        return
    search, own = own_search(specimen.variant(campaign)), own_pipeline(specimen)
    if search is None and own is None and specimen.latent.present:
        return
    progress("characterising")

    def within(stage: str) -> None:
        progress(f"characterising, {stage}")

    try:
        if search is not None:
            yield from search(campaign, progress=within)
        elif own is None:  # by the same law as the program's, never by a simpler one
            found = characterise_general(campaign, specimen, starts=specimen.starts, progress=within)
            yield found.parameters
        else:
            yield characterise(campaign, profile=0, progress=within).parameters
    except InputError:
        return


def begun_at(known: Mapping[str, Estimate], unknowns: Unknowns) -> np.ndarray:
    """A start of a base fit, scaled, at known constants.

    Args:
        known: constants by name, see `characterised`.
        unknowns: numbers of the program that is fitted. Those of another one may be scaled otherwise.
    """
    u = unknowns.neutral.copy()
    for k in unknowns.base:
        estimate = known.get(unknowns.items[k].name)
        if estimate is not None:
            value = float(constant_to_si(estimate.value, estimate.unit))
            u[k] = np.clip(unknowns.items[k].scaled(value), unknowns.low[k], unknowns.high[k])
    return u

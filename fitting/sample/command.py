"""Preparations of `pneusma posterior` before the fit: the file of the chains, the model to sample."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from fitting.calibrate.registry import characterise
from fitting.data.recordings import Campaign
from fitting.specimens import kind_of, specimen_of
from fitting.specimens.saved_models.files import is_model
from pneusma_jax.calibration import load_calibration
from pneusma_jax.calibration.records import Calibration
from pneusma_jax.errors import InputError

from .checkpoint import same_settings, settings_of
from .problem import Problem
from .problems import sampling_problem
from .settings import Settings

CHAIN = "chain.h5"
"""Name of the chains' file in a folder of results."""
STARTS = {"base": "alloy", "material": "silicone"}
"""Kind of table that each option of a fit takes."""


def chain_file(folder: Path, resume: bool, force: bool, settings: Settings) -> Path:
    """Path of the chains, checked against existing files before any fit.

    Args:
        folder: folder of the results.
        resume: true if chains are continued.
        force: true if they may be replaced.
        settings: requested settings.

    Raises:
        InputError: if chains would be overwritten without `force`, or if there are none to resume with these
            settings.
    """
    path = folder / CHAIN
    if resume and not path.exists():
        raise InputError(f"{path}: there is no chain to resume; run once without --resume")
    if resume:
        same_settings(path, settings_of(path), settings.requested())
    if path.exists() and not (resume or force):
        raise InputError(
            f"{path}: chains are here already; continue them with --resume, or replace them with --force"
        )
    return path


def problem_for(
    campaign: Campaign,
    model: str | None,
    law: str | None,
    seed: int,
    progress: Callable[[str], None] = lambda _: None,
) -> Problem:
    """Problem to sample; fitted first where the kind has a pipeline.

    Args:
        campaign: recordings of one kind.
        model: table of constants whose priors are used, by name or path, or a model on disk whose parameters
            are sampled; None for none.
        law: law of elastomers to fit and sample; None for the one that predicts best.
        seed: seed of the fit.
        progress: called with a word for each step of the fit that begins.

    Raises:
        InputError: if the campaign or the table cannot be used, or a law is given for a kind without laws.
    """
    kind = kind_of(campaign)
    specimen = specimen_of(kind)
    if law is not None and not specimen.several_laws:
        raise InputError(
            f"{campaign.path}: --law is about elastomers, but these recordings are of kind {kind}"
        )
    fitted = partial(characterise, campaign, seed=seed, progress=progress)
    if model is not None and is_model(model):
        if law is not None:
            raise InputError(f"{model}: a model has a law of its own; leave out --law")
        return sampling_problem(fitted(model=model))
    if specimen.several_laws:
        table, options = _law_and_table(model, law)
        return sampling_problem(fitted(**options), table)
    options = {} if model is None else _start_table(model, kind)
    return sampling_problem(fitted(**options))


def _start_table(model: str, kind: str) -> dict[str, str]:
    """Option of the fit by which recordings of a kind start from a table of constants."""
    table = load_calibration(model)
    option = "material" if table.kind == STARTS["material"] else "base"
    options = specimen_of(kind).options
    if option not in options:
        wanted = " or ".join(repr(STARTS[o]) for o in options)
        raise InputError(
            f"{table.path or table.name}: kind is {table.kind!r}, but recordings of kind {kind} start from a "
            f"table of kind {wanted}"
        )
    return {option: model}


def _law_and_table(model: str | None, law: str | None) -> tuple[Calibration | None, dict[str, Any]]:
    """Table of `--model`, and the options of the fit that follow from it and `--law`."""
    if model is None:
        return None, {} if law is None else {"law": law}
    table = load_calibration(model, kind="silicone")
    stated = table.text.get("law", "")
    if law is not None and law != stated:
        raise InputError(f"{table.path}: holds law {stated!r}, but --law asks for {law!r}")
    terms = sum(name.startswith("alpha_") for name in table.quantities) if stated == "ogden" else None
    return table, {"law": stated, "terms": terms}

"""Characterisation of wires, tubes or actuators from a campaign of recordings."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fitting.calibrate.information import Information, with_errors
from fitting.calibrate.open_constants import of_unfitted, open_constants
from fitting.calibrate.profile_likelihood import Profile
from fitting.calibrate.profiled_fits import loosest, to_the_end, with_intervals
from fitting.calibrate.quoted import estimates, of_prior_alone
from fitting.calibrate.result import Characterisation, Estimate
from fitting.data.recordings import Campaign, all_real
from fitting.inference.lasting_noise import (
    SURE_OF_WHITE,
    Lasting,
    side_variances_by_name,
    variances_by_name,
)
from fitting.inference.parameters import Parameters
from fitting.inference.progress import Stages
from fitting.specimens import Specimen, priors
from fitting.specimens.refitted import refitted
from fitting.specimens.saved_model_notes import absent_effects
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.specimen import EVERY
from fitting.specimens.with_saved_model import Augmented, Held
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.errors import InputError
from pneusma_jax.precision import require_float64
from pneusma_jax.units import constant_to_si, to_si

from .fit import GeneralFit, beside_zeros, continued_from, fit_campaign
from .information import Repeat, held_back, informed, repeats
from .profiles import profiles
from .scores import Score, scores

FITS, PROFILE = "fit", "profile"
"""What is counted in each stage of a characterisation."""


@dataclass(frozen=True)
class GeneralCharacterisation(Characterisation):
    """Constants of wires, tubes or actuators, identified or adjusted within their tolerances.

    Attributes:
        campaign: the measured campaign.
        identify: an alloy or material was to be identified.
        fit: the fit.
        start: values of the free parameters before it, SI.
        information: Fisher information of the recordings.
        identifiability: sentences about open or loosely known constants.
        profiles: profile likelihoods by parameter.
        scores: every recording beside its prediction.
        repeats: expected gain from measuring each recording once more.
        options: tables that the campaign was fitted from.
        seed: seed of the scattered starts.
        model: the model on disk that was fitted; None for the base model.
        lasting: zeros of instruments that are off or drift, and what they add to errors.
    """

    campaign: Campaign
    identify: bool
    fit: GeneralFit
    start: dict[str, float]
    information: Information
    identifiability: list[dict[str, Any]]
    profiles: dict[str, Profile]
    scores: tuple[Score, ...]
    repeats: tuple[Repeat, ...]
    options: dict[str, str | Path]
    seed: int
    model: Augmented | None = None
    lasting: Lasting | None = None

    @property
    def title(self) -> str:
        """Title of the campaign."""
        return self.campaign.title

    @property
    def kind(self) -> str:
        """Kind of the recordings."""
        return self.fit.kind

    @property
    def specimen(self) -> Specimen:
        """Specimen of the recordings."""
        return self.fit.model.specimen

    @property
    def real(self) -> bool | None:
        """Measured (True), simulated (False), or nobody said (None)."""
        return all_real(self.fit.recordings)

    @property
    def fitted(self) -> Parameters:
        """Free parameters at the values found, in SI, with standard errors and correlations."""
        return self.fit.result.parameters

    @property
    def parameters(self) -> dict[str, Estimate]:
        """Everything that was free, and what was held because no recording shows it, with the error of its
        prior; in the unit of files."""
        last, names = self.lasting, self.information.names
        variances = {} if last is None else variances_by_name(last, names)
        sides = {} if last is None else side_variances_by_name(last, names)
        jumping = self.information.jumping
        return estimates(self.fitted, self.profiles, variances, sides, jumping) | {
            name: of_prior_alone(quantity) for name, quantity in self.unseen.items()
        }

    @property
    def unseen(self) -> dict[str, Quantity]:
        """Constants that no recording shows, held at their table's values, by name; SI."""
        return _held_unseen(self.specimen, self.campaign, self.options, self.fitted)

    def held(self) -> list[Held]:
        """Numbers of the model on disk that this fit left as they are; nothing for the base model."""
        return [] if self.model is None else self.model.held(self.campaign, self.fitted)

    def augmented(self) -> AugmentedModel | None:
        """The model on disk with the numbers found; None for the base model."""
        if self.model is None:
            return None
        errors = {
            name: to_si(estimate.sd, estimate.unit, difference=True)
            for name, estimate in self.parameters.items()
        }
        return refitted(self.model, self.campaign, self.fitted, f"Fitted to {self.title}", errors)


def characterise_general(
    campaign: Campaign,
    specimen: Specimen,
    *,
    adjust: Mapping[str, Mapping[str, Any]] | None = None,
    starts: int,
    profile: int | Sequence[str] = 0,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
    model: Augmented | None = None,
    hold_unseen: bool = False,
    **options: str | Path,
) -> GeneralCharacterisation:
    """Fit a campaign of one kind: priors, least squares from several starts, errors, what stays open.

    Constants that no recording shows (`Specimen.unseen`) are free with the priors of their table. So their
    doubt counts in every interval.

    Args:
        campaign: recordings.
        specimen: specimen of the recorded kind.
        adjust: changes to free parameters by name, in the unit of files; see `characterise_spring`.
        starts: number of starts of the fit in all.
        profile: parameters to profile, or how many of the loosest.
        seed: seed of the scattered starts.
        progress: called with a word for each step that begins.
        model: model on disk, of this kind; the base model by default.
        hold_unseen: true to hold the constants that no recording shows at their table's values.
        **options: tables to start from, as the specimen's `rows_for` takes them.

    Raises:
        InputError: if the recordings or options cannot be used, in one line.
    """
    require_float64()
    stage_progress = Stages(progress, (FITS, PROFILE) if profile else (FITS,))
    recordings = campaign.fittable(specimen.kind)
    predictor = model or specimen
    doubtful = {} if model or hold_unseen else specimen.unseen(campaign, **options)
    parameters = _free(campaign, predictor, adjust or {}, options, doubtful)
    start = {name: entry.value for name, entry in parameters.items()}
    rows = predictor.rows_for(campaign, **options)
    if model is not None:
        rows = model.prepared(start, rows)
    fits = stage_progress.of(FITS)
    fit = fit_campaign(recordings, rows, parameters, starts, seed, fits, predictor)
    unseen = {} if model else _held_unseen(specimen, campaign, options, fit.result.parameters)
    begun = _beside_zeros(_FitWithErrors.of(fit, unseen), unseen, fits)
    ended, profiled = _profiled(begun, unseen, profile, stage_progress)
    return _result(campaign, start, ended, profiled, options, seed, model)


def _free(
    campaign: Campaign,
    predictor: Specimen | Augmented,
    adjust: Mapping,
    options: Mapping[str, Any],
    doubtful: Mapping[str, Quantity],
) -> Parameters:
    """Free parameters as the user adjusts them; refused where nothing is free.

    Args:
        campaign, predictor, adjust, options: as of `characterise_general`.
        doubtful: further constants that are free with the priors of their table.
    """
    parameters = predictor.parameters_for(campaign, **options)
    for quantity in doubtful.values():
        parameters.add(priors.tabulated(quantity))
    parameters = adjusted(parameters, adjust)
    if not parameters:
        raise InputError(
            f"{campaign.path}: alloy and material are known and the tolerances leave nothing open; "
            'state "fit" for one of them, or a [tolerance]'
        )
    return parameters


def _held_unseen(
    specimen: Specimen, campaign: Campaign, options: Mapping[str, Any], fitted: Parameters
) -> dict[str, Quantity]:
    """Constants that no recording shows, held at their table's values, by name; SI."""
    found = specimen.unseen(campaign, **options)
    return {name: quantity for name, quantity in found.items() if name not in fitted}


@dataclass(frozen=True)
class _FitWithErrors:
    """A fit with standard errors.

    Attributes:
        fit: the fit.
        information: Fisher information of all its recordings with `role = fit`.
        each: Fisher information of each recording, SI, shape (parameters, parameters) each.
        lasting: zeros of instruments that are off or drift, and what they add to errors.
    """

    fit: GeneralFit
    information: Information
    each: list[np.ndarray]
    lasting: Lasting

    @classmethod
    def of(cls, fit: GeneralFit, unseen: Mapping[str, Quantity]) -> "_FitWithErrors":
        """A fit with the errors by its information; the doubt of held constants counts in `lasting`."""
        fisher, each, last = informed(fit, unseen)
        return cls(replace(fit, result=with_errors(fit.result, lambda _: fisher)), fisher, each, last)


def _beside_zeros(
    now: _FitWithErrors, unseen: Mapping[str, Quantity], progress: Callable[[str], None]
) -> _FitWithErrors:
    """The fit with correlated noise, where zeros of instruments probably are off or drift.

    A constant that is held at a wrong value leaves slow misfit, as a zero does. So noise stays white while
    one is held.
    """
    if now.fit.zeros or unseen or now.lasting.steady >= SURE_OF_WHITE:
        return now
    found = beside_zeros(now.fit, now.lasting.sizes, progress)
    return _FitWithErrors.of(found, unseen) if found.zeros else now


def _profiled(
    begun: _FitWithErrors,
    unseen: Mapping[str, Quantity],
    profile: int | Sequence[str],
    stage_progress: Stages,
) -> tuple[_FitWithErrors, dict[str, Profile]]:
    """Profile likelihoods by parameter, and the fit, which goes on where a profile falls below it.

    Args:
        begun: the fit to begin with.
        unseen: constants that no recording shows, held at their table's values.
        profile: as of `characterise_general`.
        stage_progress: progress of its stages.
    """

    def profiles_of(now: _FitWithErrors, leave: bool) -> tuple[dict[str, Profile], list[str]]:
        wanted = _wanted(now.fit, profile)
        if not wanted:
            return {}, wanted
        variances = variances_by_name(now.lasting, now.information.names)
        return profiles(now.fit, wanted, variances, leave, stage_progress.of(PROFILE, len(wanted))), wanted

    def continued(now: _FitWithErrors, _: str, lowest: Mapping[str, float]) -> tuple[_FitWithErrors, bool]:
        fits = stage_progress.of(FITS)
        further = continued_from(now.fit, lowest, fits)
        if further.result is now.fit.result:
            return replace(now, fit=further), False
        return _beside_zeros(_FitWithErrors.of(further, unseen), unseen, fits), True

    ended, (profiled, _) = to_the_end(begun, profiles_of, continued)
    return ended, profiled


def _result(
    campaign: Campaign,
    start: dict[str, float],
    ended: _FitWithErrors,
    profiled: dict[str, Profile],
    options: Mapping[str, str | Path],
    seed: int,
    model: Augmented | None,
) -> GeneralCharacterisation:
    """The characterisation of a fit: what stays open, scores of recordings, the gain of repeats.

    Args:
        campaign, options, seed, model: as of `characterise_general`.
        start: values of the free parameters before the fit, SI.
        ended: the fit.
        profiled: profile likelihoods by parameter.
    """
    fit, fisher = ended.fit, ended.information
    fitted = fit.result.parameters
    absent, natural = (absent_effects(model, fitted), model.natural_ends()) if model else ({}, frozenset())
    left_open = open_constants(
        fisher, fitted, start, absent, natural, profiled=with_intervals(profiled),
        unfitted=of_unfitted(fisher.names, campaign.recordings),
    )  # fmt: skip
    result = GeneralCharacterisation(
        campaign=campaign,
        identify=priors.identifies(fit.recordings),
        fit=fit,
        start=start,
        information=fisher,
        identifiability=left_open,
        profiles=profiled,
        scores=tuple(scores(fit)),
        repeats=tuple(repeats(fit, fisher, ended.each)),
        options=dict(options),
        seed=seed,
        model=model,
        lasting=ended.lasting,
    )
    return replace(result, identifiability=[*left_open, *map(held_back, result.unseen)])


def _wanted(fit: GeneralFit, profile: int | Sequence[str]) -> list[str]:
    """Parameters to profile: so many of the loosest, or those of a list.

    A parameter of the list at a bound is left out if it has no prior. An unknown name stays, so that the
    search refuses it.
    """
    known = fit.result.parameters
    if isinstance(profile, int):
        return loosest(known, known.layout().free, profile)
    able = loosest(known, [name for name in profile if name in known], EVERY)
    return [name for name in profile if name in able or name not in known]


def adjusted(parameters: Parameters, changes: Mapping[str, Mapping[str, Any]]) -> Parameters:
    """Parameters changed as a user asks, in the unit of files."""
    in_si = {}
    for name, change in changes.items():
        unit = parameters[name].unit if name in parameters else "1"
        in_si[name] = {
            key: constant_to_si(value, unit) if key in ("value", "min", "max") else value
            for key, value in change.items()
        }
    return priors.adjusted(parameters, in_si)


def characterise_specimen(
    campaign: Campaign,
    specimen: Specimen,
    *,
    adjust: Mapping[str, Mapping[str, Any]] | None = None,
    starts: int | None = None,
    profile: int | Sequence[str] | None = None,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
    **tables: str | Path,
) -> GeneralCharacterisation:
    """Constants of specimens of one kind; by a simpler law where the whole one misses the recordings.

    The simpler law (`Specimen.simpler`) lacks constants that no recording shows. It is not tried if the user
    adjusts one of these.

    Args:
        campaign: recordings of one kind.
        specimen: specimen of that kind.
        adjust: see `characterise_general`.
        starts: fits in all; the specimen's own number by default.
        profile: parameters to profile, or how many; the specimen's own number by default.
        seed, progress: see there.
        **tables: tables to start from, as the specimen's `rows_for` takes them.
    """
    common = {
        "adjust": adjust,
        "starts": specimen.starts if starts is None else starts,
        "profile": specimen.profiled if profile is None else profile,
        "seed": seed,
        "progress": progress,
    }
    found = characterise_general(campaign, specimen, **common, **tables)
    plain, words = specimen.simpler(campaign, **tables)
    asked = set(adjust or {}) & set(specimen.unseen(campaign, **tables))
    if plain and found.fit.misses and not asked:
        common["progress"] = lambda word: progress(f"{words}, {word}")
        found = characterise_general(campaign, specimen, **common, hold_unseen=True, **{**tables, **plain})
    return found

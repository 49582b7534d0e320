"""The noise of every instrument of a campaign, from the residuals of a fitted model."""

from dataclasses import replace

import numpy as np

from fitting.inference.noise import rounding_noise
from fitting.inference.readings import read_values, stated_noise
from fitting.specimens.reduction import chosen_readings

from ..evaluate.evaluation import Evaluation, row_count
from ..evaluate.instruments import Series, each_of_its_size, instrument_of, series_of
from ..evaluate.program import Program


def with_noise_of(program: Program, here: Evaluation) -> Program:
    """The program with the noise that all recordings of an instrument show once a model is fitted.

    Where nobody states it, recordings that clearly differ have one each (`each_of_its_size`).
    A resistance that latent trajectories follow shows no errors, so its first estimate stays
    (`high_frequency_noise`).

    Args:
        program: program of the campaign; it is not changed.
        here: the fitted model.
    """
    bare, size = [list(row) for row in program.bare], program.stacked.mask.shape[1]
    groups: dict[tuple[str, bool], list[tuple[int, int, Series]]] = {}
    for k, (recording, hidden) in enumerate(zip(program.recordings, program.followed(here), strict=True)):
        shape = len(program.channels[k]), size
        readings = chosen_readings(recording)
        taken = hidden.leverage().reshape(shape) if hidden else np.zeros(shape)
        for j, channel in enumerate(program.channels[k]):
            stated = stated_noise(recording, channel.quantity) or None
            if program.follows(channel.quantity):
                continue
            one = series_of(channel, bare[k][j], here.predicted[k][j], stated, recording.block)
            rounding = rounding_noise(read_values(recording, channel.quantity)) / np.sqrt(recording.block)
            one = one.dithered(rounding)
            if stated is None:
                one = replace(one, readings=readings)
            key = channel.quantity, stated is None
            groups.setdefault(key, []).append((k, j, one.less(taken[j])))
    for (_, unstated), members in groups.items():
        series = [one for _, _, one in members]
        noise = instrument_of(series + _samples(program, members))
        each = each_of_its_size(series, noise) if noise and unstated else None
        if each is not None:
            noise, series = instrument_of(each), each
        for (k, j, _), one in zip(members, series, strict=True) if noise else ():
            bare[k][j] = noise.applied_to(bare[k][j], one)
    copy = replace(program, bare=bare)
    copy.count_input_noise(here.u)
    return copy


def _samples(program: Program, members: list[tuple[int, int, Series]]) -> list[Series]:
    """The samples behind rows that are means, where their noise is stated."""
    found = []
    for k, j, one in members:
        if one.stated and one.block > 1:
            quantity, rows = program.bare[k][j].quantity, row_count(program.stacked, k)
            found.append(one.finer(program.recordings[k].whole.si(quantity), rows))
    return found

"""The noise of every instrument of a campaign, from the residuals of a fitted model."""

from dataclasses import replace

import numpy as np

from fitting.inference.noise import rounding_noise
from fitting.inference.readings import read_values, stated_noise
from fitting.specimens.reduction import chosen_readings

from ..evaluate.evaluation import Evaluation, row_count
from ..evaluate.instruments import Series, each_of_its_size, instrument_of, series_of
from ..evaluate.program import Program

Member = tuple[int, int, Series]
"""Numbers of a recording and of its channel, and the errors of this channel."""


def with_noise_of(program: Program, here: Evaluation, apart: bool = False) -> Program:
    """The program with the noise that all recordings of an instrument show once a model is fitted.

    A resistance that latent trajectories follow shows no errors, so its first estimate stays
    (`high_frequency_noise`).

    Args:
        program: program of the campaign; it is not changed.
        here: the fitted model.
        apart: true to give recordings that clearly differ a noise each where nobody states it
            (`each_of_its_size`).
    """
    bare = [list(row) for row in program.bare]
    for (_, unstated), members in _groups(program, here).items():
        series = [one for _, _, one in members]
        noise = instrument_of(series + _samples(program, members))
        each = each_of_its_size(series, noise) if noise and unstated and apart else None
        if each is not None:
            noise, series = instrument_of(each), each
        for (k, j, _), one in zip(members, series, strict=True) if noise else ():
            bare[k][j] = noise.applied_to(bare[k][j], one)
    copy = replace(program, bare=bare)
    copy.count_input_noise(here.u)
    return copy


def recordings_differ(program: Program, here: Evaluation) -> bool:
    """True if a noise that nobody states clearly differs between recordings; arguments as `with_noise_of`."""
    for (_, unstated), members in _groups(program, here).items():
        series = [one for _, _, one in members]
        noise = instrument_of(series) if unstated else None
        if noise and each_of_its_size(series, noise) is not None:
            return True
    return False


def _groups(program: Program, here: Evaluation) -> dict[tuple[str, bool], list[Member]]:
    """Errors of all channels by quantity, and whether nobody states their noise."""
    bare, size = program.bare, program.stacked.mask.shape[1]
    groups: dict[tuple[str, bool], list[Member]] = {}
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
    return groups


def _samples(program: Program, members: list[Member]) -> list[Series]:
    """The samples behind rows that are means, where their noise is stated."""
    found = []
    for k, j, one in members:
        if one.stated and one.block > 1:
            quantity, rows = program.bare[k][j].quantity, row_count(program.stacked, k)
            found.append(one.finer(program.recordings[k].whole.si(quantity), rows))
    return found

"""Recordings at the pace at which physics goes on in them: long ones averaged over blocks of samples."""

import dataclasses

import numpy as np

from fitting.models.rows import averaged
from fitting.recordings import Campaign, Recording


def thinned(campaign: Campaign, most: int) -> Campaign:
    """A campaign whose recordings have at most `most` rows; means over equal blocks of samples.

    Args:
        campaign: as it was read.
        most: rows that are left at most. A diagnosis fits hundreds of models, each row after row.
    """
    return dataclasses.replace(campaign, recordings=[_thinned(r, most) for r in campaign.recordings])


def _thinned(recording: Recording, most: int) -> Recording:
    columns = {name: recording.columns[name] for name in recording.known_columns}
    if len(recording) <= most:
        return recording
    numbers = {name: values for name, values in columns.items() if np.asarray(values).dtype.kind == "f"}
    return dataclasses.replace(recording, columns=averaged(numbers, most)[0])

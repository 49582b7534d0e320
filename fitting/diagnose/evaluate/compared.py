"""Measured outputs that a model is compared with."""

from collections.abc import Sequence

from fitting.data.recordings import Recording
from fitting.inference.channels import Channel
from fitting.specimens.rows import Rows
from fitting.specimens.specimen import Specimen
from pneusma_jax.errors import InputError

from .high_frequency_noise import high_frequency_readings
from .noise import channels_of


def compared_channels(
    recordings: Sequence[Recording], rows: Sequence[Rows], specimen: Specimen, size: int
) -> list[list[Channel]]:
    """Measured outputs of every recording, with the noise that is stated, or that their second differences
    tell.

    Args:
        recordings: recordings of one campaign.
        rows: the same as arrays.
        specimen: their specimen.
        size: number of rows of every recording, with padding.

    Raises:
        InputError: if a recording has no output that the specimen's model explains.
    """
    latent = specimen.latent
    estimates = high_frequency_readings(recordings, rows) if latent.present else [{}] * len(rows)
    outputs, found = (*specimen.explained, *latent.readings), []
    for recording, own, estimated in zip(recordings, rows, estimates, strict=True):
        channels = channels_of(recording, own, outputs, size, estimated)
        if not any(channel.count for channel in channels if channel.quantity in specimen.explained):
            wanted = " or ".join(specimen.explained)
            raise InputError(
                f"{recording.path or recording.name}: there is no {wanted} to compare the model with"
            )
        found.append(channels)
    return found

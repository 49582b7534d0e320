"""The former name of `fitting.data.recordings`, for programs that were written for it."""

from fitting.data.recordings import (
    Campaign,
    Recording,
    check_recording,
    read_campaign,
    read_recording,
    recordings_folder,
    write_recording,
)

__all__ = [
    "Campaign",
    "Recording",
    "check_recording",
    "read_campaign",
    "read_recording",
    "recordings_folder",
    "write_recording",
]

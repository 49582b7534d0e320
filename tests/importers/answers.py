"""Small tables to import, and what an import answers: the line of a refusal, the notices that ask to check."""

import pytest

from fitting.data.importers import import_file, make_options
from pneusma_jax.errors import InputError

ROWS = "".join(f"{2 * k},{4.0 * k:.3f},{0.1 * k:.4f},{3.32 + 0.001 * k:.4f}\n" for k in range(8))
SPRING = "Time [s],Extension [mm],Force [N],Resistance [Ohm]\n" + ROWS
PULL = "Time [s],Extension [mm],Force [N]\n" + "".join(f"{k},{k / 2},{k / 9:.3f}\n" for k in range(9))
TUBE = "Time (s),Pressure (kPa),Length (mm)\n" + "".join(f"{k},{k}.0,{56 + 0.1 * k:.2f}\n" for k in range(8))


def refusal(path, **named):
    """The one line with which an import of a file is refused; it names the file."""
    with pytest.raises(InputError) as caught:
        import_file(path, make_options(**named))
    assert "\n" not in str(caught.value) and path.name in str(caught.value)
    return str(caught.value)


def checks(recording):
    """Notices of a recording that ask the person to check something, but for sizes that nobody states.

    Most tables of these tests state none; `assumes_sizes` tells of that question.
    """
    return [note for note in recording.notices if note.startswith("check:") and "no [geometry]" not in note]


def assumes_sizes(recording):
    """True if a recording asks the person for the sizes of its specimen, which nobody states."""
    return any(note.startswith("check: the sidecar has no [geometry]") for note in recording.notices)

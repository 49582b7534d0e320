"""What an import answers: the line of a refusal, and the notices that ask the person to check."""

import pytest

from fitting.data.importers import import_file, make_options
from pneusma_jax.errors import InputError


def refusal(path, **named):
    """The one line with which an import of a file is refused; it names the file."""
    with pytest.raises(InputError) as caught:
        import_file(path, make_options(**named))
    assert "\n" not in str(caught.value) and path.name in str(caught.value)
    return str(caught.value)


def checks(recording):
    """Notices of a recording that ask the person to check something."""
    return [note for note in recording.notices if note.startswith("check:")]

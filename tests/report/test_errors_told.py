"""What errors were multiplied by is said alike at every place of a report."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.inference.lasting_noise import Lasting
from fitting.report.instrument_zeros import (
    error_factors,
    how_errors_grew,
    lasting_zeros,
    not_drawn,
    possible_zeros,
)
from pneusma_jax.units import amount


def zeros(grown, beside=False, steady=0.01):
    sizes, told = ({"stress": 0.1}, {"stress": 0.9}), {"steady": steady, "steady_by_output": {"stress": steady}}
    return Lasting(np.array([1.0, grown**2]), *sizes, fitted_beside_zeros=beside, **told)


@pytest.mark.parametrize(
    ("inflation", "lasting", "said"),
    [
        (1.0, None, ""),
        (1.3, None, "multiplied by 1.3 for misfit and correlation"),
        (1.0, zeros(2.0), "multiplied by up to 2 for zeros of instruments"),
        (1.0, zeros(2.0, steady=0.9), "multiplied by up to 2 for zeros of instruments that these recordings do not exclude"),
        (1.3, zeros(2.0), "multiplied by 1.3 for misfit and correlation and by up to 2 for zeros of instruments"),
        (1.0, zeros(1.02), ""),
        (1.0, zeros(2.0, beside=True), ""),
    ],
)
def test_all_factors_of_the_errors_are_told_together(inflation, lasting, said):
    """A report said that errors were multiplied by up to 2, and at another place by 1."""
    assert error_factors(inflation, lasting) == said
    assert how_errors_grew(inflation, lasting) == (f"were {said}" if said else "were not multiplied")


def test_the_sentence_on_zeros_has_the_same_factor():
    (sentence,) = lasting_zeros(zeros(2.0))
    assert "multiplied by up to 2 for that" in sentence
    assert not lasting_zeros(zeros(1.02)) and "as noise alone" in lasting_zeros(zeros(2.0, beside=True))[0]


def test_a_zero_without_evidence_is_a_doubt_and_no_finding():
    """Springs without drift were said to have wrong zeros: the size was that of the prior."""
    result = lambda found: SimpleNamespace(lasting=found, information=SimpleNamespace(names=("a", "b")))  # noqa: E731
    doubt = zeros(2.0, steady=0.9)
    assert lasting_zeros(doubt) == [] and possible_zeros(result(zeros(2.0))) == []
    (said,) = possible_zeros(result(doubt))
    assert "a zero of stress that is off would look like another b, so its error counts it." in said
    assert possible_zeros(result(zeros(1.02, steady=0.9))) == [] and possible_zeros(result(None)) == []


def test_captions_say_that_zeros_are_not_drawn():
    """A fit beside a zero lay above all readings of its figure, without a word."""
    assert "so the model may lie beside the readings" in not_drawn(zeros(2.0, beside=True))
    assert not_drawn(zeros(2.0)) == not_drawn(None) == ""


@pytest.mark.parametrize(("number", "unit", "text"), [("3.2", "kPa", "3.2 kPa"), ("3.2", "1", "3.2"), ("1", "1", "1"), ("2 to 3", "", "2 to 3"), ("1", "1/m", "1 1/m")])
def test_a_plain_number_has_no_unit(number, unit, text):
    assert amount(number, unit) == text

"""When a fit of a wire, tube or actuator goes on to look for a better minimum, on fits that only say how they end."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.calibrate.general import fit as general
from fitting.inference.least_squares import Status
from fitting.inference.parameters import Parameters

STARTS = 8


@pytest.fixture
def searching(monkeypatch):
    """Starts of every fit that is made, where reduced chi-square is `bare` and, noise of drivers counted, `decided`."""

    def of(bare, decided):
        asked = []

        def fitted(model, recordings, rows, parameters, starts, seed):
            asked.append(starts)
            reduced = decided if rows[0] == "decided" else bare
            return SimpleNamespace(
                chi_square=100.0 * reduced, reduced_chi_square=reduced, status=Status.CONVERGED, values={},
                parameters=Parameters(), start_chi_squares=[100.0 * reduced] * (starts if isinstance(starts, int) else 1),
            )  # fmt: skip

        monkeypatch.setattr(general, "_fit", fitted)
        monkeypatch.setattr(general, "_misfits", lambda fit: [np.random.default_rng(0).standard_normal(100)])
        monkeypatch.setattr(general, "inflation_of", lambda reduced, misfits: 1.0)
        model = SimpleNamespace(decides=lambda rows: True, decided=lambda values, rows: ["decided"])
        found = general.fit_campaign(["a recording"], ["bare"], Parameters(), STARTS, 0, lambda word: None, model)
        return found, [n for n in asked if n == STARTS]

    return of


def test_noise_of_the_drivers_is_no_reason_to_search_on(searching):
    found, many = searching(bare=1.5, decided=1.0)
    assert len(many) == 1 and len(found.starts) == STARTS and found.reduced_chi_square == 1.0


def test_what_that_noise_does_not_explain_is(searching):
    found, many = searching(bare=20.0, decided=10.0)
    assert len(many) == 1 + general.DRAWS and len(found.starts) == STARTS + general.DRAWS * (STARTS - 1)

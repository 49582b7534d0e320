"""The caution in files of an elastomer: there only where the law misses more than ordinary instruments, and of its own range."""

import dataclasses

import numpy as np

from fitting.characterise import characterise
from fitting.data.recordings import Campaign, Recording
from fitting.report.elastomer.text import caution, left_by


def pulled(ripple):
    """A law of Yeoh with a ripple, as part of the largest stress, that it does not have; nobody states the noise."""
    strain = np.linspace(0.0, 1.5, 150)
    stretch = 1.0 + strain
    i1 = stretch**2 + 2.0 / stretch - 3.0
    stress = 2.0 * (stretch - stretch**-2) * (30.0 + 2.0 * i1)
    noise = 1e-4 * np.random.default_rng(1).standard_normal(150)
    stress += stress[-1] * (ripple * np.sin(12.0 * strain) + noise)
    recording = Recording("a", None, "elastomer", "fit", "A", columns={"strain": strain, "stress_kPa": stress})
    return characterise(Campaign("c", [recording], False), law="yeoh")


def test_a_law_that_misses_no_more_than_an_ordinary_instrument_is_not_distrusted():
    """Every command said not to trust its numbers, because instruments of unstated noise are accurate to 1 %."""
    result = pulled(0.004)
    assert "ordinary instruments are accurate to" in left_by(result)[0]
    assert "caution" not in result.documents()["material.toml"]


def test_a_file_has_the_caution_of_its_own_range():
    """The table of an actuator's range repeated what the law of the whole range leaves."""
    result = pulled(0.05)
    said = caution(result, result.whole)
    assert said == left_by(result)[0] and said in result.documents()["material.toml"]
    fits = dataclasses.replace(result.whole.best, mean_square=1.0)
    chosen = result.whole.choice.chosen
    own = dataclasses.replace(result.whole, fits={**result.whole.fits, chosen: fits})
    both = dataclasses.replace(result, actuator=own)
    files = both.documents()
    assert said in files["material.toml"] and "caution" not in files["material_actuator.toml"]


def test_a_law_that_leaves_noise_has_no_caution():
    assert "caution" not in pulled(0.0).documents()["material.toml"]

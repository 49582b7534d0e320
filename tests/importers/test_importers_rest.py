"""The stress of a specimen at rest: the number that a question states is one that the file bears out."""

import numpy as np
import pytest
from answers import checks

from fitting.data.slack import noise_of_steps, reading_at_rest

STEPS = np.arange(110) / 100.0


def text(strain, stress, heads="Strain (%),Stress (MPa)"):
    return heads + "\n" + "".join(f"{x:.6g},{y:.6g}\n" for x, y in zip(strain, stress, strict=True))


def preloads(recording):
    return [note for note in checks(recording) if "a preload" in note]


def test_a_row_at_no_strain_and_no_stress_is_no_preload_of_a_curve_that_bends_at_once(read):
    """A parabola through eight coarse rows of a stiff film reaches 2 % of the largest stress at no strain."""
    stress = np.where(STEPS > 0, 9.0 + 108.0 * (1 - np.exp(-1.6 * STEPS)), 0.0)
    assert not preloads(read(text(STEPS, stress), kind="elastomer"))


def test_a_preload_at_no_strain_is_asked_about_with_the_reading_of_the_file(read):
    stress = 3.0 + 108.0 * (1 - np.exp(-1.6 * STEPS**0.5))
    (note,) = preloads(read(text(STEPS, stress), kind="elastomer"))
    assert "stress is 3000 kPa at strain 0:" in note
    assert note.endswith("--subtract stress_kPa=3000")


def test_where_no_row_is_near_no_strain_the_question_names_the_strain_of_the_first_rows(read):
    """First rows that stand still tell nothing about a strain eight times as far away as they reach."""
    still = np.linspace(0.36, 0.32, 14)
    strain = np.append(still, np.linspace(0.33, 16.0, 280))
    stress = np.append(np.linspace(0.69, 3.0, 14), 3.0 + 25.0 * (np.linspace(0.33, 16.0, 280) / 16.0) ** 2)
    (note,) = preloads(read(text(strain, stress / 1000.0), kind="elastomer"))
    at = float(note.split(" at strain ")[1].split(":")[0])
    reading = float(note.split("stress is ")[1].split(" ")[0])
    assert at == pytest.approx(0.36 / 100, rel=0.03)
    assert reading == pytest.approx(0.69, rel=0.4)


def test_noise_around_a_rest_is_averaged_by_the_parabola():
    rng = np.random.default_rng(4)
    strain = np.linspace(0.0, 0.5, 300)
    errors = []
    for _ in range(200):
        stress = 40.0 + 300.0 * strain + 2.0 * rng.standard_normal(300)
        errors.append(reading_at_rest(strain, stress).reading - 40.0)
        assert noise_of_steps(stress) == pytest.approx(2.0, rel=0.3)
    assert np.std(errors) < 2.0 * 0.9


def test_a_first_row_with_hardly_a_reading_is_no_preload_of_the_other_sign(read):
    """A crosshead that has moved by 1 % of its way before the load rises."""
    strain = 0.01 + STEPS
    assert not preloads(read(text(strain, 0.08 + 24.0 * STEPS), kind="elastomer"))
    (note,) = preloads(read(text(strain, 2.0 + 24.0 * STEPS), kind="elastomer"))
    assert "stress is 1760 kPa at strain 0:" in note

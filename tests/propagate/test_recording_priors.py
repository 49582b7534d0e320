"""A study through a recording draws what is known of a material: the priors of its table or of a model."""

import shutil

import jax
import numpy as np
import pytest
from study_texts import EXAMPLES

from fitting.data.recordings import read_campaign
from fitting.propagate.problem import build_problem
from fitting.propagate.reading import read_study
from fitting.propagate.responses.course import kept_rows
from fitting.specimens import specimen_of
from pneusma_jax.calibration import load_calibration

SD = {"G_m": 0.01, "G_a": 0.005}
"""Relative standard deviations of fitted moduli, a fifth and a tenth of what recordings take for granted [1]."""
PULL = EXAMPLES / "spring" / "isoresistive_3"


def alloy_file(folder):
    """An alloy whose moduli were fitted, and nothing else is uncertain."""
    lines = []
    for line in load_calibration("krl35", "alloy").path.read_text(encoding="utf-8").splitlines():
        name = line.partition(" = ")[0]
        head, mark, _ = line.partition(", prior = ")
        if name in SD:
            value = float(line.partition("value = ")[2].partition(",")[0])
            head += f", prior = {{mean = {value}, sd = {SD[name] * value}}}"
        lines.append(f"{head}}}" if mark else line)
    (folder / "alloy.toml").write_text("\n".join(lines), encoding="utf-8")


@pytest.fixture
def problem(tmp_path):
    """`problem(of_tables, sidecar)` is the study of a pulled spring with that alloy."""
    alloy_file(tmp_path)
    shutil.copy(PULL.with_suffix(".csv"), tmp_path)
    shutil.copy(PULL.parent / "campaign.toml", tmp_path)
    sidecar = PULL.with_suffix(".toml").read_text(encoding="utf-8")

    def build(named='alloy = "alloy.toml"', change=lambda text: text, priors="true"):
        (tmp_path / PULL.with_suffix(".toml").name).write_text(change(sidecar), encoding="utf-8")
        (tmp_path / "study.toml").write_text(
            'schema = "pneusma-study/1"\n[model]\nthrough = "recording"\nrecording = "isoresistive_3.csv"\n'
            f"points = 21\n{named}\n[vary]\npriors = {priors}\n",
            encoding="utf-8",
        )
        return build_problem(read_study(tmp_path / "study.toml"))

    return build


def spreads(built):
    """Relative standard deviation of each drawn number."""
    z = np.random.default_rng(0).normal(size=(20_000, len(built.inputs.names)))
    values = built.inputs.values(z)
    return dict(zip(built.inputs.value_names, values.std(axis=0) / np.abs(values.mean(axis=0)), strict=True))


def own_alloy(text):
    """The sidecar with that alloy, and without tolerances."""
    head = text.partition("[tolerance]")[0]
    return head.replace('alloy = "krl35"', 'alloy = "alloy.toml"')


def test_a_fitted_alloy_varies_as_its_table_says(problem):
    found = spreads(problem(priors='["alloy"]'))
    assert found == {name: pytest.approx(sd, rel=0.03) for name, sd in SD.items()}


def test_the_recordings_own_alloy_varies_as_its_table_says(problem):
    found = spreads(problem("", own_alloy))
    assert {name: found[name] for name in SD} == {n: pytest.approx(sd, rel=0.03) for n, sd in SD.items()}
    assert found["wire_diameter"] == pytest.approx(0.02, rel=0.03)  # dimensions keep their tolerances


def test_a_stated_tolerance_of_the_own_alloy_comes_first(problem):
    found = spreads(problem("", lambda text: own_alloy(text) + "[tolerance]\nG_a = 0.04\n"))
    assert found["G_a"] == pytest.approx(0.04, rel=0.03) and found["G_m"] == pytest.approx(SD["G_m"], rel=0.03)


def test_a_model_of_the_same_recording_keeps_its_errors(problem, tmp_path):
    """Nothing is fitted here, so that errors from these very recordings are not counted twice."""
    title = read_campaign(PULL.with_suffix(".csv")).title
    (tmp_path / "mine.toml").write_text(
        'schema = "pneusma-model/1"\nname = "mine"\n[base]\nalloy = "krl35"\n'
        'G_a = {value = 15.0, unit = "GPa", status = "fitted", '
        f'source = "Fitted to {title}", prior = {{mean = 15.0, sd = 0.15}}}}\n',
        encoding="utf-8",
    )
    built = problem('model = "mine.toml"')
    assert spreads(built)["G_a"] == pytest.approx(0.01, rel=0.03)


def test_bands_hold_truths_that_are_drawn_from_the_priors(problem):
    """Of 400 springs with moduli from the table's priors, 90 % lie in the band of 90 %, to three standard errors."""
    built, random = problem(priors='["alloy"]'), np.random.default_rng(3)
    values = built.inputs.values(random.normal(size=(2000, len(built.inputs.names))))
    low, high = np.quantile(built.evaluator(values)[0][:, built.columns.of("force_N")], [0.05, 0.95], axis=0)
    nominal = load_calibration("krl35", "alloy").values()
    drawn = {n: nominal[n] * (1.0 + sd * random.normal(size=400)) for n, sd in SD.items()}
    spring = specimen_of("spring")
    rows = spring.rows_for(read_campaign(PULL.with_suffix(".csv")))[0]
    there = np.flatnonzero(np.asarray(rows.mask))
    force = np.asarray(jax.jit(jax.vmap(lambda own: spring.predict(own, rows)["force"]))(drawn))
    force = force[:, there[kept_rows(len(there), 21)]]
    stretched = np.ptp(force, axis=0) > 1e-3
    assert stretched.sum() >= 5
    share = np.mean((low <= force) & (force <= high), axis=0)[stretched]
    np.testing.assert_allclose(share, 0.9, atol=3.0 * np.sqrt(0.9 * 0.1 / 400))

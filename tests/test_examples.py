"""The two examples: the design holds when solved anew, the samples follow the priors, the figure is there."""

import runpy
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import kstest, truncnorm

import pneusma_jax as pj

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).resolve().parents[1] / "notebooks" / "examples"


@pytest.fixture(scope="module")
def design():
    return runpy.run_path(str(EXAMPLES / "design_by_gradient.py"))


@pytest.fixture(scope="module")
def band():
    return runpy.run_path(str(EXAMPLES / "uncertainty_band.py"))


def test_the_design_has_the_wanted_curvature_and_length(design, capsys):
    thickness, coils = design["main"](["--curvature", "50"])
    body = pj.make_actuator(
        "pneusma2", wall_thickness=thickness, active_coils=coils, free_length=coils * design["PITCH"]
    )
    found = pj.solve(body, 30e3, (pj.MartensiteFraction(1.0), pj.MartensiteFraction(0.3)))
    assert float(found.curvature) == pytest.approx(50.0, rel=1e-6)
    assert float(found.length) == pytest.approx(56e-3, rel=1e-6)
    assert "as made: 49.98" in capsys.readouterr().out


def test_the_gradient_it_prints_is_right(design):
    wanted, miss = jnp.asarray([50.0, 56e-3]), design["miss"]
    loss = jax.jit(lambda x: jnp.sum(miss(x, wanted) ** 2))
    slope = jax.grad(loss)(jnp.zeros(2))
    numeric = [(loss(h) - loss(-h)) / 2e-5 for h in 1e-5 * jnp.eye(2)]
    np.testing.assert_allclose(slope, jnp.stack(numeric), rtol=1e-6)


def test_a_design_that_is_not_there_is_said_so(design):
    with pytest.raises(SystemExit, match="No such design was found"):
        design["main"](["--curvature", "-40"])


def test_samples_follow_the_priors(band):
    drawn = band["draw"]("krl35", 4000, jax.random.key(1))
    table = pj.load_calibration("krl35").quantities
    assert set(drawn) == {name for name, quantity in table.items() if quantity.prior}
    for name in ("G_m", "gamma_L", "gR_decay", "alpha_1"):
        p = table[name].prior
        law = truncnorm((p.min - p.mean) / p.sd, (p.max - p.mean) / p.sd, p.mean, p.sd)
        assert kstest(np.asarray(drawn[name]), law.cdf).pvalue > 1e-3, name
    assert abs(np.corrcoef(drawn["G_m"], drawn["G_a"])[0, 1]) < 0.06


def test_the_band_is_drawn_and_repeats_with_its_seed(band, tmp_path, capsys):
    figure = tmp_path / "band.png"
    first = band["main"](["--samples", "40", "--seed", "3", "--figure", str(figure)])
    assert figure.read_bytes().startswith(b"\x89PNG") and "440 equilibria" in capsys.readouterr().out
    assert first.shape == (40, 11) and np.all(np.isfinite(first))
    again = band["main"](["--samples", "40", "--seed", "3", "--figure", str(figure)])
    np.testing.assert_array_equal(first, again)
    spread = np.std(first, axis=0)
    assert np.all(spread > 1.0) and np.all(np.median(first, axis=0) > 20.0)


def test_a_specimen_at_the_priors_means_is_the_nominal_one(band):
    means = [
        {name: jnp.asarray(q.value) for name, q in pj.load_calibration(table).quantities.items() if q.prior}
        for table in ("krl35", "dragon_skin_10_fast", "pneusma2")
    ]
    nominal = pj.make_actuator("pneusma2")
    cold, warm = pj.MartensiteFraction(1.0), pj.MartensiteFraction(band["HOT"])
    expected = [pj.solve(nominal, pressure, (cold, warm)).curvature for pressure in band["PRESSURES"][[0, 6]]]
    np.testing.assert_allclose(band["specimen"](*means)[jnp.asarray([0, 6])], jnp.stack(expected), rtol=1e-9)

"""The joint posterior of several specimens, against exact integrals."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.calibrate.result import Estimate
from fitting.characterise import characterise
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.report import render
from fitting.report.posterior.hierarchy import content, report_of
from fitting.sample import Settings, Target, hierarchy, sample
from fitting.sample.hierarchy import Together, joint_target, own_value, sample_together, shared_constants
from fitting.sample.side_by_side import side_by_side
from fitting.specimens.rows import Rows, numbers, stack
from fitting.synthesise import synthesise, write_synthetic
from pneusma_jax.errors import InputError

MEAN, SD, ERROR = 1.0, 2.0, 0.3
MEASURED = np.array([0.2, 1.1, 2.6])


def away(values, data):
    """A constant, and a specimen's own wall, measured once each and once together."""
    x, own = values["x"], values["wall_thickness"]
    return jnp.stack([(x - data["y"]) / ERROR, own / 0.1])


def specimens(scale="linear"):
    entries = [
        Parameters(
            Parameter("x", y, prior=Prior(MEAN, SD, *((1e-3, 50.0) if scale == "log" else ())), scale=scale),
            Parameter("wall_thickness", 0.0, prior=Prior(0.0, 1.0)),
        )
        for y in MEASURED
    ]
    targets = [
        Target.from_residual(away, own, {"y": jnp.asarray(y)})
        for own, y in zip(entries, MEASURED, strict=True)
    ]
    return targets, entries


def exact() -> tuple[float, float, float, np.ndarray]:
    """Mean and sd of the population's mean, mean of the spread, means of the specimens: sums over the spread.

    Given the spread, everything is Gaussian.
    """
    spread = np.geomspace(1e-3 * SD, 10.0 * SD, 4000)
    width = np.gradient(spread)
    total = ERROR**2 + spread**2
    precision = 1.0 / SD**2 + len(MEASURED) / total
    centre = (MEAN / SD**2 + MEASURED.sum() / total) / precision
    square = (MEASURED**2).sum() / total + MEAN**2 / SD**2 - precision * centre**2
    logs = -0.5 * (len(MEASURED) * np.log(total) + np.log(precision) + square) - 0.5 * (spread / SD) ** 2
    weight = np.exp(logs - logs.max()) * width
    weight /= weight.sum()
    mean = weight @ centre
    own = weight @ (centre[:, None] + (spread**2 / total)[:, None] * (MEASURED[None, :] - centre[:, None]))
    return mean, np.sqrt(weight @ (1.0 / precision + centre**2) - mean**2), weight @ spread, own


@pytest.fixture(scope="module")
def together():
    targets, entries = specimens()
    target, parameters = joint_target(targets, entries)
    posterior = sample(target, parameters, Settings(sampler="nuts", seed=2, ensembles=2, warm_up=200))
    problems = tuple(SimpleNamespace(kind="tube", parameters=own) for own in entries)
    fits = tuple(SimpleNamespace(parameters={"x": Estimate(y, ERROR, "1", False)}) for y in MEASURED)
    return Together(("A", "B", "C"), problems, fits, posterior)


def test_specimens_are_drawn_to_their_mean_as_far_as_they_should(together):
    posterior, found = together.posterior, together.posterior.summary["x"]
    assert posterior.converged, posterior.verdict
    mean, sd, spread, own = exact()
    assert abs(found.mean - mean) < 4.0 * found.mcse and found.sd == pytest.approx(sd, rel=0.15)
    assert abs(posterior.summary["x_spread"].mean - spread) < 4.0 * posterior.summary["x_spread"].mcse
    np.testing.assert_allclose(together.shared["x"].together, own, atol=0.05)
    for k in range(len(MEASURED)):
        assert posterior.summary[f"wall_thickness_in_{k + 1}"].sd == pytest.approx(0.0995, rel=0.15)


def test_the_report_shows_population_specimens_and_pooling(together):
    shared = together.shared
    assert list(shared) == ["x"] and 0.0 < shared["x"].pooling < 0.5  # they differ by far more than the error
    report = render.text(report_of(together))
    assert "Joint posterior of 3 campaigns" in report and "drawn to the mean" in report
    assert render.documents(report_of(together))["report.json"]
    assert content(together)["constants"]["x"]["specimens"]["B"]["alone"] == MEASURED[1]


def recording(y, specimen):
    """Readings of a constant as a recording of their own length."""
    ones = np.ones(len(y))
    return Rows(
        mask=ones > 0.0, time=np.arange(len(y)) * 1.0, inputs={}, measured={"y": np.asarray(y, float)},
        weight={"y": ones / ERROR}, base={"x": np.asarray(0.0)}, extra={}, specimen=np.asarray(specimen),
    )  # fmt: skip


def misfit(values, stacked):
    """Weighted misfit of every recording, by a loop that only forward mode can differentiate."""

    def one(rows):
        x = numbers(values, rows)["x"]
        root = jax.lax.while_loop(lambda s: jnp.abs(s**2 - x) > 1e-13, lambda s: 0.5 * (s + x / s), x)
        return rows.weight["y"] * (root**2 - rows.measured["y"])

    return jax.vmap(one)(stacked)


@pytest.mark.slow
def test_campaigns_of_any_length_are_one_program_and_their_likelihoods_add_up():
    lengths = ((3, 5), (40,), (7, 2, 33))
    drawn = np.random.default_rng(3)
    rows = [stack([recording(drawn.normal(1.0, 0.2, n), 1) for n in own]) for own in lengths]
    entries = [Parameters(Parameter("x", 1.0, prior=Prior(1.0, 0.5, 0.1, 9.0))) for _ in rows]
    targets = [Target.from_residual(misfit, own, data) for own, data in zip(entries, rows, strict=True)]
    (form,) = side_by_side(targets)
    assert form.members == (0, 1, 2)
    target, _ = joint_target(targets, entries)
    names, point = target.names, np.array([1.1, 0.3, 0.4, -0.7, 1.3])
    assert names == ("x", "x_spread", "x_of_1", "x_of_2", "x_of_3")
    point[1] = np.log(point[1])
    own = 1.1 + 0.3 * point[2:]
    alone = sum(
        float(t.likelihood(t.values(jnp.array([x])), t.data)) for t, x in zip(targets, own, strict=True)
    )
    likelihood = lambda z: target.likelihood(target.values(z), target.data)  # noqa: E731
    assert float(likelihood(jnp.asarray(point))) == pytest.approx(alone, rel=1e-9)
    rows_of = lambda z: target.likelihood.residual(target.values(z), target.data)  # noqa: E731
    assert -0.5 * float(jnp.sum(rows_of(jnp.asarray(point)) ** 2)) == pytest.approx(alone, rel=1e-9)
    slope = np.asarray(jax.grad(likelihood)(jnp.asarray(point)))
    steps = 1e-6 * np.eye(5)
    differences = [(likelihood(point + h) - likelihood(point - h)) / 2e-6 for h in steps]
    np.testing.assert_allclose(slope, differences, rtol=1e-5, atol=1e-4)
    np.testing.assert_allclose(jax.jacfwd(likelihood)(jnp.asarray(point)), slope, rtol=1e-9)


def test_campaigns_with_other_parameters_are_another_form():
    (alone, *_), entries = specimens()
    other = Parameters(
        Parameter("x", 1.0, prior=Prior(MEAN, SD)), Parameter("wall_thickness", 0.0, vary=False)
    )
    held = Target.from_residual(away, other, {"y": jnp.asarray(0.5)})
    assert [form.members for form in side_by_side([alone, held, alone])] == [(0, 2), (1,)]


def product(values, data):
    """The product of a shared constant and a dimension, told a hundred times better than each of them."""
    return jnp.stack([(values["x"] * values["wall_thickness"] - data["y"]) / 1e-3])


def of_a_product(correlated):
    """Campaigns whose product is known; their fits say so, or not."""
    entries, targets = [], []
    for y in (0.9, 1.0, 1.15):
        own = Parameters(
            Parameter("x", 1.0, prior=Prior(1.0, 0.3, 0.1, 9.0), standard_error=0.08),
            Parameter("wall_thickness", y, prior=Prior(1.0, 0.1, 0.2, 4.0), standard_error=0.08 * y),
        )
        if correlated:
            own["x"].set(correlations={"wall_thickness": -1.0 + 1e-7})
            own["wall_thickness"].set(correlations={"x": -1.0 + 1e-7})
        entries.append(own)
        targets.append(Target.from_residual(product, own, {"y": jnp.asarray(y)}))
    return joint_target(targets, entries)[0]


def test_a_dimension_follows_the_constant_that_it_trades_with():
    """The same density in coordinates in which the valley is straight: it falls by what priors say alone."""
    bent, straight = of_a_product(False), of_a_product(True)
    assert bent.names == straight.names and not any("wall" in name for name in straight.prior_names)
    point = np.array([1.05, np.log(0.1), 0.4, -0.8, 1.2, 0.9, 1.0, 1.15])
    x = 1.05 + 0.1 * point[2:5]
    there = point.copy()
    there[5:] /= x
    dense, plain = (jax.jit(lambda p, t=target: t.log_probability(p)) for target in (bent, straight))
    wanted = float(dense(there)) - np.log(x).sum()
    assert float(plain(point)) == pytest.approx(wanted, rel=1e-5)
    fits = np.array([1.0, np.log(0.1), 0.0, 0.0, 0.0, 0.9, 1.0, 1.15])
    fallen = [float(found(fits) - found(point)) for found in (dense, plain)]
    assert fallen[0] > 1000.0 and abs(fallen[1]) < 10.0


@pytest.mark.slow
def test_three_tubes_are_drawn_together(tmp_path):
    """Each tube's own estimate holds the prior; without it they are farther apart than all together."""
    fits = {}
    for seed in (1, 2, 3):
        write_synthetic(synthesise("tube", seed=seed), tmp_path / f"t{seed}")
        fits[f"t{seed}"] = characterise(tmp_path / f"t{seed}")
    together = sample_together(fits, seed=1, progress=False)
    assert together.converged, together.posterior.verdict
    assert together.posterior.diagnostics["gradients_per_draw"] < 64.0  # the valley is straight
    stiffness = together.shared["silicone_stiffness"]
    assert len(stiffness.specimens) == 6 and 0.1 < stiffness.pooling < 0.9
    prior = fits["t1"].fitted["silicone_stiffness__1"].prior
    told = stiffness.alone_sd**-2.0 - prior.sd**-2.0
    without = (stiffness.alone / stiffness.alone_sd**2 - prior.mean / prior.sd**2) / told
    assert np.ptp(stiffness.together) < 0.8 * np.ptp(without)


def test_a_positive_constant_is_spread_by_ratios():
    targets, entries = specimens("log")
    target, parameters = joint_target(targets, entries)
    values = parameters.valuesdict()
    back = [
        float(own_value(entries[0]["x"], values["x"], values["x_spread"], values[f"x_of_{k + 1}"]))
        for k in range(len(MEASURED))
    ]
    np.testing.assert_allclose(back, MEASURED, rtol=1e-6)  # it begins where the single fits ended
    assert values["x"] == pytest.approx(np.exp(np.log(MEASURED).mean()))
    assert bool(np.isfinite(target.log_probability(target.pack(parameters))))


def test_specimens_of_one_campaign_are_specimens_too():
    """A campaign may have several: they share a constant with each other as with those of other campaigns."""
    free = lambda name, prior=Prior(1.0, 0.1): Parameter(name, 1.0, prior=prior)  # noqa: E731
    first = Parameters(
        free("silicone_stiffness__1"), free("silicone_stiffness__2"), free("wall_thickness__1")
    )
    second = Parameters(free("silicone_stiffness"), free("lonely"), free("gain", None))
    assert shared_constants([first, second]) == {
        "silicone_stiffness": [
            (0, "silicone_stiffness__1"),
            (0, "silicone_stiffness__2"),
            (1, "silicone_stiffness"),
        ]
    }


def test_one_specimen_is_no_hierarchy(monkeypatch):
    alone = SimpleNamespace(kind="tube", parameters=specimens()[1][0])
    monkeypatch.setattr(hierarchy, "sampling_problem", lambda fit: alone)
    with pytest.raises(InputError, match="two specimens or more"):
        sample_together({"a": None})
    with pytest.raises(InputError, match="of one kind, not tube and wire"):
        kinds = iter(["tube", "wire"])
        monkeypatch.setattr(hierarchy, "sampling_problem", lambda fit: SimpleNamespace(kind=next(kinds)))
        sample_together({"a": None, "b": None})

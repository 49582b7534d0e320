"""The joint posterior of several specimens, against exact integrals."""

from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.calibrate.result import Estimate
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.report import render
from fitting.report.posterior.hierarchy import content, report_of
from fitting.sample import Settings, Target, hierarchy, sample
from fitting.sample.hierarchy import Together, joint_target, own_value, sample_together, shared_constants
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

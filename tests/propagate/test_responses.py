"""Rows of a study are what the model itself says, whatever they go through."""

import dataclasses
from importlib.resources import files

import h5py
import numpy as np
import pytest
from study_texts import EXAMPLES, tube_study

import pneusma_jax as pj
from fitting.control import Converter, Plant, usual_loop
from fitting.data.protocols.reading import load_protocol
from fitting.data.recordings import read_campaign
from fitting.propagate import build_problem, propagate, read_study
from fitting.propagate.inputs_of import read_draws
from fitting.simulate.protocol import run_protocol
from fitting.simulate.state import described_actuator
from fitting.specimens.registry import specimen_of
from pneusma_jax.errors import InputError

STATE = """
schema = "pneusma-study/1"
[model]
through = "state"
design = "pneusma2"
pressure_kPa = {from = 10.0, to = 40.0, points = 3}
xi0_2 = 0.4
"""


def problem_of(write, text):
    return build_problem(read_study(write(text)))


@pytest.fixture
def state(write):
    return problem_of(write, STATE + "[vary]\npriors = true\n")


@pytest.fixture(params=["tube", pytest.param("springs", marks=pytest.mark.slow)])
def nominal(request, write):
    """A study of states with or without springs, and the state of the tables at 25 kPa."""
    if request.param == "springs":
        found = pj.solve(pj.make_actuator("pneusma2"), 25e3, (pj.MartensiteFraction(1.0), pj.MartensiteFraction(0.4)))
        return problem_of(write, STATE + "[vary]\npriors = true\n"), found
    tube = STATE.replace("pneusma2", "pneuflex_s").replace("xi0_2 = 0.4\n", "")
    return problem_of(write, tube + "[vary]\npriors = true\n"), pj.solve(pj.make_actuator("pneuflex_s"), 25e3)


def test_priors_of_all_tables_vary_but_for_what_follows_others(state):
    names = state.inputs.names
    assert {"G_m", "silicone_stiffness", "wall_thickness", "prestrain"} <= set(names)
    assert not {"free_length", "attached_length"} & set(names), "these follow coils and pitch, and the tube"
    assert len(state.notices) == 2 and all("own prior is left out" in sentence for sentence in state.notices)
    assert {"alloy.density", "silicone.density"} <= set(names), "a name of two tables has its table before it"


def test_a_table_among_the_dimensions_is_read_and_told(write):
    """It took the place of the one that `[model]` names, in silence."""
    here, there = 'alloy = "krl45"\n', 'geometry = {alloy = "krl45"}\n'
    told = [problem_of(write, STATE + more + "[vary]\npriors = true\n") for more in (here, there, here + there)]
    line = "alloy is named in [model] geometry; name it in [model] itself"
    assert [line in problem.notices for problem in told] == [False, True, True]
    expected = pj.load_calibration("krl45").quantities["ka_1"].value
    assert [problem.response.variables["ka_1"].value for problem in told] == [expected] * 3


def test_a_table_among_the_dimensions_lies_beside_the_study(write, monkeypatch, tmp_path):
    write((files("calibration_data") / "krl45.toml").read_text(), "mine.toml")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    study = STATE + 'geometry = {alloy = "mine.toml"}\n[vary]\npriors = true\n'
    expected = pj.load_calibration("krl45").quantities["ka_1"].value
    assert problem_of(write, study).response.variables["ka_1"].value == expected


@pytest.mark.slow
def test_rows_of_states_are_those_of_the_model(state):
    random = np.random.default_rng(0)
    values = state.inputs.values(random.normal(size=(2, len(state.inputs.names))))
    y, status = state.evaluator(values)
    assert np.all(status == 0) and np.all(np.isfinite(y))
    for row, given in zip(y, values, strict=True):
        known = dict(zip(state.inputs.value_names, given, strict=True))
        table = pj.load_calibration("krl35")
        alloy = pj.load_alloy(table)
        changes = {n: x for n, x in known.items() if hasattr(alloy, n) and n != "density"}
        alloy = dataclasses.replace(alloy, **changes)
        silicone = dataclasses.replace(pj.load_silicone(), stiffness=known["silicone_stiffness"])
        sizes = {n: known[n] for n in ("outer_diameter", "wall_thickness", "length", "wire_diameter",
                                       "mandrel_diameter", "initial_pitch", "active_coils", "prestrain")}  # fmt: skip
        body = pj.make_actuator("pneusma2", alloy, silicone, pj.design_geometry("pneusma2", **sizes))
        drive = (pj.MartensiteFraction(1.0), pj.MartensiteFraction(0.4))
        for k, pressure in enumerate((10e3, 25e3, 40e3)):
            found = pj.solve(body, pressure, drive)
            assert row[state.columns.of("curvature_1pm")][k] == pytest.approx(float(found.curvature), rel=1e-9)
            assert row[state.columns.of("force_2_N")][k] == pytest.approx(float(found.springs[1].force), rel=1e-9)


def test_the_nominal_row_is_that_of_the_tables(nominal):
    state, found = nominal
    assert state.nominal[state.columns.of("curvature_1pm")][1] == pytest.approx(float(found.curvature), rel=1e-9)


@pytest.mark.slow
def test_rows_that_cannot_be_solved_say_why_and_stop_none(write):
    text = STATE.replace("pressure_kPa = {from = 10.0, to = 40.0, points = 3}", "pressure_kPa = 20.0")
    problem = problem_of(write, text + "[input]\nxi0_2 = {low = 0.9, high = 1.1}\n")
    y, status = problem.evaluator(np.array([[0.95], [1.05], [np.nan], [1.0]]))
    assert list(status) == [0, pj.Status.fraction_out_of_range, pj.Status.input_not_finite, 0]
    assert np.array_equal(np.isfinite(y[:, 0]), [True, False, False, True])


@pytest.mark.slow
def test_a_protocol_is_that_of_simulate(write):
    text = """
schema = "pneusma-study/1"
[model]
through = "protocol"
protocol = "thermal_cycle"
points = 11
[input]
G_m = {mean = 3.0, sd = 0.3, unit = "GPa"}
[[output]]
name = "curvature_1pm"
"""
    problem = problem_of(write, text)
    protocol = load_protocol("thermal_cycle")
    course = run_protocol(protocol, described_actuator(None, {}))
    kept = np.searchsorted(protocol.time, problem.columns.driver.values)
    expected = course.outputs["model_curvature_1pm"][kept]
    np.testing.assert_allclose(problem.nominal, expected, rtol=1e-8, atol=1e-10)
    assert problem.columns.driver.name == "time_s" and len(expected) == 11
    assert {"pressure_offset", "pressure_gain", "xi0_2_offset"} <= set(problem.response.variables)


@pytest.mark.slow
def test_a_chain_is_that_of_the_model(write):
    text = """
schema = "pneusma-study/1"
[model]
through = "chain"
design = "orthogonal_chain"
pressure_kPa = 10.0
segment_2 = {xi0_1 = 0.4}
[input]
G_m = {mean = 3.0, sd = 0.3, unit = "GPa"}
[[output]]
name = "tip_x_mm"
[[output]]
name = "tip_z_mm"
"""
    from fitting.simulate.chain_state import chain_state
    from pneusma_jax.serial_chain.designs import load_chain

    problem = problem_of(write, text)
    design = load_chain("orthogonal_chain")
    given = [{"xi0_1": 0.4} if k == 1 else {} for k in range(len(design.designs))]
    found = chain_state(design, {}, 10e3, given)
    np.testing.assert_allclose(problem.nominal, found.tip[[0, 2]], rtol=1e-6, atol=1e-9)


def test_a_recording_of_a_tube_has_its_tolerances_and_its_fit(write):
    problem = problem_of(write, tube_study(9, "[vary]\npriors = true"))
    tube = specimen_of("tube")
    rows = tube.rows_for(read_campaign(EXAMPLES / "tube" / "inflation_1.csv"))[0]
    expected = 1e3 * np.asarray(tube.predict({}, rows)["length"])
    np.testing.assert_allclose(problem.nominal[[0, -1]], expected[np.asarray(rows.mask)][[0, -1]], rtol=1e-12)
    assert problem.columns.driver.name == "pressure_kPa" and problem.inputs.names


def test_derivatives_through_a_tube_are_those_of_differences(write):
    problem = problem_of(write, tube_study(3, "[vary]\npriors = true"))
    here = problem.inputs.values(np.full((1, len(problem.inputs.names)), 0.3))
    value, slope = problem.evaluator.with_gradient(lambda y: y[1], here)
    step = 1e-6 * here[0]
    rows = np.concatenate([here + np.diag(step), here - np.diag(step)])
    ends = problem.evaluator(rows)[0][:, 1].reshape(2, -1)
    np.testing.assert_allclose(slope[0], (ends[0] - ends[1]) / (2.0 * step), rtol=1e-6)
    assert value[0] == pytest.approx(problem.evaluator(here)[0][0, 1], rel=1e-12)


def posterior(folder, table, units):
    folder.mkdir()
    with h5py.File(folder / "posterior.nc", "w") as file:
        group = file.create_group("posterior")
        for name, values in table.items():
            data = group.create_dataset(name, data=values.reshape(4, -1))
            if name in units:
                data.attrs["unit"] = units[name]
    return folder


@pytest.fixture
def sampled(tmp_path):
    random = np.random.default_rng(1)
    shared = random.normal(size=4000)
    table = {"a": 1.0 + 0.5 * shared, "b": np.exp(0.8 * shared + 0.6 * random.normal(size=4000))}
    return posterior(tmp_path / "sampled", table, {}), table


POSTERIOR = """
schema = "pneusma-study/1"
[model]
through = "expression"
outputs = {y = "a + 0*c", z = "b", product = "a*b"}
[input]
a = {mean = 0.0, sd = 1.0}
b = {mean = 0.0, sd = 1.0}
c = {mean = 0.0, sd = 1.0}
[sampling]
rows = 20000
[vary]
posterior = "sampled"
"""


def test_draws_of_a_posterior_and_inputs_of_the_study_do_not_name_the_same_number(write, sampled):
    with pytest.raises(InputError, match="is in the posterior, and varies otherwise"):
        problem_of(write, POSTERIOR)


TUBE_POSTERIOR = tube_study(3, """[vary]
posterior = "own"
""")


def test_a_posterior_of_several_specimens_gives_the_numbers_of_the_one_that_is_meant(write, tmp_path):
    random = np.random.default_rng(0)
    table = {name: 1.0 + 0.01 * k + 0.001 * random.normal(size=400) for k, name in enumerate(
        ("wall_thickness__1", "silicone_stiffness__1", "wall_thickness__2", "silicone_stiffness__2", "zero"))}  # fmt: skip
    posterior(tmp_path / "own", table, {"wall_thickness__1": "mm", "wall_thickness__2": "mm"})
    with pytest.raises(InputError, match="posterior is of 2 specimens; say in .vary. which one is meant"):
        problem_of(write, TUBE_POSTERIOR)
    with pytest.raises(InputError, match="posterior_specimen = 3, but .* is of 2"):
        problem_of(write, TUBE_POSTERIOR + "posterior_specimen = 3\n")
    with pytest.raises(InputError, match="the model has no number 'zero'.*; state in .model. the alloy, material or model that its fit has, or name it in .vary. leave_out"):
        problem_of(write, TUBE_POSTERIOR + "posterior_specimen = 2\n")
    problem = problem_of(write, TUBE_POSTERIOR + 'posterior_specimen = 2\nleave_out = ["zero"]\n')
    means = dict(zip(problem.inputs.draws.names, problem.inputs.draws.table.mean(axis=0), strict=True))
    assert set(means) == {"wall_thickness", "silicone_stiffness"}
    assert means["wall_thickness"] == pytest.approx(1e-3 * table["wall_thickness__2"].mean())
    assert means["silicone_stiffness"] == pytest.approx(table["silicone_stiffness__2"].mean())
    assert any("only the numbers of specimen 2" in sentence for sentence in problem.notices)


def test_form_with_whole_draws_is_refused_before_any_row_is_computed(write, sampled):
    text = POSTERIOR[: POSTERIOR.index("[input]")] + '[vary]\nposterior = "sampled"\n'
    limited = text.replace("a + 0*c", "a") + "[[limit]]\non = 'y'\nabove = 3.0\n[rare]\n"
    with pytest.raises(InputError, match="posterior_as = 'copula', or methods = \\['subset'\\]"):
        problem_of(write, limited)
    assert problem_of(write, limited + "methods = ['subset']\n").study.rare.methods == ("subset",)


@pytest.mark.parametrize("how", ["draws", "copula"])
def test_a_posterior_keeps_its_marginals_and_its_correlation(write, sampled, tmp_path, how):
    folder, table = sampled
    path = tmp_path / "state.toml"
    text = STATE.replace("{from = 10.0, to = 40.0, points = 3}", "20.0")
    renamed = {"G_m": 3e9 + 1e8 * table["a"], "wall_thickness": 1e-3 + 1e-6 * table["b"]}
    units = {"G_m": "GPa", "wall_thickness": "mm"}
    posterior(tmp_path / "own", {"G_m": renamed["G_m"] / 1e9, "wall_thickness": renamed["wall_thickness"] * 1e3}, units)
    path.write_text(text + f'[vary]\nposterior = "own"\nposterior_as = "{how}"\n')
    inputs = build_problem(read_study(path)).inputs
    z = np.random.default_rng(0).normal(size=(50_000, len(inputs.names)))
    values = inputs.values(z @ inputs.lower.T)
    for k, name in enumerate(inputs.value_names):
        expected = np.quantile(renamed[name], [0.05, 0.5, 0.95])
        np.testing.assert_allclose(np.quantile(values[:, k], [0.05, 0.5, 0.95]), expected, rtol=2e-3)
    ranks = np.argsort(np.argsort(values, axis=0), axis=0)
    original = np.argsort(np.argsort(np.stack([renamed[n] for n in inputs.value_names], 1), axis=0), axis=0)
    assert np.corrcoef(ranks.T)[0, 1] == pytest.approx(np.corrcoef(original.T)[0, 1], abs=0.02)
    assert inputs.names == (("posterior",) if how == "draws" else inputs.value_names)


@pytest.mark.slow
def test_a_posterior_band_holds_fresh_recordings_as_often_as_it_says(tmp_path):
    """200 campaigns of a line with noise, whose posterior is exact; the truth is drawn from its prior."""
    places, noise, held = np.linspace(0.0, 1.0, 5), 0.3, []
    lines = ", ".join(f'y{k} = "a + {x} * b"' for k, x in enumerate(places))
    outputs = "".join(f'[[output]]\nname = "y{k}"\nnoise = {noise}\n' for k in range(5))
    text = f"""
schema = "pneusma-study/1"
[model]
through = "expression"
outputs = {{{lines}}}
[vary]
posterior = "draws"
[sampling]
rows = 2000
{outputs}"""
    for seed in range(200):
        random = np.random.default_rng(seed)
        folder = tmp_path / str(seed)
        folder.mkdir()
        truth, x = random.normal(size=2), random.random(8)
        design = np.stack([np.ones(8), x], axis=1)
        measured = design @ truth + noise * random.normal(size=8)
        precision = np.eye(2) + design.T @ design / noise**2
        covariance = np.linalg.inv(precision)
        draws = random.multivariate_normal(covariance @ design.T @ measured / noise**2, covariance, 4000)
        posterior(folder / "draws", {"a": draws[:, 0], "b": draws[:, 1]}, {})
        (folder / "study.toml").write_text(text)
        low, high = propagate(folder / "study.toml", folder / "out").quantiles([0.05, 0.95])
        fresh = truth[0] + truth[1] * places + noise * random.normal(size=5)
        held.append(np.mean((low <= fresh) & (fresh <= high)))
    assert 0.87 <= np.mean(held) <= 0.93


def test_a_file_that_is_no_posterior_is_named(tmp_path):
    (tmp_path / "posterior.nc").write_bytes(b"nothing")
    with pytest.raises(InputError, match="cannot be read as a posterior of `pneusma posterior`"):
        read_draws(tmp_path)


def test_noise_of_a_measurement_widens_its_band_and_nothing_else(write, tmp_path):
    text = """
schema = "pneusma-study/1"
[model]
through = "expression"
outputs = {y = "a"}
[input]
a = {mean = 0.0, sd = 1.0}
[[output]]
name = "y"
[[output]]
name = "measured"
of = "y"
noise = 2.0
[sampling]
rows = 20000
"""
    result = propagate(write(text), tmp_path / "out")
    assert result.summary.moments.sd == pytest.approx([1.0, np.sqrt(5.0)], rel=0.03)


LOOP = """
schema = "pneusma-study/1"
[model]
through = "closed_loop"
design = "pneusma2"
pressure_kPa = 20.0
points = 600
[noise]
resistance_ohm = 1e-3
[input.pressure]
mean = 20.0
sd = 0.2
unit = "kPa"
[[output]]
name = "curvature_1pm"
[[output]]
name = "rmse_1pm"
"""


@pytest.mark.slow
def test_a_closed_loop_is_that_of_control_and_its_controller_is_not_told(write):
    problem = problem_of(write, LOOP)
    loop, plant = usual_loop(), Plant(pj.make_actuator("pneusma2"))
    quiet = dataclasses.replace(loop, converter=Converter(noise=0.0))
    expected = quiet.run(plant, plant)
    np.testing.assert_allclose(problem.nominal[:-1], expected.curvature, rtol=1e-6, atol=1e-6)
    assert problem.nominal[-1] == pytest.approx(expected.rmse(10.0), rel=1e-6)
    assert problem.columns.driver.name == "time_s" and set(problem.inputs.names) == {"pressure", "noise"}
    given = {"pressure": np.array([20e3, 20e3, 20.5e3]), "noise": np.array([-1.0, 0.3, -1.0])}
    y = problem.evaluator(np.stack([given[name] for name in problem.inputs.value_names], axis=1))[0]
    np.testing.assert_allclose(y[0], problem.nominal)
    assert 1e-3 < np.max(np.abs(y[1] - y[0])) < 2.0, "the readings' noise moves the plant a little"
    other = quiet.driven(plant, plant, quiet.planned(plant), np.zeros((600, 2)), 20.5e3)[0].curvature
    np.testing.assert_allclose(y[2, :-1], other, rtol=1e-6, atol=1e-6)
    assert np.max(np.abs(y[2, :-1] - y[0, :-1])) > 0.1, "another pressure in the plant moves it"

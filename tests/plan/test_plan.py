"""Planning a first campaign: information is the model's own, choices maximise it, and what is written says so."""

import csv
import json
import tomllib
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from click.testing import CliRunner

import pneusma_jax as pj
from fitting.calibrate.spring.reach import STEPS, published_spring, steps_of
from fitting.cli import main
from fitting.data.publish import RECORD
from fitting.plan import plan_campaign
from fitting.plan.candidates import (
    COLD,
    HEATED,
    HELD,
    HOT,
    LATENT_ROWS,
    Candidate,
    candidates,
    courses,
    published_campaign,
)
from fitting.plan.choose import WANTED, choose, covariances, expected_sd, log_volume
from fitting.plan.information import Accuracy, held_phase, information, phase_course
from fitting.plan.knowledge import CONSTANTS, knowledge_of
from fitting.plan.rates import choose_rates, cooling_seconds, heating_seconds, minutes, rates_of
from fitting.plan.specimen import described
from fitting.report.plan.text import _lost
from pneusma_jax.calibration import load_calibration
from pneusma_jax.errors import InputError

pytestmark = pytest.mark.slow

NOISE = jnp.asarray([0.004, 0.0002])
PUBLISHED = published_spring()


@pytest.fixture(scope="module")
def known():
    return knowledge_of("krl35")


def told(known, tests, misfit=0.0, repeats=1, draws=None):
    constants = {k: jnp.asarray(v)[None] for k, v in known.nominal.items()} if draws is None else draws
    scale = jnp.asarray(known.sd)
    made = courses(tests) if isinstance(tests, list) else tests
    accuracy = Accuracy(NOISE, jnp.asarray(misfit), jnp.asarray(float(repeats)))
    return np.asarray(information(constants, known.names, scale, PUBLISHED, made, accuracy))


# --- what can be done ---------------------------------------------------------------------------------------


def test_candidates_keep_a_hot_spring_short():
    pool = candidates()
    assert len({test.name for test in pool}) == len(pool)  # files are named so
    for test in pool:
        hot = test.hold in (HOT, HEATED) or (test.hold == HELD and test.share < 0.45)
        assert max(test.strains) <= (3.45 if hot else 5.75)
    assert {test.hold for test in pool} == {COLD, HOT, HELD, HEATED}
    assert Candidate(COLD, (*STEPS, STEPS[-1])) in pool
    assert [test.hold for test in published_campaign()] == [COLD, HOT, *[HELD] * 5]


def test_steps_follow_the_wire_and_not_the_spring():
    assert steps_of(PUBLISHED) == STEPS
    other = pj.SpringGeometry(0.5e-3, 2.0e-3, 0.55e-3, 20.0, 11e-3)
    steps = steps_of(other)
    theirs = PUBLISHED.shear_strain(PUBLISHED.free_length * np.array(STEPS))
    np.testing.assert_allclose(other.shear_strain(other.free_length * np.array(steps)), theirs, rtol=0.02)
    with pytest.raises(InputError, match="are its dimensions right"):
        steps_of(pj.SpringGeometry(1e-6, 0.1, 1e-6, 5.0, 5e-6))


def test_courses_go_where_the_tests_say():
    tests = [Candidate(HELD, STEPS[:2], 0.5), Candidate(HEATED, (2.3,)), Candidate(COLD, (*STEPS, STEPS[-1]))]
    made = courses(tests)
    assert made.strain.shape[1] % LATENT_ROWS == 0
    assert made.strain.max(axis=1).tolist() == pytest.approx([2.3, 2.3, 5.75])
    assert made.strain[:, -1].tolist() == [0.0] * 3 and made.mask[2].all()
    peaks = [np.sum((s[1:-1] > s[:-2]) & (s[1:-1] > s[2:])) for s in made.strain]
    assert peaks[0] == 2 and peaks[2] == 6
    assert made.warmth[0].max() == 0.0 and made.warmth[1].max() == 1.0
    assert np.all(made.strain[1][made.warmth[1] > 0.0] == 2.3)  # heated at constant length


def test_a_held_phase_is_what_a_slow_controller_reaches(known):
    """Where some phase has the resistance it is that phase; else the heater is at the stop that the error asks for."""
    alloy = pj.Alloy(**known.nominal)
    gamma = jnp.linspace(0.0, 0.19, 100)
    for share in (0.2, 0.5, 0.9):
        phase = np.asarray(held_phase(alloy, gamma, jnp.asarray(share)))
        rest = float(alloy.rho_a(0.0) + share * (alloy.rho_m(0.0) - alloy.rho_a(0.0)))
        rho = np.asarray(alloy.resistivity(jnp.asarray(phase), gamma))
        inside = (phase > 0.0) & (phase < 1.0)
        assert inside[0]
        np.testing.assert_allclose(rho[inside], rest, rtol=1e-9)
        assert np.all(rho[phase == 1.0] <= rest + 1e-9)
        assert np.all(rho[phase == 0.0] >= rest - 1e-9)
    assert phase[-1] == 1.0  # near the cold end the set-point is lost and the wire cools
    cold = courses([Candidate(COLD, (1.15,)), Candidate(HOT, (1.15,))])
    for k, expected in enumerate((1.0, 0.0)):
        one = eqx.tree_at(lambda t: (t.hold, t.share, t.warmth), cold, (cold.hold[k], cold.share[k], cold.warmth[k]))
        assert np.all(np.asarray(phase_course(alloy, gamma[: one.warmth.size], one)) == expected)


# --- what it tells ------------------------------------------------------------------------------------------


def test_information_is_that_of_finite_differences_with_the_phase_integrated_out(known):
    """Independent: sensitivities by central differences, the phase kept as explicit unknowns of a joint precision."""
    test = Candidate(HELD, STEPS[:2], 0.6)
    ours = told(known, [test])[0, 0]
    made = courses([test])
    strain, mask = made.strain[0], made.mask[0]
    alloy = pj.Alloy(**known.nominal)
    spring = pj.Spring(PUBLISHED, alloy, PUBLISHED.free_length)
    x = 14e-3 * jnp.asarray(strain)
    course = np.asarray(held_phase(alloy, spring.shear_strain(x), jnp.asarray(0.6)))
    blocks = len(strain) // LATENT_ROWS

    def outputs(constants, deviation):
        spring = pj.Spring(PUBLISHED, pj.Alloy(**constants), PUBLISHED.free_length)
        xi0 = course + np.repeat(deviation, LATENT_ROWS)
        rows = pj.simulate_spring(spring, x, pj.MartensiteFraction(jnp.asarray(xi0))).rows
        return np.concatenate([mask * rows.force / 0.004, mask * rows.resistance / 0.0002])

    columns = []
    for name, sd in zip(known.names, known.sd, strict=True):
        step = 1e-5 * sd
        ends = [outputs({**known.nominal, name: known.nominal[name] + s * step}, np.zeros(blocks)) for s in (1, -1)]
        columns.append((ends[0] - ends[1]) / 2e-5)
    for k in range(blocks):
        step = 1e-6 * np.eye(blocks)[k]
        columns.append((outputs(known.nominal, step) - outputs(known.nominal, -step)) / 2e-6)
    design = np.stack(columns, axis=1)
    joint = design.T @ design
    n = len(known.names)
    joint[n:, n:] += np.eye(blocks) / 0.3**2
    theirs = np.linalg.inv(np.linalg.inv(joint + 1e-9 * np.eye(n + blocks))[:n, :n])
    # both as what a campaign would be left with: the bare matrices are singular in directions no test shows
    a, b = (np.linalg.inv(np.eye(n) + m) for m in (ours, theirs))
    np.testing.assert_allclose(np.sqrt(np.diag(a)), np.sqrt(np.diag(b)), rtol=0.02)


def test_one_program_serves_any_number_of_tests(known, compiled):
    tests = [*candidates()[:17], *candidates()[:3]]
    made = courses(tests)
    many = told(known, made)
    compiled.clear()
    few = told(known, jax.tree.map(lambda rows: rows[:3], made))  # others alone are shorter
    assert many.shape[1] == 20 and not compiled
    np.testing.assert_array_equal(many[:, :3], few)
    np.testing.assert_array_equal(many[:, 17:], few)


def test_information_grows_as_it_should(known):
    tests = [Candidate(COLD, STEPS[:3]), Candidate(HELD, STEPS[:3], 0.25), Candidate(HEATED, (3.45,))]
    once, twice, wrong = told(known, tests)[0], told(known, tests, repeats=2)[0], told(known, tests, misfit=0.05)[0]
    for a in once:
        assert np.linalg.eigvalsh(a).min() > -1e-6 * np.linalg.eigvalsh(a).max()
    np.testing.assert_allclose(twice, 2.0 * once, rtol=1e-6, atol=1e-6 * np.abs(once).max())
    assert np.all(np.trace(wrong, axis1=1, axis2=2) < 0.3 * np.trace(once, axis1=1, axis2=2))
    # the law errs alike in a repeat: it is worth far less than the first time
    again = told(known, tests, misfit=0.05, repeats=2)[0]
    assert np.all(np.trace(again, axis1=1, axis2=2) < 1.5 * np.trace(wrong, axis1=1, axis2=2))
    rows = {name: k for k, name in enumerate(known.names)}
    assert once[0][rows["ka_1"], rows["ka_1"]] < 1e-6  # a cold spring says nothing of austenite
    assert once[1][rows["a"], rows["a"]] > 1.0


def test_choices_beat_chance_and_their_gains_add_up(known):
    pool = [t for t in candidates(shares=(0.25, 0.5, 0.75)) if len(t.strains) in (1, 3)]
    table = np.stack([told(known, pool, 0.02, r) for r in (1, 2)], axis=2)
    times = np.array([minutes(test, 0.15) for test in pool])
    chosen = choose(table, times, known.names, WANTED, 4)
    rows = [known.names.index(name) for name in WANTED]
    volume = lambda order: float(log_volume(np.linalg.inv(covariances(table, order)[-1]), rows))  # noqa: E731
    indices = [choice.index for choice in chosen]
    start = float(log_volume(np.eye(len(known.names))[None], rows))
    assert sum(choice.gain for choice in chosen) == pytest.approx(start - volume(indices), rel=1e-9)
    random = np.random.default_rng(0)
    others = [random.choice(len(pool), 4, replace=False).tolist() for _ in range(300)]
    fair = [o for o in others if times[o].sum() <= times[indices].sum()]
    assert len(fair) > 20
    best = min(volume(o) for o in fair)
    print(f"log-volume: chosen {volume(indices):.2f}, best of {len(fair)} at random {best:.2f}")
    assert volume(indices) < best
    sd = expected_sd(table, indices)
    assert np.all(np.diff(sd, axis=0) <= 1e-12) and np.all(sd[0] == 1.0)


# --- what is known before -----------------------------------------------------------------------------------


def test_knowledge_is_the_tables_and_fills_its_gaps():
    own, anything = knowledge_of("krl35"), knowledge_of()
    table = load_calibration("krl35")
    at = {name: k for k, name in enumerate(own.names)}
    assert own.sd[at["G_m"]] == table.quantities["G_m"].prior.sd
    assert own.mean[at["beta_1"]] == 21.9987 and 5.0 < own.sd[at["beta_1"]] < 12.0
    assert "T_mid" not in own.names and "gamma_max" not in own.names
    thick = knowledge_of(None, 0.5e-3)
    for name in ("rho_mean", "alpha_1", "rho_span"):
        assert thick.mean[at[name]] == pytest.approx(0.25 * anything.mean[at[name]])
        assert thick.sd[at[name]] == pytest.approx(0.25 * anything.sd[at[name]])
    draws = anything.draws(12, 3)
    assert set(draws) == set(CONSTANTS) and draws["a"][0] == anything.mean[at["a"]]
    again = anything.draws(12, 3)
    gamma = jnp.linspace(0.0, 0.195, 200)
    for k in range(12):
        alloy = pj.Alloy(**{name: values[k] for name, values in draws.items()})
        assert all(np.all(np.diff(alloy.shear_stress(gamma, x, 0.0)) > 0.0) for x in (0.0, 1.0))
        assert again["G_m"][k] == draws["G_m"][k]


def test_slow_pulls_are_asked_for_near_the_cold_end(known):
    """There the wire holds its resistance only by cooling, and a warm wire cools slowly."""
    spring = pj.Spring(PUBLISHED, pj.Alloy(**known.nominal), PUBLISHED.free_length)
    tests = [Candidate(HELD, STEPS[:3], 0.25), Candidate(HELD, STEPS, 0.875), Candidate(COLD, (1.15,))]
    near_hot, near_cold, cold = choose_rates(spring, tests, 0, 2e-4)
    assert near_cold < near_hot and near_cold <= cold <= near_hot


def test_a_resistance_that_no_rate_holds_is_told_with_what_forbids_it(known):
    """The slowest rate had been taken without a word."""
    spring = pj.Spring(PUBLISHED, pj.Alloy(**known.nominal), PUBLISHED.free_length)
    tests = [Candidate(HELD, STEPS, 0.125), Candidate(HELD, STEPS, 0.5)]
    found = rates_of(spring, tests, 0, 2e-4)
    assert found.lost == {0.125: True} and found.values[0] < found.values[1]
    (said,) = _lost(SimpleNamespace(lost=found.lost))
    assert "share 0.125" in said and "still air cools this wire too slowly" in said


def test_a_thick_wire_gets_the_time_that_it_cools_in_still_air(known):
    def spring(diameter):
        return pj.Spring(PUBLISHED, pj.Alloy(**known.nominal | {"convection": 60.0 * 0.25e-3 / diameter}), PUBLISHED.free_length)

    thin, thick = spring(0.25e-3), spring(6.0e-3)
    assert cooling_seconds(thick) == pytest.approx(24.0 * cooling_seconds(thin)) and cooling_seconds(thin) > 1.0
    assert heating_seconds(thin) == 120.0 and heating_seconds(thick) == pytest.approx(2.0 * cooling_seconds(thick))
    test = Candidate(HEATED, (1.15,))
    assert minutes(test, 0.1, heating_seconds(thick)) > minutes(test, 0.1)


# --- the plan as a whole ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plan") / "out"
    result = CliRunner().invoke(main, ["plan", "krl35", "--out", str(folder), "--tests", "4", "--draws", "2"])
    assert result.exit_code == 0, result.output
    return folder, result.stdout


def test_the_protocol_is_complete(planned):
    folder, said = planned
    assert sorted(p.name for p in folder.iterdir() if p.name != RECORD) == [
        "expected_sd.png", "protocol.csv", "protocol.html", "protocol.toml", "report.json",
    ]  # fmt: skip
    protocol = tomllib.loads((folder / "protocol.toml").read_text(encoding="utf-8"))
    assert protocol["schema"] == "pneusma-protocol/1" and protocol["alloy"] == "krl35"
    tests = protocol["test"]
    assert [t["role"] for t in tests].count("validation") == 1 and tests[-1]["role"] == "validation"
    assert sum(t["repeats"] for t in tests[:-1]) <= 4
    for test in tests:
        assert test["rate_percent_per_s"] > 0.0 and test["sampling_s"] <= 0.5 and test["minutes"] > 5.0
        np.testing.assert_allclose(test["peaks_mm"], 0.13988 * np.array(test["strains_percent"]), rtol=1e-3)
        assert ("setpoint_ohm" in test) == (test["hold"] == "resistance")
        if "setpoint_ohm" in test:
            assert 3.2 < test["setpoint_ohm"] < 3.76
    assert protocol["minutes"] == pytest.approx(sum(t["minutes"] * t["repeats"] for t in tests), abs=0.1)
    assert set(WANTED) <= set(protocol["expected"])
    for fields in protocol["expected"].values():
        assert 0.0 < fields["sd_after"] <= fields["sd_before"] * 1.001
    with open(folder / "protocol.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == [t["name"] for t in tests]
    assert json.loads((folder / "report.json").read_text())["tests"] == tests
    page = (folder / "protocol.html").read_text(encoding="utf-8")
    for words in ("Before you start", "Tests, in this order", "data:image/svg+xml", "wholly martensitic", tests[0]["name"]):
        assert words in page
    assert tests[0]["name"] in said and "hours with set-up" in said


def test_the_plan_says_which_test_tells_the_memory_and_the_resistivities(planned):
    """Only unloading shows the residual strain, and only cold wire the resistivity of martensite."""
    folder, _ = planned
    expected = tomllib.loads((folder / "protocol.toml").read_text())["expected"]
    for name, fields in expected.items():
        assert 0.0 < fields["sd_after_that_alone"] <= fields["sd_before"] * (1.0 + 1e-3), name
    for name in ("rho_mean", "rho_span", "gR_amplitude"):
        assert not expected[name]["told_best_by"].startswith("hot"), name
        assert expected[name]["sd_after_that_alone"] >= 0.99 * expected[name]["sd_after"], name
    page = (folder / "protocol.html").read_text()
    assert "Which test tells which constant" in page


def test_the_plan_repeats_and_is_not_the_same_for_everything(planned):
    first = (planned[0] / "protocol.toml").read_text(encoding="utf-8")
    names = [t["name"] for t in tomllib.loads(first)["test"]]
    again = plan_campaign("krl35", tests=4, draws=2)
    assert [test.candidate.name for test in again.tests] == names
    hot, cold = (
        plan_campaign("krl35", tests=1, draws=2, wanted=names).tests[0].candidate
        for names in (("ka_1", "ka_2", "ka_3"), ("beta_1", "km_1", "km_2"))
    )
    assert hot.is_hot and cold.hold == COLD
    assert again.relative_sd()["G_a"] < again.relative_sd(0)["G_a"]


def test_alloy_or_geometry_may_be_given(tmp_path):
    file = tmp_path / "spring.toml"
    file.write_text('[geometry]\nwire_diameter_mm = 0.3\nalloy = "krl45"\n')
    assert described("krl35") == ("krl35", {})
    assert described(None) == (None, {})
    assert described(str(file)) == ("krl45", {"wire_diameter_mm": 0.3})
    assert described("krl35", file) == ("krl35", {"wire_diameter_mm": 0.3})
    file.write_text('[geometry]\nwire_diameter_mm = 0.3\nalloy = "fit"\n')
    assert described(str(file)) == (None, {"wire_diameter_mm": 0.3})
    with pytest.raises(InputError, match="did you mean 'krl"):
        described("krl53")
    with pytest.raises(InputError, match="given twice"):
        described(str(file), file)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("krl99",), "no alloy is called"),
        (("nowhere.toml",), "cannot be read"),
        (("niti_wire",), "an alloy of straight wires, but one of springs is needed here"),
        (("--tests", "0"), "0 is not in the range x>=1"),
        (("--tests", "51"), "must be 1 to 50"),
        (("--draws", "201"), "must be 1 to 200"),
        (("--misfit", "2"), "is a share"),
        (("--noise", "force=1"), "did you mean 'force_N'"),
        (("--for", "T_mid"), "no constant that such tests show"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(tmp_path, options, words):
    result = CliRunner().invoke(main, ["plan", *options, "--out", str(tmp_path / "x")])
    assert result.exit_code == 2 and words in result.stderr and len(result.stderr.splitlines()) == 1
    assert not (tmp_path / "x").exists()

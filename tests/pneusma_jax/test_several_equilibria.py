"""Measured resistances: every equilibrium found, said to be several, and the way of a history followed."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from activations import phases

import pneusma_jax as pj
from pneusma_jax.actuator.branches import BEHIND, _without_doubles


def resistances(found):
    return tuple(pj.Resistance(spring.resistance) for spring in found.springs)


@pytest.fixture(scope="module")
def body():
    return pj.make_actuator("pneusma2")


def test_cold_springs_under_pressure_stay_straight_and_the_others_are_listed(body):
    cold = pj.solve(body, 45e3, phases(1.0, 1.0))
    found = pj.solve(body, 45e3, resistances(cold))
    assert pj.Status(int(found.status)) is pj.Status.several_equilibria and bool(found.converged)
    assert abs(float(found.curvature)) < 1e-6
    every = pj.solve_all(body, 45e3, resistances(cold))
    count = int(every.equilibria[0])
    bends = np.sort(np.asarray(every.curvature)[:count])
    assert count >= 3 and np.all(np.isnan(np.asarray(every.curvature)[count:]))
    assert bends[-1] == pytest.approx(5.39, abs=0.01)
    np.testing.assert_allclose(bends, -bends[::-1], atol=1e-6)  # the design is symmetric
    for number, measured in enumerate(resistances(cold)):
        again = np.asarray(every.springs[number].resistance)[:count]
        assert np.all(again <= float(measured.value) + 1e-6)  # cold springs may stay below


def test_random_states_come_back_or_are_said_to_be_one_of_several(body):
    rng, rows = np.random.default_rng(11), 300
    pressure = rng.uniform(0.0, 50e3, rows)
    true = pj.solve_batch(body, pressure, phases(*rng.uniform(0.0, 1.0, (2, rows))))
    found = pj.solve_batch(body, pressure, resistances(true))
    unique = np.asarray(found.status) == pj.Status.converged
    assert np.all(np.asarray(found.converged))
    assert 0.9 < unique.mean() < 1.0
    off = np.abs(np.asarray(found.curvature - true.curvature))
    assert off[unique].max() < 1e-5


# pressure [Pa] and fractions beside a fold, where a step of Newton's method only halves the distance
BESIDE_FOLDS = [
    (39243.54860515612, 0.9760907977315938, 0.3140013907815481),
    (32460.197773429656, 0.9867096735433194, 0.42834162200624737),
    (38522.109229626076, 0.13662807778113106, 0.9753188788941983),
    (37784.53390002407, 0.9860729329050529, 0.7941590603757306),
    (25138.38409044221, 0.9980253024130853, 0.5149088718359018),
]


@pytest.mark.parametrize("way", ["batch", "one by one", pytest.param("compiled batch", marks=pytest.mark.slow)])
def test_a_state_beside_a_fold_comes_back_or_is_said_to_be_one_of_several(body, way):
    pressure, *fractions = np.asarray(BESIDE_FOLDS).T
    true = pj.solve_batch(body, pressure, phases(*fractions))
    ohms = np.stack([np.asarray(spring.resistance) for spring in true.springs])
    if way == "one by one":
        rows = zip(pressure, ohms.T, strict=True)
        found = [pj.solve(body, p, tuple(pj.Resistance(x) for x in pair)) for p, pair in rows]
        found = jax.tree.map(lambda *x: jnp.stack(x), *found)
    else:
        # enough rows for a grid of starts
        pressure, ohms = np.tile(pressure, 5), np.tile(ohms, 5)
        pressure[-2:] = 0.0, 50e3
        solved = lambda p, pair: pj.solve_batch(body, p, tuple(pj.Resistance(x) for x in pair))  # noqa: E731
        found = (jax.jit(solved) if way == "compiled batch" else solved)(pressure, ohms)
    rows = slice(0, len(BESIDE_FOLDS))
    assert np.all(np.asarray(found.converged)[rows])
    off = np.abs(np.asarray(found.curvature)[rows] - np.asarray(true.curvature))
    assert np.all((off < 0.01) | (np.asarray(found.status)[rows] == pj.Status.several_equilibria))


# pressure [Pa] and fractions of rows with other equilibria within 0.2 1/m, at which a spring is nearly cold
NEARLY_COLD = [
    (22521.804481357278, 0.2639233505272828, 1.0),
    (22791.828222658412, 0.25571444126949094, 1.0),
    (31439.899231297702, 0.9999976456671847, 0.9760216946795865),
    (22022.84146856055, 0.9995927036702474, 0.005581308686451569),
    (30562.261732918694, 0.8757213160894741, 0.9998798172545367),
    (31528.021166871433, 0.9767239034708654, 0.9996940002067038),
    (30371.373399963562, 1.0, 0.8703590987290345),
    (25950.343269712896, 0.9996429451570694, 0.030663842623928406),
]


@pytest.mark.parametrize(
    "way",
    ["batch", "one by one", *(pytest.param(way, marks=pytest.mark.slow) for way in ("one by one, compiled", "compiled batch"))],
)
def test_a_state_with_a_nearly_cold_spring_comes_back_or_is_said_to_be_one_of_several(body, way):
    random = np.random.default_rng(35)
    given = np.concatenate([NEARLY_COLD, random.uniform([0.0, 0.0, 0.0], [50e3, 1.0, 1.0], (40, 3))])
    given = given[: len(NEARLY_COLD)] if "one by one" in way else given
    true = pj.solve_batch(body, given[:, 0], phases(*given[:, 1:].T))
    ohms = np.stack([np.asarray(spring.resistance) for spring in true.springs], axis=1)

    def batch(pressure, ohms):
        return pj.solve_batch(body, pressure, tuple(pj.Resistance(x) for x in ohms.T))

    def one(pressure, ohms):
        return pj.solve(body, pressure, tuple(pj.Resistance(x) for x in ohms), throw=False)

    solved = batch if "batch" in way else one
    solved = jax.jit(solved) if "compiled" in way else solved
    if "batch" in way:
        found = solved(given[:, 0], ohms)
    else:
        found = jax.tree.map(lambda *x: jnp.stack(x), *map(solved, given[:, 0], ohms))
    off = np.abs(np.asarray(found.curvature) - np.asarray(true.curvature))
    assert np.all(np.asarray(found.converged))
    assert np.all((off < 0.01) | (np.asarray(found.status) == pj.Status.several_equilibria))


@pytest.mark.parametrize(
    ("design", "pressure"),
    [("pneusma1", 20e3), ("pneusma1", 45e3), *(pytest.param("pneusma2", p, marks=pytest.mark.slow) for p in (20e3, 45e3))],
)
def test_a_history_fed_its_own_resistances_comes_back(design, pressure):
    heat = np.interp(np.arange(0.0, 100.5, 0.5), [0, 5, 45, 55, 95, 100], [1, 1, 0.4, 0.4, 1, 1])
    rows, body = len(heat), pj.make_actuator(design)
    given = phases(np.ones(rows), heat)[-len(body.springs) :]
    history = pj.simulate_history(body, np.full(rows, pressure), given)
    back = pj.simulate_history(body, np.full(rows, pressure), resistances(history.rows))
    np.testing.assert_allclose(back.rows.curvature, history.rows.curvature, atol=1e-6)
    several = np.asarray(back.rows.status) == pj.Status.several_equilibria
    assert several.any() == (pressure > 30e3)


@pytest.mark.slow
@pytest.mark.parametrize("design", ["pneusma1", "pneusma2", "triad"])
def test_histories_at_twenty_pressures_come_back_or_say_that_there_are_others(design):
    heat, body = np.interp(np.linspace(0, 100, 61), [0, 5, 45, 55, 95, 100], [1, 1, 0.4, 0.4, 1, 1]), pj.make_actuator(design)
    given = phases(*np.ones((len(body.springs) - 1, 61)), heat)
    for pressure in np.linspace(2.5e3, 50e3, 20):
        true = pj.simulate_history(body, np.full(61, pressure), given).rows
        back = pj.simulate_history(body, np.full(61, pressure), resistances(true)).rows
        off = np.linalg.norm((back.bend - true.bend) / np.asarray(true.length)[:, None], axis=1)
        several = np.asarray(back.status) == pj.Status.several_equilibria
        assert np.all(np.asarray(back.converged)) and np.all((off < 0.01) | several), pressure


def test_paths_of_a_history_that_cannot_win_are_given_up():
    """Of paths at one equilibrium, that which is cheaper by more than the next row can make up for stays."""
    cost = np.asarray([0.5, 0.5, 0.1, 0.2, 0.65, BEHIND + 0.2])
    unknowns = np.asarray([[0.0], [0.0], [0.0], [1.0], [1.0], [2.0]])
    change = np.asarray([[0.1], [0.1], [0.6], [0.0], [0.4], [0.0]])
    kept = np.asarray(_without_doubles(cost, unknowns, change))
    #                                 its twin  far     alone  worse  behind
    np.testing.assert_array_equal(kept, [0.5, np.inf, 0.1, 0.2, np.inf, np.inf])


@pytest.mark.slow
def test_derivatives_by_resistance_are_right_to_second_order(body):
    warm = pj.solve(body, 20e3, phases(0.9, 0.5))

    def curvature(q):
        changed = eqx.tree_at(lambda b: b.silicone.stiffness, body, q[3])
        given = (pj.Resistance(q[1]), pj.Resistance(q[2]))
        return pj.solve(changed, 1e4 * q[0], given, throw=False).curvature

    at = jnp.asarray([2.0, *(float(s.resistance) for s in warm.springs), 1.0])
    slope = jax.jit(jax.grad(curvature))
    step = 1e-5 * np.eye(4)
    by_values = [(float(curvature(at + h)) - float(curvature(at - h))) / 2e-5 for h in step]
    np.testing.assert_allclose(slope(at), by_values, rtol=1e-6, atol=1e-5)
    by_slopes = np.stack([(slope(at + h) - slope(at - h)) / 2e-5 for h in step])
    np.testing.assert_allclose(jax.jit(jax.hessian(curvature))(at), by_slopes, atol=1e-6 * np.abs(by_slopes).max())


@pytest.mark.slow
def test_second_derivatives_of_the_triad_are_those_of_differences():
    triad = pj.make_actuator("triad")

    def shape(q):
        changed = eqx.tree_at(lambda b: b.silicone.stiffness, triad, q[4])
        found = pj.solve(changed, 1e4 * q[0], phases(*q[1:4]), throw=False)
        return found.bend[0] + 2.0 * found.bend[1] + 100.0 * found.delta_centre

    at, step = jnp.asarray([1.5, 0.8, 0.9, 0.95, 1.0]), 1e-5 * np.eye(5)
    slope = jax.jit(jax.grad(shape))
    differences = np.stack([(slope(at + h) - slope(at - h)) / 2e-5 for h in step])
    found = jax.jit(jax.jacfwd(jax.grad(shape)))(at)
    np.testing.assert_allclose(found, differences, rtol=1e-5, atol=1e-8 * np.abs(differences).max())


@pytest.mark.slow
@pytest.mark.parametrize("order", [2, 3])
def test_a_section_that_bends_anywhere_has_second_and_third_derivatives(order):
    law = pj.load_silicone("dragon_skin_10_fast")
    section = pj.rectangle(10e-3, 8e-3, 1e-3)

    def pull(q):
        force, moment = section.integrate(law, q[0], 180.0 * q[1:])
        return force + 200.0 * (moment[0] + 2.0 * moment[1])

    first, second = (jax.jit(f) for f in (jax.grad(pull), jax.hessian(pull), jax.jacfwd(jax.hessian(pull)))[order - 2 : order])
    for at in ([0.1, 0.2, 0.3], [0.1, 0.0, 0.0]):
        at, step = jnp.asarray(at), 1e-5 * np.eye(3)
        differences = np.stack([(first(at + h) - first(at - h)) / 2e-5 for h in step], axis=-1)
        np.testing.assert_allclose(second(at), differences, atol=1e-6 * np.abs(differences).max())


def test_what_make_actuator_is_told_acts_and_contradictions_are_refused():
    usual, less = pj.make_actuator("pneusma1"), pj.make_actuator("pneusma1", prestrain=0.1)
    bend = [float(pj.solve(b, 30e3, phases(1.0)).curvature) for b in (usual, less)]
    assert abs(bend[0] - bend[1]) > 1.0
    fewer = pj.make_actuator("pneusma1", active_coils=40.0)
    assert float(fewer.springs[0].geometry.free_length) == pytest.approx(14e-3 * 40.0 / 52.0)
    with pytest.raises(ValueError, match="coils times pitch"):
        pj.make_actuator("pneusma1", active_coils=40.0, free_length=14e-3)
    with pytest.raises(ValueError, match="spring 2 must be between 0 and 1, but it is 1.5"):
        pj.solve(usual, 30e3, phases(1.5))


def test_a_fraction_that_cannot_be_is_refused_on_stands_too():
    spring, wire = pj.make_actuator("pneusma1").springs[0], pj.load_wire()
    with pytest.raises(ValueError, match="spring 1 must be between 0 and 1, but it is 1.000000001"):
        pj.simulate_spring(spring, np.linspace(0.0, 0.05, 3), pj.MartensiteFraction(1.000000001))
    with pytest.raises(ValueError, match="the wire must be between 0 and 1, but it is -0.5"):
        pj.simulate_wire(wire, stress=np.zeros(3), xi0=np.array([1.0, -0.5, 1.0]))


def test_what_cannot_be_has_a_status_inside_of_a_program():
    made = lambda w: pj.make_actuator("pneusma1", wall_thickness=w)  # noqa: E731
    solved = lambda w, p, x: pj.solve(made(w), p, (pj.MartensiteFraction(x),), throw=False)  # noqa: E731
    status = jax.jit(lambda w, p, x: solved(w, p, x).status)
    assert int(status(1e-3, 30e3, -0.5)) == pj.Status.fraction_out_of_range
    assert int(status(1e-3, 1e4, 1.0)) == pj.Status.converged
    assert int(status(6e-3, 1e4, 1.0)) == pj.Status.input_not_finite
    assert int(status(1e-3, -500.0, 1.0)) == pj.Status.converged
    assert int(status(1e-3, -30e3, 1.0)) == pj.Status.flattened


def test_a_resistance_of_no_such_spring_has_a_status():
    body = pj.make_actuator("pneusma1")
    kept = float(pj.solve(body, 20e3).springs[0].resistance)
    measured = pj.Resistance(np.array([kept, 1.2 * kept, 1e300, 0.1 * kept]))
    found = pj.solve_batch(body, np.full(4, 20e3), (measured,))
    assert list(found.status[:2]) == [0, 0] and bool(found.springs[0].clipped[1])
    assert list(found.status[2:]) == [pj.Status.resistance_out_of_range] * 2
    assert np.all(np.isnan(found.curvature[2:])) and np.all(np.isfinite(found.curvature[:2]))
    with pytest.raises(RuntimeError, match="more than twice what its spring has"):
        pj.solve(body, 20e3, (pj.Resistance(1e300),))


def test_a_coil_that_encloses_the_body_is_refused():
    with pytest.raises(ValueError, match="narrower than the body, whose width is 10 mm, but it is 50.2 mm wide"):
        pj.make_actuator("pneusma1", mandrel_diameter=49.7e-3)


def test_pressures_that_cannot_be_have_a_status():
    usual = pj.make_actuator("pneusma1")
    found = [pj.Status(int(pj.solve(usual, p, throw=False).status)) for p in (-500.0, -30e3)]
    assert found == [pj.Status.converged, pj.Status.flattened]
    far = pj.solve(usual, 2e6, throw=False)
    assert pj.Status(int(far.status)) in (pj.Status.beyond_wire, pj.Status.collapsed, pj.Status.no_equilibrium)


def test_validity_says_what_lies_beyond_the_tests():
    usual = pj.make_actuator("pneusma1")
    assert bool(pj.solve(usual, 5e3, phases(0.9)).validity.good)
    assert bool(pj.solve(usual, -2e3, phases(0.9)).validity.suction)
    assert bool(pj.solve(usual, 150e3, phases(1.0)).validity.shear.any())


@pytest.mark.parametrize(
    ("given", "what"),
    [
        (dict(prestrain=-0.1), "`prestrain` must not be negative, but it is -0.1"),
        (dict(prestrain=float("nan")), "`prestrain` must not be negative, but it is nan"),
        (dict(length=0.0), "`length` must be positive, but it is 0.0"),
        (dict(attached_length=0.5), "below the 188.4 mm of wire in the coils, but it is 500 mm"),
        (dict(attached_length=10e-3), "at least the free length of the spring, 14 mm, but it is 10 mm"),
        (dict(initial_pitch=0.1e-3), "at least the wire's diameter, 0.25 mm, but it is 0.1 mm"),
        (dict(design="pneuflex_s", fibre_stiffness=-1.0, inextensible=False), "`fibre_stiffness` must be positive, but it is -1.0"),
    ],
)
def test_dimensions_that_cannot_be_are_refused(given, what):
    with pytest.raises(ValueError, match=what):
        pj.make_actuator(**dict(design="pneusma1") | given)


@pytest.mark.parametrize(
    ("design", "given", "why"),
    [
        ("pneuflex_s", dict(fibre_stiffness=10.0), "'fibre_stiffness' changes nothing .* taken as inextensible"),
        ("pneusma1", dict(fibre_stiffness=10.0, inextensible=False), "'fibre_stiffness' changes nothing .* no fibre"),
    ],
)
def test_a_stiffness_on_which_nothing_depends_is_refused(design, given, why):
    with pytest.raises(pj.InputError, match=why):
        pj.make_actuator(design, **given)


def test_the_attached_length_follows_the_length_wherever_the_dimensions_come_from():
    own = pj.design_geometry("pneusma1")
    for body in (pj.make_actuator("pneusma1", length=60e-3), pj.make_actuator("pneusma1", geometry=own, length=60e-3)):
        assert float(body.springs[0].attached_length) == 60e-3


@pytest.mark.parametrize("ohms", [0.0, -3.5])
def test_a_resistance_that_cannot_be_is_refused(ohms):
    with pytest.raises(ValueError, match=f"spring 2 must be positive .ohm., but it is {ohms:g}"):
        pj.solve(pj.make_actuator("pneusma1"), 30e3, (pj.Resistance(ohms),))

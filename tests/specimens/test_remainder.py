"""A model discrepancy in a model: on disk, at its driver in every kind, held and marked beyond what was seen."""

import csv
import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from click.testing import CliRunner

import pneusma_jax as pj
from fitting.cli import main
from fitting.data.recordings import Campaign, Recording, write_recording
from fitting.simulate import predict
from fitting.simulate.unmodelled import BEYOND
from fitting.simulate.workspace.grid import compute_workspace
from fitting.specimens import SPECIMENS, specimen_of
from fitting.specimens.saved_model_notes import check_kind
from fitting.specimens.saved_models import (
    AddedDiscrepancy,
    AugmentedModel,
    add_effect,
    load_model,
    save_model,
)
from fitting.specimens.saved_models.files import render_model
from fitting.specimens.with_saved_model import Augmented
from fitting.synthesise import synthesise
from pneusma_jax.calibration.records import Prior, Quantity
from pneusma_jax.effects import CATALOGUE, find_effect
from pneusma_jax.model_discrepancy import Unmodelled, unit_of
from pneusma_jax.simulate.coupon import simulate_coupon

SOURCE = "Fitted to a campaign"


def remainder(kind, quantity, driver, knots, values):
    made = [
        [Quantity(f"{stem}_{k}", float(x), unit_of(name), "fitted", SOURCE, prior) for k, x in enumerate(column, 1)]
        for stem, name, column, prior in (
            ("knot", driver, knots, None),
            ("correction", quantity, values, Prior(mean=0.0, sd=1e-3)),
        )
    ]
    return AddedDiscrepancy(kind, quantity, driver, tuple(made[0]), tuple(made[1]))


@pytest.fixture
def ripple():
    """Of an elastomer, seen up to a strain of 0.4."""
    return AugmentedModel(added=(remainder("elastomer", "stress", "strain", [0.0, 0.2, 0.4], [0.0, 3e3, 1e3]),))


def pull(most=0.8, rows=9):
    strain = np.linspace(0.0, most, rows)
    columns = {"time_s": 10.0 * np.arange(rows), "strain": strain, "stress_kPa": 100.0 * strain}
    return Recording("pull", None, "elastomer", specimen="A", real=False, columns=columns)


def test_it_reads_back_equal(ripple, tmp_path):
    law = add_effect(CATALOGUE["mullins_softening"](depth=0.2), SOURCE)
    model = dataclasses.replace(ripple, added=(law, *ripple.added), name="rippled")
    again = load_model(save_model(model, tmp_path / "model.toml"))
    assert again == model
    assert [effect.slug for effect in again.effects] == ["mullins_softening", "unmodelled"]
    assert again.remainders == ripple.remainders


def test_it_is_none_of_the_catalogue():
    with pytest.raises(pj.InputError, match="no effect 'unmodelled'"):
        find_effect("unmodelled")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            'driver = "strain"',
            'driver = "strian"',
            "driver of stress is 'strian', of kind 'elastomer' did you mean 'strain'?",
        ),
        ('quantity = "stress"', 'quantity = "stresses"', "did you mean 'stress'?"),
        ('kind = "elastomer"', "kind = 3", "kind must be a word, but it is 3"),
        (
            'quantity = "stress"',
            'quantity = "time"',
            "quantity is 'time', of kind 'elastomer' known: silicone_stiffness, stress",
        ),
        (
            'kind = "elastomer"',
            'kind = "spring"',
            "quantity is 'stress', of kind 'spring' known: force, resistance",
        ),
        (
            'driver = "strain"',
            'driver = "silicone_stiffness"',
            "driver of stress is 'silicone_stiffness', of kind 'elastomer' known: max_strain, strain, ",
        ),
        ('driver = "strain"', 'driver = "time_2"', "driver of stress is 'time_2', of kind 'elastomer' "),
        ('driver = "strain"', 'driver = "xi0_2"', "driver of stress is 'xi0_2', of kind 'elastomer' known: "),
        (
            'quantity = "stress"',
            'quantity = "silicone_stiffness"',
            "driver of silicone_stiffness is 'strain', of kind 'elastomer' known: time",
        ),
        ("knot_2 = ", "knot_7 = ", "knot_2 is missing"),
        ("correction_3 = ", "correction_9 = ", "correction_3 is missing"),
        ("knot_2 = {value = 0.2", "knot_2 = {value = 0.5", "knot_3 must be larger than knot_2"),
        ('unit = "Pa"', 'unit = "mm"', "measures a length"),
        ('driver = "strain"', 'drivers = "strain"', "unknown key 'drivers'"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(ripple, old, new, says, tmp_path):
    text = render_model(ripple)
    assert old in text
    path = tmp_path / "model.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(pj.InputError) as refused:
        load_model(path)
    assert says in str(refused.value) and str(path) in str(refused.value) and "\n" not in str(refused.value)


def test_it_adds_between_its_knots_and_is_held_and_marked_beyond(ripple):
    recording = pull()
    plain, found = predict(recording), predict(recording, model=ripple)
    added = found.outputs["stress_kPa"] - plain.outputs["stress_kPa"]
    expected = [0.0, 1.5, 3.0, 2.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    np.testing.assert_allclose(added, expected, atol=1e-9)
    np.testing.assert_allclose(found.marks["model_unmodelled_stress_kPa"], expected, atol=1e-12)
    assert found.marks[BEYOND].tolist() == [0, 0, 0, 0, 0, 1, 1, 1, 1]
    assert not plain.marks
    said = " | ".join(found.notices)
    assert "describes and does not explain" in said
    assert "strain from 0 to 0.4 only; beyond it is held at its end value in 4 of 9 rows" in said


def test_within_its_range_nothing_is_said_to_be_extrapolated(ripple):
    assert not any("held" in sentence for sentence in predict(pull(0.4), model=ripple).notices)


def test_a_hundredth_beyond_is_not_marked():
    """Fits see means of neighbouring rows, whose ends lie a little inside those of the rows."""
    one = Unmodelled([0.0, 0.4], [0.0, 4e3], "silicone", "stress", "strain")
    strain = jnp.asarray([-0.003, 0.0, 0.403, 0.405, -0.005])
    found = simulate_coupon(pj.load_silicone(), strain, effects=(one,)).seen
    assert found["beyond_stress"].tolist() == [0.0, 0.0, 0.0, 1.0, 1.0]
    np.testing.assert_allclose(found["unmodelled_stress"], [0.0, 0.0, 4e3, 4e3, 0.0], atol=1e-9)


def test_the_command_marks_rows_and_warns(ripple, tmp_path):
    csv_path = write_recording(pull(), tmp_path / "campaign")
    model = save_model(ripple, tmp_path / "model.toml")
    run = CliRunner().invoke(
        main, ["simulate", str(csv_path), "--model", str(model), "--out", str(tmp_path / "out")]
    )
    assert run.exit_code == 0, run.output
    assert "beyond it is held at its end value in 4 of 9 rows" in run.stderr
    lines = (tmp_path / "out" / "model.csv").read_text().splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert [row[BEYOND] for row in rows] == ["0"] * 5 + ["1"] * 4
    assert float(rows[2]["model_unmodelled_stress_kPa"]) == pytest.approx(3.0)


def test_without_a_clock_time_is_the_number_of_the_row():
    """As a fit takes it."""
    model = AugmentedModel(added=(remainder("elastomer", "stress", "time", [0.0, 8.0], [0.0, 8e3]),))
    recording = pull()
    del recording.columns["time_s"]
    found = predict(recording, model=model)
    np.testing.assert_allclose(found.marks["model_unmodelled_stress_kPa"], np.arange(9.0), atol=1e-12)
    assert not found.marks[BEYOND].any()


def test_of_another_kind_it_is_left_out_and_said_so(ripple):
    tube = AugmentedModel(added=(remainder("tube", "length", "pressure", [0.0, 1e4], [0.0, 1e-3]),))
    found, plain = predict(pull(), model=tube), predict(pull())
    np.testing.assert_allclose(found.outputs["stress_kPa"], plain.outputs["stress_kPa"], rtol=1e-12)
    assert any("does not act here" in sentence for sentence in found.notices)


def test_it_is_differentiable_and_several_add_up():
    law, strain = pj.load_silicone(), jnp.linspace(0.0, 0.5, 6)

    def stress(values):
        one = Unmodelled([0.0, 0.5], values, "silicone", "stress", "strain")
        seen = simulate_coupon(law, strain, effects=(one, one)).seen
        return seen["stress"][2], seen

    slope, seen = jax.grad(stress, has_aux=True)(jnp.asarray([1.0, 2.0]))
    np.testing.assert_allclose(slope, [1.2, 0.8], rtol=1e-12)
    np.testing.assert_allclose(seen["unmodelled_stress"], 2.0 * (1.0 + 2.0 * strain), rtol=1e-12)
    assert not any(name.startswith("told_") for name in seen)


def test_a_clock_that_runs_late_moves_the_channel_and_not_the_driver():
    law, strain, time = pj.load_silicone(), jnp.linspace(0.0, 0.5, 6), jnp.arange(6.0)
    one = Unmodelled([0.0, 0.5], [0.0, 5e3], "silicone", "stress", "strain")
    late = find_effect("channel_lag")(delay=1.0)
    found = simulate_coupon(law, strain, time=time, effects=(late, one)).seen
    np.testing.assert_allclose(found["unmodelled_stress"], 1e4 * strain, rtol=1e-12)


DRIVERS = {
    "elastomer": ("stress", {}, ("strain", "strain_rate", "time")),
    "wire": ("strain", {"interval_s": 5.0}, ("temperature", "stress", "strain", "xi0", "time")),
    "tube": ("length", {"interval_s": 5.0}, ("pressure", "pressure_rate", "strain", "time")),
    "spring": ("force", {"interval_s": 5.0}, ("xi0", "strain", "strain_rate", "max_strain", "force", "time")),
    "actuator": ("curvature", {"interval_s": 4.0}, ("pressure", "pressure_rate", "curvature", "xi0_2", "time")),
}


@pytest.mark.parametrize(
    "kind", [pytest.param(k, marks=pytest.mark.slow if k in ("actuator", "spring", "tube") else ()) for k in DRIVERS]
)
def test_its_driver_is_that_of_a_diagnosis(kind):
    quantity, wishes, names = DRIVERS[kind]
    campaign = synthesise(kind, seed=1, tests=1, **wishes).campaign
    specimen = specimen_of(kind)
    row = specimen.rows_for(dataclasses.replace(campaign, recordings=campaign.recordings[:1]))[0]
    # a spring's hidden phase would follow the force that the term changes
    row = dataclasses.replace(row, weight=row.weight | {quantity: 0.0 * row.weight[quantity]})

    @jax.jit
    def answer(weights, ends):
        effects = tuple(
            Unmodelled(end, w * end, specimen.element, quantity, name)
            for w, end, name in zip(weights, ends, names, strict=True)
        )
        return specimen.answer({}, row, effects)

    everywhere = jnp.outer(jnp.ones(len(names)), jnp.asarray([-1.0, 1.0]))
    plain, drivers = answer(jnp.zeros(len(names)), everywhere)
    assert set(names) | {name for name in drivers if unit_of(name)} <= set(specimen.output_drivers)
    drivers = drivers | {"time": row.time}
    sizes = np.array([np.nanmax(np.abs(drivers[name])) for name in names])
    most = float(np.nanmax(np.abs(plain[quantity])))
    for k, name in enumerate(names):
        moved, _ = answer(jnp.zeros(len(names)).at[k].set(most / sizes[k]), 2.0 * sizes[:, None] * everywhere)
        expected = most / sizes[k] * drivers[name]
        np.testing.assert_allclose(moved[quantity] - plain[quantity], expected, atol=1e-9 * most)


@pytest.mark.slow
def test_a_workspace_holds_it_and_marks_where_it_is_unknown():
    model = AugmentedModel(added=(remainder("actuator", "curvature", "pressure", [1e4, 3e4], [1.0, 2.0]),))
    pressure, xi0 = np.array([0.0, 1e4, 2e4, 4e4]), np.ones(1)
    plain, found = (compute_workspace("pneuflex_s", pressure, xi0, model=m) for m in (AugmentedModel(), model))
    np.testing.assert_allclose((found.curvature - plain.curvature).ravel(), [1.0, 1.0, 1.5, 2.0], atol=1e-6)
    table = found.columns()
    assert table[BEYOND].tolist() == [1, 0, 0, 1] and BEYOND not in plain.columns()
    assert any("in 2 of 4 rows" in caution for caution in found.cautions)


def test_a_single_state_says_that_it_is_beyond(tmp_path):
    model = AugmentedModel(added=(remainder("actuator", "curvature", "pressure", [0.0, 1e4], [0.0, 2.0]),))
    path = save_model(model, tmp_path / "model.toml")
    run = CliRunner().invoke(
        main, ["simulate", "--design", "pneuflex_s", "--pressure-kPa", "20", "--model", str(path)]
    )
    assert run.exit_code == 0, run.output
    assert "pressure from 0 to 1e+04 Pa only; beyond it is held at its end value" in run.stderr


def test_a_fit_adds_it_as_it_is_and_lists_it_among_what_is_held(ripple):
    """It has no entry in the catalogue; fits of a model that had one ended there."""
    law = add_effect(CATALOGUE["mullins_softening"](depth=0.2), SOURCE)
    model = dataclasses.replace(ripple, added=(*ripple.added, law))
    campaign = Campaign("c", [pull(0.4)], False)
    found = {}
    for name, one in (("with", model), ("without", dataclasses.replace(model, added=(law,)))):
        augmented = Augmented("elastomer", one)
        parameters = augmented.parameters_for(campaign)
        assert "mullins_softening_depth" in parameters and not any("correction" in p for p in parameters)
        (rows,) = augmented.rows_for(campaign)
        found[name] = augmented.predict({n: p.value for n, p in parameters.items()}, rows)
    assert set(found["with"]) == set(found["without"])  # channels of its own are no outputs
    added = np.asarray(found["with"]["stress"] - found["without"]["stress"])
    strain = np.linspace(0.0, 0.4, 9)
    np.testing.assert_allclose(added, np.interp(strain, [0.0, 0.2, 0.4], [0.0, 3e3, 1e3]), atol=1e-6)
    augmented = Augmented("elastomer", model)
    held = [h for h in augmented.held(campaign, augmented.parameters_for(campaign)) if "correction" in h.name]
    assert [h.value for h in held] == [0.0, 3e3, 1e3] and all("discrepancy is held" in h.why for h in held)
    assert [effect.slug for effect in augmented.effects({})] == ["unmodelled", "mullins_softening"]
    assert Augmented("wire", ripple).effects({}) == ()


def test_what_is_held_has_a_name_of_its_own(ripple):
    """Of two effects of one kind, a report told the second one's numbers only."""
    other = remainder("elastomer", "stress", "time", [0.0, 80.0], [0.0, 2e3])
    heavy = add_effect(find_effect("gravity")(mass=0.001), SOURCE)
    laws = [add_effect(CATALOGUE["mullins_softening"](depth=depth), SOURCE) for depth in (0.1, 0.2)]
    model = AugmentedModel(added=(*ripple.added, heavy, laws[0], other, heavy, laws[1]))
    augmented, campaign = Augmented("elastomer", model), Campaign("c", [pull(0.4)], False)
    parameters = augmented.parameters_for(campaign)
    parameters["mullins_softening_2_depth"].set(vary=False)
    held = augmented.held(campaign, parameters)
    values = {one.name: one.value for one in held}
    assert len(values) == len(held)
    assert values["unmodelled_correction_2"] == 3e3 and values["unmodelled_2_correction_2"] == 2e3
    assert values["gravity_mass"] == values["gravity_2_mass"] == 0.001
    assert values["mullins_softening_2_depth"] == 0.2 and "mullins_softening_depth" not in values


def test_a_model_that_is_a_discrepancy_alone_acts_in_recordings_of_its_kind(ripple):
    check_kind(ripple, "elastomer")
    with pytest.raises(pj.InputError, match="nothing in this model acts in recordings of kind wire .*stress, a smooth"):
        check_kind(ripple, "wire")


@pytest.mark.parametrize(
    ("quantity", "driver", "acts"),
    [
        ("length", "pressure", True), ("silicone_stiffness", "time", True),
        ("curvature", "pressure", False), ("resistance_2", "pressure", False), ("length", "xi0_2", False),
        ("silicone_stiffness", "current_1", False),
    ],
)  # fmt: skip
def test_a_discrepancy_of_an_actuator_acts_in_a_tube_that_has_its_output_and_its_driver(quantity, driver, acts):
    """Both are balances of one body. Without the output it did nothing, and a fit said that it was added."""
    found = remainder("actuator", quantity, driver, [0.0, 1e4], [0.0, 1e-3])
    augmented = Augmented("tube", AugmentedModel(added=(found,)))
    assert augmented.more_than_base is acts and (augmented.idle == ()) is acts
    if acts:
        check_kind(augmented.model, "tube")
    else:
        with pytest.raises(pj.InputError, match=f"nothing in this model acts .*{quantity}, a smooth function of {driver}"):
            check_kind(augmented.model, "tube")


def test_what_can_drive_a_discrepancy_has_a_unit():
    drivers = {name for specimen in SPECIMENS.values() for name in specimen.output_drivers}
    assert all(unit_of(name) for name in drivers)


@pytest.mark.parametrize("kind", ["elastomer", "wire", pytest.param("tube", marks=pytest.mark.slow)])
def test_every_driver_of_a_kind_is_known_in_its_recordings(kind):
    specimen, campaign = specimen_of(kind), synthesise(kind, seed=1, tests=1).campaign
    (row,) = specimen.rows_for(dataclasses.replace(campaign, recordings=campaign.recordings[:1]))
    quantity, wide = specimen.outputs[0], np.array([-1e12, 1e12])
    effects = tuple(Unmodelled(wide, np.zeros(2), specimen.element, quantity, name) for name in specimen.output_drivers)
    found = jax.jit(specimen.answer)({}, row, effects)[0]  # a row is marked if any of its drivers is unknown
    assert not np.any(found[f"beyond_{quantity}"])

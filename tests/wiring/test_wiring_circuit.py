"""Filters on one pair of wires against formulas of a single branch, and a choice against even spacing."""

import jax.numpy as jnp
import numpy as np
import pytest
from click.testing import CliRunner

from fitting.cli import main
from fitting.wiring import Bounds, Circuit, Springs, choose_filters, crosstalk, heating
from fitting.wiring.choose import worst
from fitting.wiring.circuit import sensing
from fitting.wiring.springs import springs_of_design
from pneusma_jax.errors import InputError

NO_LOSS = dict(coil_time=1e9, lead_resistance=1e-9, voltage=2.0)


def circuit(resonances, coil=1e-3, **more):
    whole = jnp.full(len(resonances), coil)
    capacitance = 1.0 / ((2.0 * jnp.pi * jnp.asarray(resonances)) ** 2 * whole)
    return Circuit(
        jnp.full(len(resonances), 4.0), jnp.zeros(len(resonances)), whole, capacitance, **(NO_LOSS | more)
    )


def test_a_branch_at_its_resonance_is_a_resistor_and_follows_its_quality_beside_it():
    one = circuit([20e3])
    assert float(heating(one, jnp.asarray(20e3))[0]) == pytest.approx(2.0**2 / 4.0)
    quality = float(one.quality[0])
    assert quality == pytest.approx(2 * np.pi * 20e3 * 1e-3 / 4.0)
    share = float(heating(one, jnp.asarray(22e3))[0])
    assert share == pytest.approx(1.0 / (1.0 + quality**2 * (22 / 20 - 20 / 22) ** 2))


def test_leads_that_are_shared_take_their_part():
    one = circuit([20e3], lead_resistance=4.0)
    assert float(heating(one, jnp.asarray(20e3))[0]) == pytest.approx(1.0**2 / 4.0)
    assert float(jnp.real(one.admittance(jnp.asarray(20e3)))) == pytest.approx(1.0 / 8.0)


def test_crosstalk_is_heat_over_that_of_the_selected_branch():
    table = np.asarray(crosstalk(circuit([20e3, 40e3])))
    np.testing.assert_allclose(np.diagonal(table), 1.0)
    reactance = 2 * np.pi * 20e3 * 1e-3 * (1.0 - 4.0)
    assert table[0, 1] == pytest.approx(4.0**2 / (4.0**2 + reactance**2), rel=1e-9)


def test_sensing_tells_far_branches_apart():
    errors = np.asarray(sensing(circuit([20e3, 60e3]), jnp.asarray([20e3, 60e3])))
    np.testing.assert_allclose(np.diagonal(errors), -1.0, atol=0.02)
    assert abs(errors[0, 1]) < 0.02 and abs(errors[1, 0]) < 0.02


def test_chosen_filters_beat_even_spacing_and_keep_their_bounds():
    bounds = Bounds(10e3, 100e3, (10e-6, 1e-3))
    found = choose_filters(Springs(3.9, 6e-8), bounds, 4)
    assert found.crosstalk < 0.8 * found.even
    assert found.crosstalk == pytest.approx(worst(found.circuit))
    assert np.all(np.asarray(found.circuit.inductance) <= 1e-3 * (1 + 1e-9))
    spots = np.asarray(found.circuit.resonance)
    assert np.all(np.diff(spots) > 0.0) and spots[0] >= 10e3 * (1 - 1e-9) and spots[-1] <= 100e3 * (1 + 1e-9)
    np.testing.assert_allclose(np.asarray(found.made.resonance), spots, rtol=1e-9)
    assert found.spread_crosstalk > found.made_crosstalk * 0.9


def test_the_springs_of_a_design_and_what_is_refused():
    assert springs_of_design("pneusma2").resistance == pytest.approx(
        3.9, abs=0.4
    )  # Section 3.2 of the source
    with pytest.raises(InputError, match="there is no spring"):
        springs_of_design("pneuflex_s")
    done = CliRunner().invoke(main, ["wiring", "--springs", "3", "--from-kHz", "50", "--to-kHz", "20"])
    assert done.exit_code == 2 and "frequencies must ascend" in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--voltage", "0", "the voltage must be positive, but it is 0 V"),
        ("--voltage", "-3", "the voltage must be positive, but it is -3 V"),
        ("--inductance-uH-max", "-4", "but they are 1 and -4 uH"),
        ("--to-kHz", "1e300", "no finite number anywhere between these frequencies"),
    ],
)
def test_circuits_that_cannot_be_are_refused_in_one_line(option, value, words, tmp_path):
    arguments = ["wiring", "--springs", "2", option, value, "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 2 and words in done.stderr and done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("more", "code", "words"),
    [
        (["--springs", "6", "--to-kHz", "20"], 1, ["3.82 % of the heat. That does not keep the limit of 1 %."]),
        (
            ["--springs", "6", "--to-kHz", "20", "--crosstalk-percent", "5"], 0,
            ["That keeps the limit of 5 %.", "The latter does not keep the limit"],
        ),
        (["--to-kHz", "11"], 1, ["Not even two springs fit between 10 and 11 kHz; these are the best filters for two."]),
    ],
)  # fmt: skip
def test_a_limit_that_is_not_kept_is_said(more, code, words):
    done = CliRunner().invoke(main, ["wiring", "--from-kHz", "10", *more])
    said = " ".join(done.output.split())
    assert done.exit_code == code and all(part in said for part in words)

"""Heat by a current in a campaign of which one recording has none: the driven spring's austenite stands for it there."""

import equinox as eqx
import jax
import numpy as np

import pneusma_jax as pj
from fitting.data.recordings import Campaign, Recording
from fitting.data.recordings.nominal import nominal_geometry
from fitting.specimens import specimen_of
from fitting.specimens.actuator_history import with_effects
from pneusma_jax.effects.heat import OpposingSpringHeating

pj.enable_float64()
ROWS = 24
XI0 = np.linspace(1.0, 0.3, ROWS)


def bent(name, **columns):
    base = {
        "time_s": 3.0 * np.arange(ROWS), "pressure_kPa": np.full(ROWS, 30.0), "curvature_1pm": np.full(ROWS, 20.0),
        "resistance_2_ohm": np.linspace(3.8, 3.4, ROWS),
    }  # fmt: skip
    return Recording(name, None, "actuator", specimen="A", columns=base | columns,
                     geometry=nominal_geometry("actuator", {"design": "pneusma2"}),
                     noise={"resistance_2_ohm": 1e-4, "curvature_1pm": 0.25})  # fmt: skip


def test_a_recording_without_a_current_is_not_taken_as_unheated():
    campaign = Campaign("c", [bent("bare"), bent("heated", current_2_A=np.full(ROWS, 0.2))], None)
    program = jax.jit(with_effects)

    def left(rows, by_current):
        """Fractions of the cold spring while the other one is heated."""
        rows = eqx.tree_at(lambda r: r.extra["xi0"], rows, (np.ones(ROWS), XI0))
        values = {name: np.asarray(value) for name, value in rows.base.items()}
        effect = OpposingSpringHeating(gain=0.4, by_current=by_current)
        return np.asarray(program(values, rows, (effect,))[1]["xi0_1"])

    bare, heated = specimen_of("actuator").rows_for(campaign)
    assert left(bare, 0.0)[-1] < 0.95
    np.testing.assert_allclose(left(bare, 1.0), left(bare, 0.0), rtol=1e-9)
    assert left(heated, 1.0)[-1] < left(heated, 0.0)[-1] - 0.1

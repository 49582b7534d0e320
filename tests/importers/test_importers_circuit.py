"""Raw voltages of the source's circuit become resistance by Eq. 2.50."""

import numpy as np
import pytest

from fitting.data.importers import import_file, make_options
from fitting.data.importers.circuit import nitinol_resistance
from pneusma_jax.errors import InputError

OHMS = np.array([3.9, 3.7, 3.5, 3.4, 3.45])


def volts(ohms, adjust=1.275, resistor=4.0):
    """Output of the regulator: its adjustment voltage and the drop over the nitinol."""
    return adjust + ohms * adjust / resistor


def stand(values, heading="V_out (V)"):
    rows = "".join(f"{i},{i},{0.1 * i},{float(v)!r}\n" for i, v in enumerate(values))
    return f"Time (s),Displacement (mm),Load (N),{heading}\n{rows}"


def test_the_sources_range_of_voltages_is_its_range_of_resistances():
    """Section 2.4.1: 3.9 +- 0.4 ohm let V_OUT vary from about 2.7 to 3.1 V."""
    for ohms, volt in ((3.5, 2.7), (4.3, 3.1)):
        np.testing.assert_allclose(nitinol_resistance(np.array(volt), 1.275, 3.2), ohms, rtol=0.08)


def test_a_voltage_becomes_a_spring_recording(put):
    options = make_options(circuit=["adjust_V=1.275", "set_ohm=4"], licence="ours")
    recording = import_file(put("raw.csv", stand(volts(OHMS))), options)
    assert recording.kind == "spring"
    np.testing.assert_allclose(recording.columns["resistance_ohm"], OHMS, rtol=1e-12)
    assert any("Eq. 2.50" in notice and "0.3187 A" in notice for notice in recording.notices)


def test_amplifier_and_millivolts(put):
    logged = 1e3 * 9.0 * (volts(OHMS) - 2.5)
    options = make_options(circuit=["adjust_V=1.275", "set_ohm=4", "gain=9", "offset_V=2.5"], licence="ours")
    recording = import_file(put("raw.csv", stand(logged, "Voltage (mV)")), options)
    np.testing.assert_allclose(recording.columns["resistance_ohm"], OHMS, rtol=1e-10)


def test_an_actuator_with_a_voltage_for_each_spring(put):
    rows = "".join(f"{i},20,{a!r},{b!r},{i}\n" for i, (a, b) in enumerate(zip(volts(OHMS), volts(OHMS[::-1]), strict=True)))
    text = "t,P,U1,U2,k\n" + rows.replace("np.float64(", "").replace(")", "")
    options = make_options(
        columns=["time=t", "pressure=P", "voltage_1=U1", "voltage_2=U2", "curvature=k"],
        units=["time=s", "pressure=kPa", "voltage_1=V", "voltage_2=V", "curvature=1/m"],
        circuit=["adjust_V=1.275", "set_ohm=4"], licence="ours",
    )  # fmt: skip
    recording = import_file(put("a.csv", text), options)
    assert recording.kind == "actuator"
    np.testing.assert_allclose(recording.columns["resistance_2_ohm"], OHMS[::-1], rtol=1e-12)


def test_a_measured_resistance_is_not_overridden(put):
    rows = "".join(f"{i},{i},{0.1 * i},{float(r)!r},2.9\n" for i, r in enumerate(OHMS))
    path = put("both.csv", "Time (s),Displacement (mm),Load (N),Resistance (ohm),Voltage (V)\n" + rows)
    recording = import_file(path, make_options(licence="ours"))
    np.testing.assert_allclose(recording.columns["resistance_ohm"], OHMS, rtol=1e-12)


@pytest.mark.parametrize(
    ("circuit", "what"),
    [
        ([], "--circuit adjust_V=... --circuit set_ohm=..."),
        (["set_ohm=4"], "--circuit adjust_V=..."),
    ],
)
def test_a_voltage_without_its_circuit_is_refused(put, circuit, what):
    with pytest.raises(InputError) as error:
        import_file(put("raw.csv", stand(volts(OHMS))), make_options(circuit=circuit))
    assert what in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("text", ["set_ohm=-4", "resistor=4", "gain=0", "adjust_V"])
def test_a_circuit_that_cannot_be_is_refused(text):
    with pytest.raises(InputError, match="--circuit"):
        make_options(circuit=[text])

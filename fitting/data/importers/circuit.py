"""Conversion of raw voltages of the source's measuring circuit to resistance, Eq. 2.50.

A current regulator (LM2941) drives `V_adj / R_set` through the nitinol. The resistance is its output voltage,
less `V_adj`, over that current. The source measured the output through an amplifier (INA125) against an
offset voltage. The logged value may then be `gain (V_out - V_offset)`.
"""

import numpy as np

from ..recordings.table import unusable
from .channels import in_unit
from .making import Channel, Making

VOLTAGES = ("voltage", "voltage_1", "voltage_2", "voltage_3")
NEEDED = ("adjust_V", "set_ohm")
LEAST_CURRENT = 0.02
"""Minimum current that a resistance is computed with, as part of the largest one."""


def resistance_named(voltage: str) -> str:
    """Resistance that a voltage yields: `voltage_2` becomes `resistance_2`."""
    return voltage.replace("voltage", "resistance")


def nitinol_resistance(
    voltage: np.ndarray, adjust: float, set_resistor: float, gain: float = 1.0, offset: float = 0.0
) -> np.ndarray:
    """Resistance of the nitinol [ohm], Eq. 2.50.

    Args:
        voltage: logged voltage, `gain (V_out - offset)` [V].
        adjust: voltage of the regulator's adjustment pin, V_adj [V].
        set_resistor: R_set, which sets the current V_adj / R_set [ohm].
        gain: gain of the amplifier [1].
        offset: reference voltage of the amplifier [V].
    """
    current = adjust / set_resistor
    return (voltage / gain + offset - adjust) / current


def add_resistances(making: Making) -> None:
    """Add the resistance for each measured voltage of a spring or actuator that has none.

    Raises:
        InputError: if neither the circuit was stated nor a current measured, or the voltage's unit is
            unknown.
    """
    channels, place, circuit = making.channels, making.place, making.options.circuit
    if making.kind not in ("spring", "actuator"):
        return
    for name in VOLTAGES:
        wanted = resistance_named(name)
        if name not in channels or wanted in channels:
            continue
        channel = channels[name]
        current = channels.get(name.replace("voltage", "current"))
        flows = current is not None and current.unit is not None and np.nan_to_num(current.values).any()
        if current is not None and flows and not circuit:
            _add_ratio(making, name, channel, current)
            continue
        missing = [key for key in NEEDED if key not in circuit]
        if missing:
            ratio = ""
            if current is not None and current.unit is None:
                ratio = f"; or --unit current=mA (or A) for that voltage over {current.label!r}"
            raise unusable(
                place, f"{wanted} follows from {channel.label!r} by Eq. 2.50, which needs the circuit: "
                "state it with " + " ".join(f"--circuit {key}=..." for key in missing) + ratio,
            )  # fmt: skip
        adjust, resistor = (circuit[key] for key in NEEDED)
        gain, offset = circuit.get("gain", 1.0), circuit.get("offset_V", 0.0)
        volts = in_unit(channel, "V", name, place)
        ohms = nitinol_resistance(volts, adjust, resistor, gain, offset)
        made = (
            f"({channel.label!r} / {gain:g} + {offset:g} V - {adjust:g} V) over"
            f" {adjust / resistor:.4g} A, Eq. 2.50"
        )
        channels[wanted] = Channel(ohms, "ohm", channel.label, made=made)
        making.sources.add(name)
        for key in circuit:
            making.use("--circuit", key)


def _add_ratio(making: Making, name: str, voltage: Channel, current: Channel) -> None:
    """Add the resistance that is a measured voltage over a measured current, where that flows."""
    volts, amperes = in_unit(voltage, "V", name, making.place), in_unit(current, "A", "current", making.place)
    flows = np.abs(amperes) > LEAST_CURRENT * np.nanmax(np.abs(amperes))
    ohms = np.full(len(volts), np.nan)
    ohms[flows] = volts[flows] / amperes[flows]
    made = f"{voltage.label!r} over {current.label!r}"
    making.channels[resistance_named(name)] = Channel(ohms, "ohm", voltage.label, made=made)
    making.sources.add(name)
    making.warn(
        f"{resistance_named(name)} is {made}; it includes leads and contacts if the voltage was measured"
        " there. For the circuit of Eq. 2.50 state it with --circuit"
    )

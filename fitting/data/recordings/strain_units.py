"""Questions about strain and stress whose numbers give a wire or a rubber of impossible stiffness."""

from collections.abc import Mapping

import numpy as np

from pneusma_jax.units import UNITS, find_unit

from .recording import Recording
from .unit_question import Question, largest

STIFFEST_WIRE_MPA = 1.5e5
"""Maximum modulus of a wire [MPa]. Nitinol has 20 to 90 GPa; the stiffest reading of it is some 100 GPa."""
WIRE_STRAINS = (0.003, 0.15)
"""Largest strains of a wire that are usual [1]."""
SILICONE_KPA = (10.0, 5e3)
"""Young's moduli of silicones, as coupons or tubes [kPa]. Gels have 10 kPa, hard ones of Shore A 70 5 MPa."""
SILICONES = "silicones have 0.05 to 5 MPa"
STIFFEST_RUBBER_KPA = 5e4
"""Maximum modulus of a rubber [kPa]: hard ones of Shore A 95 have 50 MPa. The stiffest coupon recorded here
has 1.2 MPa. Thermoplastic elastomers may be stiffer, so that more is a question."""
STRESSES = ("kPa", "MPa", "Pa", "psi")
"""Units that a stress may rather be in, the most usual first."""
RUBBER_STRAINS = (0.05, 19.0)
"""Largest strains of a coupon that are usual [1]. Every measured coupon here was strained by 0.5 or more."""
PERCENT = 100.0


def strain_questions(recording: Recording, written: Mapping[str, str]) -> list[Question]:
    """Ask about a strain that makes a specimen far too stiff.

    Args:
        recording: recording of a wire or a coupon.
        written: units in which the file states its columns, as far as they are known.
    """
    wire = recording.kind == "wire"
    name = "stress_MPa" if wire else "stress_kPa"
    strain, stress = recording.columns["strain"], recording.columns[name]
    reach, most = largest(strain), largest(stress)
    usual = WIRE_STRAINS if wire else RUBBER_STRAINS
    # A wire that holds a stress is as stiff as this at least, if its strain counts from rest.
    pulled = float(np.nanmax(stress) - np.nanmin(stress)) > most / 2.0
    apart = [float(np.nanmax(x) - np.nanmin(x)) for x in (stress, strain)] if pulled else [most, reach]
    modulus = apart[0] / apart[1] if apart[1] > 0.0 else 0.0
    percent = ""
    if usual[0] <= PERCENT * reach <= usual[1]:
        percent = (
            "Are these numbers fractions under a heading of percent? Then they reach"
            f" {PERCENT * reach:.3g} (on import: --unit strain=1)"
        )
    made = written.get("strain", "percent") != "percent"
    sizes = "Are its units and sizes right? (on import: --unit, --dimension)"
    said = f"strain reaches {reach:.3g} under {most:.4g}"
    if wire and modulus > STIFFEST_WIRE_MPA and percent:
        rest = "" if pulled else ", if strain counts from no load"
        why = f"a modulus of {1e-3 * modulus:.3g} GPa{rest}; nitinol has 20 to 90 GPa"
        question = f"{said} MPa, {why}. {sizes if made else percent}"
        return [Question("" if made else "strain", question)]
    percent = "" if made else percent
    if wire or modulus <= SILICONE_KPA[1]:
        return []
    said += f" kPa, a modulus of {1e-3 * modulus:.3g} MPa; {SILICONES}"
    if modulus > STIFFEST_RUBBER_KPA:
        asked = [text for text in (percent, _softer(modulus, written.get(name))) if text]
        asked = asked or [sizes]
        return [Question("", f"{said}, hard rubbers up to 50, and plastics more. {'. '.join(asked)}")]
    if percent and modulus / PERCENT >= SILICONE_KPA[0]:
        return [Question("strain", f"{said}, hard rubbers up to 50. {percent}")]
    return []


def _softer(modulus: float, unit: str | None) -> str:
    """Question about the unit of stress in which a coupon is a silicone; empty without one.

    Args:
        modulus: modulus of the coupon [kPa].
        unit: unit that the file states; None where that is no longer known.
    """
    for other in STRESSES if unit in UNITS else ():
        softer = modulus * find_unit(other).factor / find_unit(unit).factor
        if SILICONE_KPA[0] <= softer <= SILICONE_KPA[1]:
            said = f"Are the stresses in {other} under a heading of {unit}?"
            return f"{said} Then the modulus is {in_mpa(softer)} (on import: --unit stress={other})"
    return ""


def in_mpa(kilopascal: float) -> str:
    """A modulus in words."""
    return f"{1e-3 * kilopascal:.2g} MPa"

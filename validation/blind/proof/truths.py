"""Parameters with the same meaning in the generator's form of an effect and in the tool's: values and
errors."""

import math

SAME = {
    "channel_lag": {"delay": lambda p, b: p["amplitude"]},
    "series_resistance": {"ohms": lambda p, b: p["amplitude"] * (1.0 + 0.5 * p["warming"])},
    "pressure_calibration": {"offset": lambda p, b: 1e3 * p["amplitude"] * p["offset_kPa"]},
    "camera_calibration": {"offset": lambda p, b: math.radians(p["amplitude"] * p["offset_deg"])},
    "resistance_temperature_coefficient": {"alpha_m": lambda p, b: p["amplitude"], "alpha_a": lambda p, b: p["amplitude"]},
    "gravity": {
        "mass": lambda p, b: 1e-3 * p["amplitude"] * p["rod_g"],
        "tip_mass": lambda p, b: 1e-3 * p["amplitude"] * p["tip_g"],
    },
    "tip_contact": {"angle": lambda p, b: math.radians(p["stop_deg"])},
    "stress_shifted_transformation": {"shift": lambda p, b: 1e-6 * p["amplitude"]},
    "inactive_coils": {"coils": lambda p, b: p["amplitude"]},
    "coil_contact": {"tension": lambda p, b: p["amplitude"], "opening": lambda p, b: 1e-3 * p["parting_mm"]},
    "wall_eccentricity": {"shift": lambda p, b: 1e-3 * p["amplitude"] * b.get("wall_thickness_mm", 1.0)},
}
"""True value in SI by slug and the tool's parameter, as a function of the truth's parameters and base. Signs
are a matter of convention and are left out of the comparison."""


def parameter_errors(report, truth):
    """Errors of every parameter of a named effect that has a true value: value, true, relative error, error
    in sd."""
    found = []
    for effect in report.get("effects", []):
        true_values = truth.get("parameters", {}).get(effect["name"])
        for name, value_of in (SAME.get(effect["name"], {}) if true_values else {}).items():
            stated = effect.get("parameters", {}).get(name)
            true = abs(value_of(true_values, truth.get("base", {})))
            if stated is None or not true > 0.0:
                continue
            error = abs(stated["value"]) - true
            found.append({
                "parameter": f"{effect['name']}.{name}", "value": abs(stated["value"]), "true": true,
                "relative": error / true, "sd": error / stated["sd"] if stated.get("sd") else None,
            })  # fmt: skip
    return found

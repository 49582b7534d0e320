"""Options of `pneusma synthesise KIND` that made the campaigns in `calibration_data/examples`."""

EXAMPLES: dict[str, dict[str, float]] = {
    "spring": {"seed": 1, "interval_s": 2.0},
    "wire": {"seed": 1, "interval_s": 8.0},
    "tube": {"seed": 1},
    "actuator": {"seed": 1, "interval_s": 1.0},
    "elastomer": {"seed": 20240611},
}

"""Assumptions: what instruments, latent trajectories and repeated tests usually are."""

from dataclasses import dataclass

from .threshold import threshold


@dataclass(frozen=True)
class Instruments:
    """Sizes that instruments and latent trajectories usually have."""

    still_ranges: tuple[tuple[str, float], ...] = threshold(
        (
            ("strain", 0.01), ("pressure", 1e3), ("elongation", 5e-4), ("temperature", 2.0), ("stress", 2e6),
            ("current", 0.02),
        ),
        "Maximum range for a driver of unstated noise to be still, by quantity.",
        "SI",
    )  # fmt: skip
    student_degrees: float = threshold(
        4.0, "Number of degrees of freedom of Student's t for corners of a trajectory."
    )
    minimum_floor: float = threshold(
        0.04, "Minimum noise without a signal, over the usual noise of the instrument."
    )
    maximum_correlation: float = threshold(0.9, "Maximum correlation of neighbouring errors.")
    confused_units: tuple[float, float] = threshold(
        (4.0, 3600.0), "Minimum and maximum ratio of confused units.",
        basis="with 2 instead, a tube of 2.5 times the stiffness was asked whether its kPa are inHg",
    )
    process_noise_variances: tuple[float, ...] = threshold(
        tuple(10.0**k for k in range(-10, -1)),
        "Number of process-noise variances for a choice by evidence: these.",
        "1/s",
    )
    usual_process_noise_variance: float = threshold(
        1e-6, "Factor from seconds to process-noise variance where no resistance tells it.", "1/s"
    )


@dataclass(frozen=True)
class Drift:
    """Slow drift of instruments, which explains misfit by itself."""

    sizes: tuple[float, ...] = threshold(
        (0.0, 0.2, 0.4, 0.6),
        "Number of drift sizes, equally likely, for its evidence: these, over the noise.",
        "sd",
        "nulls of the generator drift by up to 0.6 of their noise",
    )
    lasting_part: float = threshold(0.25, "Factor from a recording to the part for which drift lasts.")

    @property
    def maximum_explained(self) -> float:
        """Most of a reduced chi-square that drift may explain: twice its largest variance."""
        return 2.0 * self.sizes[-1] ** 2


@dataclass(frozen=True)
class NextExperiment:
    """Repetitions that are compared."""

    rate_factor: float = threshold(10.0, "Factor on the clock for slower and faster repetitions.")
    load_factor: float = threshold(1.25, "Factor on the load for a stronger repetition.")
    pause: float = threshold(300.0, "Number of seconds for holding the largest load.", "s")
    cooling_kelvin: float = threshold(5.0, "Minimum fall of a temperature that counts as cooling.", "K")
    cooling_fraction: float = threshold(
        0.1, "Minimum rise of a martensite fraction that counts as cooling.", "1"
    )
    cooling_factor: float = threshold(
        1.25, "Maximum cooling rate of a repetition, over the fastest recorded one.", "1",
        "noise of a rate; a specimen cools as fast as its surroundings let it",
    )  # fmt: skip
